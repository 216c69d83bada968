"""Even samples of a turn: the coarsest grid that resolves a design, and the steady-state speed of a shaft."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from kernels.effects.speed_fluctuation import Uneven, speed_fluctuation
from kernels.status import JAMMED, NOT_CONVERGED, OK
from kernels.types import Array, Status
from sweep.numerics.curves import FINEST, PER_GAP
from sweep.numerics.records import Indices

# Odd grids: the next one is tried for designs that the previous one does not resolve.
GRIDS = (65, 129, 257)
# For loads with jumps or kinks: no grid resolves all of them, the error estimates what the last one misses.
FINER = (513, FINEST)
LEFT = 1e-3  # share of J omega^2 that the last of these grids may miss of the torque
PER_LEFT = 5.0  # a jump h leaves h/(pi K) in harmonic K and shifts the energy by h pi/N at most, N = 2 K + 1
ERROR = 1e-9
SLOWEST = 0.9  # largest ratio of the last two eighths of the harmonics: 0.87 with jumps, 0.75 with kinks

Solver: TypeAlias = Callable[[Indices, int], tuple[dict[str, Array], Status]]
"""``solve(rows, size)``: results (k, ...) of the designs ``rows`` (k,) on a grid of that size, by name, and status."""


def on_first_grid(least: Array, grids: Sequence[int], solve: Solver) -> tuple[dict[str, Array], Status]:
    """Solve every design on the first of the ``grids`` that resolves it.

    ``least`` (n,) is the least number of samples of each design; coarser grids are skipped, except the last one.
    Designs for which ``solve`` returns NOT_CONVERGED are solved again on the next grid.  A load that acts between two
    samples of the last grid is not seen, and leaves no trace in an estimate of the error: NOT_CONVERGED.
    """
    n, found = len(least), dict[str, Array]()
    status: Status = np.full(n, NOT_CONVERGED, np.uint8)
    for size in grids:
        rows = np.flatnonzero((status == NOT_CONVERGED) & ((least <= size) | (size == grids[-1])))
        if not rows.size and (found or n):
            continue
        part, codes = solve(rows, size)
        unseen = np.isfinite(least[rows]) & (least[rows] > PER_GAP * size)
        codes[unseen & (codes == OK)] = NOT_CONVERGED
        status[rows] = codes
        for name, values in part.items():
            found.setdefault(name, np.empty((n, *values.shape[1:])))[rows] = values
    return found, status


def beyond(values: Array, order: int = 0) -> Array:
    """Estimate the sum of the unresolved harmonics of samples (n, N) on an even grid of the turn, (n,).

    The last two eighths of the resolved harmonics are extrapolated as a geometric series, which underestimates a kink
    by a factor of 2.7; aliasing adds the same amount.  ``order`` is the order of the derivative.
    """
    size = np.abs(np.fft.rfft(values, axis=1)) * (2.0 / values.shape[1])
    size *= np.arange(size.shape[1]) ** order
    part = size.shape[1] // 8
    last, before = size[:, -part:].sum(axis=1), size[:, -2 * part : -part].sum(axis=1)
    ratio = np.minimum(np.divide(last, before, out=np.full(len(last), SLOWEST), where=before > 0.0), SLOWEST)
    found: Array = PER_LEFT * last * ratio / (1.0 - ratio)
    return found


def forwards(speed: Array, phi: Array, *curves: Array) -> tuple[Array, list[Array]]:
    """Crank angles and curves of designs in the direction of rotation, as a crank sees them that turns forwards.

    A turn backwards in phi is one forwards in -phi.  Where ``speed`` (n,) is negative, angles (n, m) or (1, m) change
    their sign, and (n, N) curves, samples on an even grid of the turn, are mirrored.
    """
    back = (speed < 0.0)[:, None]
    if not back.any():
        return phi, list(curves)
    mirrored = [np.where(back, np.roll(y[:, ::-1], 1, axis=1), y) for y in curves]
    return np.ascontiguousarray(np.where(back, -phi, phi)), [np.ascontiguousarray(y) for y in mirrored]


def steady(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Compute the steady speed: design outputs (n,), curves at ``phi`` (n, m), and the status.

    Design outputs are computed for the magnitude of the speed; errors of the energy, and of the torque without jumps,
    are shares of J speed^2.  A crank that turns backwards is one that turns forwards in -phi, where the excess torque
    acts with the opposite sign.  NOT_CONVERGED where the motor line is too steep for the steps of the integration, or
    the search that starts from constant torque does not find the speed.
    """
    n, sense = len(inertia), np.copysign(1.0, speed)[:, None]
    phi, (stored, left) = forwards(speed, phi, inertia, sense * excess)
    out = Uneven(*(np.empty(n) for _ in range(5)), *(np.empty((n, phi.shape[1])) for _ in range(2)))
    status = np.empty(n, np.uint8)
    speed_fluctuation(stored, left, np.abs(speed), phi, status, out, coarsest, slope)
    if slope is not None:  # a motor line holds every load at some speed: the crank has one that was not found
        status[(status == JAMMED) & (slope > 0.0)] = NOT_CONVERGED
    found = {"unevenness": out.delta, "fastest": out.fastest, "slowest": out.slowest, "missed": out.missed}
    with np.errstate(divide="ignore", invalid="ignore"):
        torque = (beyond(excess) / speed**2 + 0.5 * beyond(inertia, order=1)) / inertia.mean(axis=1)
        if slope is not None:  # the line makes a torque of what the speed misses
            stiffness = np.abs(slope / (inertia.mean(axis=1) * speed))
            torque = np.maximum(torque, np.where(slope > 0.0, PER_LEFT * out.missed * (1.0 + stiffness), 0.0))
    energy = np.maximum(PER_LEFT * out.missed, torque / (inertia.shape[1] // 2))
    found |= {"energy_error": np.maximum(ERROR, energy), "torque_error": torque}
    return found | {"crank_speed": sense * out.speed, "crank_acceleration": sense * out.acceleration}, status
