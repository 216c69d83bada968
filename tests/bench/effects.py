"""Cost of every effect and output, and of a scene with everything on against the sum of its parts.

`make bench-effects` prints ns per pose and us per design on one core; the figures of the register are from here.
`python -m tests.bench.effects 100000` runs the whole scene at that size, 360 angles, in blocks as a study does.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from sweep.effects import NAMES, applicable, effect, with_effects
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array, Family

POSES = 360
BLOCK = 128
CENTRE = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2, "branch": 1.0}
INPUTS = {
    "m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 3e-4, "m_slider": 3e-4, "com_coupler_x": 45.0, "com_coupler_y": 2.0,
    "com_rocker_x": 25.0, "j_coupler_xx": 0.004, "j_coupler_yy": 0.08, "j_coupler_zz": 0.08, "j_rocker_zz": 0.3,
    "j_rocker_xx": 0.3, "j_rocker_yy": 0.1, "j_crank_zz": 0.2, "speed": 520.0, "load_torque": -500.0,
    "gravity_z": -9810.0, "flywheel": 5.0, "mu_a": 0.05, "mu_b": 0.08, "mu_c": 0.08, "mu_d": 0.05, "radius_a": 8.0,
    "radius_b": 5.0, "radius_c": 5.0, "radius_d": 7.0, "support_a1": -30.0, "support_a2": -60.0, "support_d1": -20.0,
    "support_d2": 30.0, "resisting_torque": 500.0, "journal_diameter": 12.0, "journal_length1": 15.0,
    "journal_length2": 15.0, "collar_diameter": 20.0, "permissible_pressure1": 1.0, "permissible_pressure2": 1.0,
    "permissible_pressure3": 0.5, "radial_factor": 0.56, "axial_factor": 1.5, "e_limit": 0.3,
    "dynamic_capacity": 6000.0, "required_life": 2e7, "driven_inertia": 0.6, "stiffness": 20000.0, "damping": 1.0,
    "x_point": 40.0,
}  # fmt: skip


def designs(full: Family, n: int, first: int = 0) -> Array:
    """Crank-rockers or slider-cranks a few percent round a regular one, with the inputs of the family's effects."""
    noise = np.random.default_rng(first).uniform(-0.05, 0.05, (n, len(full.parameters)))
    values = [CENTRE.get(p.name, INPUTS.get(p.name, p.default)) for p in full.parameters]
    matrix = np.array(values, dtype=np.float64) * (1.0 + noise)
    for k, p in enumerate(full.parameters):
        if p.choices is not None or p.name not in CENTRE:
            matrix[:, k] = values[k]
    return matrix


def best(run: Callable[[], object], repeats: int = 5) -> float:
    """Least wall time of several runs [s], the first one, which compiles, not counted."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def costs(n: int = 64, *, names: Sequence[str] = NAMES, each: bool = True) -> list[tuple[str, str, str, float]]:
    """Rows of (effect, output, unit of cost, cost): all pose outputs together, each alone if wanted, design outputs."""
    angles = Angles.of(2.0 * np.pi * np.arange(POSES)[None] / POSES)
    rows = []
    for name in names:
        entry = effect(name)
        bare = family(entry.families[0])
        full = with_effects(bare, (entry,))
        matrix = designs(full, n)

        def poses(
            wanted: frozenset[str], full: Family = full, matrix: Array = matrix, needs: frozenset[str] = frozenset()
        ) -> float:
            return best(lambda: full.poses(matrix, angles, wanted)) * 1e9 / (n * POSES)

        singles = [o.name for o in entry.outputs if not o.name.endswith(("_x", "_y", "_z"))]
        if entry.outputs:
            rows.append((name, "all", "ns/pose", poses(frozenset(o.name for o in entry.outputs))))
            rows += [(name, single, "ns/pose", poses(frozenset({single}))) for single in singles if each]
        if entry.design_result is not None:
            step = full.steps[-1]
            wanted = frozenset(o.name for o in entry.design_result.outputs)
            run = best(lambda: step.run(matrix, wanted, Accuracy(target=1e-8)), 3)  # noqa: B023
            rows.append((name, "design outputs", "us/design", run * 1e6 / n))
    return rows


def everything(n: int) -> tuple[float, float, float]:
    """All effects of the crank-rocker on n designs x 360 angles: seconds, the sum of the parts, peak memory [MB].

    In blocks of designs, as a study runs them; the parts are timed one by one on the first block.
    """
    bare = family("rssr")
    entries = applicable(bare)
    full = with_effects(bare, entries)
    angles = Angles.of(2.0 * np.pi * np.arange(POSES)[None] / POSES)
    wanted = frozenset(o.name for entry in entries for o in entry.outputs)
    steps = full.steps[-sum(entry.design_result is not None for entry in entries) :]

    def whole(matrix: Array) -> None:
        full.poses(matrix, angles, wanted)
        for step in steps:
            step.run(matrix, frozenset(o.name for o in step.provides), Accuracy(target=1e-8))

    block = min(n, BLOCK)
    matrix = designs(full, min(block, 64))
    whole(matrix)
    parts = 0.0
    for entry in entries:
        names = frozenset(o.name for o in entry.outputs)
        if names:
            parts += best(lambda names=names: full.poses(matrix, angles, names), 2)  # type: ignore[misc]
    for step in steps:
        whole_turn = frozenset(o.name for o in step.provides)
        parts += best(lambda step=step, w=whole_turn: step.run(matrix, w, Accuracy(target=1e-8)), 2)  # type: ignore[misc]
    start = time.perf_counter()
    for first in range(0, n, block):
        whole(designs(full, min(block, n - first), first))
    seconds = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return seconds, parts / len(matrix) * n, memory


def main() -> None:
    """Print the price list, then the scene with everything on."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    if len(sys.argv) == 1:
        for name, output, unit, cost in costs():
            print(f"{name:22s} {output:28s} {cost:10.1f} {unit}")
    seconds, parts, memory = everything(n)
    print(
        f"everything on, {n} designs x {POSES} angles: {seconds:.1f} s, {1e9 * seconds / (n * POSES):.0f} ns per pose; "
        f"sum of the parts {parts:.1f} s; peak memory {memory:.0f} MB"
    )


if __name__ == "__main__":
    main()
