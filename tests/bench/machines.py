"""Marks of machines: poses against the sum of their members', shaking and a gap over a turn, per design.

``python -m tests.bench.machines`` times the head of the study head208 and prints a table; processor time, best of five.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import sweep
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array, Family
from sweep.study import load_study
from tests.support.own_code import own_code

STUDY, DESIGNS, POSES = Path(sweep.__file__).parents[1] / "studies" / "head208", 1024, 360
MOTION = {"needle": ("s", "ds", "d2s"), "looper": ("psi", "dpsi", "d2psi")}
RUNS = 5


def head(designs: int) -> tuple[Family, Array]:
    """Make needle and looper of head208, their cranks a little different in every design; the matrix of designs."""
    shafts = {"main": {"axis": [1, 0, 0], "zero": [0, 1, 0]}}
    shafts |= {"lower": {"at": [0, -39.743, -55.139], "axis": [1, 0, 0], "zero": [0, 1, 0], "ratio": -1}}
    needle = {"chain": ["rssr", "guide"], "shaft": "main", "turn": 1.5 * np.pi, "key": 1.5 * np.pi}
    looper = {"family": "slotted", "shaft": "lower", "sense": -1, "shift": 34.516, "key": np.radians(201.768)}
    relations = {"shake": {"shaking": ["needle1", "needle2", "looper"]}, "torque": {"torque": ["needle", "looper"]}}
    relations |= {"gap": {"gap": ["needle.coupler2", "looper.driven_link"]}}
    machine = sweep.machine({"needle": needle, "looper": looper}, relations, shafts=shafts)
    found = extended(family(machine), ["max_shake_moment", "max_abs_torque"])
    reference = load_study(STUDY).reference or {}
    given = {name: value for name, value in reference.items() if name in found.parameter_names}
    matrix = np.repeat(design_matrix(found, given)[0], designs, axis=0)
    rng = np.random.default_rng(208)
    for name in ("needle.a1", "looper.a"):
        matrix[:, found.parameter_names.index(name)] *= 1.0 + 1e-4 * rng.standard_normal(designs)
    return found, matrix


def best(run: Callable[[], object]) -> float:
    """Least processor time of a call per design [us]."""
    run()
    found = []
    for _ in range(RUNS):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return 1e6 * min(found) / DESIGNS


def main() -> None:
    """Time poses, extrema and means; machine code is that of a long study."""
    rows = []
    machine, matrix = head(DESIGNS)
    turn = Angles.of(2.0 * np.pi * np.arange(POSES)[None, :] / POSES)
    alone = 0.0
    for m in machine.members:  # type: ignore[attr-defined]
        own = m.designs(matrix)
        alone += best(lambda m=m, own=own: m.family.poses(own, turn, frozenset(MOTION[m.name])))
    names = frozenset(f"{name}.{output}" for name, wanted in MOTION.items() for output in wanted)
    together = best(lambda: machine.poses(matrix, turn, names))
    rows.append(("poses, to the sum of the members' (1.3 at most)", f"{together / alone:.2f}"))
    for output in ("max_shake", "rms_shake", "max_shake_moment", "max_abs_torque", "min_gap"):
        spent = best(lambda output=output: design_outputs(machine, matrix, [output], Accuracy(target=1e-8)))
        rows.append((f"{output}, accuracy 1e-8 [us a design]", f"{spent:.0f}"))
    for text, value in rows:
        print(f"{text:60s}{value:>8s}")


if __name__ == "__main__":
    with own_code():
        main()
