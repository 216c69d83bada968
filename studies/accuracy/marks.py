"""The marks: true maxima of 100 000 random designs against the reference, the exact margin, and what both cost."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.families import rssr
from studies.accuracy import reference
from studies.accuracy.regions import BRANCH, drawn, rotatable
from studies.accuracy.timing import seconds
from sweep.families.base import Array
from sweep.reductions.sampling import Index, Status, turn

if TYPE_CHECKING:
    import pandas as pd

TARGET = 1e-8
WRONG_PEAK = 1e-4  # relative difference in height that no refinement of the right peak leaves
GRID = 360
REPEATS = 15  # of a timing; the shortest counts, and other work on the machine disturbs most of them


@dataclass(frozen=True)
class Mark:
    """What was to be reached and what was measured."""

    name: str
    asked: str
    measured: str
    met: bool


def marks(designs: int, decisions: int) -> list[Mark]:
    """Return all marks; ``decisions`` designs are decided in rational arithmetic as well."""
    turning = rotatable(designs, 2024)
    mixed = drawn(designs, np.random.default_rng(7))
    return [*_maxima(turning), *_margin(mixed), _verdicts(decisions), *_two_threads(mixed, turning)]


def tables_mark(oracle: pd.DataFrame) -> Mark:
    """Return rows of the oracle tables whose error is above the factor of their sheet;
    ``oracle`` as of :mod:`.oracle`.
    """
    beyond = int((~(oracle["factor"] <= oracle["allowed"])).sum())
    rows = int(oracle.groupby(["table", "kind"])["rows"].max().sum())
    text = f"{beyond} of {len(oracle)}, over {rows} rows; {int(oracle['undecidable'].sum())} declared undecidable"
    return Mark(
        "quantities and kinds of oracle rows beyond the factor of their sheet (8, 16, 64)", "0", text, beyond == 0
    )


def smoke_mark() -> Mark:
    """Return the smoke version of this study, run as a user would, with warm kernels."""
    with tempfile.TemporaryDirectory() as folder:
        start, before = time.perf_counter(), os.times()
        command = [sys.executable, "-m", "studies.accuracy", "--smoke", "--out", folder]
        subprocess.run(command, check=True, capture_output=True)
        took, after = time.perf_counter() - start, os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return Mark("`make smoke-accuracy` [s]", "20", f"{took:.0f}; {used:.0f} of processor time", took <= 20.0)


def study_mark(took: float) -> Mark:
    """Return the study that measures all this, up to its figures."""
    used = sum(os.times()[:4])
    text = f"{took / 60.0:.1f}; {used / 60.0:.1f} of processor time"
    return Mark("`make study-accuracy` [min]", "10", text, took <= 600.0)


def _true_maxima(designs: Array, target: float) -> Callable[[], tuple[Array, Array, Array]]:
    cos, sin = rssr.sampling_tables()
    status, found, error = np.empty(len(designs), np.uint8), np.empty(len(designs)), np.empty(len(designs))

    def run() -> tuple[Array, Array, Array]:
        rssr.true_maxima(designs, cos, sin, target, status, None, error, None, None, found, None)
        return found, error, status.astype(np.float64)

    return run


def _maxima(designs: Array) -> list[Mark]:
    found, error, status = _true_maxima(designs, TARGET)()
    exact = even_reference(designs)
    off = np.abs(found - exact) / exact
    # Where they differ the even samples may be the ones that missed, or their rounding: the slower reference decides.
    doubtful = np.flatnonzero(~((off <= TARGET) & (off * exact <= error)))
    exact[doubtful] = reference.largest_acceleration(np.ascontiguousarray(designs[doubtful]))
    off = np.abs(found - exact) / exact
    answered = status == st.OK
    worst, wrong = float(off[answered].max()), int((off[answered] > WRONG_PEAK).sum())
    held = int((np.abs(found - exact)[answered] > error[answered]).sum())
    angles, least, grid = turn(GRID), np.empty(len(designs)), np.empty(len(designs))
    dense = seconds(lambda: rssr.dense_maxima(designs, angles.cos[0], angles.sin[0], least, None, grid, None), REPEATS)
    true = seconds(_true_maxima(designs, TARGET), REPEATS)
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
    """Return the largest |psi''| from 65 536 even samples by the fused loop,
    and halving between the neighbours of the top.
    """
    angles = turn(reference.SAMPLES)
    step = 2.0 * np.pi / reference.SAMPLES
    exact, halves = np.empty(len(designs)), np.array_split(np.arange(len(designs)), 2)

    def work(rows: Index, own: Array) -> None:
        part = np.ascontiguousarray(designs[rows])
        least, grid, at = np.empty(len(part)), np.empty(len(part)), np.empty(len(part), np.int64)
        rssr.dense_maxima(part, angles.cos[0], angles.sin[0], least, None, grid, None, at, own)
        gaps = np.full(len(part), step)
        exact[rows] = np.fmax(grid, reference.refined(part, "d2psi", 0, angles.phi[0, at], gaps, gaps)[0])

    _together(work, [(half, np.empty(reference.SAMPLES)) for half in halves])
    return exact


def _together(work: Callable[[Any, Any], None], parts: Sequence[tuple[Any, Any]]) -> None:
    """Run two threads, one call each."""
    threads = [threading.Thread(target=work, args=part) for part in parts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _margin(designs: Array) -> list[Mark]:
    n = len(designs)
    status, margin, turns = np.empty(n, np.uint8), np.empty(n), np.empty(n)
    # So short that a phase of a slower clock would be all it sees.
    repeats = 20 * REPEATS
    took = 1e9 * seconds(lambda: rssr.margin(designs, status, margin, turns, None, None, None), repeats) / n
    return [Mark("exact margin with rotatability [ns per design]", "25", f"{took:.0f}", took <= 25.0)]


def _verdicts(designs: int) -> Mark:
    """Return verdicts near change points against the sign of a fine minimum in 50 digits."""
    wrong, undecided = 0, 0
    generator = np.random.default_rng(5)
    plain = rotatable(designs, 77)
    plain[:, 1] *= _to_the_edge(plain)
    plain[:, 1] *= 1.0 + generator.choice([-1.0, 1.0], designs) * 10.0 ** generator.uniform(-15.5, -8.0, designs)
    status, turns = np.empty(designs, np.uint8), np.empty(designs)
    rssr.margin(plain, status, None, turns, None, None, None)
    for design, verdict, code in zip(plain, turns, status, strict=True):
        if code == st.UNDECIDABLE:
            undecided += 1
        else:
            wrong += int((least_discriminant(design) > 0.0) != bool(verdict == 1.0))
    text = f"{wrong} of {designs} within 1e-15.5 ... 1e-8 of a change point; {undecided} reported as undecidable"
    return Mark("wrong verdicts on full rotation", "0", text, wrong == 0)


def _to_the_edge(designs: Array) -> Array:
    """Return the factor on the coupler that brings each design to its change point,
    as near as halving in float64 comes.
    """
    low, high, trial = np.zeros(len(designs)), np.ones(len(designs)), designs.copy()
    status, turns = np.empty(len(designs), np.uint8), np.empty(len(designs))
    for _ in range(54):
        middle = 0.5 * (low + high)
        trial[:, 1] = designs[:, 1] * middle
        rssr.margin(trial, status, None, turns, None, None, None)
        turning = turns == 1.0
        high, low = np.where(turning, middle, high), np.where(turning, low, middle)
    return high


def least_discriminant(design: Array) -> float:
    """Return the sign-exact least value of Delta over the turn in 50 digits:
    64 samples and Newton from the lowest ones.
    """
    from mpmath import mp, mpf

    with mp.workdps(50):
        a, b, c, e, f, g, alpha = (mpf(float(x)) for x in design[:7])
        sa, ca = mp.sin(alpha), mp.cos(alpha)
        k0 = (a * a - b * b + c * c + e * e + f * f + g * g - 2 * f * g * ca) / (2 * c)
        k1, k2 = a * g * sa / c, a * e / c
        c1, s1 = 2 * (k0 * k2 - a * e), 2 * (a * f * sa * ca - k0 * k1)
        d3, d4, d5 = a * a - k2 * k2, 2 * k1 * k2, a * a * ca * ca - k1 * k1
        c0, c2, s2 = e * e + (f * sa) ** 2 - k0 * k0 + (d3 + d5) / 2, (d3 - d5) / 2, d4 / 2

        def value(t: Any) -> Any:
            return c0 + c1 * mp.cos(t) + s1 * mp.sin(t) + c2 * mp.cos(2 * t) + s2 * mp.sin(2 * t)

        count = 64
        samples = [value(2 * mp.pi * k / count) for k in range(count)]
        best = min(samples)
        for k in range(count):
            if samples[k] <= samples[k - 1] and samples[k] <= samples[(k + 1) % count]:
                t = 2 * mp.pi * k / count
                for _ in range(60):
                    slope = -c1 * mp.sin(t) + s1 * mp.cos(t) - 2 * c2 * mp.sin(2 * t) + 2 * s2 * mp.cos(2 * t)
                    bend = -c1 * mp.cos(t) - s1 * mp.sin(t) - 4 * c2 * mp.cos(2 * t) - 4 * s2 * mp.sin(2 * t)
                    step = max(min(-slope / abs(bend), mpf("0.05")), mpf("-0.05"))
                    t += step
                    if abs(step) < mpf(10) ** -40:
                        break
                best = min(best, value(t))
        return float(best)


def _two_threads(mixed: Array, turning: Array) -> list[Mark]:
    """Return the verdict and true maximum of every design, wall time on two threads:
    of any designs, and of those that turn.
    """
    assert set(np.unique(mixed[:, BRANCH])) <= {-1.0, 1.0}
    return [_in_two_threads(mixed, "every random design"), _in_two_threads(turning, "every design that turns")]


def _in_two_threads(designs: Array, which: str) -> Mark:
    halves = [np.ascontiguousarray(part) for part in np.array_split(designs, 2)]
    cos, sin = rssr.sampling_tables()
    statuses = [np.empty(len(part), np.uint8) for part in halves]

    def work(part: Array, status: Status) -> None:
        rssr.true_maxima(part, cos, sin, TARGET, status, None, None, None, None, np.empty(len(part)), None)

    parts = list(zip(halves, statuses, strict=True))
    took, work_of_both = (
        1e9 * seconds(lambda: _together(work, parts), REPEATS, clock=clock) / len(designs)
        for clock in (time.perf_counter, time.process_time)
    )
    turning = float(np.mean(np.concatenate(statuses) == st.OK))
    text = f"{took:.0f} of wall time, {work_of_both:.0f} of processor time of both; {100 * turning:.0f} % turn"
    return Mark(
        f"exact rotatability and true maximum acceleration of {which}, two threads [ns per design]",
        "60",
        text,
        took <= 60.0,
    )
