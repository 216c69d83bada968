"""The planar case next to pylinkage: ``make bench-peers``, in an environment of its own; never a dependency, not in CI.

Ordinary four-bars of the price list: position, velocity and acceleration of the rocker at evenly spaced crank angles,
and the largest acceleration of the turn, each program by its fastest way: pylinkage's compiled stepping, the poses of
one design, and the sweep over many.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from studies.accuracy.machine import description
from studies.accuracy.prices import GRID, SAMPLES
from studies.accuracy.subjects import ORDINARY, measure, regions_of
from studies.accuracy.timing import per_design, spread
from studies.accuracy.witness import reference
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array
from sweep.reductions.sampling import turn

PLANAR = "four_bar"
DESIGNS = 4  # a linkage of pylinkage is one design, so few do
OWN, SWEPT = "linksweep, one design at a time", "linksweep, many designs at once"


def main() -> None:
    """Time both, compare their accelerations, keep the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.peers", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    out: Path = parser.parse_args().out

    import pandas as pd

    region = next(region for region in regions_of(PLANAR, (DESIGNS, 0, 0)) if region.name == ORDINARY)
    exact = reference(family(PLANAR), region.designs).value
    rows = [
        row
        for samples in SAMPLES
        for row in (
            _row(f"pylinkage {version('pylinkage')}", samples, _pylinkage, region.designs, exact),
            _row(OWN, samples, _own, region.designs, exact),
            _swept(samples, region.designs, exact),
        )
    ]
    table = pd.DataFrame(rows)
    out.mkdir(parents=True, exist_ok=True)
    table.to_parquet(out / "peers.parquet", index=False)
    print(f"{description()}\n{table.to_string(index=False)}")


def _row(
    what: str, samples: int, make: Callable[[Array, int], Callable[[], float]], designs: Array, exact: Array
) -> dict[str, object]:
    runs = [make(design, samples) for design in designs]
    error = max(abs(run() / value - 1.0) for run, value in zip(runs, exact, strict=True))

    def together() -> None:
        for run in runs:
            run()

    head: dict[str, object] = {"what": what, "family": PLANAR, "method": GRID, "setting": float(samples)}
    return head | {"largest_error": error} | spread(together).columns(len(runs), "design")


def _swept(samples: int, designs: Array, exact: Array) -> dict[str, object]:
    mechanism, accuracy = family(PLANAR), Accuracy(samples=samples)
    name = measure(mechanism)

    def run(some: Array) -> Array:
        return np.asarray(design_outputs(mechanism, some, [name], accuracy)[name], np.float64)

    error = float(np.abs(run(designs) / exact - 1.0).max())
    head: dict[str, object] = {"what": SWEPT, "family": PLANAR, "method": GRID, "setting": float(samples)}
    return head | {"largest_error": error} | per_design(run, designs)


def _own(design: Array, samples: int) -> Callable[[], float]:
    mechanism, one, angles = family(PLANAR), design[None, :], turn(samples)
    wanted = frozenset({"psi", "dpsi", "d2psi"})
    assert measure(mechanism) == "max_abs_d2psi"
    return lambda: float(np.abs(mechanism.poses(one, angles, wanted)["d2psi"]).max())


def _pylinkage(design: Array, samples: int) -> Callable[[], float]:
    """Return the rocker's angular acceleration from its pin's, as the program gives no angles."""
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    a, b, c, e = (float(x) for x in design[:4])
    left, right = Ground(0.0, 0.0, name="A"), Ground(e, 0.0, name="D")
    crank = Crank(anchor=left, radius=a, angular_velocity=2.0 * math.pi / samples, name="B")
    rocker = RRRDyad(anchor1=crank.output, anchor2=right, distance1=b, distance2=c, name="C")
    linkage = Linkage([left, right, crank, rocker], name="four-bar")
    linkage.set_input_velocity(crank, omega=1.0, alpha=0.0)
    return partial(_largest, linkage, samples, e, c)


def _largest(linkage: object, samples: int, frame: float, rocker: float) -> float:
    traces = linkage.step_fast_with_kinematics(iterations=samples)  # type: ignore[attr-defined]
    position, _, acceleration = (np.asarray(trace)[:, -1] for trace in traces)
    x, y = position[:, 0] - frame, position[:, 1]
    return float(np.abs(x * acceleration[:, 1] - y * acceleration[:, 0]).max()) / rocker**2


if __name__ == "__main__":
    main()
