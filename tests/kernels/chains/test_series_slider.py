"""Slider-cranks, spatial and planar, at the end of fused chains and by themselves.

The staged route (poses of each family, kernels/chains/links.py) shares no loop, no chain rule and no search with
the fused one.  Single poses are compared with the 25-digit table, extrema with poses in twice the working precision.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from kernels import chains as chain_kernels
from kernels import status as st
from kernels.families import rssp, rssr
from kernels.families.rssp import stage
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.families.capabilities import InSeries
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, fused
from tests.support.climbing import (
    amplified,
    assert_fused_extrema_lie_within_their_errors,
    assert_fused_margins_are_those_of_poses,
    climbed,
)
from tests.support.selection import mostly_long
from tests.support.turn_designs import DRIVEN_SLIDER, RSSP, crank_rockers, driven_sliders, slider_cranks

EPS = 2.0**-53
PLANAR, DRIVEN_PLANAR = family("slider_crank"), family(["rssr", "slider_crank"])
PHI = np.arange(256) * (2.0 * np.pi / 256)
TABLE = json.loads((Path(__file__).parents[2] / "oracle" / "composite_open.json").read_text())["rows"]
COUPLER = 9  # column of b2 in the designs of both chains


def planar_cranks(n, seed):
    r = np.random.default_rng(seed)
    lengths = [r.uniform(0.1, 1.0, n), r.uniform(1.0, 4.0, n), r.uniform(-1.0, 1.0, n)]
    return np.column_stack([*lengths, r.choice([-1.0, 1.0], n)])


def planar_chains(n, seed):
    return np.column_stack([crank_rockers(n, seed), planar_cranks(n, seed + 1), driven_sliders(n, seed)[:, -4:]])


def turning(of, n, seed):
    designs = MAKERS[of.name](40 * n, seed)
    margin = design_outputs(of, designs, ["margin"], Accuracy(target=1e-6))
    return np.ascontiguousarray(designs[margin["status"] == st.OK][:n])


FAMILIES = {of.name: of for of in (DRIVEN_SLIDER, DRIVEN_PLANAR, RSSP, PLANAR)}
MAKERS = dict(zip(FAMILIES, (driven_sliders, planar_chains, slider_cranks, planar_cranks), strict=True))
CASES = {name: turning(of, 300, 3) for name, of in FAMILIES.items()}
REQUESTS = {
    "rssr+rssp": (Request("s", 1), Request("ds", -1), Request("d2s", 0), Request("d3s", 0)),
    "rssr+slider_crank": (Request("d2s", 0),),
    "rssp": (Request("s", -1), Request("ds", 0), Request("d2s", 1), Request("d3s", 0)),
    "slider_crank": (Request("d2s", 0),),
}


def chain_of(of):
    return fused._chained(fused._forms(of))


def test_motion_at_single_poses_is_that_of_the_25_digit_table_within_its_estimated_errors():
    rows = [row for row in TABLE if row["stage2_type"].lower() == "rssp"]
    chain, worst = chain_of(DRIVEN_SLIDER), 0.0
    assert len(rows) > 20
    for row in rows:
        own = {f"{name}{k}": x for k in (1, 2) for name, x in row[f"stage{k}"].items()}
        own |= {"branch1": row["sigma1"], "branch2": row["sigma2"], "kappa2": row["kappa"], "offset2": row["theta0"]}
        own |= {"shift2": 0.0, "turn2": 0.0}
        design = np.array([[float(own[p.name]) for p in DRIVEN_SLIDER.parameters]])
        c, u, v = chain.record.constants(design, 0), np.cos(row["phi"]), np.sin(row["phi"])
        m, blur = chain.travel(c, u, v)[0], chain.blur(c, u, v)
        with mp.workdps(30):
            found = (m.x0, m.x1, m.x2, m.x3)
            off = [float(abs(mpf(float(x)) - mpf(row[y]))) for x, y in zip(found, ("y", "d1", "d2", "d3"), strict=True)]
        for k in range(4):
            # The table takes its angles and links as given; what rounding them does is not the kernel's.
            given = 2.0 * EPS * max(float(row["cond"][name]) for name in ("y", "d1", "d2", "d3")[: k + 1])
            worst = max(worst, off[k] / (blur[k] + given))
    assert worst <= 1.0


@pytest.mark.parametrize("name", ["rssr+rssp", "rssr+slider_crank"])
def test_a_grid_gives_the_largest_of_its_poses_and_their_status(name):
    of, designs = FAMILIES[name], CASES[name]
    names = ("ds", "d2s", "d3s")
    requests = tuple(Request(own, 0) for own in names)
    found = fused.sampled_maxima(of, designs, requests, PHI.size)
    poses = of.poses(designs, Angles.of(PHI[None, :]), frozenset(names))
    size = amplified(of, designs)
    for request in requests:
        most = np.abs(poses[request.pose]).max(axis=1)
        # Some tens of roundings per stage, each amplified by the nearest dead point; the third derivative twice.
        allowed = 256.0 * EPS * size ** (2.0 if request.pose == "d3s" else 1.0)
        assert (np.abs(found[request] - most) <= allowed * np.maximum(most, 1.0)).all()
    apart = designs[:20].copy()
    apart[::2, COUPLER] *= 0.02
    found = fused.sampled_maxima(of, apart, requests, 64)[requests[1]]
    assert np.isnan(found[::2]).all() and np.isfinite(found[1::2]).all()
    outputs = design_outputs(of, apart, ["max_abs_d2s"], Accuracy(samples=64))
    assert (outputs["status"][::2] == st.NOT_ROTATABLE).all() and (outputs["status"][1::2] == st.OK).all()


PAIRS = [(n, r) for n, rs in REQUESTS.items() for r in rs]


@pytest.mark.parametrize("pair", mostly_long(PAIRS, [(n, rs[0]) for n, rs in REQUESTS.items()]), ids=str)
def test_extrema_lie_within_their_errors_of_precise_poses_climbed_from_the_search_on_poses(pair):
    name, request_ = pair
    assert_fused_extrema_lie_within_their_errors(FAMILIES[name], CASES[name], request_)


@pytest.mark.parametrize("name", ["rssr+rssp", "rssp"])
def test_places_of_extrema_are_those_of_the_search_on_poses(name):
    of, designs = FAMILIES[name], CASES[name]
    request = Request("d2s", 0, place=True)
    found, _ = extrema.true_extrema(of, designs, [request], 1e-8)
    slow, _ = extrema.true_extrema(of, designs, [request], 1e-8, locate=True)
    both = np.stack([found[request].phi, slow[request].phi], axis=1)
    off = np.abs(np.angle(np.exp(1j * (both[:, 0] - both[:, 1]))))
    same = off <= found[request].err_phi + slow[request].err_phi
    # Or the curve is as high at one place as at the other.
    height = np.abs(of.precise_poses(designs, Angles.of(both), frozenset(("d2s",)))["d2s"])
    assert (same | (np.abs(height[:, 0] - height[:, 1]) <= 64.0 * EPS * height[:, 0])).all()
    assert same.mean() > 0.8
    assert np.median(found[request].err_phi) < 1e-12


@pytest.mark.parametrize("name", ["rssr+rssp", "rssr+slider_crank"])
def test_margins_of_the_slider_are_those_of_the_search_on_poses(name):
    assert_fused_margins_are_those_of_poses(FAMILIES[name], CASES[name], 2)


def near_a_change_point(of, seed):
    """Designs whose slider comes within 1e-9 ... 1e-3 of a dead point: its coupler is shortened to that."""
    designs = turning(of, 200, seed)
    column, margin = (COUPLER, "margin2") if of is DRIVEN_SLIDER else (1, "margin")
    wanted = 10.0 ** np.random.default_rng(seed).uniform(-9.0, -3.0, len(designs))
    low, high = np.full(len(designs), 0.01), np.ones(len(designs))
    for _ in range(60):
        middle = 0.5 * (low + high)
        tried = designs.copy()
        tried[:, column] *= middle
        short = ~(design_outputs(of, tried, [margin], Accuracy(target=1e-8))[margin] > wanted)
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    designs[:, column] *= high
    turns = design_outputs(of, designs, ["margin"], Accuracy(target=1e-8))
    return np.ascontiguousarray(designs[(turns["status"] == st.OK) & (turns["margin"] < 1e-2)])


@pytest.mark.parametrize("name", ["rssr+rssp", "rssp"])
def test_near_change_points_no_error_exceeds_its_estimate(name):
    of = FAMILIES[name]
    designs = near_a_change_point(of, 5)
    assert len(designs) > 80
    request = Request("d2s", 0)
    found, status = extrema.true_extrema(of, designs, [request], 1e-8)
    slow, other = extrema.true_extrema(of, designs, [request], 1e-10, locate=True)
    good = (status == st.OK) & (other == st.OK)  # below margins of 1e-7 the search on poses gives up
    assert good.mean() > 0.5 and set(np.unique(status)) <= {st.OK, st.NOT_CONVERGED, st.UNDECIDABLE}
    exact = climbed(of, designs[good], "d2s", 0, slow[request].phi[good])
    off = np.abs(found[request].value[good] - exact)
    shared = 8.0 * EPS * amplified(of, designs[good]) * np.abs(exact)
    assert (off <= found[request].err[good] + shared).all()


def hard_sliders(kind, n, seed):
    """Slider-cranks whose terms cancel, or whose motion is tiny against their links."""
    designs, r = slider_cranks(n, seed), np.random.default_rng(seed)
    if kind == "slide along the crank axis":
        designs[:, 4] = 0.5 * np.pi - 10.0 ** r.uniform(-12.0, -1.0, n)
    elif kind == "tiny crank":
        designs[:, 0] = 10.0 ** r.uniform(-10.0, -4.0, n)
    else:
        designs[:, 3] = 10.0 ** r.uniform(2.0, 6.0, n)
        designs[:, 1] += designs[:, 3] * np.cos(designs[:, 4]) + 2.0 * designs[:, 0] + np.abs(designs[:, 2])
    return designs


@pytest.mark.parametrize("kind", ["slide along the crank axis", "tiny crank", "long offset"])
@pytest.mark.parametrize("name", ["rssr+rssp", "rssp"])
def test_no_error_of_hard_sliders_exceeds_its_estimate(name, kind):
    of, designs, request = FAMILIES[name], hard_sliders(kind, 600, 4), Request("d2s", 0)
    if of is DRIVEN_SLIDER:
        driven = driven_sliders(600, 4)
        driven[:, 8:14] = designs
        designs = driven
    found, status = extrema.true_extrema(of, designs, [request], 1e-8)
    slow, other = extrema.true_extrema(of, designs, [request], 1e-8, locate=True)
    np.testing.assert_array_equal(status, other)
    good = status == st.OK
    assert good.sum() > 100
    exact = climbed(of, designs[good], "d2s", 0, slow[request].phi[good])
    shared = 8.0 * EPS * amplified(of, designs[good]) * np.abs(exact) if of is DRIVEN_SLIDER else 0.0
    assert (np.abs(found[request].value[good] - exact) <= found[request].err[good] + shared).all()


@pytest.mark.parametrize("name", ["rssr+rssp", "rssp"])
def test_statuses_are_those_of_the_search_on_poses(name):
    of = FAMILIES[name]
    designs = MAKERS[of.name](400, 11)
    start = 8 if of is DRIVEN_SLIDER else 0
    designs[0, start + 1], designs[1, start + 5], designs[2, start + 2] = -1.0, 0.5, np.nan
    designs[3, start + 4] = 1e6  # rad
    request = Request("d2s", 0)
    found, status = extrema.true_extrema(of, designs, [request], 1e-8)
    slow, other = extrema.true_extrema(of, designs, [request], 1e-8, locate=True)
    np.testing.assert_array_equal(status, other)
    np.testing.assert_array_equal(np.isnan(found[request].value), np.isnan(slow[request].value))
    assert (status == st.OK).sum() > 10 and (status == st.NOT_ROTATABLE).sum() > 10


def nearest_zero(design):
    """Distance [rad] of the nearest complex zero of Q from the real axis, by the roots of a polynomial in e^(i phi)."""
    a, b, e, f, alpha, _ = design
    n0, na = f * np.cos(alpha), a * np.sin(alpha)
    cos, sin = np.array([0.5, 0.0, 0.5]), np.array([-0.5j, 0.0, 0.5j])  # times z
    one = np.array([0.0, 1.0, 0.0])
    m, n = e * one - a * cos, n0 * one - na * sin
    square = np.polymul(m, m) + np.polymul(n, n)
    square[2] -= b * b
    return np.abs(np.log(np.abs(np.roots(square)))).min()


def test_the_nearest_singularity_of_a_slider_by_itself_is_a_zero_of_its_discriminant():
    designs = near_a_change_point(RSSP, 7)
    status, distance = np.empty(len(designs), np.uint8), np.empty(len(designs))
    rssp.opening(designs, status, distance)
    exact = np.array([nearest_zero(design) for design in designs])
    assert (status == st.OK).all()
    known = (exact > 1e-3) & (exact < 0.1)
    assert known.sum() > 20
    # To leading order: the next term is of the second order in the distance.
    assert (np.abs(distance / exact - 1.0)[known] < 0.05).all()


def test_a_slider_by_itself_opens_as_its_margin_says():
    designs = slider_cranks(500, 13)
    designs[0, 0], designs[1, 5] = -1.0, 0.0
    status, distance = np.empty(len(designs), np.uint8), np.empty(len(designs))
    rssp.opening(designs, status, distance)
    other = np.empty(len(designs), np.uint8)
    rssp.margin(designs, other, *np.empty((3, len(designs))))
    np.testing.assert_array_equal(status, other)
    assert set(np.unique(status)) >= {st.OK, st.NOT_ROTATABLE, st.INVALID_INPUT}


def test_scaling_the_slider_by_a_power_of_two_scales_what_is_found():
    designs = CASES["rssr+rssp"]
    request = Request("d2s", 0)
    scaled = designs.copy()
    scaled[:, 8:12] *= 2.0**40
    found, large = (
        fused.extrema((fused.curve_of(DRIVEN_SLIDER, request, False),), d, 1e-8)[0][0] for d in (designs, scaled)
    )
    np.testing.assert_array_equal(np.ldexp(found.value, 40), large.value)


def test_jitted_closures_give_the_bits_of_their_python_bodies(monkeypatch):
    for of, start, form in ((DRIVEN_SLIDER, 8, stage.FORM), (DRIVEN_PLANAR, 8, stage.PLANAR_FORM)):
        assert of.stages[-1].family.find(InSeries).form is form
        design = CASES[of.name][0, start : start + form.columns].copy()
        cos, sin = (np.cos(design[4]), np.sin(design[4])) if form.angle is not None else (1.0, 0.0)
        results = []
        for python in (False, True):
            if python:  # an instruction, no function, in machine code
                monkeypatch.setattr(stage, "largest", max)
                form_of = {name: getattr(form, name).py_func for name in ("constants", "travel", "dip", "travel_blur")}
                monkeypatch.setattr(stage, "_travel", stage._travel.py_func)
                monkeypatch.setattr(stage, "_travel_blur", stage._travel_blur.py_func)
            else:
                form_of = {name: getattr(form, name) for name in ("constants", "travel", "dip", "travel_blur")}
            c = form_of["constants"](design, 0, 1, cos, sin)
            results.append([*c])
            for phi in PHI[:24]:
                u, v = np.cos(phi), np.sin(phi)
                m = form_of["travel"](c, u, v)
                results[-1] += [*m, *form_of["dip"](c, u, v), *form_of["travel_blur"](c, u, v, m.x1, m.x2, m.x3)]
        monkeypatch.undo()
        np.testing.assert_array_equal(*results)


def test_another_coupling_would_be_noticed():
    """Negative control: the maxima of a chain whose crank is turned by a millionth are not these."""
    designs, request = CASES["rssr+rssp"][:100], Request("d2s", 0)
    other = designs.copy()
    other[:, DRIVEN_SLIDER.parameter_names.index("offset2")] += 1e-6
    found, turned = (extrema.true_extrema(DRIVEN_SLIDER, d, [request], 1e-8)[0][request] for d in (designs, other))
    assert (np.abs(found.value - turned.value) > found.err + turned.err).mean() > 0.9


def test_chains_of_sliders_are_fused_and_what_they_lack_is_left_to_poses():
    assert chain_kernels.chained((rssr.FORM, rssp.FORM)) is chain_of(DRIVEN_SLIDER)
    for of in FAMILIES.values():
        assert fused.curve_of(of, Request("d2s", 0), False) is not None
        assert fused.curve_of(of, Request("pressure_angle", 1), False) is None
        assert fused.curve_of(of, Request("d3s", 0, place=True), False) is None
