"""Time of every family's poses and own steps on this machine, next to the crank-rocker's in the same run.

Poses: position and all its derivatives, on random changes of one ordinary design.  Families take turns, and each counts
with its fastest round.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from sweep.families import NAMES, family
from sweep.families.base import Accuracy, Angles, Array, Family, March
from sweep.reductions.margins import margin_suffixes, own_step
from sweep.reductions.sampling import on_closed_turn
from sweep.reductions.turn import margin_group

SAMPLES, ROUNDS, MOST = 360, 7, 4096
SECONDS = 0.02  # of one run
ACCURACIES = (Accuracy(samples=720), Accuracy(target=1e-8), Accuracy(target=1e-8, certify=True))
FEWER_SAMPLES = 180
WIDE = 0.6


class Run(NamedTuple):
    """Something to be timed, and how many units one call makes."""

    call: Callable[[], object]
    units: int


def designs_of(mechanism: Family, count: int = MOST, spread: float = 0.02) -> Array:
    """Designs within a share of the ordinary one in every parameter that has no choices."""
    given, random = mechanism.example, np.random.default_rng(1)
    columns = []
    for parameter in mechanism.parameters:
        value = given.get(parameter.name, parameter.default if parameter.default is not None else 0.0)
        share = 0.0 if parameter.choices is not None else spread
        columns.append(value * (1.0 + share * random.uniform(-1.0, 1.0, count)))
    return np.column_stack(columns)


def ladder(mechanism: Family) -> list[str]:
    """The position and its derivatives, lowest first."""
    names = [mechanism.position]
    while names[-1] in mechanism.derivative_of:
        names.append(mechanism.derivative_of[names[-1]])
    return names


def sized(designs: Array, work: Callable[[Array], object], per_design: int = 1, fewest: int = 2) -> Run:
    """The work on as many of the designs as take about `SECONDS`, at least on so many."""
    count, took = fewest, 0.0
    work(designs[:count])  # compiles
    while took < 0.5 * SECONDS and count < len(designs):
        count = min(2 * count, len(designs))
        start = time.process_time()
        work(designs[:count])
        took = time.process_time() - start
    chosen = designs[:count]
    return Run(lambda: work(chosen), count * per_design)


def least(runs: dict[str, Run], rounds: int = ROUNDS) -> dict[str, float]:
    """Least processor time of every run [ns per unit] over interleaved rounds."""
    best = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, run in runs.items():
            start = time.process_time()
            run.call()
            best[name] = min(best[name], (time.process_time() - start) / run.units * 1e9)
    return best


def pose_runs() -> dict[str, Run]:
    """By family: poses over a turn, an interval there and back, or the grid of a march."""
    angles = Angles.of(np.arange(SAMPLES)[None, :] * (2.0 * np.pi / SAMPLES))
    runs = {}
    for name in NAMES:
        bare = family(name)
        mechanism, wanted = on_closed_turn(bare), frozenset(ladder(bare))
        runs[name] = sized(designs_of(bare), lambda some, m=mechanism, w=wanted: m.poses(some, angles, w), SAMPLES)  # type: ignore[misc]
    return runs


def margin_runs() -> dict[str, Run]:
    """By family that has no own step for it: the margin over poses, of designs many of which do not turn."""
    runs = {}
    for mechanism in map(family, NAMES):
        for suffix in margin_suffixes(mechanism):
            if own_step(mechanism, suffix, ACCURACIES[1]) is None:
                work = partial(_margin, mechanism)
                # what a margin takes differs from design to design, so that a few of them say little
                runs[mechanism.name] = sized(designs_of(mechanism, spread=WIDE), work, fewest=256)
    return runs


def _margin(mechanism: Family, designs: Array) -> object:
    return margin_group(mechanism, designs, (), ACCURACIES[1])


def step_runs() -> dict[str, Run]:
    """By "family: step": all outputs of a family's own step, at the first accuracy that it serves.

    A step that serves some accuracies only and samples has a second row, "... fewer", on fewer samples.
    """
    runs = {}
    for name in NAMES:
        mechanism = family(name)
        for step in mechanism.steps:
            outputs = frozenset(o.name for o in step.provides)
            served = [a for a in ACCURACIES if step.applies(a)]
            if isinstance(mechanism.domain, March) or served[0].samples is None or len(served) > 1:
                shown = {f"{name}: {step.name}": served[0]}
            else:
                fewer = Accuracy(samples=FEWER_SAMPLES)
                shown = {f"{name}: {step.name}": served[0], f"{name}: {step.name}, fewer": fewer}
            for row, accuracy in shown.items():
                runs[row] = sized(
                    designs_of(mechanism),
                    lambda some, s=step, o=outputs, a=accuracy: s.run(some, o, a),  # type: ignore[misc]
                )
    return runs


def step_costs(rounds: int = ROUNDS) -> tuple[dict[str, float], dict[str, float]]:
    """Per own step its time per design, and what each sample adds where it works through them [ns]."""
    best = least(step_runs(), rounds)
    fixed, samples = {}, {}
    for row, ns in best.items():
        if row.endswith(", fewer"):
            continue
        fewer = best.get(f"{row}, fewer")
        if fewer is None:
            fixed[row] = ns
        else:
            samples[row] = (ns - fewer) / (ACCURACIES[0].samples - FEWER_SAMPLES)  # type: ignore[operator]
            fixed[row] = max(fewer - FEWER_SAMPLES * samples[row], 1.0)
    return fixed, samples
