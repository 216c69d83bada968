"""Joint loads next to MuJoCo: difference and time per pose of every family with joints, for the accuracy pages.

MuJoCo gets the exported model; Newton's method closes its loop, and its own inverse dynamics gives the loads, called
from Python pose by pose, as tests/effects/test_mujoco_loads.py does.  ``make bench-peers`` writes the table; another
program is further rows with the same columns.
"""

from __future__ import annotations

import argparse
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd

import sweep
from studies.accuracy.timing import spread
from sweep.effects import extended
from sweep.families import family
from sweep.families.base import Angles
from tests.effects.test_mujoco_loads import CHANGE, SPEED, Loop, apart, bodies, model_of
from tests.exchange.test_export import LINKED, scaled

POSES, MANY = 25, 3600
WANTED = (*(f"force_{joint}_{axis}" for joint in "abcd" for axis in "xyz"), "drive_torque")


def main() -> None:
    """Compare and time every family, and keep the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.loads", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    out: Path = parser.parse_args().out
    table = pd.DataFrame([compared(name) for name in LINKED])
    out.mkdir(parents=True, exist_ok=True)
    table.to_parquet(out / "loads.parquet", index=False)
    print(table.to_string(index=False))


def compared(name: str) -> dict[str, Any]:
    """A row: largest difference of a load over the turn, relative to the largest, and both times per pose."""
    follower = "slider" if name in ("rssp", "slider_crank") else "rocker"
    design = scaled(name) | bodies(follower) | {"gravity_x": 900.0, "gravity_y": -9810.0, "gravity_z": 400.0}
    design |= {"finger": 0.0, "speed": SPEED, "speed_change": CHANGE}
    phis = np.linspace(0.2, 6.4, POSES)
    with tempfile.TemporaryDirectory() as folder:
        file = sweep.export(name, model_of(design), Path(folder) / "model.xml", phi=0.2)
        gaps = apart(name, design, file, phis)
        loop = Loop(file, SPEED, CHANGE)

        def theirs() -> None:
            for phi in phis:
                loop.at(phi)

        its = spread(theirs).columns(POSES, "pose")
    own = spread(_own(name, design)).columns(MANY, "pose")
    row = {"program": f"MuJoCo {mujoco.__version__}", "family": name, "poses": POSES}
    return row | {"largest_difference": max(gaps.values())} | its | {f"{key}_own": x for key, x in own.items()}


def _own(name: str, design: dict[str, float]) -> partial[object]:
    full = extended(family(name), WANTED)
    row = np.array([[design.get(p.name, p.default or 0.0) for p in full.parameters]])
    return partial(full.poses, row, Angles.of(np.linspace(0.2, 6.4, MANY)[None, :]), frozenset(WANTED))


if __name__ == "__main__":
    main()
