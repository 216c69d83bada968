"""Fused chains: one kernel for all stages gives what the stages give one after the other.

The staged route (kernels/chains/links.py, poses of each family) shares no loop, no chain rule and no search with
the fused one; extrema are compared with poses in twice the working precision about the peaks that the search on poses
finds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kernels import chains as chain_kernels
from kernels import status as st
from kernels.families import guide, rssr
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, fused
from tests.support.climbing import (
    amplified,
    assert_fused_extrema_lie_within_their_errors,
    assert_fused_margins_are_those_of_poses,
    climbed,
)
from tests.support.selection import mostly_long
from tests.support.turn_designs import NEEDLE, crank_rockers, guided_four_bars

EPS = 2.0**-53
THREE = family(["rssr", "rssr", "guide"])
ROCKERS = family(["rssr", "rssr"])
PHI = np.arange(256) * (2.0 * np.pi / 256)
COMPONENTS = {"ds": "x1", "d2s": "x2", "d3s": "x3", "dev": "y0", "ddev": "y1", "d2dev": "y2"}


def coupled(n, seed):
    r = np.random.default_rng(seed)
    return np.column_stack([r.choice([-1.0, 1.0], n), r.uniform(-3.0, 3.0, n)])


def chains(name, n, seed):
    """Designs all of whose stages turn, with some of them near change points."""
    of = {"rssr+guide": NEEDLE, "rssr+rssr": ROCKERS, "rssr+rssr+guide": THREE}[name]
    parts, names = [], name.split("+")
    for k, own in enumerate(names):
        make = crank_rockers if own == "rssr" else (lambda n, seed: guided_four_bars(n, seed, (0.5, 2.0)))
        parts += [make(40 * n, seed + 7 * k)] + ([coupled(40 * n, seed + 7 * k + 1)] if k else [])
    designs = np.column_stack([*parts, np.zeros((40 * n, 2 * (len(names) - 1)))])
    margin = design_outputs(of, designs, ["margin"], Accuracy(target=1e-6))
    return of, np.ascontiguousarray(designs[margin["status"] == st.OK][:n])


CASES = {name: chains(name, 300, seed) for seed, name in enumerate(("rssr+guide", "rssr+rssr", "rssr+rssr+guide"))}


def forms(of):
    return tuple({"rssr": rssr.FORM, "guide": guide.FORM}[stage.family.name] for stage in of.stages)


def staged(of, designs, names):
    poses = of.poses(designs, Angles.of(PHI[None, :]), frozenset(names))
    assert (poses["status"] == st.OK).all()
    return poses


@pytest.mark.parametrize("name", CASES)
def test_travel_and_its_derivatives_are_those_of_the_stages_one_after_the_other(name):
    of, designs = CASES[name]
    chain, few = chain_kernels.chained(forms(of)), designs[:60]
    names = COMPONENTS if of.position == "s" else {"dpsi": "x1", "d2psi": "x2", "d3psi": "x3"}
    poses = staged(of, few, (*names, *(["s"] if of.position == "s" else [])))
    fused_names = names | ({"s": "x0"} if of.position == "s" else {})
    found = {own: np.empty((len(few), PHI.size)) for own in fused_names}
    for i in range(len(few)):
        c = chain.record.constants(few, i)
        for j, phi in enumerate(PHI):
            m, deltas = chain.travel(c, np.cos(phi), np.sin(phi))
            assert len(deltas) == len(of.stages)
            for own, component in fused_names.items():
                found[own][i, j] = getattr(m, component)
    for own in fused_names:
        size = np.abs(poses[own]).max(axis=1, keepdims=True)
        # Some tens of roundings per stage, each amplified by the nearest dead point; a third derivative twice.
        order = {"d3s": 2.0, "d3psi": 2.0}.get(own, 1.0)
        share = 64.0 * len(of.stages) * EPS * amplified(of, few)[:, None] ** order
        assert (np.abs(found[own] - poses[own]) <= share * np.maximum(size, 1.0)).all(), own


@pytest.mark.parametrize("name", CASES)
def test_a_grid_gives_the_largest_of_its_poses(name):
    of, designs = CASES[name]
    names = ("d2s", "dev") if of.position == "s" else ("dpsi", "d2psi")
    requests = tuple(Request(own, 0) for own in names)
    found = fused.sampled_maxima(of, designs, requests, PHI.size)
    poses = staged(of, designs, names)
    for request in requests:
        most = np.abs(poses[request.pose]).max(axis=1)
        share = 256.0 * len(of.stages) * EPS * amplified(of, designs)
        assert (np.abs(found[request] - most) <= share * np.maximum(most, 1.0)).all()


def test_a_grid_that_meets_what_does_not_reach_is_left_to_poses():
    of, designs = CASES["rssr+guide"]
    apart = designs[:20].copy()
    apart[::2, 9] *= 0.05  # a coupler of stage 2 that is far too short
    found = fused.sampled_maxima(of, apart, (Request("d2s", 0),), 64)[Request("d2s", 0)]
    assert np.isnan(found[::2]).all() and np.isfinite(found[1::2]).all()
    outputs = design_outputs(of, apart, ["max_abs_d2s"], Accuracy(samples=64))
    assert (outputs["status"][::2] == st.NOT_ROTATABLE).all() and (outputs["status"][1::2] == st.OK).all()


REQUESTS = {
    "rssr+guide": (
        Request("d2s", 0),
        Request("dev", 0),
        Request("s", 1),
        Request("x_m", -1),
        Request("y_m2", 1),
        Request("d3s", 0),
    ),
    "rssr+rssr": (Request("dpsi", 1), Request("d2psi", 0), Request("d3psi", -1)),
    "rssr+rssr+guide": (Request("ds", -1), Request("d2dev", 0), Request("dev", -1)),
}


PAIRS = [(n, r) for n, rs in REQUESTS.items() for r in rs]


@pytest.mark.parametrize("pair", mostly_long(PAIRS, [(n, rs[0]) for n, rs in REQUESTS.items()]), ids=str)
def test_extrema_lie_within_their_errors_of_precise_poses_climbed_from_the_search_on_poses(pair):
    name, request_ = pair
    of, designs = CASES[name]
    assert_fused_extrema_lie_within_their_errors(of, designs, request_)


PLACES = {"rssr+guide": (Request("d2s", 0, place=True), Request("s", -1, place=True), Request("dev", 1, place=True))}
PLACES["rssr+rssr"] = (Request("dpsi", 1, place=True),)


@pytest.mark.parametrize(("name", "request_"), [(n, r) for n, rs in PLACES.items() for r in rs], ids=str)
def test_places_of_extrema_are_those_of_the_search_on_poses(name, request_):
    of, designs = CASES[name]
    found, _ = extrema.true_extrema(of, designs, [request_], 1e-8)
    slow, _ = extrema._searched(of, designs, [request_], 1e-8, False, False, None)
    left = fused.extrema((fused.curve_of(of, request_, False),), designs, 1e-8)[0][2]
    # What turns back within the swing of the stage before is equally high twice: rounding says where, on poses.
    assert left.mean() < (0.3 if request_.pose in ("s", "dev") else 0.02)
    both = np.stack([found[request_].phi, slow[request_].phi], axis=1)
    off = np.abs(np.angle(np.exp(1j * (both[:, 0] - both[:, 1]))))
    # Each knows its place to its own error, next to a dead point too, where both see the rounding of the same poses;
    # or the curve is as high at one place as at the other.
    same = off <= found[request_].err_phi + slow[request_].err_phi
    there = of.precise_poses(designs, Angles.of(both), frozenset((request_.pose,)))[request_.pose]
    height = np.abs(there) if request_.mode == 0 else there
    assert (same | (np.abs(height[:, 0] - height[:, 1]) <= 64.0 * EPS * np.abs(height[:, 0]))).all()
    assert same.mean() > 0.8
    assert np.median(found[request_].err_phi) < 1e-12


def on_the_tie(curve, design):
    """A design between this one and its like with the next stage turned, of which two peaks are equally high."""

    def at(turned):
        row = design.copy()
        row[18] += turned
        found, status, undecided = fused.extrema((curve,), row[None], 1e-8)[0]
        return row, found.phi[0] if status[0] == st.OK and not undecided[0] else np.nan

    def apart(a, b):
        return abs(np.angle(np.exp(1j * (a - b)))) > 0.5

    steps = [0.02 * k for k in range(40)]
    places = [at(t)[1] for t in steps]
    jump = next((k for k in range(39) if apart(places[k], places[k + 1])), None)
    if jump is None:
        return None
    low, high, before = steps[jump], steps[jump + 1], places[jump]
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if apart(before, at(middle)[1]) else (middle, high)
    return at(low)[0]


def test_which_of_two_equal_peaks_is_higher_is_left_to_the_search_on_poses_where_the_place_is_wanted():
    of, designs = CASES["rssr+guide"]
    plain, placed = (fused.curve_of(of, Request("d2s", 0, place=place), False) for place in (False, True))
    tied = next(row for design in designs if (row := on_the_tie(plain, design)) is not None)[None]
    assert not fused.extrema((plain,), tied, 1e-8)[0][2][0]
    assert fused.extrema((placed,), tied, 1e-8)[0][2][0]
    found, status = extrema.true_extrema(of, tied, [placed.request], 1e-8)
    assert status[0] == st.OK and np.isfinite(found[placed.request].phi[0])


@pytest.mark.parametrize("name", ["rssr+guide", "rssr+rssr+guide"])
def test_margins_of_later_stages_are_those_of_the_search_on_poses(name):
    of, designs = CASES[name]
    for number in range(2, len(of.stages) + 1):
        assert_fused_margins_are_those_of_poses(of, designs, number)


def near_a_change_point(seed):
    """Needle drives whose second stage comes within 1e-9 ... 1e-3 of a dead point: its coupler is shortened to that."""
    of, designs = CASES["rssr+guide"]
    r = np.random.default_rng(seed)
    wanted = 10.0 ** r.uniform(-9.0, -3.0, len(designs))
    low, high = np.full(len(designs), 0.2), np.ones(len(designs))
    for _ in range(60):
        middle = 0.5 * (low + high)
        tried = designs.copy()
        tried[:, 9] *= middle
        margin = design_outputs(of, tried, ["margin2"], Accuracy(target=1e-8))["margin2"]
        short = ~(margin > wanted)
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    designs = designs.copy()
    designs[:, 9] *= high
    turns = design_outputs(of, designs, ["margin"], Accuracy(target=1e-8))
    return of, np.ascontiguousarray(designs[(turns["status"] == st.OK) & (turns["margin"] < 1e-2)])


def test_near_change_points_no_error_exceeds_its_estimate():
    of, designs = near_a_change_point(5)
    assert len(designs) > 100
    for request in (Request("d2s", 0), Request("s", -1)):
        found, status = extrema.true_extrema(of, designs, [request], 1e-8)
        slow, other = extrema.true_extrema(of, designs, [request], 1e-10, locate=True)
        good = (status == st.OK) & (other == st.OK)  # below margins of 1e-7 the search on poses gives up
        assert good.mean() > 0.5 and set(np.unique(status)) <= {st.OK, st.NOT_CONVERGED, st.UNDECIDABLE}
        exact = climbed(of, designs[good], request.pose, request.mode, slow[request].phi[good])
        off = np.abs(found[request].value[good] - exact)
        shared = 8.0 * EPS * amplified(of, designs[good]) * np.abs(exact)
        assert (off <= found[request].err[good] + shared).all()


def test_what_rounding_has_moved_too_far_is_taken_from_precise_poses(monkeypatch):
    of, designs = CASES["rssr+guide"]
    request = Request("d2s", 0)
    called = []
    confirm = fused._confirm
    monkeypatch.setattr(fused, "_confirm", lambda *given: (called.append(given[5].size), confirm(*given)))
    found, status = extrema.true_extrema(of, designs, [request], 1e-13)  # finer than plain poses are
    slow, _ = extrema.true_extrema(of, designs, [request], 1e-13, locate=True)
    assert sum(called) > 100 and (status == st.OK).all()
    off = np.abs(found[request].value - slow[request].value)
    assert (off <= found[request].err + slow[request].err).all()


def test_a_first_stage_that_does_not_turn_and_bad_couplings_give_no_value():
    of, designs = CASES["rssr+guide"]
    bad = designs[:4].copy()
    bad[0, 0] *= 50.0  # a crank longer than all other links together
    found, status, undecided = fused.extrema((fused.curve_of(of, Request("d2s", 0), False),), bad, 1e-8)[0]
    assert status[0] == st.NOT_ROTATABLE and not undecided[0] and np.isnan(found.value[0])
    bad = designs[:4].copy()
    bad[0, 17], bad[1, 18], bad[2, 12] = 0.5, 1e6, np.nan  # kappa, offset [rad], xi
    found, status, undecided = fused.extrema((fused.curve_of(of, Request("d2s", 0), False),), bad, 1e-8)[0]
    assert undecided[:3].all() and np.isnan(found.value[:3]).all() and np.isfinite(found.value[3])


def test_no_bit_depends_on_the_designs_beside_it():
    of, designs = CASES["rssr+guide"]
    together = fused.extrema((fused.curve_of(of, Request("d2s", 0), False),), designs, 1e-8)[0][0]
    for i in (0, 17, 63):
        alone = fused.extrema((fused.curve_of(of, Request("d2s", 0), False),), designs[[i]], 1e-8)[0][0]
        assert alone.value[0] == together.value[i] and alone.err[0] == together.err[i]


def test_jitted_kernels_give_the_bits_of_their_python_bodies(monkeypatch):
    of, designs = CASES["rssr+guide"]
    few = designs[:6]
    chain, cos, sin = chain_kernels.chained(forms(of)), np.cos(PHI[:16]), np.sin(PHI[:16])
    kernel, results = chain_kernels.dense_maxima(chain), []
    for function in (kernel, kernel.py_func):
        if function is not kernel:
            monkeypatch.setattr("kernels.chains.dense.largest", max)  # an instruction, no function, in machine code
        least, out = np.empty((6, 2)), [np.empty(6) for _ in range(6)]
        function(few, cos, sin, least, *out)
        results.append((least, *out))
    opening, distance = np.empty(6, np.uint8), np.empty(6)
    rssr.opening(few, opening, distance)
    search, searched, table = chain_kernels.find_extrema(chain, (2,)), [], chain_kernels.sampling_tables()
    made_of = np.tile([1.0, 0.0, 0.0], (6, 1))
    for function in (search, search.py_func):
        status, found = np.empty((2, 6), np.uint8), np.empty((6, 2, 6))
        function(few, opening, distance, table, made_of, np.array([1, -1]), 1e-8, -1.0, status, found)
        searched.append((status, found))
    for a, b in (*zip(*results, strict=True), *zip(*searched, strict=True)):
        np.testing.assert_array_equal(a, b)


def test_a_wrong_chain_rule_or_a_lost_stage_would_be_noticed():
    """Negative control: the fused chain of other couplings is not that of the stages."""
    of, designs = CASES["rssr+guide"]
    other = designs[:50].copy()
    other[:, 18] += 1e-6
    request = (Request("d2s", 0),)
    found = fused.sampled_maxima(of, other, request, PHI.size)[request[0]]
    most = np.abs(staged(of, designs[:50], ("d2s",))["d2s"]).max(axis=1)
    assert (np.abs(found - most) > 1e-10 * most).mean() > 0.9


def test_requests_without_a_fused_curve_go_to_poses():
    of, _ = CASES["rssr+guide"]
    for pose in ("d3s", "d2dev"):
        assert fused.curve_of(of, Request(pose, 0), False) is not None
        assert fused.curve_of(of, Request(pose, 0, place=True), False) is None  # no slope to find its place by
    assert fused.curve_of(of, Request("psi1", 1), False) is None
    assert fused.curve_of(of, Request("discriminant1", -1), True) is None  # the first stage has its own margin
    assert fused.curve_of(of.precise(), Request("d2s", 0), False) is None
    assert fused.curve_of(family("rssr"), Request("d2psi", 0), False) is None  # it has a search of its own
    alone = replace(of.stages[1].family, capabilities=())
    assert fused.curve_of(replace(of, stages=(of.stages[0], replace(of.stages[1], family=alone))),
                          Request("d2s", 0), False) is None  # fmt: skip
