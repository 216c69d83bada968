"""Certified maxima of the travel of a guided point: of the guide alone, or at the end of a chain of crank-rockers."""

from __future__ import annotations

from functools import partial

import numpy as np

from kernels import status as st
from kernels.families import guide, rssr
from sweep.families import guide as guided
from sweep.families import rssr as crank_rocker
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step, Travel
from sweep.reductions.extrema import Request, true_extrema

MOST_CELLS = 1000  # enclosures of one design before its proof is given up
DERIVATIVES = ("ds", "d2s", "d3s")
GUIDE_COLUMNS, ROCKER_COLUMNS = len(guided.PARAMETERS), len(crank_rocker.PARAMETERS)


def certified_travel(family: Family) -> Step | None:
    """The step that proves maxima of a guided point's travel; None for a family without one."""
    if family.travel is None:
        return None
    run = partial(_proven, family, family.travel)
    outputs: list[Output] = []
    for pose in (o for o in family.pose_outputs if o.name in DERIVATIVES):
        words = f"largest magnitude over one turn of {pose.name}: {pose.text}"
        outputs.append(Output(f"max_abs_{pose.name}", pose.unit, words, pose.equation))
        place = f"crank angle of the largest magnitude of {pose.name}: {pose.text}"
        outputs.append(Output(f"phi_max_abs_{pose.name}", "rad", place, pose.equation))
    return Step(
        "certified maxima", tuple(outputs), run, 8000.0 + 7000.0 * len(family.travel.starts), _certified, certifies=True
    )


def _certified(accuracy: Accuracy) -> bool:
    return accuracy.certify


def _proven(family: Family, travel: Travel, designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    assert accuracy.target is not None
    starts, couplings = travel
    n = len(designs)
    driven = np.ascontiguousarray(designs[:, starts[-1] : starts[-1] + GUIDE_COLUMNS])
    stages = [designs[:, start : start + ROCKER_COLUMNS] for start in starts[:-1]] + [guided.as_crank_rocker(driven)]
    joined = np.reshape([designs[:, k : k + 2] for k in couplings], (len(couplings), n, 2))
    shares = np.empty((n, 6))
    guide.travel_shares(driven, shares)
    names = [name for name in DERIVATIVES if wanted & {f"max_abs_{name}", f"phi_max_abs_{name}"}]
    found, searched = true_extrema(family, designs, [Request(name, 0) for name in names], accuracy.target, locate=True)
    columns: Columns = {"status": searched.copy()}
    for name in names:
        peak, status, error = found[Request(name, 0)], searched.copy(), np.full(n, np.nan)
        value, phi = peak.value.copy(), peak.phi.copy()
        rssr.certify_travel(
            np.stack(stages), joined, shares, DERIVATIVES.index(name) + 1, accuracy.target, MOST_CELLS,
            status, value, phi, error, np.empty(n),
        )  # fmt: skip
        # Where the proof found a higher peak it climbed it to a thousandth of the target.
        elsewhere = np.abs(phi - peak.phi) > peak.err_phi
        far = np.where(elsewhere, np.maximum(peak.err_phi, np.sqrt(accuracy.target)), peak.err_phi)
        for key, values, err in ((f"max_abs_{name}", value, error), (f"phi_max_abs_{name}", phi, far)):
            if key in wanted:
                columns |= {key: values, f"err_{key}": err}
        columns["status"] = np.where(columns["status"] == st.OK, status, columns["status"])
    return columns
