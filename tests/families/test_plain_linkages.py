"""Slider-crank, four-bar, inverted slider-crank, epicyclic dwell against points and printed numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.families import cam, epicyclic_dwell, inverted_slider_crank
from sweep.families import family
from sweep.families.base import Angles
from tests.reference import plain_linkages as naive
from tests.support.family_checks import conditions
from tests.support.plain_designs import DESIGNS, PHI, evaluated


@pytest.mark.parametrize("name", DESIGNS)
def test_plain_linkage_equals_its_points_and_their_derivatives(name):
    known = set(family(name).pose_names)
    for k, design in enumerate(DESIGNS[name]):
        phi = PHI[k % len(PHI)]
        expected = naive.derivatives(getattr(naive, name), design, phi, 3)
        want = [key for key in expected if key in known]
        row = evaluated(name, design, want, phi)
        assert row.status == st.OK
        size = max(1.0, *(abs(float(expected[key])) for key in want))
        for key in want:
            # a few roundings, times sensitivities that these proportions keep below 1000
            assert float(abs(row[key] - expected[key])) < 1000.0 * 2.0**-52 * size, (key, design, phi)


@pytest.mark.parametrize("name", DESIGNS)
def test_plain_linkage_complex_step_gives_the_next_derivative(name):
    mechanism = family(name)
    ladder = mechanism.derivative_of
    for k, design in enumerate(DESIGNS[name]):
        values = [design.get(p.name, p.default if p.default is not None else 0.0) for p in mechanism.parameters]
        phi = np.array([[PHI[k % len(PHI)]]])
        wanted = frozenset([*ladder, *ladder.values()])
        real = mechanism.poses(np.array([values]), Angles.of(phi), wanted)
        turned = mechanism.poses(np.array([values]) + 0.0j, Angles.of(phi + 1e-100j), wanted)
        for lower, upper in ladder.items():
            size = max(1.0, *(abs(real[key][0, 0]) for key in ladder.values()))
            assert turned[lower][0, 0].imag / 1e-100 == pytest.approx(real[upper][0, 0], abs=1e-12 * size), (lower, k)


@pytest.mark.parametrize("name", DESIGNS)
def test_plain_linkage_complex_step_gives_slopes_with_respect_to_every_parameter(name):
    mechanism = family(name)
    position = mechanism.position
    for k, design in enumerate(DESIGNS[name][-2:]):
        values = np.array(
            [design.get(p.name, p.default if p.default is not None else 0.0) for p in mechanism.parameters]
        )
        phi = Angles.of(np.array([[PHI[k]]]))
        for column, parameter in enumerate(mechanism.parameters):
            if parameter.choices is not None:
                continue
            direction = np.eye(values.size)[column]
            exact = mechanism.poses(np.array([values + 1e-100j * direction]), phi, frozenset({position}))
            slope = exact[position][0, 0].imag / 1e-100
            step = 1e-5 * max(1.0, abs(values[column]))
            ends = [
                mechanism.poses(np.array([values + d * direction]), phi, frozenset({position}))[position][0, 0]
                for d in (-step, step)
            ]
            # second order in the step
            assert slope == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-7, abs=1e-7), parameter.name


def matrix_of(name):
    mechanism = family(name)
    rows = [
        [d.get(p.name, p.default if p.default is not None else 0.0) for p in mechanism.parameters]
        for d in DESIGNS[name]
    ]
    return np.array(rows, dtype=float)


@pytest.mark.parametrize(
    ("name", "function", "outputs", "places"),
    [
        ("inverted_slider_crank", inverted_slider_crank.poses, 9, 2),
        ("epicyclic_dwell", epicyclic_dwell.poses, 8, 0),
        ("cam", cam.poses, 7, 0),
        ("cam_lever", cam.lever_poses, 7, 0),
    ],
)
def test_plain_linkage_kernel_jitted_equals_plain_python(name, function, outputs, places):
    designs, phi = matrix_of(name), np.linspace(0.0, 6.2, 23)[None, :]
    records = {
        "inverted_slider_crank": inverted_slider_crank.Outputs, "epicyclic_dwell": epicyclic_dwell.Outputs,
        "cam": cam.Outputs, "cam_lever": cam.LeverOutputs,
    }  # fmt: skip
    angles = (phi,) if name.startswith("cam") else (np.cos(phi), np.sin(phi))
    results = []
    for run in (function, function.py_func):
        shape = (len(designs), phi.size)
        status, out = np.empty(shape, np.uint8), [np.empty(shape) for _ in range(outputs)]
        room = [np.empty((places, *shape))] if places else []
        run(designs, *angles, status, records[name](*out, *room))
        results.append([status, *out, *room])
    for compiled, plain in zip(*results, strict=True):
        # the same arithmetic; sine and cosine come from two libraries that may differ by a rounding
        np.testing.assert_allclose(compiled, plain, rtol=1e-13, atol=1e-12)


def test_slider_crank_has_the_printed_limits_and_acceleration():
    frame = sweep.summarise(
        "slider_crank",
        {"a": 1.0, "b": 3.0, "e": [0.0, 0.5]},
        ["stroke", "phi_ext", "max_abs_d2s", "margin"],
        accuracy=1e-9,
    )
    assert frame.stroke[0] == pytest.approx(2.0, rel=1e-14)
    assert frame.stroke[1] == pytest.approx(math.sqrt(16.0 - 0.25) - math.sqrt(4.0 - 0.25), rel=1e-14)
    assert frame.phi_ext[0] % (2.0 * math.pi) == pytest.approx(0.0, abs=1e-14)
    assert frame.phi_ext[1] == pytest.approx(math.asin(0.5 / 4.0), abs=1e-14)
    assert frame.max_abs_d2s[0] == pytest.approx(1.0 + 1.0 / 3.0, rel=1e-9)
    assert frame.margin[1] == pytest.approx(1.0 - (1.5 / 3.0) ** 2, rel=1e-14)


def test_slider_crank_published_spatial_example_has_its_planar_strokes():
    # sqrt(b^2 - (e +- a)^2): the limits of the benchmark with the slide line through the crank axis's normal
    row = sweep.summarise("slider_crank", {"a": 0.08, "b": 0.3}, ["s_ext", "s_fold"], accuracy=1e-10).iloc[0]
    assert (row.s_ext, row.s_fold) == pytest.approx((0.38, 0.22), rel=1e-14)


def test_four_bar_matches_the_textbook_positions():
    # Norton, position problem, row a: ground 6, crank 2, coupler 7, rocker 9, crank at 30 deg
    frame = sweep.evaluate(
        "four_bar", {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0, "branch": [1.0, -1.0]}, ["psi"], phi=[math.pi / 6]
    )
    assert sorted(np.degrees(frame.psi).round(2)) == [-143.66, 117.29]


def test_four_bar_is_the_crank_rocker_and_the_guide_to_the_last_bit():
    phi = np.linspace(0.0, 6.2, 13)
    links = {"a": 1.0, "b": 3.0, "c": 2.5, "e": 3.0, "branch": [1.0, -1.0]}
    own = sweep.evaluate("four_bar", links | {"xi": 1.2, "eta": -0.4}, ["psi", "d3psi", "x_m", "d2y_m"], phi)
    rocker = sweep.evaluate("rssr", links | {"f": 0.0, "g": 0.0, "alpha": 0.0}, ["psi", "d3psi"], phi)
    point = sweep.evaluate("guide", links | {"xi": 1.2, "eta": -0.4, "lam": 0.0, "h": 0.0}, ["s", "d2dev"], phi)
    np.testing.assert_array_equal(own[["psi", "d3psi"]], rocker[["psi", "d3psi"]])
    np.testing.assert_array_equal(own[["x_m", "d2y_m"]], point[["s", "d2dev"]])


def test_inverted_slider_crank_swings_by_the_tangents_to_the_crank_circle():
    frame = sweep.summarise(
        "inverted_slider_crank", {"a": 1.0, "e": 2.0, "h": [0.0, 0.3]},
        ["swing", "phi0", "margin", "rotatable", "max_dpsi", "min_dpsi"], accuracy=1e-10,
    )  # fmt: skip
    assert frame.rotatable.all()
    assert abs(frame.swing[0]) == pytest.approx(2.0 * math.asin(0.5), rel=1e-9)
    assert frame.phi0[0] == pytest.approx(2.0 * math.acos(0.5), rel=1e-9)
    assert frame.max_dpsi[0] == pytest.approx(1.0 / 3.0, rel=1e-9)
    assert frame.min_dpsi[0] == pytest.approx(-1.0, rel=1e-9)
    assert frame.margin[1] == pytest.approx(1.0 - 0.3**2, rel=1e-9)  # the pin passes the rocker pivot at 1


def test_inverted_slider_crank_with_a_long_crank_turns_fully():
    # Whitworth's quick return: the rocker makes full turns and has no limit positions
    table = {"a": 1.0, "e": 0.5, "h": 0.0}
    assert sweep.summarise("inverted_slider_crank", table, ["swing"], accuracy=1e-8).status[0] == st.NOT_OSCILLATING
    row = sweep.summarise("inverted_slider_crank", table, ["max_dpsi", "min_dpsi"], accuracy=1e-9).iloc[0]
    assert (row.max_dpsi, row.min_dpsi) == pytest.approx((2.0, 2.0 / 3.0), rel=1e-9)


def test_geneva_drive_moves_as_its_triangle():
    # Crank 50, pivots 50 sqrt(2) apart, crank at 30 deg: textbooks have 4.08, 233 and 477 at 10 rad/s.
    a, e, phi = 50.0, 50.0 * math.sqrt(2.0), math.radians(30.0)
    found = sweep.evaluate("inverted_slider_crank", {"a": a, "e": e}, "psi, s, dpsi, ds, d2psi", phi=phi).iloc[0]
    square = a * a + e * e - 2.0 * a * e * math.cos(phi)  # of the slot, by the cosine rule; its derivatives follow
    # Some ten roundings.
    assert found["s"] ** 2 == pytest.approx(square, rel=1e-14)
    assert math.tan(found["psi"]) == pytest.approx(a * math.sin(phi) / (a * math.cos(phi) - e), rel=1e-14)
    assert found["ds"] == pytest.approx(a * e * math.sin(phi) / math.sqrt(square), rel=1e-14)
    assert found["dpsi"] == pytest.approx(a * (a - e * math.cos(phi)) / square, rel=1e-14)
    assert found["d2psi"] == pytest.approx(a * e * (e * e - a * a) * math.sin(phi) / square**2, rel=1e-14)


@pytest.mark.parametrize("slots", [3, 4, 5, 6, 8, 12])
def test_geneva_wheel_has_the_speed_and_accelerations_of_its_closed_form(slots):
    # With m = a/e = sin(pi/slots) and r^2 = 1 + m^2 - 2 m cos phi: psi'' = m (1 - m^2) sin phi/r^4, largest where its
    # derivative is zero, which is a quadratic in cos phi.  The crank enters the slot along it.
    m = math.sin(math.pi / slots)
    want = "max_abs_dpsi, max_abs_d2psi, phi_max_abs_d2psi, max_abs_d3psi, swing, phi0"
    found = sweep.summarise("inverted_slider_crank", {"a": m, "e": 1.0}, want, accuracy=1e-12).iloc[0]
    half = (1.0 + m * m) / (4.0 * m)
    cosine = math.sqrt(half * half + 2.0) - half
    peak = m * (1.0 - m * m) * math.sqrt(1.0 - cosine**2) / (1.0 + m * m - 2.0 * m * cosine) ** 2
    # The accuracy asked; a place comes from a root of the derivative.
    assert found["max_abs_dpsi"] == pytest.approx(m / (1.0 - m), rel=1e-12)
    assert found["max_abs_d2psi"] == pytest.approx(peak, rel=1e-12)
    assert abs(math.cos(found["phi_max_abs_d2psi"])) == pytest.approx(cosine, rel=1e-11)
    assert found["max_abs_d3psi"] == pytest.approx(m * (1.0 - m * m) / (1.0 - m) ** 4, rel=1e-12)
    assert abs(found["swing"]) == pytest.approx(2.0 * math.pi / slots, rel=1e-14)
    assert found["phi0"] == pytest.approx(math.pi - 2.0 * math.pi / slots, rel=1e-14)
    place = math.pi / 2.0 - math.pi / slots
    entering = sweep.evaluate("inverted_slider_crank", {"a": m, "e": 1.0}, "dpsi, d2psi", phi=place)
    assert entering["dpsi"][0] == pytest.approx(0.0, abs=1e-15)
    assert entering["d2psi"][0] == pytest.approx(math.tan(math.pi / slots), rel=1e-14)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({}, st.OK),
        ({"h": 1.5}, st.NOT_ASSEMBLED),
        ({"h": 1.0}, st.DEAD_POINT),
        ({"e": 1.0}, st.SINGULAR),
        ({"a": 0.0}, st.INVALID_INPUT),
        ({"h": math.inf}, st.INVALID_INPUT),
        ({"branch": 0.5}, st.INVALID_INPUT),
    ],
)
def test_inverted_slider_crank_status_explains_every_nan(change, status):
    mechanism = family("inverted_slider_crank")
    design = {"a": 1.0, "e": 2.0, "h": 0.2, "branch": 1.0} | change
    columns = mechanism.poses(
        np.array([list(design.values())]), Angles.of(np.array([[0.0]])), frozenset(mechanism.pose_names)
    )
    assert columns["status"][0, 0] == status
    if status == st.OK:
        assert all(np.isfinite(columns[name][0, 0]) for name in mechanism.pose_names)
    elif status == st.DEAD_POINT:
        assert columns["psi"][0, 0] == pytest.approx(0.5 * math.pi) and np.isnan(columns["dpsi"][0, 0])
    else:
        assert all(np.isnan(columns[name][0, 0]) for name in ("psi", "dpsi", "d3psi", "s", "pressure_angle"))


def test_epicyclic_dwell_with_equal_gears_is_the_geared_dwell_drive():
    phi = np.linspace(0.0, 6.2, 41)
    table = {"k": [1.05, 1.3, 1.7, 0.8], "a": [0.3, 1.2, 0.4, 0.2]}
    names = ["dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "x_b", "y_b"]
    own, other = (sweep.evaluate(f, table, names, phi) for f in ("epicyclic_dwell", "geared_dwell"))
    # differences of plain and of stable forms: no pin of these comes nearer than 0.2 to the axis
    np.testing.assert_allclose(own[names], other[names], atol=1e-11)
    measures = ["dwell_angle", "dwell_deviation", "dwell_band"]
    own, other = (sweep.summarise(f, table, measures, accuracy=1e-9) for f in ("epicyclic_dwell", "geared_dwell"))
    np.testing.assert_allclose(own[measures], other[measures], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("n", "mesh"), [(2.0, 1.0), (3.0, 1.0), (4.0, -1.0), (9.0, -1.0)])
def test_epicyclic_dwell_without_offset_dwells_n_times_a_turn(n, mesh):
    phi = np.linspace(0.0, 0.6, 7)
    frame = [
        sweep.evaluate("epicyclic_dwell", {"k": 1.2, "a": 0.0, "n": n, "mesh": mesh}, ["psi", "d2psi"], p)
        for p in (phi, phi + 2.0 * math.pi / n)
    ]
    turned = np.exp(1j * (frame[1].psi - frame[0].psi - 2.0 * math.pi / n))
    np.testing.assert_allclose(turned, 1.0, atol=1e-13)
    np.testing.assert_allclose(frame[0].d2psi, frame[1].d2psi, atol=1e-11)


def test_epicyclic_dwell_measures_are_what_the_curve_shows():
    table = {"k": [1.2, 1.2], "a": [0.3, 0.1], "n": [3.0, 4.0], "mesh": [1.0, -1.0]}
    measures = sweep.summarise(
        "epicyclic_dwell", table, ["dwell_angle", "dwell_deviation", "dwell_band"], accuracy=1e-9
    )
    for k in range(2):
        design = {name: values[k] for name, values in table.items()}
        half, band = 0.5 * measures.dwell_angle[k], 0.5 * measures.dwell_band[k]
        phi = np.linspace(0.0, half, 20001)
        psi = sweep.evaluate("epicyclic_dwell", design, ["psi"], phi).psi
        assert abs(psi.iloc[-1]) < 1e-12 and psi[1:-1].max() < 0.0
        assert -psi.min() == pytest.approx(measures.dwell_deviation[k], rel=1e-7)  # of the grid: half a cell squared
        end = sweep.evaluate("epicyclic_dwell", design, ["psi"], [band]).psi[0]
        assert end == pytest.approx(measures.dwell_deviation[k], rel=1e-12)


def test_epicyclic_dwell_measures_keep_their_digits_at_short_dwells():
    # equal gears have closed forms; they were 4e-5 off at k = 1 + 1e-12, with 1e-8 asked
    table = {
        "k": [1.0 + 1e-12, 1.0 + 1e-8, 1.0 + 9.239517300141387e-07, 1.1],
        "a": [0.3, -0.9, -0.999999076, 3.0999999],
    }
    measures = ["dwell_angle", "dwell_deviation", "dwell_band"]
    own, other = (sweep.summarise(f, table, measures, accuracy=1e-9) for f in ("epicyclic_dwell", "geared_dwell"))
    np.testing.assert_allclose(own[measures], other[measures], rtol=1e-14)
    # (5) for k next to 1: L phi^3 (L^2 - 1)/6 = (k - 1) L phi
    table = {"k": 1.0 + 2.0**-36, "a": 0.2, "n": [3.0, 8.0, 64.0], "mesh": [1.0, -1.0, 1.0]}
    arm = np.array([4.0, 7.0, 65.0])
    found = sweep.summarise("epicyclic_dwell", table, measures, accuracy=1e-9)
    np.testing.assert_allclose(found.dwell_angle, 2.0 * np.sqrt(6.0 * 2.0**-36 / (arm**2 - 1.0)), rtol=1e-9)


def test_epicyclic_cross_slide_has_the_published_dwell():
    # N. D. Thang: a ring of 4 planet radii, tracer at 11/30 of one: a square whose corners lie at phi = 0, 90 deg ...
    phi = np.linspace(-0.25 * math.pi, 0.75 * math.pi, 200001)
    design = {"k": 11.0 / 30.0, "a": 0.0, "n": 4.0, "mesh": -1.0}
    frame = sweep.evaluate("epicyclic_dwell", design, ["x_b", "y_b"], phi)
    across = (frame.x_b + frame.y_b).to_numpy() / math.sqrt(2.0)  # a slide square to the side at 45 deg
    stroke = 2.0 * across.max()
    for part, degrees in ((0.01, 63.23), (0.001, 43.18)):
        inside = phi[across > across.max() - part * stroke]
        assert math.degrees(inside.max() - inside.min()) == pytest.approx(degrees, abs=0.01)


def test_rocker_of_a_short_frame_keeps_the_digits_of_its_derivatives():
    # It nearly turns with the crank: the acceleration has the frame as a factor and was a difference of numbers near 1,
    # wrong by 2^-53 times crank over frame.  Each output counts alone; 16 as of the other planar loopers, 8 found.
    generator = np.random.default_rng(8)
    name, outputs = "inverted_slider_crank", ["psi", "dpsi", "d2psi", "d3psi", "s", "ds", "d2s"]
    for _ in range(25):
        e, h = 10.0 ** generator.uniform(-6.0, -1.0, 2) * generator.choice([-1.0, 1.0], 2)
        design = {"a": generator.uniform(0.5, 3.0), "e": e, "h": h, "branch": generator.choice([-1.0, 1.0])}
        phi = generator.uniform(-3.0, 3.0)
        expected, row = naive.derivatives(getattr(naive, name), design, phi, 3), evaluated(name, design, outputs, phi)
        sizes = conditions(name, list(design.values()), phi, outputs)
        for output in outputs:
            size = max(sizes[output], abs(float(expected[output])), 1.0 if output == "psi" else 0.0)
            assert float(abs(row[output] - expected[output])) <= 16.0 * 2.0**-53 * size, (output, design, phi)
