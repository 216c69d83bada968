"""Rotatability, margin and largest pressure angle from poses alone, against dense samples and own steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from tests.support.turn_designs import GUIDE, MAKERS, NEEDLE, RSSR, crank_rockers, guided_four_bars, needle_drives

WANTED = ["rotatable", "margin", "max_pressure_angle"]
EXACT = Accuracy(target=1e-8)
ANGLES = Angles.of(np.arange(4096)[None, :] * (2.0 * np.pi / 4096))


@pytest.mark.parametrize("name", ["rssr", "rssp", "guide"])
def test_margin_is_the_least_squared_cosine_of_the_pressure_angle(name):
    mechanism, make = MAKERS[name]
    mechanism = replace(mechanism, steps=())
    designs = make(300, 31)
    found = design_outputs(mechanism, designs, WANTED, EXACT)
    poses = mechanism.poses(designs, ANGLES, frozenset(["pressure_angle"]))
    assembled = (poses["status"] == st.OK).all(axis=1)
    turns = found["rotatable"]
    assert 20 < turns.sum() < 280
    # 4096 samples see every gap but the narrowest; none of these designs is that close to its change point.
    np.testing.assert_array_equal(turns, assembled)
    np.testing.assert_array_equal(turns, found["margin"] > 0.0)
    largest = poses["pressure_angle"][turns].max(axis=1)
    assert (found["max_pressure_angle"][turns] >= largest).all()
    np.testing.assert_allclose(found["max_pressure_angle"][turns], largest, atol=1e-5)
    np.testing.assert_allclose(found["margin"][turns], np.cos(found["max_pressure_angle"][turns]) ** 2, rtol=1e-12)
    assert np.isnan(found["max_pressure_angle"][~turns]).all()
    assert (found["status"][~turns] == st.NOT_ROTATABLE).all()


@pytest.mark.parametrize(("mechanism", "make"), [(RSSR, crank_rockers), (GUIDE, guided_four_bars)])
def test_negative_margin_is_the_discriminant_over_its_scale(mechanism, make):
    designs = make(200, 32)
    found = design_outputs(replace(mechanism, steps=()), designs, ["margin"], EXACT)
    discriminant = mechanism.poses(designs, ANGLES, frozenset(["discriminant"]))["discriminant"].min(axis=1)
    sampled = discriminant / (2.0 * designs[:, 1] * designs[:, 2]) ** 2
    no = found["status"] == st.NOT_ROTATABLE
    assert no.sum() > 20
    np.testing.assert_allclose(found["margin"][no], sampled[no], atol=1e-4)
    assert (found["margin"][no] <= sampled[no] + 1e-12).all()


@pytest.mark.parametrize(
    ("name", "beside"), [("rssr", "max_psi"), ("four_bar", "max_x_m"), ("guide", "max_abs_dev"), ("guide", "box_x")]
)
def test_margin_on_samples_is_that_of_the_margin_alone_whatever_is_asked_beside_it(name, beside):
    """Whether the crank turns is looked for before poses are sampled; that took the margin from what does not turn."""
    design = {"a": [25.0, 25.0], "b": [30.0, 60.0], "c": [30.0, 50.0], "e": [60.0, 40.0]}
    rest = {p.name: 0.0 for p in family(name).parameters if p.default is None and p.name not in design}
    alone = sweep.summarise(name, design | rest, ["margin"], samples=64)
    both = sweep.summarise(name, design | rest, [beside, "margin"], samples=64)
    assert alone.margin[0] < 0.0 < alone.margin[1]
    np.testing.assert_array_equal(both.margin, alone.margin)
    assert both.status.tolist() == [st.NOT_ROTATABLE, st.OK] and np.isnan(both[beside][0])


LOCKED = {"a": 25.0, "b": 30.0, "c": 30.0, "e": 60.0, "f": 0.0, "g": 0.0, "alpha": 0.3}  # its crank does not turn
CHAINED = {f"{p}1": x for p, x in LOCKED.items()} | {f"{p}2": x for p, x in family("guide").example.items()}


@pytest.mark.parametrize(
    ("mechanism", "design", "margins", "beside"),
    [
        ("rssr", LOCKED, ["margin"], ["swing", "least_transmission_angle"]),
        ("slider_crank", {"a": 30.0, "b": 20.0}, ["margin", "minus_margin"], ["stroke", "least_transmission_angle"]),
        (["rssr", "guide"], CHAINED, ["margin"], ["swing1"]),
        (["rssr", "guide"], CHAINED, ["margin", "margin1"], ["phi_ext1", "least_transmission_angle1"]),
        (
            {"arm": {"family": "rssr"}},
            {f"arm.{p}": x for p, x in LOCKED.items()},
            ["margin", "arm.margin"],
            ["arm.swing", "arm.least_transmission_angle"],
        ),
    ],
)
def test_margin_of_what_does_not_turn_is_there_whatever_is_asked_beside_it(mechanism, design, margins, beside):
    """An output asked beside it found first that the crank does not turn; the margin was nan then."""
    alone = sweep.summarise(mechanism, design, margins[:1])[margins[0]][0]
    found = sweep.summarise(mechanism, design, [*beside, *margins]).iloc[0]
    assert alone < 0.0
    for name in margins:
        assert found[name] == (-alone if name.startswith("minus") else alone)  # the same double
        assert 0.0 < found[f"err_{name}"] < 1e-12
    assert np.isnan(found[beside].to_numpy(float)).all() and found.status == st.NOT_ROTATABLE


@pytest.mark.parametrize(("name", "offset"), [("inverted_slider_crank", "h"), ("slotted", "s")])
def test_error_of_the_margin_of_a_slot_that_does_not_reach_is_rounding(name, offset):
    """There the motion is singular, the discriminant is not: the error of its least value was larger than that."""
    found = sweep.summarise(name, {"a": 1.0, "e": 1.25, offset: 0.5}, ["margin"], accuracy=1e-8).iloc[0]
    assert found.status == st.NOT_ROTATABLE
    assert abs(found.margin + 3.0) <= found.err_margin <= 1e-10


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("rssr", ["swing", "phi0", "psi_ext", "max_abs_d2psi", "max_abs_d3psi"]),
        ("rssp", ["stroke", "s_ext", "s_fold", "phi_ext", "phi0", "stroke_ratio"]),
    ],
)
def test_own_steps_and_general_routes_agree(name, more):
    mechanism, make = MAKERS[name]
    designs = make(2000, 33)
    own = design_outputs(mechanism, designs, [*WANTED, *more], EXACT)
    general = design_outputs(replace(mechanism, steps=()), designs, [*WANTED, *more], EXACT)
    np.testing.assert_array_equal(own["rotatable"], general["rotatable"])
    for output in ("margin", "max_pressure_angle", *more):
        error = np.abs(own[output] - general[output])
        if output.startswith(("phi", "psi")):
            error = np.abs(np.angle(np.exp(1j * error)))
        assert (np.isnan(own[output]) == np.isnan(general[output])).all(), output
        known = ~np.isnan(error)
        assert known.sum() > 500
        assert (error <= own[f"err_{output}"] + general[f"err_{output}"] + 1e-12)[known].mean() >= 0.999, output


def test_weakest_stage_decides_for_the_chain():
    designs = needle_drives(400, 34)
    names = [f"{base}{k}" for base in WANTED for k in ("", "1", "2")]
    found = design_outputs(NEEDLE, designs, names, EXACT)
    both = found["rotatable1"] & found["rotatable2"]
    np.testing.assert_array_equal(found["rotatable"], both)
    assert 10 < both.sum() < 390
    np.testing.assert_array_equal(found["margin"], np.fmin(found["margin1"], found["margin2"]))
    np.testing.assert_array_equal(
        found["max_pressure_angle"][both],
        np.maximum(found["max_pressure_angle1"], found["max_pressure_angle2"])[both],
    )
    numbered = [name for name in names if name not in WANTED]
    apart = design_outputs(NEEDLE, designs, numbered, EXACT)
    for name in (*numbered, "status"):
        np.testing.assert_array_equal(apart[name], found[name], err_msg=name)
    alone = design_outputs(RSSR, designs[:, :8], WANTED, EXACT)
    np.testing.assert_array_equal(found["rotatable1"], alone["rotatable"])
    np.testing.assert_allclose(found["margin1"], alone["margin"], rtol=1e-9)
    # The second stage only swings: its margin is at least that of a full turn.
    full = design_outputs(GUIDE, designs[:, 8:17], ["margin"], EXACT)
    assert (found["margin2"][both] >= full["margin"][both] - 1e-9).all()
    assert (found["margin2"][both] > full["margin"][both] + 1e-3).any()


@pytest.mark.parametrize("power", [-300, -40, 1, 40, 250])
@pytest.mark.parametrize("name", ["rssr", "rssp", "guide", "rssr+guide"])
def test_margins_do_not_know_the_scale(name, power):
    mechanism, make = MAKERS[name]
    mechanism = replace(mechanism, steps=())
    designs = make(40, 35)
    scaled = designs.copy()
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.unit == "length":
            scaled[:, k] = np.ldexp(scaled[:, k], power)
    first, second = (design_outputs(mechanism, d, WANTED, EXACT) for d in (designs, scaled))
    for column in first:
        np.testing.assert_array_equal(first[column], second[column])


def test_margin_is_exact_on_samples_too():
    designs = crank_rockers(200, 36)
    refined = design_outputs(RSSR, designs, WANTED, EXACT)
    sampled = design_outputs(RSSR, designs, WANTED, Accuracy(samples=16))
    for name in WANTED:
        np.testing.assert_allclose(sampled[name], refined[name], rtol=1e-9)


def test_change_point_is_undecidable_not_a_verdict():
    # a + e = b + c: the links fold into one line and just reach.
    table = {"a": [1.0], "b": [3.0], "c": [2.0], "e": [4.0], "f": [0.0], "g": [0.0], "alpha": [0.0]}
    frame = sweep.summarise("rssr", table, ["rotatable", "margin", "max_abs_d2psi"])
    assert frame["status"][0] == st.UNDECIDABLE
    assert not frame["rotatable"][0]
    assert abs(frame["margin"][0]) < 1e-14
    assert np.isnan(frame["max_abs_d2psi"][0])


def test_first_stage_that_does_not_turn_spoils_only_what_needs_the_turn():
    table = {"a1": [3.0], "b1": [1.0], "c1": [1.0], "e1": [1.5], "f1": [0.0], "g1": [0.0], "alpha1": [0.0]}
    table |= {
        "a2": [1.0],
        "b2": [2.5],
        "c2": [2.5],
        "e2": [2.0],
        "xi2": [5.0],
        "eta2": [0.0],
        "lam2": [0.0],
        "h2": [4.0],
    }
    frame = sweep.summarise(["rssr", "guide"], table, ["rotatable", "margin", "margin2", "stroke"])
    assert frame["status"][0] == st.NOT_ROTATABLE
    assert frame["margin"][0] < 0.0
    assert frame[["margin2", "stroke"]].isna().all(axis=None)
    assert family(["rssr", "guide"]).name == "rssr+guide"
    assert family("rssr+guide") is family("rssr, guide") is family(["rssr", "guide"])


@pytest.mark.parametrize("name", ["five_link", "heddle"])
def test_error_of_the_margin_meets_a_target_of_1e_12(name):
    """The least discriminant was known to 1e-10 at any target: the error of the angle was 2e-11."""
    found = sweep.summarise(name, family(name).example, ["margin", "max_pressure_angle"], accuracy=1e-12).iloc[0]
    assert found.status == st.OK
    assert found.err_margin <= 1e-12 * found.margin
    assert found.err_max_pressure_angle <= 1e-12 * found.max_pressure_angle


@pytest.mark.parametrize(
    ("coupler", "turns"), [(2.47, True), (2.4775812395237153, False), (2.48, False), (2.49, False)]
)
@pytest.mark.parametrize("mechanism", ["five_link", ["five_link", "rssp"], {"m": {"family": "five_link", "ratio": -1}}])
def test_a_five_link_whose_coupler_comes_to_stand_along_the_crank_axis_does_not_turn(mechanism, coupler, turns):
    """Its motion ends where the discriminant is 79, not 0: rotatable was true with a gap of up to 0.1 rad."""
    link = {"a": 0.5661188035137457, "b": coupler, "c": 2.8914465417692554, "e": -1.486243557626949,
            "f": -0.4606248574445999, "g": 0.24397883068695592, "alpha": 1.137804718078769, "h": 0.25391672875457516,
            "s2": -0.05427957741596856}  # fmt: skip
    angles = np.arange(0.9, 0.96, 1e-4) if coupler < 2.48 else np.linspace(0.0, 2.0 * np.pi, 4000)
    assert (sweep.evaluate("five_link", link, ["psi"], phi=angles)["status"] == st.OK).all() == turns
    table, name = link, "rotatable"
    if isinstance(mechanism, list):
        table = {f"{p}1": x for p, x in link.items()} | {"a2": 0.1, "b2": 5.0, "e2": 0.0, "f2": 0.0, "alpha2": 0.0}
        name = "rotatable1"
    if isinstance(mechanism, dict):
        table = {f"m.{p}": x for p, x in link.items()}
    found = sweep.summarise(mechanism, table, [name, name.replace("rotatable", "margin")]).iloc[0]
    assert bool(found[name]) == turns and found.status == (st.OK if turns else st.NOT_ROTATABLE)
    assert (found.iloc[1] > 0.1) if turns else np.isnan(found.iloc[1])
