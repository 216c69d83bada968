"""The swivel linkage from its points alone: the rod from the crank pin through the block's centre, 100 digits."""

from __future__ import annotations

import mpmath as mp

from tests.reference.space import crank_pin, derivatives, exact, length, vector

STEP = "1e-20"  # [rad]; the rod turns at once where the pin passes near the block's centre


def position(design, phi, near=None):
    """Length of the rod up to the block, and the working point."""
    a, e, f, g, alpha, reach = design
    pin = crank_pin(a, f, alpha, phi)
    rod = vector(e, 0, g) - pin
    point = pin + rod * (reach / length(rod))
    return {"rho": length(rod), "x_p": point[0], "y_p": point[1], "z_p": point[2]}


def outputs(design, phi):
    """rho and the working point with three derivatives each."""
    with mp.workdps(100):
        numbers = exact(design)
        return derivatives(lambda x, near: position(numbers, x, near), mp.mpf(float(phi)), step=STEP)
