"""Back-rest at kernel level: the 25-digit table, points and balances in 40 digits, roots, symmetries, hard inputs."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

from kernels import status as st
from kernels.families import backrest
from kernels.families.backrest import Mode
from tests.reference import backrest as naive

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "backrest_open.json").read_text())["rows"]
FIELDS = backrest.Design._fields
GEOMETRY = ("phi", "R1", "h", "theta", "gamma", "L1", "L2", "Lc", "wrap", "x_axis", "y_axis", "clearance", "roots")
LOADS = ("K", "N1", "N2", "K_couple", "N1_couple", "N2_couple", "offset_e", "F_spring", "spring_length")
BAND = ("K_low", "K_high")
EXAMPLE = {
    "a1": 0.75, "b1": 0.5625, "a2": 0.125, "b2": 0.4375, "H": 0.03125, "r": 0.0625, "r0": 0.046875, "psi": 1.5,
    "xE": 0.0, "yE": 0.25, "f": 0.125, "P1": 300.0, "P2": 200.0, "lM": 0.25, "nu": 1.0, "x3": 0.75, "y3": 0.6875,
    "cs": 512.0, "l0": 0.5, "F0": 1856.0, "rg": 0.1875, "nug": 0.125,
}  # fmt: skip


def design(**given_values):
    values = dict.fromkeys(FIELDS, 0.0) | {"s1": 1.0, "s2": 1.0, "root": 1.0}
    return [(values | given_values)[name] for name in FIELDS]


def posed(designs, rho, mode=Mode.LAW, dtype=np.float64, plain=False):
    matrix, rho = np.atleast_2d(np.asarray(designs, dtype)), np.atleast_2d(np.asarray(rho, dtype=float))
    shape = (len(matrix), rho.shape[1])
    status = np.empty(shape, np.uint8)
    blocks = [np.empty((len(names), *shape), dtype) for names in (GEOMETRY, LOADS, BAND)]
    function = backrest.poses.py_func if plain else backrest.poses
    with np.errstate(all="ignore"):
        function(matrix, rho, np.full(len(matrix), int(mode), np.uint8), status, *blocks)
    names = (*GEOMETRY, *LOADS, *BAND)
    return dict(zip(names, np.concatenate(blocks), strict=True)) | {"status": status}


def one_pose(values, rho, mode=Mode.LAW):
    return {name: out[0, 0] for name, out in posed([design(**values)], [[rho]], mode).items()}


def conditions(p, phi, rho, function):
    """Sum of |input d(output)/d(input)| for every output: what one rounding of each input can do."""
    inputs = {k: mpf(v) for k, v in p.items()} | {"phi_": mpf(phi), "rho_": mpf(rho)}

    def values(given_inputs):
        return function(
            {k: v for k, v in given_inputs.items() if k[-1] != "_"}, given_inputs["phi_"], given_inputs["rho_"]
        )

    base, step = values(inputs), mpf(10) ** -18
    sums = dict.fromkeys(base, mpf(0))
    for k, v in inputs.items():
        if v != 0:
            moved = values(inputs | {k: v * (1 + step)})
            sums = {name: total + abs(moved[name] - base[name]) / step for name, total in sums.items()}
    return sums


def test_backrest_matches_oracle_on_every_row_of_geometry_and_tension():
    for row in (r for r in ROWS if r["kind"] in ("geometry", "tension")):
        values, rho = dict(row["in"]), row["in"]["rho"]
        got = one_pose({k: v for k, v in values.items() if k in FIELDS}, rho)
        assert got["status"] == st.OK
        p = {"s1": 0.0, "s2": 0.0} | {k: v for k, v in values.items() if k in FIELDS and k != "phi"}
        function = naive.geometry if row["kind"] == "geometry" else naive.statics
        with mp.workdps(40):
            sizes = conditions(p, values["phi"], rho, function)
            for name, expected in row["out"].items():
                size = max(abs(mpf(expected)), sizes[name])
                # 8 roundings of each input: the closed forms add about as many as there are inputs
                assert abs(mpf(float(got[name])) - mpf(expected)) <= 8 * mpf(2) ** -53 * size, (row["tag"], name)


@pytest.mark.parametrize("kind, mode", [("source_system", Mode.CLOSURE), ("position_for_tension", Mode.TENSION)])
def test_backrest_finds_every_position_of_the_oracle_and_no_other(kind, mode):
    counts = set()
    for row in (r for r in ROWS if r["kind"] == kind):
        values = {k: v for k, v in row["in"].items() if k in FIELDS}
        expected = row["out"]["roots"]
        counts.add(len(expected))
        assert one_pose(values, row["in"]["rho"], mode)["roots"] == len(expected)
        for k, root in enumerate(expected):
            got = one_pose(values | {"root": k + 1.0}, row["in"]["rho"], mode)
            assert got["status"] == st.OK
            for name, y in root.items():
                # simple roots, well apart: a few hundred roundings of 1 rad, and of the tensions near zero 1000 N
                room = 300.0 * 2.0**-53 * (1000.0 if name in ("K", "N1", "N2") else 1.0)
                assert abs(float(got[name]) - float(y)) <= room, name
        beyond = one_pose(values | {"root": len(expected) + 1.0}, row["in"]["rho"], mode)
        assert beyond["status"] == st.NO_ROOT
        assert math.isnan(beyond["phi"]) and beyond["roots"] == len(expected)
    assert counts == ({0, 1, 2} if kind == "source_system" else {1})


WORKED = (
    (0.375, 0.400, 27.04, 66.7, 1594, 1999, 1494.5, 1800.0, 1794.9, 1170.6, 1177.0, 0.54),
    (0.3125, 0.390625, 19.70, 73.9, 1715, 2008, 1430.5, 1736.3, 1727.5, 1114.7, 1122.2, 0.96),
    (0.25, 0.375, 12.79, 80.5, 1839, 2023, 1406.6, 1717.8, 1705.1, 1093.4, 1102.3, 1.39),
    (0.1875, 0.34375, 6.16, 86.6, 1971, 2051, 1430.1, 1750.0, 1733.0, 1115.6, 1126.2, 1.79),
    (0.125, 0.296875, -0.46, 92.5, 2117, 2085, 1491.0, 1823.0, 1800.8, 1172.5, 1185.4, 2.22),
    (0.09375, 0.25, -3.83, 95.1, 2189, 2110, 1558.0, 1893.8, 1868.4, 1239.1, 1253.7, 2.39),
)


@pytest.mark.parametrize("row", WORKED)
def test_backrest_worked_example_row_by_row(row):
    rho, phi, theta, wrap, n1, n2, tension, pp, pp_couple, mm, mm_couple, offset = row
    free = one_pose(EXAMPLE | {"f": 0.0, "phi": phi}, rho)
    for got, printed, digit in (
        (math.degrees(free["theta"]), theta, 0.01), (math.degrees(free["wrap"]), wrap, 0.1),
        (free["N1"], n1, 1.0), (free["N2"], n2, 1.0), (free["K"], tension, 0.1),
    ):  # fmt: skip
        assert abs(got - printed) <= 0.5001 * digit
    assert free["K"] == pytest.approx(free["K_couple"], rel=1e-14)
    for sign, source, couple in ((1.0, pp, pp_couple), (-1.0, mm, mm_couple)):
        got = one_pose(EXAMPLE | {"phi": phi, "s1": sign, "s2": sign}, rho)
        assert abs(got["K"] - source) <= 0.05001
        assert abs(got["K_couple"] - couple) <= 0.05001
        assert got["K_couple"] == got["K_high" if sign > 0 else "K_low"]
    assert abs(1e3 * one_pose(EXAMPLE | {"phi": phi}, rho)["offset_e"] - offset) <= 0.005001


GIVEN = some.fixed_dictionaries({
    "a1": some.floats(0.6, 0.9), "b1": some.floats(0.45, 0.65), "a2": some.floats(0.1, 0.2),
    "b2": some.floats(0.4, 0.5),
    "H": some.floats(0.0, 0.08), "r": some.floats(0.03, 0.08), "r0": some.floats(0.02, 0.1),
    "psi": some.floats(0.8, 1.6), "xE": some.floats(-0.05, 0.05), "yE": some.floats(0.2, 0.3),
    "f": some.floats(0.0, 0.2), "P1": some.floats(0.0, 400.0), "P2": some.floats(0.0, 300.0),
    "lM": some.floats(0.15, 0.3), "nu": some.floats(0.5, 1.7), "x3": some.just(0.75), "y3": some.just(0.6875),
    "cs": some.floats(0.0, 30000.0), "l0": some.just(0.5), "F0": some.floats(100.0, 2000.0),
    "rg": some.just(0.1875), "nug": some.just(0.125),
    "s1": some.sampled_from([-1.0, 0.0, 1.0]), "s2": some.sampled_from([-1.0, 0.0, 1.0]),
})  # fmt: skip


PRESSED = {
    "a1": 0.75, "b1": 0.5, "a2": 0.1875, "b2": 0.5, "H": 0.0, "r": 0.0625, "r0": 0.0625, "psi": 1.0, "xE": 0.0,
    "yE": 0.25, "f": 0.0, "P1": 0.0, "P2": 0.0, "lM": 0.25, "nu": 1.6953125, "x3": 0.75, "y3": 0.6875, "cs": 1242.0,
    "l0": 0.5, "F0": 100.0, "rg": 0.1875, "nug": 0.125, "s1": -1.0, "s2": -1.0,
}  # fmt: skip  # a spring shorter than at rest


@example(PRESSED, 0.5, 0.25)
@settings(deadline=None, max_examples=25)
@given(GIVEN, some.floats(0.0, 0.5), some.floats(0.09, 0.38))
def test_backrest_equals_points_and_balances(p, phi, rho):
    got = one_pose(p | {"phi": phi}, rho)
    assume(got["status"] == st.OK)
    with mp.workdps(40):
        exact = {k: mpf(v) for k, v in p.items()}
        for name, y in (naive.geometry(exact, mpf(phi), mpf(rho)) | naive.statics(exact, mpf(phi), mpf(rho))).items():
            # psi - phi is at least 0.3 and denominators at least 1e-3: below 1e5 roundings of forces up to 1e4 N
            room = 1e-11 * max(1.0, float(abs(y))) * (1e4 if name[0] in "KNF" else 1.0)
            if abs(got["N2_couple"]) > 1.0 and abs(math.sin(0.5 * got["wrap"])) > 1e-3:
                assert abs(float(got[name]) - float(y)) <= max(room, room * float(abs(y))), name


def test_backrest_stands_in_balance_as_one_body_about_the_pivot():
    p, phi, rho = EXAMPLE | {"s1": 1.0, "s2": -1.0}, 0.375, 0.25
    got = one_pose(p | {"phi": phi}, rho)
    with mp.workdps(30):
        exact = {k: mpf(v) for k, v in p.items()}
        g = naive.points(exact, mpf(phi), mpf(rho))
        k, n1 = mpf(got["K_couple"]), mpf(got["N1_couple"])
        pivot = g["pivot"]
        moment = k * naive.cross(g["A"] - pivot, (g["A0"] - g["A"]) / abs(g["A0"] - g["A"]))
        moment += k * naive.cross(g["B"] - pivot, (g["end"] - g["B"]) / abs(g["end"] - g["B"]))
        c1 = -g["normal"] + exact["s1"] * exact["f"] * g["along"]
        moment += n1 * naive.cross(g["axis"] + exact["r0"] * g["normal"] - pivot, c1)
        moment += naive.cross(g["axis"] - pivot, mp.mpc(0, -exact["P1"]))
        m = exact["lM"] * mp.mpc(-mp.cos(phi + 1), mp.sin(phi + 1))
        pull = mp.mpc(exact["x3"], exact["y3"]) - pivot - m
        moment += naive.cross(m, mpf(got["F_spring"]) * pull / abs(pull))
        centre = exact["rg"] * mp.mpc(-mp.cos(phi + exact["nug"]), mp.sin(phi + exact["nug"]))
        moment += naive.cross(centre, mp.mpc(0, -exact["P2"]))
        assert abs(moment) < 1e-11  # of moments near 500 N m


def test_backrest_tension_is_stationary_in_the_radius_where_the_guide_is_parallel_to_the_yarn():
    # K changes by 1 % over the half-used beam at psi = 1.6 and falls by 10 % over the full one at psi = 1.0
    steep = posed([design(**EXAMPLE | {"phi": 0.34, "f": 0.0, "psi": 1.6})], [[0.19, 0.14, 0.094]])["K"][0]
    assert np.ptp(steep) / steep[0] == pytest.approx(0.01, abs=0.005)
    flat = posed([design(**EXAMPLE | {"phi": 0.34, "f": 0.0, "psi": 1.0})], [[0.375, 0.094]])["K"][0]
    assert flat[1] / flat[0] - 1.0 == pytest.approx(-0.10, abs=0.015)
    rho = np.linspace(0.05, 0.4, 4001)
    got = posed([design(**EXAMPLE | {"phi": 0.34, "f": 0.0, "psi": 1.7})], rho[None, :])
    turning = np.argmax(np.diff(np.sign(np.diff(got["K"][0]))) != 0)
    assert 0.5 * math.pi + got["theta"][0][turning] == pytest.approx(1.7, abs=2e-3)


def test_backrest_source_closure_needs_no_couple():
    for row in (r for r in ROWS if r["kind"] == "source_system" and r["out"]["roots"]):
        got = one_pose({k: v for k, v in row["in"].items() if k in FIELDS}, row["in"]["rho"], Mode.CLOSURE)
        assert abs(got["offset_e"]) < 1e-12
        assert got["K"] == pytest.approx(got["K_couple"], rel=1e-10)


def test_backrest_source_closure_of_a_pin_without_radius_has_no_root_where_its_reaction_is_infinite():
    """N2 H = 0 then: only the bracket's moment can vanish.  Zeros of S, a factor of the equation, were taken too."""
    base = EXAMPLE | {
        "a1": 0.62, "b1": 0.55, "a2": 0.17, "b2": 0.33, "r": 0.057, "r0": 0.0, "psi": 1.87, "yE": 0.315, "x3": 0.63,
        "y3": 0.55, "cs": 410.0, "l0": 0.64, "rg": 0.23, "phi_lo": -1.2, "phi_hi": 1.9, "s1": -1.0,
    }  # fmt: skip
    roots = int(one_pose(base, 0.2, Mode.CLOSURE)["roots"])
    reactions = [one_pose(base | {"root": k}, 0.2, Mode.CLOSURE)["N2"] for k in range(1, roots + 1)]
    assert roots >= 1 and max(map(abs, reactions)) < 1e-8


