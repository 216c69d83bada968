"""Theorems of the literature that hold exactly: Roberts' cognates, Bennett's linkage, Hooke's joints, the wobble drive,
Watt's curve, Freudenstein's collineation axis, Grashof's rule, spherical triangles, Cardan's circles, Hart's inversor,
Scott Russell's line; exercises of textbooks by the vector loops that they pose.

The theorems are closed forms that share no equation with the kernels; tolerances are roundings of float64.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import sweep
from kernels import status as st

ANGLES = np.radians([14.0, 75.0, 120.0, 163.0, 200.0, 255.0, 290.0, 340.0])


def test_cognate_linkage_of_roberts_draws_the_same_coupler_curve() -> None:
    """Roberts 1875, Chebyshev 1878.  The cognate on the crank's pivot turns with the coupler of the first linkage.

    With m = (xi + i eta)/b its links are those of the first in the order b, a, c, e, all turned and stretched by m.
    """
    first = {"a": 2.0, "b": 6.0, "c": 5.0, "e": 6.5, "xi": 3.0, "eta": 2.5, "branch": -1.0}
    path = "x_m, y_m, dx_m, dy_m"
    found = sweep.evaluate("four_bar", first, f"{path}, x_b, y_b, x_c, y_c, psi, omega_z", phi=ANGLES)
    coupler = np.arctan2(found["y_c"] - found["y_b"], found["x_c"] - found["x_b"])
    m = (first["xi"] + 1j * first["eta"]) / first["b"]
    size, turned, arm = abs(m), m / abs(m), abs(m) * first["a"] / m
    cognate = {"a": size * first["b"], "b": size * first["a"], "c": size * first["c"], "e": size * first["e"]}
    cognate |= {"xi": arm.real, "eta": arm.imag, "phi": coupler, "branch": np.sign(np.sin(ANGLES - found["psi"]))}
    second = sweep.evaluate("four_bar", cognate, path)
    there, here = (np.asarray(table["x_m"] + 1j * table["y_m"]) for table in (second, found))
    np.testing.assert_allclose(turned * there, here, atol=5e-14)
    there, here = (np.asarray(table["dx_m"] + 1j * table["dy_m"]) for table in (second, found))
    # The cognate's rates count per angle of its own crank; some of its poses are ten times worse conditioned.
    np.testing.assert_allclose(turned * there * found["omega_z"].to_numpy(), here, atol=1e-12)


def test_linkage_of_bennett_turns_as_its_closed_form() -> None:
    """Bennett 1903: opposite links are equal, the sines of their twists go as their lengths.

    Four hinges move it in space; its joints' points are those of a crank-rocker, one of whose assemblies it is.
    tan(psi/2) is tan(phi/2) times a constant; both assemblies meet where the links are in line.
    """
    twist, long = np.radians(20.0), 1.8
    other = np.arcsin(long * np.sin(twist))
    table = {"a": 1.0, "b": long, "c": 1.0, "e": long, "f": 0.0, "g": 0.0, "alpha": other}
    branch = np.sign(ANGLES - np.pi)
    found = sweep.evaluate("rssr", table | {"phi": ANGLES, "branch": branch}, "psi, dpsi, d2psi")
    k = np.cos((other - twist) / 2.0) / np.cos((other + twist) / 2.0)
    x = np.tan(ANGLES / 2.0)
    np.testing.assert_allclose(np.tan(found["psi"] / 2.0), k * x, rtol=1e-13)
    rate = k * (1.0 + x**2) / (1.0 + (k * x) ** 2)
    np.testing.assert_allclose(found["dpsi"], rate, rtol=1e-13)
    np.testing.assert_allclose(found["d2psi"], rate * x * (1.0 - k**2) / (1.0 + (k * x) ** 2), rtol=1e-12)


@pytest.mark.parametrize(("key", "slowest", "fastest"), [(0.0, 1.0, 1.0), (90.0, None, None)])
def test_two_joints_of_hooke_turn_evenly_if_their_forks_are_in_line(
    key: float, slowest: float | None, fastest: float | None
) -> None:
    """Both at 25 deg; with the middle forks crossed the speed goes from cos^2 to 1/cos^2 of that angle."""
    square = np.cos(np.radians(25.0)) ** 2
    joint = {"a": 1.0, "b": np.sqrt(2.0), "c": 1.0, "e": 0.0, "f": 0.0, "g": 0.0, "alpha": np.radians(25.0)}
    design = {f"{name}{stage}": value for name, value in joint.items() for stage in (1, 2)}
    design["offset2"] = np.radians(key)
    found = sweep.summarise("rssr+rssr", design, "min_dpsi, max_dpsi", accuracy=1e-10).iloc[0]
    assert found["min_dpsi"] == pytest.approx(square if slowest is None else slowest, rel=1e-12)
    assert found["max_dpsi"] == pytest.approx(1.0 / square if fastest is None else fastest, rel=1e-12)


def test_wobble_drive_swings_as_its_closed_form() -> None:
    """Spherical four-bar, a crank of 18 deg and three right angles: tan psi = -tan 18 deg cos phi on one assembly."""
    slope = np.radians(18.0)
    drive = {"a": np.sin(slope), "b": np.sqrt(2.0), "c": 1.0, "e": 0.0, "f": np.cos(slope), "g": 0.0}
    drive["alpha"] = np.pi / 2.0
    found = sweep.evaluate("rssr", drive, "psi", phi=ANGLES)["psi"]
    np.testing.assert_allclose(np.abs(np.tan(found)), np.abs(np.tan(slope) * np.cos(ANGLES)), rtol=1e-13, atol=1e-15)
    turn = sweep.summarise("rssr", drive, "swing, phi0, max_abs_dpsi, max_abs_d2psi, margin", accuracy=1e-10).iloc[0]
    assert abs(turn["swing"]) == pytest.approx(2.0 * slope, rel=1e-14)
    assert turn["phi0"] == pytest.approx(np.pi, rel=1e-14)
    assert turn["max_abs_dpsi"] == pytest.approx(np.tan(slope), rel=1e-14)
    # It is largest at the dead centres.
    assert turn["max_abs_d2psi"] == pytest.approx(np.sin(2.0 * slope) / 2.0, rel=1e-14)
    assert turn["margin"] == pytest.approx(np.cos(slope) ** 2 / 2.0, rel=1e-14)


def test_middle_of_the_coupler_of_watt_draws_his_curve() -> None:
    """Pivots 2 k apart, arms b, coupler 2 c: r^2 = b^2 - (k sin t +- sqrt(c^2 - k^2 cos^2 t))^2 about their middle."""
    b, k, c = 3.0, 3.2, 1.1
    design = {"a": b, "b": 2.0 * c, "c": b, "e": 2.0 * k, "xi": c, "eta": 0.0, "branch": [1.0, -1.0]}
    found = sweep.evaluate("four_bar", design, "x_m, y_m", phi=np.linspace(-0.6, 0.6, 13))
    assert (found["status"] == 0).all()
    x, y = found["x_m"].to_numpy() - k, found["y_m"].to_numpy()
    sine, cosine = y / np.hypot(x, y), x / np.hypot(x, y)
    root = np.sqrt(c**2 - (k * cosine) ** 2)
    misses = [x**2 + y**2 - b**2 + (k * sine + sign * root) ** 2 for sign in (1.0, -1.0)]
    # The root vanishes where a line through the middle touches the curve: some hundred roundings of 10.
    np.testing.assert_allclose(np.min(np.abs(misses), axis=0), 0.0, atol=1e-11)


@pytest.mark.parametrize("extreme", ["max_dpsi", "min_dpsi"])
def test_collineation_axis_is_square_to_the_coupler_where_the_rocker_is_fastest(extreme: str) -> None:
    """Freudenstein 1956: the axis joins the pole of coupler and frame to that of crank and rocker."""
    design = {"a": 1.0, "b": 3.5, "c": 2.7, "e": 3.0, "branch": -1.0}
    phi = sweep.summarise("four_bar", design, f"phi_{extreme}", accuracy=1e-12)[f"phi_{extreme}"]
    pose = sweep.evaluate("four_bar", design, "x_b, y_b, x_c, y_c", phi=phi.to_numpy()).iloc[0]
    crank, rocker_pin = np.array([pose["x_b"], pose["y_b"]]), np.array([pose["x_c"], pose["y_c"]])
    rocker, coupler = rocker_pin - [3.0, 0.0], rocker_pin - crank
    # D + t rocker = u crank, and B + v coupler on the frame line.
    pole = np.linalg.solve(np.column_stack([crank, -rocker]), [3.0, 0.0])[0] * crank
    axis = pole - (crank - crank[1] / coupler[1] * coupler)
    # The place is flat to the root of the accuracy of the value; it comes from a root of the derivative.
    assert axis @ coupler / np.linalg.norm(axis) / np.linalg.norm(coupler) == pytest.approx(0.0, abs=1e-11)


def test_slot_beside_its_pivot_moves_as_its_vector_loop() -> None:
    # Crank 2 at 30 deg, frame 6, slot 4 beside the pivot of the rocker: row a of Norton's table of inverted linkages.
    design = {"a": 2.0, "e": 6.0, "h": -4.0}
    found = sweep.evaluate("inverted_slider_crank", design, "psi, s, dpsi, ds, d2psi, d2s", phi="30 deg").iloc[0]
    pin, slot = 2.0 * np.exp(1j * np.pi / 6.0), np.exp(1j * found["psi"])
    arm = found["s"] - 4.0j
    speed = found["ds"] + 1j * arm * found["dpsi"]
    growth = found["d2s"] + 1j * (arm * found["d2psi"] + found["ds"] * found["dpsi"]) + 1j * speed * found["dpsi"]
    # pin = frame + arm in the slot's direction, and twice its derivative; some ten roundings of 6.
    assert abs(pin - 6.0 - arm * slot) < 1e-14
    assert abs(1j * pin - speed * slot) < 1e-14
    assert abs(-pin - growth * slot) < 1e-14


@pytest.mark.parametrize("branch", [-1, 1])
def test_four_bar_moves_as_its_vector_loop(branch: int) -> None:
    # Row a of Norton's tables of four-bars: frame 6, crank 2 at 30 deg, coupler 7, rocker 9.
    design = {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0, "branch": branch}
    want = "omega_z, dpsi, eps_z, d2psi, psi, x_b, y_b, x_c, y_c"
    found = sweep.evaluate("four_bar", design, want, phi="30 deg").iloc[0]
    crank, rocker = 2.0 * np.exp(1j * np.pi / 6.0), 9.0 * np.exp(1j * found["psi"])
    coupler = 6.0 + rocker - crank
    # The coupler keeps its length and side; crank + coupler = frame + rocker, and twice its derivative.
    assert abs(coupler) == pytest.approx(7.0, rel=1e-15)
    assert math.copysign(1.0, (coupler * np.conj(1j * rocker)).real) == branch
    assert abs(crank + 1j * (found["y_c"] - found["y_b"]) + found["x_c"] - found["x_b"] - 6.0 - rocker) < 5e-15
    assert abs(crank + coupler * found["omega_z"] - rocker * found["dpsi"]) < 5e-15
    turned = [1j * found[eps] - found[omega] ** 2 for eps, omega in (("eps_z", "omega_z"), ("d2psi", "dpsi"))]
    assert abs(coupler * turned[0] - rocker * turned[1] - crank) < 2e-14


def test_engine_moves_as_its_triangle() -> None:
    # Crank 3 at 40 deg, rod 8, an engine of Beer and Johnston: sin(rod) = (a/b) sin(crank), and its derivatives.
    want = "pressure_angle, s, ds, d2s, omega_z, eps_z"
    rod = sweep.evaluate("slider_crank", {"a": 3.0, "b": 8.0}, want, phi="40 deg").iloc[0]
    sine, cosine = math.sin(math.radians(40.0)), math.cos(math.radians(40.0))
    lean = math.asin(3.0 / 8.0 * sine)
    turn = -3.0 * cosine / (8.0 * math.cos(lean))
    bend = (3.0 * sine / 8.0 - turn**2 * math.sin(lean)) / math.cos(lean)
    expected = {
        "pressure_angle": lean, "s": 3.0 * cosine + 8.0 * math.cos(lean), "omega_z": turn, "eps_z": bend,
        "ds": -3.0 * sine + 8.0 * turn * math.sin(lean),
        "d2s": -3.0 * cosine + 8.0 * (bend * math.sin(lean) - turn**2 * math.cos(lean)),
    }  # fmt: skip
    # Some ten roundings.
    assert {name: rod[name] for name in expected} == pytest.approx(expected, rel=1e-14)


def test_linkage_of_three_links_moves_as_its_vector_loop() -> None:
    # Beer and Johnston: AB = 8 + 14 i, BD = 12 + 3 i, ED = -17 + 17 i.
    drawn = sweep.from_points("four_bar", A=[0, 0, 0], B=[8, 14, 0], C=[20, 17, 0], D=[37, 0, 0])
    design = drawn.parameters | {"branch": drawn.branch}
    found = sweep.evaluate("four_bar", design, "omega_z, dpsi, eps_z, d2psi", phi=drawn.phi).iloc[0]
    crank, coupler, rocker = 8.0 + 14.0j, 12.0 + 3.0j, -17.0 + 17.0j
    # Some ten roundings of 25.
    assert abs(crank + coupler * found["omega_z"] - rocker * found["dpsi"]) < 1e-13
    turned = [1j * found[eps] - found[omega] ** 2 for eps, omega in (("eps_z", "omega_z"), ("d2psi", "dpsi"))]
    assert abs(coupler * turned[0] - rocker * turned[1] - crank) < 1e-13


def test_every_four_bar_of_whole_lengths_turns_by_the_rule_of_grashof() -> None:
    """All 9^4 of lengths 1 to 9: the crank passes where frame and crank are in line, or the links touch there."""
    a, b, c, e = np.array(list(itertools.product(range(1, 10), repeat=4)), float).T
    found = sweep.summarise("four_bar", {"a": a, "b": b, "c": c, "e": e}, "rotatable, margin", accuracy=1e-10)
    near, far = np.abs(e - a) - np.abs(b - c), b + c - (e + a)
    turns = (near > 0.0) & (far > 0.0)
    np.testing.assert_array_equal(found["rotatable"], turns)
    touches = ~turns & (near >= 0.0) & (far >= 0.0)
    assert (found["status"][touches] == st.UNDECIDABLE).all() and touches.sum() == 693 and turns.sum() == 1332
    cosines = [(b * b + c * c - x * x) / (2.0 * b * c) for x in (e - a, e + a)]
    margin = np.minimum(1.0 - cosines[0] ** 2, 1.0 - cosines[1] ** 2)
    np.testing.assert_allclose(found["margin"][turns], margin[turns], rtol=0.0, atol=1e-14)  # some ten roundings of 1


@pytest.mark.parametrize("phi", [-90.0, 0.0, 90.0, 180.0])
@pytest.mark.parametrize("branch", [-1.0, 1.0])
def test_spherical_four_bar_stands_by_the_cosine_rule(phi: float, branch: float) -> None:
    """Crank, coupler, rocker and frame are arcs of one sphere; the crank is nearest to the rocker's axis at -90 deg."""
    crank, coupler, rocker, frame = np.random.default_rng(5).uniform(0.1, np.pi - 0.1, (4, 500))
    design = {"a": np.sin(crank), "f": np.cos(crank), "c": np.sin(rocker), "g": np.cos(rocker), "e": np.zeros(500)}
    design |= {"b": 2.0 * np.sin(coupler / 2.0), "alpha": frame, "branch": np.full(500, branch)}
    found = sweep.evaluate("rssr", design | {"phi": np.full(500, np.radians(phi))}, "psi, x_b, y_b")
    angle = np.radians(phi + 90.0)
    diagonal = np.arccos(np.cos(frame) * np.cos(crank) + np.sin(frame) * np.sin(crank) * np.cos(angle))
    cosine = (np.cos(coupler) - np.cos(rocker) * np.cos(diagonal)) / (np.sin(rocker) * np.sin(diagonal))
    reaches = np.abs(cosine) < 1.0
    np.testing.assert_array_equal(found["status"] == st.OK, reaches)
    assert reaches.sum() > 100
    # From the diagonal to the rocker: the triangle's angle, on the side of the branch.  Some ten roundings.
    turned = branch * (found["psi"] - np.arctan2(found["y_b"], found["x_b"]))[reaches]
    np.testing.assert_allclose(np.cos(turned), cosine[reaches], rtol=0.0, atol=2e-14)
    assert (np.sin(turned) > 0.0).all()


