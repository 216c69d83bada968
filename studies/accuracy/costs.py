"""What each further output and effect costs, and what float32 saves on disk."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

import sweep
from kernels.families import rssr
from studies.accuracy.reference import RSSR
from studies.accuracy.timing import seconds
from sweep.effects import NAMES, effect
from sweep.effects import costs as effects
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.reductions.sampling import turn

if TYPE_CHECKING:
    import pandas as pd

Names: TypeAlias = tuple[tuple[str, ...], ...]
POSES = effects.POSES  # of a turn
MOTION = ("dpsi", "d2psi", "d3psi")
GRIDS: Names = ((), ("dpsi",), ("d2psi",), ("d3psi",), MOTION)
POSE_SETS: Names = (
    ("psi",),
    ("sin_psi", "cos_psi"),
    ("dpsi",),
    ("d2psi",),
    ("d3psi",),
    ("psi", *MOTION),
    ("discriminant",),
    ("pressure_angle",),
    ("x_b", "y_b", "z_b", "x_c", "y_c", "z_c"),
)
TURNS: Names = (
    ("rotatable",),
    ("margin",),
    ("max_pressure_angle",),
    ("swing",),
    ("max_abs_dpsi",),
    ("max_abs_d2psi",),
    ("max_abs_d3psi",),
)
FINE, MANY = Accuracy(target=1e-8), 4000


def output_costs(designs: Array, smoke: bool) -> pd.DataFrame:
    """Return the time of every output of the crank-rocker, each alone, in one run, and of every effect of the register.

    Columns: what is computed, of which families, ns per pose or per design, and how many times the angle psi at one
    pose, or at the poses of a turn, that is.  In smoke two pose sets and one output of a turn.
    """
    import pandas as pd

    few = slice(2) if smoke else slice(None)
    rows = [_row("largest over a grid", names, _dense(designs, names), "pose") for names in GRIDS[few]]
    rows += [_row("poses", names, _poses(designs, names), "pose") for names in POSE_SETS[few]]
    rows += [_row("whole turn, exact", names, _turn(designs, names), "design") for names in TURNS[few]]
    motion = effects.motion_ns(RSSR.name, 16 if smoke else 64, REPEATS)
    rows.append(_row("effect", (effects.MOTION,), 1e-9 * motion, "pose"))
    return with_effects(pd.DataFrame(rows), NAMES)


def with_effects(table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return the table of :func:`output_costs` with these effects as sweep/costs.toml has them, behind the others.

    `make bench` measures them on the first of their families, without the motion that they need.
    """
    import pandas as pd

    whole = table["what"].str.partition(":")[0].isin(names) & (table["kind"] == "effect")
    found = [effects.Cost(name, "all", "pose", ns) for name in names if (ns := effect(name).ns_per_pose)]
    found += [effects.Cost(name, "all", "design", ns) for name in names if (ns := effect(name).ns_per_design)]
    rows = pd.DataFrame([_effect(cost) for cost in found])
    position = float(table.loc[table["what"] == "psi", "nanoseconds"].iloc[0])
    if len(rows):
        poses = np.where(rows["per"] == "pose", position, POSES * position)
        rows["times_position"] = rows["nanoseconds"] / poses
    return pd.concat([table[~whole], rows], ignore_index=True)


def _effect(cost: effects.Cost) -> dict[str, object]:
    row: dict[str, object] = {"kind": "effect", "per": cost.per, "nanoseconds": cost.ns}
    entry = effect(cost.effect)
    design = entry.design_result.outputs if entry.design_result else ()
    count = len(entry.outputs if cost.per == "pose" else design)
    return row | {"what": f"{cost.effect}: {count} {cost.per} outputs", "family": ", ".join(entry.families)}


def _row(kind: str, names: tuple[str, ...], took: float, per: str) -> dict[str, object]:
    if kind.startswith("largest"):
        what = ", ".join(f"max_abs_{name}" for name in names) or "least discriminant"
    elif kind == "effect":
        what = f"{names[0]} and joint records of every effect"
    else:
        what = ", ".join(names)
    return {"kind": kind, "what": what, "family": RSSR.name, "per": per, "nanoseconds": 1e9 * took}


def _dense(designs: Array, names: tuple[str, ...]) -> float:
    angles, n = turn(POSES), len(designs)
    least = np.empty(n)
    out = [np.empty(n) if name in names else None for name in MOTION]
    took = seconds(lambda: rssr.dense_maxima(designs, angles.cos[0], angles.sin[0], least, out[0], out[1], out[2]))
    return took / (n * POSES)


def _poses(designs: Array, names: tuple[str, ...]) -> float:
    angles, few = turn(POSES), designs[:128]
    return seconds(lambda: RSSR.poses(few, angles, frozenset(names))) / (len(few) * POSES)


def _turn(designs: Array, names: tuple[str, ...]) -> float:
    many = np.tile(designs, (-(-MANY // len(designs)), 1))  # what a call itself costs must not show
    return seconds(lambda: design_outputs(RSSR, many, list(names), FINE)) / len(many)


REPEATS = 3
STORED = ("margin", "max_pressure_angle", "max_abs_d2psi")
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
    """Return bytes, time and error of the same sweep stored in float64 and in float32."""
    import pandas as pd

    dtypes = ("float64", "float32")
    rows: dict[str, dict[str, object]] = {dtype: {"dtype": dtype} for dtype in dtypes}
    took = dict.fromkeys(dtypes, float("inf"))
    frames = {}
    with tempfile.TemporaryDirectory() as name:
        for again in range(REPEATS):
            for dtype in dtypes:
                folder = Path(name) / f"{dtype}-{again}"
                folder.mkdir()
                (folder / "study.toml").write_text(STUDY.format(designs=designs, dtype=dtype))
                start = time.process_time()
                sweep.run(folder, out=folder / "designs", jobs=1)
                took[dtype] = min(took[dtype], time.process_time() - start)
        for dtype in dtypes:
            folder = Path(name) / f"{dtype}-0" / "designs"
            frames[dtype] = sweep.load(folder).sort_values("design")
            size = sum(path.stat().st_size for path in folder.glob("part-*.parquet"))
            rows[dtype] |= {"rows": len(frames[dtype]), "bytes_per_row": size / len(frames[dtype])}
            rows[dtype]["ns_per_design"] = 1e9 * took[dtype] / designs
    for dtype in dtypes:
        for output in STORED:
            exact, stored = (frames[key][output].to_numpy(np.float64) for key in ("float64", dtype))
            rows[dtype][output] = float(np.abs(stored / exact - 1.0).max())
    return pd.DataFrame(list(rows.values()))
