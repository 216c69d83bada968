"""Certified maxima of a guided point's travel and deviation: of a guide alone, or behind crank-rockers."""

from __future__ import annotations

from functools import partial

import numpy as np

from kernels import status as st
from sweep.costs import nanoseconds
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step, Work
from sweep.families.capabilities import CrankRockerLoop, GuidedPoint
from sweep.families.chain import stages_of
from sweep.families.parts import Stage
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema

MOST_CELLS = 1000  # enclosures of one design before its proof is given up
ORDERS = 3  # derivatives that the proof knows


def certified_travel(family: Family) -> Step | None:
    """Step that proves maxima of a guided point's travel and deviation; None for a family that has none to prove."""
    stages = stages_of(family)
    guided = stages[-1].family.find(GuidedPoint)
    if guided is None or any(s.family.find(CrankRockerLoop) is None for s in stages):
        return None
    curves = proven_curves(family, guided)
    outputs: list[Output] = []
    for pose in (family.pose_output[name] for name in curves):
        words = f"largest magnitude over one turn of {pose.name}: {pose.text}"
        outputs.append(Output(f"max_abs_{pose.name}", pose.unit, words, pose.equation))
        place = f"crank angle of the largest magnitude of {pose.name}: {pose.text}"
        outputs.append(Output(f"phi_max_abs_{pose.name}", "rad", place, pose.equation))
    return Step(
        "certified maxima", tuple(outputs), partial(_proven, family, stages, guided), _certified, Work.PROOF,
        certifies=True, cost=lambda accuracy: len(stages) * nanoseconds("work", "certified travel"),
    )  # fmt: skip


def proven_curves(family: Family, guided: GuidedPoint) -> dict[str, tuple[int, int]]:
    """Pose outputs whose maxima the proof knows.

    To each: 0 for the travel along the line, 1 for the deviation across it, and the order of the derivative.
    """
    curves: dict[str, tuple[int, int]] = {}
    name = family.position
    for order in range(ORDERS + 1):
        if order > 0:
            curves[name] = (0, order)
        if name in guided.across:
            curves[guided.across[name]] = (1, order)
        name = family.derivative_of.get(name, "")
    return curves


def _certified(accuracy: Accuracy) -> bool:
    return accuracy.certify


def _proven(
    family: Family,
    stages: tuple[Stage, ...],
    guided: GuidedPoint,
    designs: Array,
    wanted: frozenset[str],
    accuracy: Accuracy,
) -> Columns:
    from kernels.families.rssr.certify import certify_maxima  # here: only proofs wait for its import

    assert accuracy.target is not None
    n = len(designs)
    loops = [_loop(stage, designs) for stage in stages]
    coupled = [designs[:, s.kappa : s.kappa + 2] for s in stages if s.kappa is not None]
    joined = np.reshape(coupled, (len(stages) - 1, n, 2))
    shares = guided.shares(stages[-1].designs(designs))
    known = proven_curves(family, guided)
    names = [name for name in known if wanted & {f"max_abs_{name}", f"phi_max_abs_{name}"}]
    locate = any(f"phi_max_abs_{name}" in wanted for name in names)
    requests = [Request(name, 0) for name in names]
    found, searched = true_extrema(family, designs, requests, accuracy.target, locate=locate)
    value = np.stack([found[request].value for request in requests])
    phi = np.stack([found[request].phi for request in requests])
    status, error = np.tile(searched, (len(names), 1)), np.full(value.shape, np.nan)
    certify_maxima(
        np.stack(loops), joined, shares, np.array([known[name] for name in names], np.int64), accuracy.target,
        MOST_CELLS, status, value, phi, error, np.empty(n),
    )  # fmt: skip
    columns: Columns = {"status": searched.copy()}
    for j, name in enumerate(names):
        # Where the proof found a higher peak it climbed it to a thousandth of the target.
        peak = found[requests[j]]
        elsewhere = np.abs(phi[j] - peak.phi) > peak.err_phi
        far = np.where(elsewhere, np.maximum(peak.err_phi, np.sqrt(accuracy.target)), peak.err_phi)
        for key, values, err in ((f"max_abs_{name}", value[j], error[j]), (f"phi_max_abs_{name}", phi[j], far)):
            if key in wanted:
                columns |= {key: values, f"err_{key}": err}
        columns["status"] = np.where(columns["status"] == st.OK, status[j], columns["status"])
    return columns


def _loop(stage: Stage, designs: Array) -> Array:
    """Return a stage as a crank-rocker, (n, 8)."""
    found = stage.family.find(CrankRockerLoop)
    assert found is not None
    return found.matrix(stage.designs(designs))