def test_pin_of_the_circles_of_cardan_goes_straight_or_along_an_ellipse() -> None:
    """A planet in a ring of twice its size; about the ellipse's centre the link turns as that of a Hooke's joint."""
    drive = {"a": 3.0, "n": 2.0, "mesh": -1.0, "k": [1.0, 0.4]}
    found = sweep.evaluate("epicyclic_dwell", drive, "x_b, y_b, psi, dpsi, d2psi", phi=ANGLES)
    k = np.repeat(drive["k"], len(ANGLES))
    np.testing.assert_allclose(found["x_b"], 3.0 + (1.0 + k) * np.cos(np.tile(ANGLES, 2)), rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(found["y_b"], (1.0 - k) * np.sin(np.tile(ANGLES, 2)), rtol=1e-15, atol=1e-15)
    assert (found.loc[found["design"] == 0, ["y_b", "psi", "dpsi", "d2psi"]] == 0.0).all(axis=None)
    turn = sweep.summarise("epicyclic_dwell", drive | {"a": 0.0, "k": 0.4}, "max_dpsi, min_dpsi", accuracy=1e-12)
    assert turn["max_dpsi"][0] == pytest.approx(1.4 / 0.6, rel=1e-12)
    assert turn["min_dpsi"][0] == pytest.approx(0.6 / 1.4, rel=1e-12)


def test_antiparallelogram_inverts_as_hart_says() -> None:
    """Points that divide crank, frame and coupler alike: O, P, Q in line, OP times OQ = t (1 - t) (b^2 - a^2)."""
    a, b, t = 2.0, 5.0, 0.3
    crossed = np.sign(np.pi - ANGLES)
    design = {"a": a, "b": b, "c": a, "e": b, "xi": t * b, "phi": ANGLES, "branch": crossed}
    found = sweep.evaluate("four_bar", design, "x_b, y_b, x_m, y_m, psi, dpsi")
    o = (1.0 - t) * (found["x_b"] + 1j * found["y_b"])
    product = (found["x_m"] + 1j * found["y_m"] - o) * np.conj((1.0 - t) * b - o)
    np.testing.assert_allclose(product, t * (1.0 - t) * (b * b - a * a), rtol=1e-14)
    # The tangents of the half angles have one ratio.
    half, ratio = np.tan(ANGLES / 2.0), (a + b) / (a - b)
    np.testing.assert_allclose(np.tan(found["psi"] / 2.0) / half, ratio, rtol=1e-13)
    np.testing.assert_allclose(found["dpsi"], ratio * (1.0 + half**2) / (1.0 + (ratio * half) ** 2), rtol=1e-13)


def test_rod_of_an_isosceles_slider_crank_draws_the_line_of_scott_russell() -> None:
    """Crank as long as the rod, in line: the rod's other end, as far behind the crank pin, goes square to the slide."""
    phi = np.radians([-80.0, -50.0, 10.0, 75.0])
    design = {"a": 2.0, "b": 2.0, "x_point": -2.0}
    found = sweep.evaluate("slider_crank", design, "s, ds, d2s, x_p, y_p, dx_p, dy_p, d2x_p, d2y_p", phi=phi)
    sine, cosine = 4.0 * np.sin(phi), 4.0 * np.cos(phi)
    # The pressure angle is the crank angle: up to some forty roundings of 4 at 80 deg.
    for name, expected in (("s", cosine), ("ds", -sine), ("d2s", -cosine), ("y_p", sine), ("dy_p", cosine)):
        np.testing.assert_allclose(found[name], expected, rtol=0.0, atol=2e-14)
    np.testing.assert_allclose(found["d2y_p"], -sine, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found[["x_p", "dx_p", "d2x_p"]], 0.0, atol=1e-13)


def test_five_positions_of_a_coupler_have_its_pins_as_circle_points_of_burmester() -> None:
    """From five poses of the coupler alone, the pins keep their distances from the pivots."""
    design = {"a": 1.4, "b": 4.2, "c": 3.1, "e": 3.9, "branch": -1.0, "xi": 1.9, "eta": 0.8}
    found = sweep.evaluate("four_bar", design, "x_b, y_b, x_c, y_c, x_m, y_m", phi=ANGLES[:5])
    b, c, m = (found[f"x_{pin}"] + 1j * found[f"y_{pin}"] for pin in "bcm")
    turned = (c - b) / 4.2
    for moving, pivot, radius in ((0.0, 0.0, 1.4), (4.2, 3.9, 3.1)):
        np.testing.assert_allclose(np.abs(b + turned * moving - pivot), radius, rtol=1e-14)
    np.testing.assert_allclose(m, b + turned * (1.9 + 0.8j), rtol=1e-14)
