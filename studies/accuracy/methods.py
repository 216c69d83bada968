"""The ways to a maximum acceleration and to a swing that the work-precision diagrams compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from kernels import status as st
from kernels.families import rssr
from kernels.families.rssr.single import dense_acceleration_single
from studies.accuracy.reference import RSSR
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles, Array
from sweep.reductions.sampling import pose_columns, sample_turn, turn

Way: TypeAlias = Callable[[Array], Array]
"""Designs (n, 8) to one value each (n,); nan where the method itself says that it has no answer."""

REFINED_STEPS = 3


@dataclass(frozen=True)
class Method:
    """One point of a curve: a method at one setting (samples per turn or accuracy asked for)."""

    curve: str
    setting: float
    run: Way


def acceleration_methods(samples: tuple[int, ...], targets: tuple[float, ...]) -> list[Method]:
    """Return ways to the largest |psi''| over the turn."""
    found = [Method("grid, float64", n, _grid(n)) for n in samples]
    found += [Method("grid, float32", n, _grid_single(n)) for n in samples]
    found += [Method("grid + parabola", n, _grid_parabola(n)) for n in samples if n <= 4096]
    found += [Method("grid + refined top sample", n, _grid_refined(n)) for n in samples if n <= 4096]
    found += [Method("accuracy=", target, _adaptive(target)) for target in targets]
    found += [Method("certified, accuracy=", target, _certified(target)) for target in targets]
    return found


def swing_methods(samples: tuple[int, ...], targets: tuple[float, ...]) -> list[Method]:
    """Return ways to the magnitude of the swing."""
    found = [Method("grid, float64", n, _swing_grid(n, False)) for n in samples]
    found += [Method("grid + parabola", n, _swing_grid(n, True)) for n in samples if n <= 4096]
    found += [Method("accuracy=", target, _swing_adaptive(target)) for target in targets]
    return found


def _grid(samples: int) -> Way:
    angles = turn(samples)
    cos, sin = angles.cos[0], angles.sin[0]

    def run(designs: Array) -> Array:
        least, found = np.empty(len(designs)), np.empty(len(designs))
        rssr.dense_maxima(designs, cos, sin, least, None, found, None)
        return found

    return run


def _grid_single(samples: int) -> Way:
    angles = turn(samples)
    cos, sin = angles.cos[0].astype(np.float32), angles.sin[0].astype(np.float32)

    def run(designs: Array) -> Array:
        found = np.empty(len(designs), np.float32)
        dense_acceleration_single(designs, cos, sin, found)
        return found.astype(np.float64)

    return run


def _grid_top(samples: int) -> Callable[[Array], tuple[Array, Array]]:
    angles = turn(samples)
    phi, cos, sin = (column[0] for column in angles)
    scratch = np.empty(samples)

    def run(designs: Array) -> tuple[Array, Array]:
        least, found, at = np.empty(len(designs)), np.empty(len(designs)), np.empty(len(designs), np.int64)
        rssr.dense_maxima(designs, cos, sin, least, None, found, None, at, scratch)
        return found, phi[at]

    return run


def _grid_parabola(samples: int) -> Way:
    top, step = _grid_top(samples), 2.0 * np.pi / samples

    def run(designs: Array) -> Array:
        found, phi = top(designs)
        sides = Angles.of(phi[:, None] + np.array([[-step, step]]))
        around = np.abs(np.asarray(RSSR.poses(designs, sides, frozenset({"d2psi"}))["d2psi"], np.float64))
        return _vertex(around[:, 0], found, around[:, 1])

    return run


def _vertex(left: Array, middle: Array, right: Array) -> Array:
    curvature = 2.0 * middle - left - right
    rise = np.divide((right - left) ** 2, 8.0 * curvature, out=np.zeros(middle.size), where=curvature > 0.0)
    height: Array = middle + rise
    return height


def _grid_refined(samples: int) -> Way:
    top, step = _grid_top(samples), 2.0 * np.pi / samples

    def run(designs: Array) -> Array:
        """Find the root of psi''' between the neighbours of the top sample by regula falsi (Illinois)."""
        found, phi = top(designs)
        ends, _ = pose_columns(RSSR, designs, phi[:, None] + np.array([[-step, step]]), ("d3psi",))
        low, high = phi - step, phi + step
        f_low, f_high = ends["d3psi"].T.copy()
        for _ in range(REFINED_STEPS):
            at = np.where(f_low * f_high < 0.0, (low * f_high - high * f_low) / (f_high - f_low), phi)
            here, _ = pose_columns(RSSR, designs, at[:, None], ("d2psi", "d3psi"))
            f, height = here["d3psi"][:, 0], np.abs(here["d2psi"][:, 0])
            found = np.fmax(found, height)
            same = f * f_low > 0.0
            low, f_high = np.where(same, at, low), np.where(same, 0.5 * f_high, f)
            f_low, high = np.where(same, f, 0.5 * f_low), np.where(same, high, at)
        return found

    return run


def _adaptive(target: float) -> Way:
    def run(designs: Array) -> Array:
        columns = design_outputs(RSSR, designs, ["max_abs_d2psi"], Accuracy(target=target))
        return np.asarray(columns["max_abs_d2psi"], np.float64)

    return run


def _certified(target: float) -> Way:
    accuracy = Accuracy(target=target, certify=True)

    def run(designs: Array) -> Array:
        columns = design_outputs(RSSR, designs, ["max_abs_d2psi"], accuracy)
        return np.where(columns["status"] == st.OK, np.asarray(columns["max_abs_d2psi"], np.float64), np.nan)

    return run


def _swing_grid(samples: int, parabola: bool) -> Way:
    def run(designs: Array) -> Array:
        swing = np.empty(len(designs))
        block = max(1, 2**17 // samples)
        for start in range(0, len(designs), block):
            part = slice(start, start + block)
            columns, _, winds = sample_turn(RSSR, designs[part], samples, ("psi",))
            psi = columns["psi"]
            ends = [_highest(sign * psi, parabola) for sign in (1.0, -1.0)]
            swing[part] = np.where(winds, np.nan, ends[0] + ends[1])
        return swing

    return run


def _highest(y: Array, parabola: bool) -> Array:
    if not parabola:
        return np.asarray(y.max(axis=1), np.float64)
    rows, top, count = np.arange(len(y)), y.argmax(axis=1), y.shape[1]
    return _vertex(y[rows, (top - 1) % count], y[rows, top], y[rows, (top + 1) % count])


def _swing_adaptive(target: float) -> Way:
    def run(designs: Array) -> Array:
        return np.abs(
            np.asarray(design_outputs(RSSR, designs, ["swing"], Accuracy(target=target))["swing"], np.float64)
        )

    return run
