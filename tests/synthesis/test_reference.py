"""Synthesis against limits, geometry and the special curves of the source; the acceptance tests one by one."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.synthesis.locus import admissible_arcs, locus, locus_designs
from tests.reference import synthesis as naive
from tests.support.turn_designs import crank_rockers, slider_cranks

RSSR_NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
RSSP_NAMES = ("a", "b", "e", "f", "alpha", "branch")


def requirements(n, seed, **fixed):
    r = np.random.default_rng(seed)
    table = {
        "swing": r.uniform(0.05, 1.6, n) * r.choice([-1.0, 1.0], n),
        "phi0": r.uniform(2.4, 3.9, n),
        "phi1": r.uniform(0.0, 2.0 * np.pi, n),
        "e": r.uniform(-2.0, 2.0, n),
        "f": r.uniform(-2.0, 2.0, n),
        "g": r.uniform(-2.0, 2.0, n),
        "alpha": r.uniform(0.0, np.pi, n),
    }
    return pd.DataFrame(table | {name: np.full(n, value) for name, value in fixed.items()})


def accepted(frame):
    return frame[frame["status"] == st.OK]


@pytest.mark.parametrize("kind", [np.float64, np.complex128])
@pytest.mark.parametrize(
    ("family", "row"),
    [
        ("rssr", [0.87, 3.0, 1.0, 0.0, 5.0, 2.0, 0.0]),  # axes in line: the rocker ball stays on the crank axis
        ("rssp", [0.0, 3.0, 1.0, 5.0, 0.5]),  # no stroke
    ],
)
def test_a_place_without_a_crank_has_none_and_raises_nothing(family, row, kind):
    """Both balls lie on the crank axis, so the crank is 0/0; optimisers come there with complex steps."""
    found = locus(family, ("phi1",)).solve(np.array([row], kind))
    assert found.status[0] != st.OK
    assert np.isnan(found.designs[0, :2]).all()


def test_crank_rockers_come_back_from_their_limits():
    designs = pd.DataFrame(crank_rockers(600, 71), columns=RSSR_NAMES)
    limits = sweep.summarise("rssr", designs, ["swing", "phi0", "phi_ext", "psi_ext"], accuracy=1e-12)
    both = designs.join(limits)[limits["status"] == st.OK]
    assert len(both) > 150
    table = both[["swing", "phi0", "e", "f", "g", "alpha"]].assign(phi1=both["phi_ext"])
    back = sweep.synthesise("rssr", table)
    assert (back["status"] == st.OK).all()
    np.testing.assert_array_equal(back["branch"], both["branch"])
    for name in ("a", "b", "c"):
        # the limits are known to about 1e-12 and the determinant of the locus may be as small as 1e-4
        np.testing.assert_allclose(back[name], both[name], rtol=1e-7, err_msg=name)
        assert np.median(np.abs(back[name] / both[name] - 1.0)) < 1e-11
    table = table.drop(columns="phi1").assign(psi1=both["psi_ext"])
    solutions = sweep.synthesise("rssr", table)
    assert len(solutions) == 2 * len(table)
    gap = (solutions["c"] - both["c"].loc[solutions.index]).abs().groupby(level=0).min()
    assert gap.max() < 1e-6


def test_slider_cranks_come_back_from_their_limits():
    designs = pd.DataFrame(slider_cranks(600, 72), columns=RSSP_NAMES)
    limits = sweep.summarise("rssp", designs, ["stroke", "phi0", "phi_ext", "s_ext"], accuracy=1e-12)
    both = designs.join(limits)[limits["status"] == st.OK]
    assert len(both) > 400
    both = both.assign(stroke=-both["branch"] * both["stroke"])
    common = both[["stroke", "f", "alpha"]]
    ways = {
        "phi1": common.assign(phi0=both["phi0"], phi1=both["phi_ext"]),
        "s1": common.assign(e=both["e"], s1=both["s_ext"]),
        "e": common.assign(phi0=both["phi0"], e=both["e"]),
    }
    for way, table in ways.items():
        back = sweep.synthesise("rssp", table)
        for name in ("a", "b", "e"):
            gap = (back[name] / both[name].loc[back.index] - 1.0).abs().groupby(level=0).min()
            assert gap.max() < 1e-8, (way, name)
            assert gap.median() < 1e-13, (way, name)


def test_accepted_crank_rockers_do_what_was_required():
    frame = accepted(sweep.synthesise("rssr", requirements(3000, 73)))
    assert len(frame) > 200
    limits = sweep.summarise("rssr", frame[list(RSSR_NAMES)], ["swing", "phi0", "phi_ext", "psi_ext", "margin"])
    assert (limits["status"] == st.OK).all()
    for name, period in (("swing", 0.0), ("phi0", 0.0), ("phi_ext", 2.0 * np.pi), ("psi_ext", 2.0 * np.pi)):
        error = limits[name] - frame[name]
        error = error - period * np.round(error / period) if period else error
        assert error.abs().max() < 1e-6, name
    np.testing.assert_allclose(limits["margin"], frame["margin"], rtol=1e-9, atol=1e-14)


def test_branch_defect_is_caught_though_the_discriminant_is_positive():
    """Lengths from plain geometry alone pass the side condition and a > 0, turn fully - and miss the swing."""
    table = requirements(1500, 74)
    frame = sweep.synthesise("rssr", table)
    defects = table[frame["failed"] == "branch"].iloc[:60]
    assert len(defects) == 60
    missed = 0
    for row in defects.itertuples(index=False):
        lengths = naive.rssr(*row)
        assert lengths["a"] > 0
        assert lengths["ahead"] > 0 > lengths["back"]
        design = {k: float(lengths[k]) for k in ("a", "b", "c")} | {
            k: getattr(row, k) for k in ("e", "f", "g", "alpha")
        }
        for branch in (1.0, -1.0):
            turn = sweep.summarise("rssr", design | {"branch": branch}, ["margin", "swing"]).iloc[0]
            if turn["status"] == st.OK:
                assert turn["margin"] > 0.0
                assert abs(turn["swing"] - row.swing) > 1e-3
                missed += 1
    assert missed >= 100


def test_side_and_crank_failures_are_what_they_say():
    table = requirements(600, 75)
    frame = sweep.synthesise("rssr", table)
    for failure, holds in (
        ("side", lambda x: not x["ahead"] > 0 > x["back"]),
        ("crank", lambda x: x["ahead"] > 0 > x["back"] and x["a"] < 0),
    ):
        rows = table[frame["failed"] == failure].iloc[:40]
        assert len(rows) == 40
        assert all(holds(naive.rssr(*row)) for row in rows.itertuples(index=False)), failure
    assert (frame["status"][frame["failed"] != ""] == st.NOT_ADMISSIBLE).all()
    assert frame.loc[frame["failed"] != "", ["a", "b", "c", "margin"]].isna().all().all()


def test_pressure_limit_keeps_the_lengths_and_says_so():
    table = requirements(2000, 76)
    free, limited = sweep.synthesise("rssr", table), sweep.synthesise("rssr", table, max_pressure_angle=0.9)
    steep = limited["failed"] == "pressure angle"
    assert steep.sum() > 20
    assert (limited["status"][steep] == st.LIMIT_EXCEEDED).all()
    assert (free["max_pressure_angle"][steep] > 0.9).all()
    assert accepted(limited)["max_pressure_angle"].max() <= 0.9
    pd.testing.assert_series_equal(free["a"], limited["a"])


def test_planar_locus_is_the_circle_of_alt():
    rows = accepted(sweep.synthesise("rssr", requirements(2000, 77, alpha=0.0)))
    assert len(rows) > 80
    x, y = rows["c"] * np.cos(rows["psi_ext"]), rows["c"] * np.sin(rows["psi_ext"])
    d, p, e = rows["swing"] - rows["phi0"], rows["phi0"], rows["e"]
    terms = [
        np.sin(d) * (x * x + y * y),
        e * (np.sin(d) - np.sin(p)) * x,
        e * (np.cos(d) - np.cos(p)) * y,
        -e * e * np.sin(p),
    ]
    assert (sum(terms).abs() <= 1e-10 * sum(t.abs() for t in terms)).all()
    moved = accepted(sweep.synthesise("rssr", rows[["swing", "phi0", "e", "alpha"]].assign(
        phi1=rows["phi_ext"], f=rows["f"] + 3.0, g=rows["g"] + 3.0)))  # fmt: skip
    np.testing.assert_allclose(moved["b"], rows["b"], rtol=1e-12)  # only f - g matters in the plane


def test_straight_locus_of_the_plane_has_one_phi1_and_is_found_by_psi1():
    """alpha = 0, phi0 = swing + 180 deg: Alt's circle is a line through the crank axis, the same phi1 all along it."""
    table = {"swing": math.radians(20.0), "phi0": math.radians(200.0), "e": 1.0, "f": 0.0, "g": 0.0, "alpha": 0.0}
    assert set(sweep.synthesise("rssr", table | {"phi1": np.linspace(0.0, 6.2, 40)})["failed"]) == {"point"}
    rows = accepted(sweep.synthesise("rssr", table | {"psi1": np.linspace(-3.1, 3.1, 200)}))
    assert len(rows) > 5
    assert np.ptp(rows["phi_ext"]) < 1e-12
    limits = sweep.summarise("rssr", rows[list(RSSR_NAMES)], ["swing", "phi0"], accuracy=1e-12)
    np.testing.assert_allclose(limits["swing"], table["swing"], rtol=1e-9)
    np.testing.assert_allclose(limits["phi0"], table["phi0"], rtol=1e-9)


