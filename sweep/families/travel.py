"""Certified maxima of the travel of a guided point: of the guide alone, or at the end of a chain of crank-rockers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from kernels import status as st
from kernels.families import guide, rssr
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step

MOST_CELLS = 1000  # enclosures of one design before its proof is given up
DERIVATIVES = ("ds", "d2s", "d3s")
# Columns of a design matrix in which stages and couplings begin.
GUIDE_COLUMNS, ROCKER_COLUMNS = 9, 8


def certified_travel(family: Family, starts: Sequence[int], couplings: Sequence[int]) -> Step:
    """The step that proves maxima of the travel.

    Parameters
    ----------
    family : whose poses the search works on
    starts : columns in which the stages' parameters begin, the guide's last
    couplings : columns of kappa of each stage but the first; the offset stands behind it
    """
    run = partial(_proven, family, tuple(starts), tuple(couplings))
    outputs: list[Output] = []
    for pose in (o for o in family.pose_outputs if o.name in DERIVATIVES):
        words = f"largest magnitude over one turn of {pose.name}: {pose.text}"
        outputs.append(Output(f"max_abs_{pose.name}", pose.unit, words, pose.equation))
        place = f"crank angle of the largest magnitude of {pose.name}: {pose.text}"
        outputs.append(Output(f"phi_max_abs_{pose.name}", "rad", place, pose.equation))
    return Step("certified maxima", tuple(outputs), run, 8000.0 + 7000.0 * len(starts), _certified, certifies=True)


def as_crank_rocker(designs: Array) -> Array:
    """Design matrix of a guide's four-bar as a crank-rocker with parallel axes and all links in one plane."""
    matrix = np.zeros((len(designs), ROCKER_COLUMNS))
    matrix[:, :4], matrix[:, -1] = designs[:, :4], designs[:, GUIDE_COLUMNS - 1]
    return matrix


def _certified(accuracy: Accuracy) -> bool:
    return accuracy.certify


def _proven(
    family: Family,
    starts: tuple[int, ...],
    couplings: tuple[int, ...],
    designs: Array,
    wanted: frozenset[str],
    accuracy: Accuracy,
) -> Columns:
    from sweep.extrema import Request, true_extrema

    assert accuracy.target is not None
    n = len(designs)
    driven = np.ascontiguousarray(designs[:, starts[-1] : starts[-1] + GUIDE_COLUMNS])
    stages = [designs[:, start : start + ROCKER_COLUMNS] for start in starts[:-1]] + [as_crank_rocker(driven)]
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
