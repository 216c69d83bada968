"""What tolerances do to a curve: the derivative of an output by every toleranced dimension, all along the turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.families.base import Angles, Array, Family
from sweep.optimise.points import STEP


def changes(family: Family, designs: Array, sigma: Array, outputs: Sequence[str], phi: Array) -> dict[str, Array]:
    """Return how much outputs change when one dimension is off by its standard deviation, by the complex step.

    Parameters
    ----------
    family : of the designs
    designs : (n, P)
    sigma : (P,) standard deviations; what is exact has none and no row
    outputs : names of pose outputs
    phi : (m,) crank angles

    Returns
    -------
    For each output (n, q, m), one row per dimension that is not exact.  The root of the sum of their squares is the
    standard deviation of the curve there, to first order and for independent dimensions; nan for designs with a nan.
    """
    own = np.flatnonzero(sigma)
    # Complex kernels raise where they divide by zero: designs that do not exist are left out.
    known = np.flatnonzero(np.isfinite(designs).all(axis=1))
    stepped = np.repeat(designs[known].astype(np.complex128), len(own), axis=0)
    stepped[np.arange(len(stepped)), np.tile(own, len(known))] += 1j * STEP * np.tile(sigma[own], len(known))
    angles = Angles.of(phi[None, :].astype(np.complex128))
    with np.errstate(all="ignore"):  # a design may not reach every pose; its nan is answered by the caller
        found = family.poses(np.ascontiguousarray(stepped), angles, frozenset(outputs))
    out = {name: np.full((len(designs), len(own), len(phi)), np.nan) for name in outputs}
    for name, values in out.items():
        values[known] = (found[name].imag / STEP).reshape(len(known), len(own), len(phi))
    return out
