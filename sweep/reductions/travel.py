"""Certified maxima of the travel of a guided point: of the guide alone, or at the end of a chain of crank-rockers."""

from __future__ import annotations

from functools import partial

import numpy as np

from kernels import status as st
from kernels.families import rssr
from sweep.costs import nanoseconds
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step, Work
from sweep.families.capabilities import CrankRockerLoop, GuidedPoint
from sweep.families.chain import Stage, stages_of
from sweep.reductions.extrema import Request, true_extrema

MOST_CELLS = 1000  # enclosures of one design before its proof is given up
ORDERS = 3  # derivatives of the travel that the proof knows


def certified_travel(family: Family) -> Step | None:
    """Return the step that proves maxima of a guided point's travel;
    None for a family or chain that has none to prove.
    """
    stages = stages_of(family)
    if stages[-1].family.find(GuidedPoint) is None or any(s.family.find(CrankRockerLoop) is None for s in stages):
        return None
    names = derivatives(family)
    outputs: list[Output] = []
    for pose in (family.pose_output[name] for name in names):
        words = f"largest magnitude over one turn of {pose.name}: {pose.text}"
        outputs.append(Output(f"max_abs_{pose.name}", pose.unit, words, pose.equation))
        place = f"crank angle of the largest magnitude of {pose.name}: {pose.text}"
        outputs.append(Output(f"phi_max_abs_{pose.name}", "rad", place, pose.equation))
    return Step(
        "certified maxima", tuple(outputs), partial(_proven, family, stages, names), _certified, Work.PROOF,
        certifies=True, cost=lambda accuracy: len(stages) * nanoseconds("work", "certified travel"),
    )  # fmt: skip


def derivatives(family: Family) -> tuple[str, ...]:
    """Return the first three derivatives of the travel, from the first."""
    names = [family.position]
    while len(names) <= ORDERS:
        names.append(family.derivative_of[names[-1]])
    return tuple(names[1:])


def _certified(accuracy: Accuracy) -> bool:
    return accuracy.certify


def _proven(
    family: Family,
    stages: tuple[Stage, ...],
    orders: tuple[str, ...],
    designs: Array,
    wanted: frozenset[str],
    accuracy: Accuracy,
) -> Columns:
    assert accuracy.target is not None
    n = len(designs)
    loops = [_loop(stage, designs) for stage in stages]
    joined = np.reshape([designs[:, s.kappa : s.kappa + 2] for s in stages if s.kappa is not None], (-1, n, 2))
    guided = stages[-1].family.find(GuidedPoint)
    assert guided is not None
    shares = guided.shares(stages[-1].designs(designs))
    names = [name for name in orders if wanted & {f"max_abs_{name}", f"phi_max_abs_{name}"}]
    locate = any(f"phi_max_abs_{name}" in wanted for name in names)
    requests = [Request(name, 0) for name in names]
    found, searched = true_extrema(family, designs, requests, accuracy.target, locate=locate)
    columns: Columns = {"status": searched.copy()}
    for name in names:
        peak, status, error = found[Request(name, 0)], searched.copy(), np.full(n, np.nan)
        value, phi = peak.value.copy(), peak.phi.copy()
        rssr.certify_travel(
            np.stack(loops), joined, shares, orders.index(name) + 1, accuracy.target, MOST_CELLS,
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


def _loop(stage: Stage, designs: Array) -> Array:
    """Return a stage as a crank-rocker, (n, 8)."""
    found = stage.family.find(CrankRockerLoop)
    assert found is not None
    return found.matrix(stage.designs(designs))