def test_backrest_equation_of_which_nothing_is_left_has_no_root():
    got = one_pose(EXAMPLE | {"H": 0.0, "r0": 0.0, "phi_lo": -0.125, "phi_hi": 0.5}, 0.25, Mode.CLOSURE)
    assert (got["roots"], got["status"]) == (0.0, st.NO_ROOT)


def test_backrest_two_close_roots_are_not_stepped_over():
    base = {k: v for k, v in ROWS[-1]["in"].items() if k in FIELDS}
    base |= EXAMPLE | {"psi": 1.0, "phi_lo": -0.125, "phi_hi": 0.5, "s1": 1.0, "s2": 1.0}
    phi = np.linspace(-0.125, 0.5, 8001)

    def dense(h):
        """Sign changes of N2 H - N1 r0 over 8000 bracket angles, away from poles."""
        values = posed([design(**base | {"H": h, "phi": x}) for x in phi], [[0.25]])
        x = (values["N2"] * h - values["N1"] * base["r0"])[:, 0]
        keep = np.abs(x[1:] - x[:-1]) < 50.0
        return int(((np.sign(x[1:]) != np.sign(x[:-1])) & keep & (values["R1"][1:, 0] > 0.0)).sum())

    low, high = 0.0, 0.2
    counts = {}
    for _ in range(30):  # towards the height at which the two roots merge
        h = 0.5 * (low + high)
        counts[h] = one_pose(base | {"H": h}, 0.25, Mode.CLOSURE)["roots"]
        low, high = (h, high) if counts[h] >= 1 else (low, h)
    assert counts[min(counts, key=lambda x: abs(x - low))] >= 1
    near = posed(
        [design(**base | {"H": low, "root": 1.0}), design(**base | {"H": low, "root": 2.0})], [[0.25]], Mode.CLOSURE
    )
    gap = abs(near["phi"][1, 0] - near["phi"][0, 0])
    if near["roots"][0, 0] == 2.0:
        assert 0.0 < gap < 0.625 / 400.0  # both inside one cell of the search
    for h in (0.5 * low, 0.9 * low, 1.1 * low):
        assert dense(h) == one_pose(base | {"H": h}, 0.25, Mode.CLOSURE)["roots"]