def test_right_angle_locus_is_the_hyperbola():
    rows = accepted(sweep.synthesise("rssr", requirements(2000, 78, alpha=math.pi / 2)))
    assert len(rows) > 80
    x, y = rows["c"] * np.cos(rows["psi_ext"]), rows["c"] * np.sin(rows["psi_ext"])
    s, p, e, g = rows["swing"], rows["phi0"], rows["e"], rows["g"]
    terms = [
        -np.cos(s) * np.sin(p) * x * x,
        np.sin(s) * np.sin(p) * x * y,
        -g * (1.0 - np.cos(s)) * np.cos(p) * x,
        -e * (1.0 + np.cos(s)) * np.sin(p) * x,
        e * np.sin(p) * np.sin(s) * y,
        -g * np.cos(p) * np.sin(s) * y,
        -(e * e + g * g) * np.sin(p),
    ]
    assert (sum(terms).abs() <= 1e-10 * sum(t.abs() for t in terms)).all()


def test_central_locus_is_a_circle_through_the_rocker_axis():
    rows = accepted(sweep.synthesise("rssr", requirements(2000, 79, phi0=math.pi)))
    assert len(rows) > 80
    x, y = rows["c"] * np.cos(rows["psi_ext"]), rows["c"] * np.sin(rows["psi_ext"])
    h, ca, gs = 0.5 * rows["swing"], np.cos(rows["alpha"]), rows["g"] * np.sin(rows["alpha"])
    terms = [
        ca * np.cos(h) * (x * x + y * y),
        (rows["e"] * ca * np.cos(h) - gs * np.sin(h)) * x,
        -(rows["e"] * ca * np.sin(h) + gs * np.cos(h)) * y,
    ]
    assert (sum(terms).abs() <= 1e-10 * sum(t.abs() for t in terms)).all()


