"""Limits and margin of the slider-crank: extremes of the motion at 50 digits, plain Python, symmetries, faults."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.families import rssp
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from tests.reference import rssp as naive
from tests.support.turn_designs import slider_cranks

RSSP = family("rssp")
NAMES = family("rssp").parameter_names
LENGTHS = ("s_ext", "s_fold", "stroke")
ANGLES = ("phi_ext", "phi_fold", "phi0", "stroke_ratio")
MARGINS = ("rotatable", "margin", "max_pressure_angle")
EXACT = Accuracy(target=1e-12)
SYNTHESIS = json.loads((Path(__file__).parents[2] / "oracle" / "synthesis_open.json").read_text())["rows"]


def found(designs, names=LENGTHS + ANGLES):
    return design_outputs(RSSP, np.atleast_2d(np.asarray(designs, float)), list(names), EXACT)


def rotating(n, seed):
    designs = slider_cranks(n, seed)
    return designs[found(designs, ("margin",))["status"] == st.OK]


def test_limits_are_the_extremes_of_the_motion():
    """Within the error that the step itself reports, which must be small: a bound that says nothing is no bound."""
    designs = rotating(40, 3)[:5]
    columns = found(designs)
    for row, design in enumerate(designs):
        expected = naive.limit_positions(tuple(design))
        for name in LENGTHS + ANGLES:
            error = float(abs(mpf(float(columns[name][row])) - expected[name]))
            assert error <= columns[f"err_{name}"][row], (row, name)
            assert columns[f"err_{name}"][row] < 1e-12


@pytest.mark.parametrize(
    "design",
    [
        (0.9156694153827526, 153125.804726411, 0.7518401918250965, 153093.08559841683, -0.6997877999593956, 1.0),
        (0.5797536651829513, 1.15078897550208, -2.8504666715231437e-07, -0.9915894035245809, -1.4176715885555362, -1.0),
        (0.9177776008254614, 1.1170132756632343, 2.660216937976385e-05, 0.6367121675577532, -1.3499089814149792, 1.0),
        (0.5816465378735323, 1.0082751993815842, 2.816717530130745e-06, 0.8235905107085677, 1.3548974719757266, -1.0),
        (
            0.9278532771362085,
            2.8503111846897533,
            -7.671861582560828e-15,
            -0.17347362231624253,
            -1.3041402458925866,
            1.0,
        ),
        (0.5896896938701731, 2.6880973701066777, 7.294341599270926e-15, 0.8825590525203351, -0.500493803336483, 1.0),
        (0.3, 30000.0, 0.2, 0.1, 0.4, 1.0),
    ],
)
def test_errors_hold_for_long_offsets_balls_near_the_crank_axis_and_almost_symmetric_mechanisms(design):
    """A stroke of some 1e-5 comes from distances that are small themselves, a margin from two almost equal dips."""
    columns = found(design, LENGTHS + ANGLES + MARGINS)
    exact = naive.limit_positions(design)
    with mp.workdps(50):
        b = mpf(design[1])
        exact["margin"] = naive.least_discriminant(design) / b**2
        exact["max_pressure_angle"] = mp.acos(mp.sqrt(exact["margin"]))
        for name in LENGTHS + ANGLES + MARGINS[1:]:
            error = float(abs(mpf(float(columns[name][0])) - exact[name]))
            assert error <= columns[f"err_{name}"][0], name
    assert columns["err_max_pressure_angle"][0] < 1e-8 * columns["max_pressure_angle"][0]


def test_limits_recover_the_requirements_of_the_synthesis_table():
    """The table gives a, b to 25 digits; rounded to doubles they move the limits by rounding errors times 1/|w|."""
    rows = [row for row in SYNTHESIS if row["mechanism"] == "RSSP"]
    assert len(rows) == 32
    designs = [[float(r["a"]), float(r["b"]), r["e"], r["f"], r["alpha"], r["sigma"]] for r in rows]
    columns = found(designs)
    assert (columns["status"] == st.OK).all()
    with mp.workdps(40):
        for k, row in enumerate(rows):
            size = max(abs(row["e"]), abs(row["f"]), abs(float(row["b"])))
            assert abs(columns["s_ext"][k] - float(row["S1"])) <= 64 * 2.0**-53 * max(size, row["cond"]["S1"])
            assert columns["stroke"][k] == pytest.approx(abs(row["S0"]), rel=1e-12)
            assert columns["phi0"][k] == pytest.approx(row["phi0"], rel=0, abs=1e-11)


def test_limits_agree_with_the_general_route_on_random_designs():
    designs = slider_cranks(600, 11)
    names = LENGTHS + ANGLES + MARGINS
    own, general = found(designs, names), design_outputs(replace(RSSP, steps=()), designs, names, EXACT)
    np.testing.assert_array_equal(own["status"], general["status"])
    np.testing.assert_array_equal(own["rotatable"], general["rotatable"])
    for name in names[:-3] + names[-2:]:
        np.testing.assert_allclose(own[name], general[name], rtol=0, atol=2e-12, err_msg=name)


def test_no_rotating_design_of_a_hundred_thousand_fails():
    r = np.random.default_rng(5)
    n = 100_000
    spread = [10.0 ** r.uniform(-3, 1, n), 10.0 ** r.uniform(-1, 1, n)]
    designs = np.column_stack(
        [*spread, r.normal(0, 2, n), r.normal(0, 2, n), r.uniform(-np.pi, np.pi, n), r.choice([-1.0, 1.0], n)]
    )
    columns = found(designs)
    good = columns["status"] == st.OK
    assert good.sum() > 20_000
    assert set(np.unique(columns["status"])) <= {st.OK, st.NOT_ROTATABLE, st.UNDECIDABLE}
    a, b, e, f, alpha, branch = designs[good].T
    assert (np.sign(columns["s_ext"] - columns["s_fold"])[good] == branch).all()
    for end, crank in (("ext", a), ("fold", -a)):  # crank and coupler in line
        s = columns[f"s_{end}"][good]
        rho = np.hypot(e, s * np.cos(alpha))
        gap = np.hypot(rho - crank, s * np.sin(alpha) - f) - b
        w = s - f * np.sin(alpha) - a * np.cos(alpha) * np.sin(columns[f"phi_{end}"][good])
        assert (np.abs(gap) * b <= np.abs(w) * columns[f"err_s_{end}"][good] + 1e-14 * b * b).all()


def test_stroke_of_a_tiny_crank_keeps_every_digit():
    design = (4.5e-10, 45.0, 19.0, -2.5, 0.36, 1.0)
    exact = float(naive.limit_positions(design)["stroke"])
    columns = found(design)
    assert columns["stroke"][0] == pytest.approx(exact, rel=1e-14)
    difference = abs(columns["s_ext"][0] - columns["s_fold"][0])
    assert abs(difference - exact) > 1e-9 * exact  # negative control: the difference of the positions loses them


def test_planar_central_slider_crank():
    columns = found((1.0, 3.0, 0.0, 0.0, 0.0, 1.0))
    assert [columns[n][0] for n in LENGTHS] == [4.0, 2.0, 2.0]
    assert columns["phi0"][0] == math.pi
    assert columns["stroke_ratio"][0] == 1.0
    assert found((1.0, 3.0, 0.0, 0.0, 0.0, 1.0), ("margin",))["margin"][0] == pytest.approx(8.0 / 9.0, rel=1e-15)


@settings(deadline=None, max_examples=25)
@given(
    a=some.floats(0.01, 1.0),
    e=some.floats(-2.0, 2.0),
    f=some.floats(-2.0, 2.0),
    alpha=some.floats(-3.0, 3.0),
    over=some.floats(0.05, 3.0),
    exponent=some.sampled_from([-300, -20, 20, 300]),
)
def test_limits_scale_and_mirror(a, e, f, alpha, over, exponent):
    b = math.hypot(abs(e) + a, abs(f) + a) + over  # long enough to rotate
    one = found((a, b, e, f, alpha, 1.0))
    mirror = found((a, b, e, -f, alpha, -1.0))
    unit = 2.0**exponent
    scaled = found((a * unit, b * unit, e * unit, f * unit, alpha, 1.0))
    assert one["status"][0] == mirror["status"][0] == scaled["status"][0] == st.OK
    for name in LENGTHS:
        sign = 1.0 if name == "stroke" else -1.0
        assert mirror[name][0] == sign * one[name][0]
        if abs(e) > 1e-5 and abs(f) > 1e-5:  # scaled denormals lose bits
            assert scaled[name][0] == one[name][0] * unit
    assert mirror["phi0"][0] == pytest.approx(2.0 * np.pi - one["phi0"][0], abs=1e-14)


def test_jitted_equals_plain_python():
    designs = rotating(20, 9)[:6]
    for kernel, outputs in ((rssp.limits, 9), (rssp.margin, 3)):
        compiled, plain = (np.empty((outputs, len(designs))) for _ in range(2))
        states = np.empty((2, len(designs)), np.uint8)
        for k, (function, room) in enumerate(((kernel, compiled), (kernel.py_func, plain))):
            function(designs, states[k], *([room] if kernel is rssp.limits else room))
        np.testing.assert_array_equal(compiled, plain)
        np.testing.assert_array_equal(states[0], states[1])


def test_margin_never_decides_wrongly_at_the_boundary():
    """Couplers a few units in the last place around the shortest that rotates; 60 digits judge."""
    wrong, undecided, decided = 0, 0, 0
    for design in rotating(20, 21)[:5]:
        a, b, e, f, alpha, branch = design
        with mp.workdps(60):
            shortest = float(mp.sqrt(mpf(b) ** 2 - naive.least_discriminant(tuple(design))))
        for steps in (-300, -40, -8, -2, -1, 0, 1, 2, 8, 40, 300):
            near = shortest + steps * np.spacing(shortest)
            trial = (a, near, e, f, alpha, branch)
            verdict = found(trial, ("margin",))["status"][0]
            turns = naive.least_discriminant(trial) > 0
            wrong += int(verdict == (st.NOT_ROTATABLE if turns else st.OK))
            undecided += int(verdict == st.UNDECIDABLE)
            decided += int(verdict in (st.OK, st.NOT_ROTATABLE) and abs(steps) == 300)
    assert wrong == 0
    assert undecided > 0
    assert decided == 10  # the band is narrow: 300 units away every case is decided


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"a": 2.0, "b": 1.0, "e": 0.0}, st.NOT_ROTATABLE),
        ({"a": 1.0, "b": 3.0, "e": 2.0, "f": 0.0, "alpha": 0.0}, st.UNDECIDABLE),
        ({"e": 0.0, "alpha": math.pi / 2, "f": 0.5}, st.OK),
    ],
)
def test_status_of_special_designs(change, status):
    design = {"a": 1.0, "b": 3.0, "e": 0.3, "f": 0.2, "alpha": 0.4} | change
    frame = sweep.summarise("rssp", design, ["s_ext", "phi0", "stroke"])
    assert frame["status"][0] == status
    assert frame["s_ext"].isna()[0] == (status != st.OK)


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
@pytest.mark.parametrize("column", [0, 1])
def test_bad_lengths_give_a_status_and_no_number(column, value):
    design = np.array([[1.0, 3.0, 0.3, 0.2, 0.4, 1.0]])
    design[0, column] = value
    columns = found(design)
    assert columns["status"][0] == st.INVALID_INPUT
    assert all(np.isnan(columns[name][0]) for name in LENGTHS + ANGLES)