@pytest.mark.parametrize("mode", [Mode.TENSION, Mode.COUPLE])
def test_backrest_held_tension_is_held(mode):
    p = EXAMPLE | {"s1": 1.0, "s2": -1.0, "K0": 1450.0, "phi_lo": -0.1, "phi_hi": 1.2}
    got = posed([design(**p)], [[0.35, 0.25, 0.15, 0.1]], mode)
    assert (got["status"] == st.OK).all()
    np.testing.assert_allclose(got["K" if mode == Mode.TENSION else "K_couple"], 1450.0, rtol=1e-13)


def test_backrest_law_is_linear_in_the_curvature_of_the_beam():
    p = EXAMPLE | {"phi": 0.4, "turn": -0.15, "rho_full": 0.375, "rho_empty": 0.09375}
    phi = posed([design(**p)], [[0.375, 0.15, 0.09375]])["phi"][0]
    np.testing.assert_allclose(
        phi, [0.4, 0.4 - 0.15 * (1 / 0.15 - 1 / 0.375) / (1 / 0.09375 - 1 / 0.375), 0.25], rtol=1e-15
    )
    nothing = one_pose(EXAMPLE | {"phi": 0.4, "turn": -0.1}, 0.2)
    assert nothing["status"] == st.INVALID_INPUT


