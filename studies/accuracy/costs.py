"""What each further output and effect costs, what float32 saves on disk, what one more digit costs the optimiser."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import sweep
from kernels import status as st
from kernels.families import rssr
from studies.accuracy.reference import RSSR
from studies.accuracy.timing import seconds
from sweep.effects import applicable, extended
from sweep.families.base import Accuracy, Array, Family
from sweep.sampling import turn
from sweep.summaries import design_outputs

if TYPE_CHECKING:
    import pandas as pd

POSES = 720
# A small machine: what an effect needs and no default gives, by the unit of the parameter (SI).
INPUTS = {
    "length": 0.05, "mass": 0.1, "inertia": 1e-4, "force": 1e4, "torque": 1.0, "stiffness": 1e6, "damping": 10.0,
    "speed": 500.0, "ratio": 0.1,
}  # fmt: skip
NAMED = {"support_a1": -1.0, "support_d1": -1.0, "support_a2": 1.0, "support_d2": 1.0}


def output_costs(designs: Array, smoke: bool) -> pd.DataFrame:
    """Time per pose and per design of every output and effect of the crank-rocker, each alone; few effects in smoke."""
    import pandas as pd

    rows = [_dense(designs, names) for names in ((), ("dpsi",), ("d2psi",), ("d3psi",), ("dpsi", "d2psi", "d3psi"))]
    rows += [_evaluated(designs, names) for names in _POSE_SETS]
    few = np.ascontiguousarray(designs[: max(8, len(designs) // 8)])
    for effect in applicable(RSSR)[: 1 if smoke else None]:
        pose = tuple(output.name for output in effect.outputs)
        if pose:
            rows.append(_effect(few, effect.name, pose))
        if effect.design_result is not None:
            rows.append(_design_effect(few, effect.name, tuple(o.name for o in effect.design_result.outputs)))
    frame = pd.DataFrame(rows)
    base = float(frame.loc[frame["outputs"] == "psi", "ns_per_pose"].iloc[0])
    frame["times_position"] = frame["ns_per_pose"] / base
    return frame


_POSE_SETS = (
    ("psi",),
    ("sin_psi", "cos_psi"),
    ("dpsi",),
    ("d2psi",),
    ("d3psi",),
    ("psi", "dpsi", "d2psi", "d3psi"),
    ("discriminant",),
    ("pressure_angle",),
    ("x_b", "y_b", "z_b", "x_c", "y_c", "z_c"),
)


def _dense(designs: Array, names: tuple[str, ...]) -> dict[str, object]:
    angles, n = turn(POSES), len(designs)
    least = np.empty(n)
    out = [np.empty(n) if name in names else None for name in ("dpsi", "d2psi", "d3psi")]
    took = seconds(lambda: rssr.dense_maxima(designs, angles.cos[0], angles.sin[0], least, out[0], out[1], out[2]))
    label = ", ".join(f"max |{name}|" for name in names) or "least discriminant"
    return _row("loop over a grid", label, took, n, POSES)


def _evaluated(designs: Array, names: tuple[str, ...]) -> dict[str, object]:
    angles, few = turn(POSES), designs[:128]
    took = seconds(lambda: RSSR.poses(few, angles, frozenset(names)))
    return _row("poses", ", ".join(names), took, len(few), POSES)


def _with_inputs(family: Family, designs: Array) -> Array:
    added = family.parameters[len(RSSR.parameters) :]
    values = [
        NAMED.get(p.name, INPUTS.get(p.unit, 1.0) if p.default is None and p.choices is None else (p.default or 0.0))
        for p in added
    ]
    chosen = [p.choices[0] if p.choices and p.default is None else v for p, v in zip(added, values, strict=True)]
    return np.column_stack([designs, np.tile(chosen, (len(designs), 1))])


def _effect(designs: Array, name: str, outputs: tuple[str, ...]) -> dict[str, object]:
    family, angles = extended(RSSR, outputs), turn(POSES)
    full = _with_inputs(family, designs[:16])
    took = seconds(lambda: family.poses(full, angles, frozenset(outputs)), repeats=3)
    return _row("effect", f"{name}: all {len(outputs)} pose outputs", took, len(full), POSES)


def _design_effect(designs: Array, name: str, outputs: tuple[str, ...]) -> dict[str, object]:
    family = extended(RSSR, outputs)
    full = _with_inputs(family, designs[:8])
    took = seconds(lambda: design_outputs(family, full, outputs, Accuracy(target=1e-6)), repeats=3)
    return _row("effect", f"{name}: {len(outputs)} design outputs", took, len(full), math.nan)


def _row(kind: str, outputs: str, took: float, designs: int, poses: float) -> dict[str, object]:
    per_design = 1e9 * took / designs
    return {"kind": kind, "outputs": outputs, "ns_per_pose": per_design / poses, "ns_per_design": per_design}


STUDY = """
[study]
name = "stored"
[mechanism]
family = "rssr"
[scene]
want = ["margin", "max_pressure_angle", "max_abs_d2psi"]
[design]
sample = {{ kind = "sobol", n = {designs}, seed = 1 }}
a = {{ from = 0.1, to = 1.0, unit = "mm" }}
b = {{ from = 0.5, to = 5.0, unit = "mm" }}
c = {{ from = 0.5, to = 4.0, unit = "mm" }}
e = {{ from = -3.0, to = 3.0, unit = "mm" }}
f = {{ from = -2.0, to = 2.0, unit = "mm" }}
g = {{ from = -2.0, to = 2.0, unit = "mm" }}
alpha = {{ from = 0, to = 180, unit = "deg" }}
[limits]
rotatable = true
[accuracy]
target = 1e-8
[output]
keep = "feasible"
dtype = "{dtype}"
"""


def storage_costs(designs: int) -> pd.DataFrame:
    """Bytes, time and error of the same sweep stored in float64 and in float32."""
    import pandas as pd

    rows, frames = [], {}
    for dtype in ("float64", "float32"):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "study.toml").write_text(STUDY.format(designs=designs, dtype=dtype))
            sweep.run(folder, out=folder / "warm", jobs=1)
            start = time.perf_counter()
            sweep.run(folder, out=folder / "designs", jobs=1)
            took = time.perf_counter() - start
            frames[dtype] = sweep.load(folder / "designs").sort_values("design")
            size = sum(path.stat().st_size for path in (folder / "designs").glob("part-*.parquet"))
        rows.append({"dtype": dtype, "rows": len(frames[dtype]), "bytes_per_row": size / len(frames[dtype])})
        rows[-1] |= {"ns_per_design": 1e9 * took / designs}
    exact, stored = frames["float64"]["max_abs_d2psi"].to_numpy(), frames["float32"]["max_abs_d2psi"].to_numpy()
    error = np.abs(stored.astype(np.float64) / exact - 1.0)
    for row, largest in zip(rows, (0.0, float(error.max())), strict=True):
        row["largest_error_of_storing"] = largest
    return pd.DataFrame(rows)


def optimiser_costs(targets: tuple[float, ...], starts: int) -> pd.DataFrame:
    """Time and result of one optimisation at different accuracies: least acceleration for a swing of 45 degrees."""
    import pandas as pd

    from sweep.optimise import Problem, minimise
    from sweep.study import Limit, OptimiseSettings

    swing, angle = math.radians(45.0), math.radians(45.0)
    limits = (Limit("swing", swing, swing), Limit("max_pressure_angle", None, angle))
    low, high = np.array([0.05, 0.3, 0.3, -1.0]), np.array([0.9, 2.0, 2.0, 1.0])
    rows, best = [], []
    for target in targets:
        problem = Problem(
            RSSR, ("a", "b", "c", "f"), low, high, {"e": 1.0, "g": 0.0, "alpha": 0.5, "branch": -1.0}, "max_abs_d2psi",
            limits, accuracy=Accuracy(target=target),
        )  # fmt: skip
        first = problem.rows(
            np.random.default_rng(3).uniform([0.2, 0.5, 0.6, -0.2], [0.35, 0.9, 1.0, 0.2], (starts, 4))
        )
        minimise(problem, first[:1], OptimiseSettings(starts=1))
        start = time.perf_counter()
        results = minimise(problem, first, OptimiseSettings(starts=starts))
        took = time.perf_counter() - start
        best.append(results[0].objective)
        ok = sum(result.status == st.OK for result in results)
        rows.append({"accuracy": target, "seconds_per_start": took / starts, "objective": best[-1], "converged": ok})
    for row, value in zip(rows, best, strict=True):
        row["difference_from_finest"] = abs(value - best[-1]) / best[-1]
    return pd.DataFrame(rows)
