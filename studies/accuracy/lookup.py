"""The ways to a rocker angle between samples: direct evaluation, and a table of the turn with interpolation."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels._jit import kernel, kernel_fused
from kernels.families.rssr.closure import reduce_design
from kernels.reduce import largest
from studies.accuracy.methods import Method, Way
from studies.accuracy.reference import RSSR
from sweep.families.base import Angles, Array, Family
from sweep.reductions.sampling import BLOCK, turn

Singles: TypeAlias = NDArray[np.float32]


def position_methods(samples: tuple[int, ...], phi: Array) -> list[Method]:
    """Return ways to psi of every design at its own crank angles phi (n, m), in [0, 2 pi)."""
    found = [Method("table, straight lines", n, _table(n, phi, False)) for n in samples]
    found += [Method("table, cubics", n, _table(n, phi, True)) for n in samples]
    found.append(Method("direct, float32", 1, _direct_single(phi)))
    found.append(Method("direct, float64", 1, _direct(RSSR, phi)))
    found.append(Method("direct, twice float64", 1, _direct(RSSR.precise(), phi)))
    return found


def _direct(mechanism: Family, phi: Array) -> Way:
    def run(designs: Array) -> Array:
        return np.asarray(mechanism.poses(designs, Angles.of(phi), frozenset({"psi"}))["psi"], np.float64)

    return run


def _direct_single(phi: Array) -> Way:
    def run(designs: Array) -> Array:
        psi, single = np.empty(phi.shape, np.float32), phi.astype(np.float32)
        position_single(designs, np.cos(single), np.sin(single), psi)
        return psi.astype(np.float64)

    return run


def _table(samples: int, phi: Array, cubic: bool) -> Way:
    angles, wanted = turn(samples), frozenset({"psi", "dpsi"} if cubic else {"psi"})
    size = max(1, BLOCK // samples)

    def run(designs: Array) -> Array:
        found = np.empty(phi.shape)
        for start in range(0, len(designs), size):
            part = slice(start, start + size)
            columns = RSSR.poses(designs[part], angles, wanted)
            psi, dpsi = np.asarray(columns["psi"], np.float64), None
            if cubic:
                dpsi = np.asarray(columns["dpsi"], np.float64)
            between(psi, dpsi, phi[part], found[part])
        return found

    return run


@kernel_fused
def position_single(designs: Array, cos_phi: Singles, sin_phi: Singles, psi: Singles) -> None:
    """Compute the rocker angle in float32; the constants of a design in float64, rounded once."""
    least = np.float32(0.0)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        e, y0, ca, branch = np.float32(r.e), np.float32(r.y0), np.float32(r.ca), np.float32(r.branch)
        k0, k1, k2 = np.float32(r.k0), np.float32(r.k1), np.float32(r.k2)
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[i, j], sin_phi[i, j]
            x, y, w = e - u, y0 + ca * v, k0 + k1 * v - k2 * u
            t = np.sqrt(largest(x * x + y * y - w * w, least))
            psi[i, j] = np.arctan2(-branch * (x * t - y * w), -(x * w + y * t))


@kernel
def between(psi: Array, dpsi: Array | None, phi: Array, out: Array) -> None:
    """Compute the angle between the samples (n, m) of a turn that begins at 0:
    by straight lines, or by cubics where dpsi is given.

    ``phi`` (n, k) in [0, 2 pi); the table's angles may jump by full turns.
    """
    count = psi.shape[1]
    step = 2.0 * math.pi / count
    for i in range(psi.shape[0]):
        for j in range(phi.shape[1]):
            place = phi[i, j] / step
            floor = int(place)
            x, here, after = place - floor, floor % count, (floor + 1) % count
            rise = psi[i, after] - psi[i, here]
            rise -= 2.0 * math.pi * np.rint(rise / (2.0 * math.pi))
            if dpsi is None:
                out[i, j] = psi[i, here] + x * rise
            else:
                first, last = step * dpsi[i, here], step * dpsi[i, after]
                bend = 3.0 * rise - 2.0 * first - last + x * (first + last - 2.0 * rise)
                out[i, j] = psi[i, here] + x * (first + x * bend)
