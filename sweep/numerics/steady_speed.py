"""Steady-state speed of a shaft of constant mean speed, from samples of inertia and torque excess over its turn."""

from __future__ import annotations

import numpy as np

from kernels.effects.speed_fluctuation import Uneven, speed_fluctuation
from kernels.types import Array, Status

# Odd grids: the next one is tried for designs that the one before does not resolve.
GRIDS = (65, 129, 257)
# Loads that jump or have kinks: no grid resolves all of them, the error says what the last one misses.
FINER = (513, 2049)
LEFT = 1e-3  # share of J omega^2 that the last of these may miss of the torque
PER_LEFT = 5.0  # a jump h leaves h/(pi K) in harmonic K and shifts the energy by h pi/N at most, N = 2 K + 1
ERROR = 1e-9


def forwards(speed: Array, phi: Array, *curves: Array) -> tuple[Array, list[Array]]:
    """Crank angles and curves of designs as a crank sees them that turns forwards.

    A turn backwards in phi is one forwards in -phi.  Where ``speed`` (n,) is negative, angles (n, m) or (1, m) change
    their sign, and (n, N) curves, samples on an even grid of the turn, are mirrored on it.
    """
    back = (speed < 0.0)[:, None]
    if not back.any():
        return phi, list(curves)
    mirrored = [np.where(back, np.roll(y[:, ::-1], 1, axis=1), y) for y in curves]
    return np.ascontiguousarray(np.where(back, -phi, phi)), [np.ascontiguousarray(y) for y in mirrored]


def steady(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Kernel's numbers, (n,), and curves at phi, (n, m), without a suffix, and the status.

    Numbers are of the magnitude of the speed.  A crank that turns backwards is one that turns forwards in -phi, where
    the torque that is left over acts the other way.
    """
    n, sense = len(inertia), np.copysign(1.0, speed)[:, None]
    phi, (stored, left) = forwards(speed, phi, inertia, sense * excess)
    out = Uneven(*(np.empty(n) for _ in range(5)), *(np.empty((n, phi.shape[1])) for _ in range(2)))
    status = np.empty(n, np.uint8)
    speed_fluctuation(stored, left, np.abs(speed), phi, status, out, coarsest, slope)
    found = {"unevenness": out.delta, "fastest": out.fastest, "slowest": out.slowest, "missed": out.missed}
    return found | {"crank_speed": sense * out.speed, "crank_acceleration": sense * out.acceleration}, status
