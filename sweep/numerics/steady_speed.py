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


def backwards(phi: Array, *curves: Array) -> tuple[Array, list[Array]]:
    """Crank angles and curves on an even grid of a turn as a crank sees them that turns the other way.

    A turn backwards in phi is one forwards in -phi, (n, N) curves are its samples at the same grid.  Done twice it
    gives what was there before.
    """
    return -phi, [np.ascontiguousarray(np.roll(y[:, ::-1], 1, axis=1)) for y in curves]


def steady(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Kernel's numbers, (n,), and curves at phi, (n, m), without a suffix, and the status.

    Numbers are of the magnitude of the speed.  A crank that turns backwards is one that turns forwards in -phi, where
    the torque that is left over acts the other way.
    """
    if (speed < 0.0).any():
        return _of_both_senses(inertia, excess, speed, slope, phi, coarsest)
    n = len(inertia)
    out = Uneven(*(np.empty(n) for _ in range(5)), *(np.empty((n, phi.shape[1])) for _ in range(2)))
    status = np.empty(n, np.uint8)
    speed_fluctuation(inertia, excess, speed, phi, status, out, coarsest, slope)
    found = {"unevenness": out.delta, "fastest": out.fastest, "slowest": out.slowest, "missed": out.missed}
    return found | {"crank_speed": out.speed, "crank_acceleration": out.acceleration}, status


def _of_both_senses(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Do the same where some cranks turn backwards."""
    found: dict[str, Array] = {}
    status = np.empty(len(speed), np.uint8)
    for rows, sense in ((np.flatnonzero(speed > 0.0), 1.0), (np.flatnonzero(speed < 0.0), -1.0)):
        at, stored, left = phi[rows] if len(phi) > 1 else phi, inertia[rows], excess[rows]
        if sense < 0.0:
            at, (stored, left) = backwards(at, stored, -left)
        given = None if slope is None else slope[rows]
        part, status[rows] = steady(stored, left, sense * speed[rows], given, np.ascontiguousarray(at), coarsest)
        for name, values in part.items():
            turned = sense if name in ("crank_speed", "crank_acceleration") else 1.0
            found.setdefault(name, np.empty((len(speed), *values.shape[1:])))[rows] = turned * values
    return found, status