def ellipse(s0, s1, e, sa, tan_phi0):
    """Left side of the source's (12), corrected."""
    ca = math.sqrt(1.0 - sa * sa)
    return ca * ca * tan_phi0 * (s1 * s1 + s0 * s1) + e * e * tan_phi0 - s0 * ca * e


def test_slider_locus_is_the_ellipse_and_the_printed_example_misses_it():
    r = np.random.default_rng(80)
    n = 500
    table = {"stroke": r.uniform(0.2, 2.0, n), "phi0": r.uniform(2.5, 3.8, n), "phi1": r.uniform(0.0, 6.28, n)}
    rows = accepted(sweep.synthesise("rssp", table | {"f": r.uniform(-1, 1, n), "alpha": r.uniform(0.0, 1.4, n)}))
    assert len(rows) > 40
    for row in rows.itertuples():
        value = ellipse(row.stroke, row.s_ext, row.e, math.sin(row.alpha), math.tan(row.phi0))
        assert abs(value) < 1e-12 * (1.0 + row.s_ext**2 + row.e**2)
    assert ellipse(1.0, -1.5, 0.8, 0.6, 0.5) == pytest.approx(-0.08)
    assert ellipse(1.0, -1.618033988749895, 0.8, 0.6, 0.5) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("swing", [1e-9, -1e-9])
def test_tiny_swing_keeps_every_digit(swing):
    table = requirements(60, 83, swing=swing)
    rows = accepted(sweep.synthesise("rssr", table))
    assert len(rows) > 5
    for index, row in rows.iterrows():
        with mp.workdps(40):
            exact = naive.rssr(*table.loc[index])
        for name in ("a", "b", "c"):
            assert row[name] == pytest.approx(float(exact[name]), rel=1e-13)


