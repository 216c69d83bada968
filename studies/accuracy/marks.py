"""Targets of the project: true maxima of 100 000 random designs against a reference, the exact margin, and costs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels import status as st
from kernels.families import rssr
from studies.accuracy.regions import drawn, rotatable
from studies.accuracy.timing import seconds
from studies.accuracy.witness import reference
from sweep.families import family
from sweep.families.base import Array
from sweep.numerics.records import Indices
from sweep.reductions.sampling import pose_columns, turn

TARGET = 1e-8
WRONG_PEAK = 1e-4  # relative difference in height that excludes the right peak
GRID = 360
REPEATS = 15  # repetitions of a timing; the shortest counts, since other work on the machine disturbs most of them
SAMPLES, HALVINGS = 65536, 44  # of the reference: from one sample distance to the rounding of an angle


@dataclass(frozen=True)
class Mark:
    """A target and its measured value."""

    name: str
    asked: str
    measured: str
    met: bool


def marks(designs: int) -> list[Mark]:
    """Return all marks except those of whole programs."""
    turning = rotatable(designs, 2024)
    mixed = drawn(designs, np.random.default_rng(7))
    both = [(mixed, "every random design"), (turning, "every design that turns")]
    return [*_maxima(turning), _margin(mixed), *(_in_two_threads(*pair) for pair in both)]


def smoke_mark() -> Mark:
    """Return the time of this study's smoke version, run as a user would, with warm kernels."""
    with tempfile.TemporaryDirectory() as folder:
        start, before = time.perf_counter(), os.times()
        command = [sys.executable, "-m", "studies.accuracy", "--smoke", "--out", folder]
        subprocess.run(command, check=True, capture_output=True)
        took, after = time.perf_counter() - start, os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return Mark("`make smoke-accuracy` [s]", "20", f"{took:.0f}; {used:.0f} of processor time", took <= 20.0)


def study_mark(took: float) -> Mark:
    """Return the time of the study that measures all marks, up to its figures."""
    used = sum(os.times()[:4])
    text = f"{took / 60.0:.1f}; {used / 60.0:.1f} of processor time"
    return Mark("`make study-accuracy` [min]", "10", text, took <= 600.0)


def _true_maxima(designs: Array) -> Callable[[], tuple[Array, Array, Array]]:
    table = rssr.sampling_tables()
    status, found, error = np.empty(len(designs), np.uint8), np.empty(len(designs)), np.empty((3, len(designs)))

    def run() -> tuple[Array, Array, Array]:
        rssr.true_maxima(designs, table, TARGET, status, None, error, None, None, found, None)
        return found, error[1], status.astype(np.float64)

    return run


def _maxima(designs: Array) -> list[Mark]:
    found, error, status = _true_maxima(designs)()
    exact = even_reference(designs)
    off = np.abs(found - exact) / exact
    # If they differ, the even samples may have missed the peak, or have rounding errors: the slower reference decides.
    doubtful = np.flatnonzero(~((off <= TARGET) & (off * exact <= error)))
    if doubtful.size:
        exact[doubtful] = reference(family("rssr"), np.ascontiguousarray(designs[doubtful])).value
    off = np.abs(found - exact) / exact
    answered = status == st.OK
    worst, wrong = float(off[answered].max()), int((off[answered] > WRONG_PEAK).sum())
    held = int((np.abs(found - exact)[answered] > error[answered]).sum())
    angles, least, grid = turn(GRID), np.empty(len(designs)), np.empty(len(designs))
    dense = seconds(lambda: rssr.dense_maxima(designs, angles.cos[0], angles.sin[0], least, None, grid, None), REPEATS)
    true = seconds(_true_maxima(designs), REPEATS)
    n = len(designs)
    return [
        Mark(
            f"largest error of max |d2psi|, {n} random rotatable designs, accuracy {TARGET:g}",
            "1e-8",
            f"{worst:.1e}; {int((~answered).sum())} designs without an answer (not converged)",
            worst <= TARGET and bool(answered.all()),
        ),
        Mark(f"wrong peaks among them (more than {WRONG_PEAK:g} too low)", "0", str(wrong), wrong == 0),
        Mark("designs whose error exceeds its estimate err_", "0", str(held), held == 0),
        Mark(
            f"time against the grid of {GRID} in the same run",
            "0.35",
            f"{true / dense:.2f} ({1e9 * true / n:.0f} and {1e9 * dense / n:.0f} ns per design)",
            true <= 0.35 * dense,
        ),
    ]


def even_reference(designs: Array) -> Array:
    """Return the largest |psi''| from even samples by the fused loop, and halving between the neighbours of the top."""
    angles = turn(SAMPLES)
    exact, halves = np.empty(len(designs)), np.array_split(np.arange(len(designs)), 2)

    def work(rows: Indices, own: Array) -> None:
        part = np.ascontiguousarray(designs[rows])
        least, grid, top = np.empty(len(part)), np.empty(len(part)), np.empty(len(part), np.int64)
        rssr.dense_maxima(part, angles.cos[0], angles.sin[0], least, None, grid, None, top, own)
        exact[rows] = np.fmax(grid, _halved(part, angles.phi[0, top], 2.0 * np.pi / SAMPLES))

    _together(work, [(half, np.empty(SAMPLES)) for half in halves])
    return exact


def _halved(designs: Array, phi: Array, reach: float) -> Array:
    """Return the height of the peak of |psi''| within ``reach`` of each angle, by halving on the sign of its slope."""
    low, high = phi - reach, phi + reach
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        columns, _ = pose_columns(family("rssr"), designs, middle[:, None], ("d2psi", "d3psi"))
        rising = columns["d3psi"][:, 0] * np.sign(columns["d2psi"][:, 0]) > 0.0
        low, high = np.where(rising, middle, low), np.where(rising, high, middle)
    columns, _ = pose_columns(family("rssr"), designs, 0.5 * (low + high)[:, None], ("d2psi",))
    return np.abs(columns["d2psi"][:, 0])


def _together(work: Callable[[Any, Any], None], parts: Sequence[tuple[Any, Any]]) -> None:
    """Run two threads, one call each."""
    threads = [threading.Thread(target=work, args=part) for part in parts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _margin(designs: Array) -> Mark:
    n = len(designs)
    status, margin, turns = np.empty(n, np.uint8), np.empty(n), np.empty(n)
    # A single call is so short that a phase of a slower clock could cover all repetitions.
    repeats = 20 * REPEATS
    took = 1e9 * seconds(lambda: rssr.margin(designs, status, margin, turns, None, None, None), repeats) / n
    return Mark("exact margin with rotatability [ns per design]", "25", f"{took:.0f}", took <= 25.0)


def _in_two_threads(designs: Array, which: str) -> Mark:
    halves = [np.ascontiguousarray(part) for part in np.array_split(designs, 2)]
    runs = [_true_maxima(half) for half in halves]
    found: dict[int, Array] = {}

    def work(number: int, run: Callable[[], tuple[Array, Array, Array]]) -> None:
        found[number] = run()[2]

    took, work_of_both = (
        1e9 * seconds(lambda: _together(work, list(enumerate(runs))), REPEATS, clock=clock) / len(designs)
        for clock in (time.perf_counter, time.process_time)
    )
    turning = float(np.mean(np.concatenate(list(found.values())) == st.OK))
    text = f"{took:.0f} of wall time, {work_of_both:.0f} of processor time of both; {100 * turning:.0f} % turn"
    return Mark(
        f"exact rotatability and true maximum acceleration of {which}, two threads [ns per design]",
        "60",
        text,
        took <= 60.0,
    )
