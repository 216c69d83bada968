"""The planar case next to pylinkage: ``make bench-peers``, in an environment of its own; never a dependency, not in CI.

One four-bar, position, velocity and acceleration of the rocker at evenly spaced crank angles, each tool by its fastest
way: pylinkage's compiled stepping, the poses of the crank-rocker for one design, and the loop over a grid.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np

from kernels.families import rssr
from studies.accuracy.machine import description
from studies.accuracy.reference import RSSR
from studies.accuracy.timing import seconds
from sweep.families.base import Array
from sweep.reductions.sampling import turn

A, B, C, E = 1.0, 3.0, 2.5, 3.2  # crank, coupler, rocker, frame; turns fully
ANGLES = 7200
DESIGNS = 2000  # side by side, as a sweep has them


def main() -> None:
    """Time both, compare the rocker's positions, keep the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.accuracy.peers", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    out: Path = parser.parse_args().out

    import pandas as pd

    phi = turn(ANGLES)
    design = np.array([[A, B, C, E, 0.0, 0.0, 0.0, 1.0]])
    wanted = frozenset({"psi", "dpsi", "d2psi"})
    least, found = np.empty(DESIGNS), np.empty(DESIGNS)
    many, grid = np.tile(design, (DESIGNS, 1)), turn(720)

    def sweep_all() -> None:
        rssr.dense_maxima(many, grid.cos[0], grid.sin[0], least, None, found, None)

    stepped, trace = _pylinkage()
    rows = [
        (f"pylinkage {version('pylinkage')}: position, velocity, acceleration", seconds(stepped) / ANGLES),
        ("linksweep: position, velocity, acceleration", seconds(lambda: RSSR.poses(design, phi, wanted)) / ANGLES),
        ("linksweep: largest acceleration over a grid", seconds(sweep_all) / (DESIGNS * 720)),
    ]
    table = pd.DataFrame(
        [{"what": what, "ns_per_angle": 1e9 * took, "ratio": rows[0][1] / took} for what, took in rows]
    )
    table["distance_of_rocker_pins"] = _distance(trace)
    out.mkdir(parents=True, exist_ok=True)
    table.to_parquet(out / "peers.parquet", index=False)
    print(f"{description()}\n{table.to_string(index=False)}")  # noqa: T201


def _pylinkage() -> tuple[Callable[[], tuple[Array, Array, Array]], Array]:
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    step = 2.0 * math.pi / ANGLES
    left, right = Ground(0.0, 0.0, name="A"), Ground(E, 0.0, name="D")
    crank = Crank(anchor=left, radius=A, angular_velocity=step, name="B")
    rocker = RRRDyad(anchor1=crank.output, anchor2=right, distance1=B, distance2=C, name="C")
    linkage = Linkage([left, right, crank, rocker], name="four-bar")
    linkage.set_input_velocity(crank, omega=1.0, alpha=0.0)

    def run() -> tuple[Array, Array, Array]:
        traces: tuple[Array, Array, Array] = linkage.step_fast_with_kinematics(iterations=ANGLES)
        return traces

    return run, run()[0]


def _distance(trace: Array) -> float:
    """Return the largest distance of the two tools' rocker pins, for the better of the two assembly modes,
    at equal crank pins.
    """
    pins = np.asarray(trace)[:, -2], np.asarray(trace)[:, -1]
    phi = np.arctan2(pins[0][:, 1], pins[0][:, 0])[None, :]
    distances = []
    for branch in (1.0, -1.0):
        design = np.array([[A, B, C, E, 0.0, 0.0, 0.0, branch]])
        motion = RSSR.poses(
            design, turn(1)._replace(phi=phi, cos=np.cos(phi), sin=np.sin(phi)), frozenset({"x_c", "y_c"})
        )
        own = np.stack([motion["x_c"][0], motion["y_c"][0]], axis=1)
        distances.append(float(np.abs(own - pins[1]).max()))
    return min(distances)


if __name__ == "__main__":
    main()