def test_mirrored_requirement_gives_the_mirrored_mechanism():
    """Y -> -Y: psi, swing and f change their signs, alpha becomes pi - alpha, phi and g stay."""
    table = requirements(1500, 84)
    one = sweep.synthesise("rssr", table)
    other = sweep.synthesise("rssr", table.assign(swing=-table["swing"], f=-table["f"], alpha=np.pi - table["alpha"]))
    np.testing.assert_array_equal(one["failed"], other["failed"])
    assert len(accepted(one)) > 100
    for name in ("a", "b", "c", "margin"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-9)
    np.testing.assert_array_equal(other["branch"], -one["branch"])


def test_scaling_by_a_power_of_two_changes_no_bit():
    table = requirements(400, 81)
    lengths = ["e", "f", "g"]
    one = sweep.synthesise("rssr", table)
    two = sweep.synthesise("rssr", table.assign(**{n: table[n] * 2.0**40 for n in lengths}))
    for name in ("a", "b", "c"):
        np.testing.assert_array_equal(one[name] * 2.0**40, two[name])
    np.testing.assert_array_equal(one["failed"], two["failed"])


def test_arcs_are_where_the_side_condition_holds():
    for seed in range(12):
        row = requirements(1, 900 + seed).drop(columns="phi1").iloc[0].to_dict()
        arcs = admissible_arcs("rssr", row)
        phi = np.linspace(0.0, 2.0 * np.pi, 721)[:-1] + 1e-4
        frame = sweep.synthesise("rssr", pd.DataFrame({"phi1": phi}).assign(**row))
        inside = np.zeros(phi.size, bool)
        for start, end in arcs:
            assert 0.0 <= start < 2.0 * np.pi
            assert start < end <= start + 2.0 * np.pi
            inside |= ((phi - start) % (2.0 * np.pi)) < end - start
        np.testing.assert_array_equal(inside, ~frame["failed"].isin(["side", "point"]))
    (arc,) = admissible_arcs("rssp", {"stroke": 1.0, "phi0": 3.3, "f": 0.1, "alpha": 0.2})
    # sin(phi0) < 0: cos(phi1) > 0 and cos(phi1 + phi0) < 0
    assert arc == pytest.approx((1.5 * math.pi, 3.5 * math.pi - 3.3), abs=1e-14)
    # rho2 = 0 at tan(phi1) = +-ca q/S; in the middle of the arc the ball is on the rocker axis
    half = {"swing": -0.5 * math.pi, "phi0": math.pi, "e": 0.0, "f": 0.3, "g": -1.0, "alpha": math.pi / 3.0}
    (arc,) = admissible_arcs("rssr", half)
    assert arc == pytest.approx((math.atan(0.5), math.pi - math.atan(0.5)), abs=1e-14)


def test_arcs_of_a_rocker_of_given_length_are_refused():
    row = {"swing": 0.7, "phi0": 3.3, "c": 2.0, "f": 0.3, "direction": 0.4, "alpha": 0.8}
    with pytest.raises(InputError, match="swing, phi0, e, f, g, alpha"):
        admissible_arcs("rssr", row)


def test_locus_designs_are_columns_for_a_study():
    table = requirements(300, 82)
    columns, status = locus_designs("rssr", {name: table[name].to_numpy() for name in table})
    frame = sweep.synthesise("rssr", table)
    assert tuple(columns) == RSSR_NAMES
    for name in RSSR_NAMES:
        np.testing.assert_array_equal(columns[name], frame[name])
    assert set(np.unique(status)) == {st.OK, st.NOT_ADMISSIBLE}


@pytest.mark.parametrize("family", ["rssr", "rssp"])
def test_complex_step_gives_the_gradients_of_the_locus(family):
    names = ("swing", "phi0", "phi1", "e", "f", "g", "alpha")
    table = requirements(300, 85)
    if family == "rssp":
        table, names = table.rename(columns={"swing": "stroke"}), ("stroke", "phi0", "phi1", "f", "alpha")
        table["alpha"] = 0.4 * table["alpha"]
    solve = locus(family, names).solve
    plain = table[list(names)].to_numpy()
    rows = plain[solve(plain).status == st.OK][:20]
    assert len(rows) == 20
    for k in range(len(names)):
        unit = np.eye(len(names))[k]
        exact = solve(rows + 1e-30j * unit).designs.imag / 1e-30
        quotient = (solve(rows + 1e-6 * unit).designs - solve(rows - 1e-6 * unit).designs) / 2e-6
        np.testing.assert_allclose(exact, quotient, rtol=1e-4, atol=1e-5 * np.abs(exact).max())
        np.testing.assert_allclose(solve(rows + 1e-30j * unit).designs.real, solve(rows).designs, rtol=1e-13)
