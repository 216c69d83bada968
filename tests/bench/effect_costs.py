"""What the effects cost, for `make bench`: sweep/costs.toml keeps what it found last."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from studies.accuracy.ordinary import designs
from sweep.effects import NAMES, effect, with_effects
from sweep.effects.base import PlacedEffect
from sweep.effects.scene import first_scene
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.families.capabilities import JointRecords

POSES = 360
MOTION = "motion"


class Cost(NamedTuple):
    """Processor time of some outputs of an effect, per "pose" or per "design"; the motion it needs is counted apart."""

    effect: str
    outputs: str
    per: str
    ns: float


def least_time(run: Callable[[], object], repeats: int = 5) -> float:
    """Least processor time of several runs [s], the first one, which compiles, not counted."""
    run()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def costs(names: Sequence[str] = NAMES, *, n: int = 64, each: bool = False, repeats: int = 5) -> list[Cost]:
    """Measure effects on one core, ``n`` designs at 360 angles each; a few milliseconds to a second per effect.

    Parameters
    ----------
    names : of effects
    n : designs
    each : every pose output alone too, besides all of them together
    repeats : of which the least time counts

    Returns
    -------
    list of Cost
        the motion of the crank-rocker with its joint records first (outputs "all", per "pose"), then per effect "all"
        (pose outputs together), each pose output by its name, "design outputs" together
    """
    angles = Angles.of(2.0 * np.pi * np.arange(POSES)[None] / POSES)
    rows = [Cost(MOTION, "all", "pose", motion_ns("rssr", n, repeats))]
    for name in names:
        entry = effect(name)
        full = with_effects(family(entry.families[0]), (PlacedEffect(entry),))
        matrix = designs(full, n)
        motion = motion_ns(entry.families[0], n, repeats) if entry.outputs else 0.0
        sets = {"all": frozenset(o.name for o in entry.outputs)} if entry.outputs else {}
        singles = [o.name for o in entry.outputs if each and not o.name.endswith(("_x", "_y", "_z"))]
        for label, wanted in (sets | {single: frozenset({single}) for single in singles}).items():
            took = least_time(lambda wanted=wanted: full.poses(matrix, angles, wanted), repeats)  # type: ignore[misc] # noqa: B023
            rows.append(Cost(name, label, "pose", took * 1e9 / (n * POSES) - motion))
        if entry.design_result is not None:
            step, all_of_them = full.steps[-1], frozenset(o.name for o in entry.design_result.outputs)
            took = least_time(lambda: step.run(matrix, all_of_them, Accuracy(target=1e-8)), repeats)  # noqa: B023
            rows.append(Cost(name, "design outputs", "design", took * 1e9 / n))
    return rows


def motion_ns(name: str, n: int, repeats: int) -> float:
    """Nanoseconds per pose of a family's motion and the joint records made of it, where it has any."""
    bare = family(name)
    matrix, angles = designs(bare, n), Angles.of(2.0 * np.pi * np.arange(POSES)[None] / POSES)
    linked = bare.find(JointRecords) is not None
    wanted = frozenset({bare.position})
    took = least_time(
        lambda: first_scene(bare, matrix, angles, {}).records if linked else bare.poses(matrix, angles, wanted), repeats
    )
    return took * 1e9 / (n * POSES)