def test_backrest_hard_inputs_are_named():
    base = EXAMPLE | {"phi": 0.375}
    cases = {
        "parallel": (base | {"phi": 1.5}, 0.25, st.SINGULAR),
        "beam engulfs": (base, 2.0, st.NOT_ASSEMBLED),
        "end inside": (base | {"a1": -0.1, "b1": 0.55}, 0.25, st.NOT_ASSEMBLED),
        "no radius": (base, 0.0, st.INVALID_INPUT),
        "infinite": (base | {"cs": math.inf}, 0.25, st.INVALID_INPUT),
    }
    for name, (values, rho, code) in cases.items():
        got = one_pose(values, rho)
        assert got["status"] == code, name
        assert all(math.isnan(got[k]) for k in ("phi", "R1", "K", "K_low", "F_spring")), name
    beside = one_pose(base | {"phi": 1.5 - 1e-9}, 0.25)
    assert beside["status"] == st.OK and beside["R1"] > 1e7


@pytest.mark.parametrize("exponent", [-300, -20, 20, 300])
def test_backrest_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    values = EXAMPLE | {"phi": 0.375, "s2": -1.0}
    scaled = dict(values)
    for name in ("a1", "b1", "a2", "b2", "H", "r", "r0", "xE", "yE", "lM", "x3", "y3", "l0", "rg"):
        scaled[name] = math.ldexp(values[name], exponent)
    scaled["cs"] = math.ldexp(values["cs"], -exponent)
    one, two = one_pose(values, 0.25), one_pose(scaled, math.ldexp(0.25, exponent))
    for name in ("phi", "theta", "gamma", "wrap", *LOADS[:6], "F_spring", *BAND):
        assert one[name] == two[name]
    for name in ("R1", "h", "L1", "L2", "Lc", "offset_e", "spring_length", "clearance"):
        assert math.ldexp(one[name], exponent) == two[name]


