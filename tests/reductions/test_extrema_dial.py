"""The accuracy dial of the general search: a smaller target gives a smaller error, and every error is below ``err_``.

The reference (tests/support/climbing.py) are poses in twice the working precision about the peak that was found; that
the peak is the right one is shown by tests/reductions/test_extrema_reference.py and by the proofs of docs/extrema.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kernels import status as st
from studies.accuracy.regions import regions
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.families.capabilities import InSeries
from sweep.quantities.kinds import Request
from sweep.reductions import rounding
from sweep.reductions.extrema import true_extrema
from tests.support.climbing import climbed, turning_points, values
from tests.support.turn_designs import (
    GUIDE,
    NEEDLE,
    RSSP,
    RSSR,
    crank_rockers,
    guided_four_bars,
    needle_drives,
    slider_cranks,
)

TARGETS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
ALONE = replace(RSSR, steps=())
ON_POSES = replace(RSSP, capabilities=tuple(one for one in RSSP.capabilities if not isinstance(one, InSeries)))
ROCKER = (Request("d2psi", 0), Request("d3psi", 0), Request("psi", 1))
SLIDE = (Request("d2s", 0), Request("d3s", 0), Request("s", 1))
TRAVEL = (Request("d2s", 0), Request("d3s", 0), Request("dev", 0), Request("s", 1), Request("s", -1))
CASES = {
    "rssr": (ALONE, crank_rockers, 2000, ROCKER),
    "rssp": (RSSP, slider_cranks, 1000, SLIDE),
    "rssp on poses": (ON_POSES, slider_cranks, 1000, SLIDE),
    "guide": (GUIDE, guided_four_bars, 1000, TRAVEL),
    "rssr+guide": (NEEDLE, needle_drives, 1000, TRAVEL),
}
HARD = ("pressure angle beyond 84", "change point", "parallel axes", "long coupler")


@pytest.fixture(scope="module", params=CASES)
def case(request):
    family, make, n, requests = CASES[request.param]
    designs = make(12 * n, 21)
    margin = design_outputs(family, designs, ["margin"], Accuracy(target=1e-8))
    designs = designs[(margin["status"] == st.OK) & (margin["margin"] > 1e-5)][:n]
    found, status = true_extrema(family, designs, requests, 1e-9)
    if family is ALONE:
        designs = designs[status != st.NOT_OSCILLATING]  # rockers that turn round have no largest angle
        found, status = true_extrema(family, designs, requests, 1e-9)
    assert (status == st.OK).all()
    exact = {r: climbed(family, designs, r.pose, r.mode, found[r].phi) for r in requests}
    return family, designs, requests, exact


def test_errors_fall_with_the_target_and_stay_below_it(case):
    family, designs, requests, exact = case
    worst = []
    for target in TARGETS:
        found, status = true_extrema(family, designs, requests, target)
        assert (status == st.OK).all()
        relative = np.abs(found[requests[0]].value / exact[requests[0]] - 1.0)
        assert relative.max() <= target
        worst.append(np.quantile(relative, 0.99))
    if family in (GUIDE, NEEDLE, RSSP):
        assert max(worst) < 1e-12  # the Newton steps of a fused search reach its rounding at any target
    else:
        assert worst[0] > 10.0 * worst[1] > 100.0 * worst[2]  # at 1e-6 most are exact already


@pytest.mark.parametrize("target", TARGETS)
def test_error_estimates_bound_the_error(case, target):
    family, designs, requests, exact = case
    found, _ = true_extrema(family, designs, requests, target)
    for request in requests:
        off = _off(found[request].value, exact[request], request)
        assert (off <= found[request].err).all()
        if request.mode == 0:
            # An estimate that is always huge would bound everything and say nothing.
            assert np.median(found[request].err / np.abs(exact[request])) <= target


@pytest.fixture(scope="module")
def hard():
    return {r.name: r.designs for r in regions(100, 5) if r.name in HARD}


@pytest.mark.parametrize("region", HARD)
@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-12])
def test_error_estimates_bound_the_error_of_hard_designs(hard, region, target):
    """Plain poses of long couplers are wrong by up to 2e-7, those near change points by 1e-8."""
    designs = hard[region]
    for request in ROCKER[:2]:
        fine, known = true_extrema(ALONE, designs, [request], 1e-9, locate=True)
        found, status = true_extrema(ALONE, designs, [request], target)
        good = (known == st.OK) & (status == st.OK)
        assert good.sum() > 30
        exact = climbed(ALONE, designs[good], request.pose, request.mode, fine[request].phi[good])
        assert (np.abs(found[request].value[good] - exact) <= found[request].err[good]).all()
        assert np.median(found[request].err[good] / exact) <= target


@pytest.mark.parametrize("region", HARD)
@pytest.mark.parametrize("target", [1e-8, 1e-12])
def test_the_search_of_the_crank_rocker_keeps_the_accuracy_asked_of_hard_designs(hard, region, target):
    """What its plain poses leave beyond the target, by rounding, its precise poses find."""
    designs, names = hard[region], ["max_abs_d2psi", "phi_max_abs_d2psi", "max_abs_d3psi", "phi_max_abs_d3psi"]
    found = design_outputs(RSSR, designs, names, Accuracy(target=target))
    assert (found["status"] == st.OK).all()
    for pose in ("d2psi", "d3psi"):
        exact = climbed(ALONE, designs, pose, 0, found[f"phi_max_abs_{pose}"])
        off, err = np.abs(found[f"max_abs_{pose}"] - exact), found[f"err_max_abs_{pose}"]
        assert (off <= err).all()
        assert (err <= target * exact).all()


@pytest.mark.parametrize("looked_at", [False, True])
def test_plain_poses_alone_know_their_errors_by_the_rounding_of_the_inputs_only(hard, looked_at, monkeypatch):
    if not looked_at:
        monkeypatch.setattr(rounding, "shaken", lambda family, designs, phi, name: np.zeros(len(designs)))
    designs, pose = hard["long coupler"], "d2psi"
    fine, _ = true_extrema(ALONE, designs, [Request(pose, 0)], 1e-9, locate=True)
    exact = climbed(ALONE, designs, pose, 0, fine[Request(pose, 0)].phi)
    plain, _ = true_extrema(replace(ALONE, precise_poses=None), designs, [Request(pose, 0)], 1e-12)
    off, err = np.abs(plain[Request(pose, 0)].value - exact), plain[Request(pose, 0)].err
    assert (off <= err).all() if looked_at else (off > 10.0 * err).sum() > 10


@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-12])
def test_places_lie_within_their_errors(case, target):
    family, designs, requests, _ = case
    for request in (r for r in requests if r.pose in family.derivative_of):
        slope = family.derivative_of[request.pose]
        fine, _ = true_extrema(family, designs, [request], 1e-9, locate=True)
        exact = turning_points(family, designs, slope, fine[request].phi)
        found, _ = true_extrema(family, designs, [request], target, locate=True)
        off = np.abs(np.angle(np.exp(1j * (found[request].phi - exact))))
        assert (off <= found[request].err_phi).all()
        assert found[request].err_phi.max() <= max(target, 1e-10)


@pytest.mark.parametrize("target", [1e-6, 1e-8, 1e-12])
def test_places_of_the_jerk_lie_within_their_errors(target):
    """The general search has no derivative of the jerk; here it is a difference of order four, good to 2e-12 rad."""
    h, request = 3e-5, Request("d3s", 0)
    designs = guided_four_bars(12000, 21)
    margin = design_outputs(GUIDE, designs, ["margin"], Accuracy(target=1e-8))
    designs = designs[(margin["status"] == st.OK) & (margin["margin"] > 1e-3)][:1000]
    found, _ = true_extrema(GUIDE, designs, [request], target, locate=True)
    place, error = found[request].phi, np.maximum(found[request].err_phi, 2e-12)

    def slope(phi):
        y = np.abs(values(GUIDE, designs, "d3s", phi[:, None] + h * np.array([-2.0, -1.0, 1.0, 2.0])))
        return 8.0 * (y[:, 2] - y[:, 1]) - (y[:, 3] - y[:, 0])

    assert (slope(place - error) >= 0.0).all() and (slope(place + error) <= 0.0).all()
    assert error.max() <= max(target, 1e-9)


def _off(value, exact, request):
    off = value - exact
    return np.abs(off - 2.0 * np.pi * np.rint(off / (2.0 * np.pi)) if request.pose == "psi" else off)