def test_backrest_jitted_equals_plain():
    rng = np.random.default_rng(3)
    p = EXAMPLE | {"phi": 0.4, "turn": -0.15, "rho_full": 0.375, "rho_empty": 0.09375, "K0": 1482.0, "phi_lo": -0.1,
                   "phi_hi": 1.0}  # fmt: skip
    designs = np.array([design(**p)] * 3)
    designs[1, 9], designs[2, 10] = 0.3, 0.0
    for dtype in (np.float64, np.complex128):
        matrix = designs.astype(dtype)
        if dtype is np.complex128:
            matrix[:, :22] += 1e-100j * rng.normal(size=(3, 22))
        for mode in Mode:
            one = posed(matrix, [[0.1, 0.25, 2.0]], mode, dtype)
            two = posed(matrix, [[0.1, 0.25, 2.0]], mode, dtype, plain=True)
            for name, values in one.items():
                np.testing.assert_allclose(values, two[name], rtol=1e-13)


@pytest.mark.parametrize("mode", list(Mode))
def test_backrest_complex_step_gives_exact_gradients_of_law_and_roots(mode):
    p = EXAMPLE | {"phi": 0.4, "turn": -0.15, "rho_full": 0.375, "rho_empty": 0.09375, "K0": 1482.0, "phi_lo": -0.1,
                   "phi_hi": 1.0}  # fmt: skip
    for name in ("a1", "H", "psi", "f", "cs", "F0", "nu", "P1"):
        k, step = FIELDS.index(name), 1e-6 * p[name]
        matrix = np.array([design(**p)], complex)
        matrix[0, k] += 1e-100j
        slope = posed(matrix, [[0.3]], mode, np.complex128)
        up, down = (one_pose(p | {name: p[name] + d}, 0.3, mode) for d in (step, -step))
        for output in ("phi", "R1", "K", "K_couple", "N1"):
            quotient = (up[output] - down[output]) / (2.0 * step)
            # rounding of a central difference over 2e-6 of the value, for outputs up to 2000
            room = 1e-6 * abs(quotient) + 1e-8 * abs(up[output]) / abs(p[name]) + 1e-9
            assert abs(slope[output][0, 0].imag * 1e100 - quotient) <= room, (name, output)


def test_negative_control_without_the_spring_the_oracle_fails():
    row = next(r for r in ROWS if r["kind"] == "tension")
    values = {k: v for k, v in row["in"].items() if k in FIELDS} | {"cs": 0.0}
    assert abs(one_pose(values, row["in"]["rho"])["K"] - float(row["out"]["K"])) > 1.0
