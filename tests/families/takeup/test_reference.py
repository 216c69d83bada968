"""Take-ups against plain versions: numerical derivatives in 40 digits, scans, symmetries, plain Python, hard inputs.

Tolerances: 64 x 2^-53 of the lengths a quantity is made of where a closed form meets 40 digits; a scan over the edge in
float64 finds a minimum to the square root of its rounding (1e-7).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp

import sweep
from kernels import status as st
from kernels.effects.thread import guide_line, thread_over_point
from kernels.families import eyelet, free_cam, guided_cam
from kernels.families import guided_cam as cam_motion
from sweep.families import family
from sweep.families.base import Angles
from tests.reference import thread as reference

EYELET = {"a": 2.0, "e": 3.0, "f": 1.0, "alpha": 0.5, "Z1": -3.0, "Z2": 4.0, "phi_h": 0.3, "P_h": 8.0,
          "dX1": 0.2, "dY1": -0.1, "dX2": 0.4, "dY2": 0.3}  # fmt: skip
GUIDED = {"P_h": 60.0, "X1": 3.0, "Z1": 12.0, "e": 5.0, "R0": 30.0, "mu1": 0.15, "mu2": 0.2, "A1": 10.0, "B2": 3.0}
BARE = {"a": 0.4, "X1": 0.83, "Y1": -2.08, "Z1": -3.56, "X2": 3.3, "Y2": -0.85, "Z2": 3.7}
PHI = np.array([-1.3, 0.0, 0.4, 1.9, 3.3, 5.1])


def eyelet_length(design, phi):
    d = {name: mp.mpf(x) for name, x in design.items()}
    place = reference.eyelet_place(d["a"], d["f"], d["alpha"], mp.mpf(phi) + d["phi_h"])
    return reference.length_over(place, (d["e"] + d["dX1"], d["dY1"], d["Z1"]), (d["e"] + d["dX2"], d["dY2"], d["Z2"]))


def test_thread_of_an_eyelet_and_its_derivatives_are_those_of_the_polyline():
    got = sweep.evaluate("eyelet", EYELET, ["P", "L", "dP", "d2P", "wrap", "X_E", "Y_E", "Z_E"], phi=PHI)
    with mp.workdps(40):
        for k, phi in enumerate(PHI):
            length = [mp.diff(lambda x: eyelet_length(EYELET, x), mp.mpf(phi), order) for order in range(3)]
            for name, expected in zip(("L", "dP", "d2P"), length, strict=True):
                assert float(abs(got[name][k] - expected)) <= 64.0 * 2.0**-53 * 10.0
            place = (got.X_E[k], got.Y_E[k], got.Z_E[k])
            turn = reference.turning(place, (3.2, -0.1, -3.0), (3.4, 0.3, 4.0))
            assert got.wrap[k] == pytest.approx(float(turn), rel=1e-14)
    np.testing.assert_array_equal(got.P, got.L - 8.0)


def test_eyelet_on_a_rocker_is_the_second_stage_of_a_chain():
    rocker = {"a1": 10.0, "b1": 40.0, "c1": 25.0, "e1": 35.0, "f1": 5.0, "g1": -3.0, "alpha1": 1.0}
    arm = {"a2": 20.0, "e2": 30.0, "f2": 10.0, "alpha2": 0.5, "Z12": -30.0, "Z22": 40.0, "offset2": 0.7}
    got = sweep.evaluate(["rssr", "eyelet"], rocker | arm, ["P", "dP", "d2P"], phi=PHI)
    alone = {name[:-1]: x for name, x in rocker.items()}
    turn = sweep.evaluate("rssr", alone, ["psi", "dpsi", "d2psi"], phi=PHI)
    own = {name[:-1]: x for name, x in arm.items() if name != "offset2"}
    thread = sweep.evaluate("eyelet", own, ["P", "dP", "d2P"], phi=turn.psi.to_numpy() + 0.7)
    np.testing.assert_allclose(got.P, thread.P, rtol=1e-13)
    np.testing.assert_allclose(got.dP, thread.dP * turn.dpsi, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(got.d2P, thread.d2P * turn.dpsi**2 + thread.dP * turn.d2psi, rtol=1e-10, atol=1e-11)


def test_feed_of_a_coupler_point_is_the_length_over_its_places():
    linkage = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "xi": 30.0, "eta": 12.0, "lam": 0.0, "h": 0.0}
    guides = {"X1": 20.0, "Y1": 60.0, "Z1": -5.0, "X2": 50.0, "Y2": 45.0, "Z2": 8.0}
    step = 1e-3
    phi = 0.7 + step * np.arange(-3, 4)
    at = sweep.evaluate("guide", linkage, ["x_m", "y_m"], phi=phi)
    rates = sweep.evaluate("guide", linkage, ["ds", "d2s"], phi=phi)  # lam = 0: along x
    across = sweep.evaluate("guide", linkage, ["ddev", "d2dev"], phi=phi)
    table = guides | {"X_E": at.x_m, "Y_E": at.y_m, "Z_E": 0.0, "dX_E": rates.ds, "dY_E": across.ddev, "dZ_E": 0.0,
                      "d2X_E": rates.d2s, "d2Y_E": across.d2dev, "d2Z_E": 0.0}  # fmt: skip
    got = sweep.thread.feed(table)
    # Central differences of sixth order; h^6 = 1e-18, rounding 1e-13/h, 1e-13/h^2.
    length = got.L.to_numpy()
    slope = np.array([-1, 9, -45, 0, 45, -9, 1]) @ length / (60.0 * step)
    bend = np.array([2, -27, 270, -490, 270, -27, 2]) @ length / (180.0 * step * step)
    assert got.dL_dphi[3] == pytest.approx(slope, abs=1e-9)
    assert got.d2L_dphi2[3] == pytest.approx(bend, abs=1e-6)


def test_eyelet_takes_up_the_same_thread_with_exchanged_guides_and_in_the_mirror():
    base = {name: x for name, x in EYELET.items() if not name.startswith("d")}
    wanted = ["P", "dP", "d2P", "wrap"]
    one = sweep.evaluate("eyelet", base, wanted, phi=PHI)
    exchanged = base | {"Z1": base["Z2"], "Z2": base["Z1"]}
    mirrored = base | {"alpha": -base["alpha"], "Z1": -base["Z1"], "Z2": -base["Z2"], "f": -base["f"]}  # z -> -z
    for other in (exchanged, mirrored):
        got = sweep.evaluate("eyelet", other, wanted, phi=PHI)
        np.testing.assert_allclose(got[wanted], one[wanted], rtol=4e-15, atol=1e-15)
    half = sweep.evaluate("eyelet", base | {"alpha": -base["alpha"]}, wanted, phi=PHI)
    assert not np.allclose(half[wanted], one[wanted])  # a mirror of the axis alone is another take-up


@pytest.mark.parametrize(("name", "base"), [("eyelet", EYELET), ("guided_cam", GUIDED), ("free_cam", BARE)])
def test_take_up_scales_with_its_lengths_bit_for_bit(name, base):
    found = family(name)
    lengths = {p.name for p in found.parameters if p.unit == "length"}
    larger = {key: x * (2.0**40 if key in lengths else 2.0**-40 if key == "a" else 1.0) for key, x in base.items()}
    wanted = [o.name for o in found.pose_outputs if o.unit == "length"]
    others = [o.name for o in found.pose_outputs if o.unit in ("rad", "1")]
    one, two = (sweep.evaluate(name, table, wanted + others, phi=PHI) for table in (base, larger))
    np.testing.assert_array_equal(two[wanted], one[wanted] * 2.0**40)
    np.testing.assert_array_equal(two[others], one[others])


@pytest.mark.parametrize(("name", "base"), [("eyelet", EYELET), ("guided_cam", GUIDED), ("free_cam", BARE)])
def test_gradient_by_the_complex_step_is_that_of_differences(name, base):
    found = family(name)
    names = frozenset(o.name for o in found.pose_outputs if not o.jumps)
    defaults = {p.name: p.default for p in found.parameters}
    row = np.array([[(defaults | base)[p] for p in found.parameter_names]])
    angles = Angles.of(np.array([[0.1, 0.4, 5.6]]))
    for k in range(row.shape[1]):
        h, moved = 1e-6 * (1.0 + abs(row[0, k])), row.astype(complex)
        moved[0, k] += 1e-30j
        up, down = row.copy(), row.copy()
        up[0, k] += h
        down[0, k] -= h
        if (down < 0.0).any() and found.parameters[k].not_negative:
            continue
        exact = found.poses(moved, angles, names)
        ahead, behind = (found.poses(x, angles, names) for x in (up, down))
        for output in names:
            slope = (ahead[output] - behind[output]) / (2.0 * h)
            size = 1.0 + np.abs(exact[output].real)
            # Central differences: rounding 1e-16/h and h^2 of the third derivative.
            np.testing.assert_allclose(exact[output].imag / 1e-30, slope, rtol=1e-6, atol=float(3e-9 * size.max()))


def test_eyelet_at_a_guide_is_singular_and_names_it():
    met = {"a": 1.0, "e": 1.0, "f": 0.0, "alpha": 0.0, "Z1": 0.0, "Z2": 3.0}
    got = sweep.evaluate("eyelet", met, ["P", "dP", "wrap"], phi=[0.0, 1.0])
    assert list(got.status) == [st.SINGULAR, st.OK]
    assert got.iloc[0][["P", "dP", "wrap"]].isna().all()


@settings(deadline=None, max_examples=60)
@given(
    wrap=some.floats(-9.0, -0.5).map(lambda x: 10.0**x), end=some.booleans(), r1=some.floats(0.1, 9.0),
    r2=some.floats(0.1, 9.0),
)  # fmt: skip
def test_wrap_keeps_its_digits_for_straight_and_folded_threads(wrap, end, r1, r2):
    # The eyelet is the origin: no rounding of differences, whatever is lost is lost by the formula.
    angle = math.pi - wrap if end else wrap
    guide = (r2 * math.cos(angle), r2 * math.sin(angle), 0.0)
    got = sweep.thread.wrap({"X1": -r1, "Y1": 0.0, "Z1": 0.0, "X2": guide[0], "Y2": guide[1], "Z2": 0.0,
                             "X_E": 0.0, "Y_E": 0.0, "Z_E": 0.0})  # fmt: skip
    with mp.workdps(40):
        expected = mp.atan2(mp.mpf(guide[1]), mp.mpf(guide[0]))
        error = abs(got.wrap[0] - expected) / (mp.pi - expected if end else expected)
    # Near pi the angle itself is rounded to 2^-52; its supplement is not asked for.
    assert float(error) <= (4.0 * 2.0**-53 * math.pi / wrap if end else 8.0 * 2.0**-53)


def test_sine_of_half_the_wrap_is_equation_26_with_its_misprint_mended():
    table = {"X1": -2.0, "Y1": 1.0, "Z1": 0.5, "X2": 3.0, "Y2": -1.0, "Z2": 2.0, "X_E": 1.0, "Y_E": 4.0, "Z_E": -1.0}
    got = sweep.thread.wrap(table).iloc[0]
    length, c, x, y = got.L, got.half_distance_c, got.x, got.y
    mended = 1.0 / (2.0 * length * math.sqrt(x**2 / (length**2 - 4 * c**2) ** 2 + y**2 / length**4))
    printed = length / (length**2 - 4 * c**2) / math.sqrt(x**2 / (length**2 - 4 * c**2) + y**2 / length**4)
    assert math.sin(0.5 * got.wrap) == pytest.approx(mended, rel=1e-13)
    assert abs(printed - mended) > 0.1


def test_weighted_difference_is_the_length_error_to_first_order():
    base = {name: x for name, x in EYELET.items() if not name.startswith("d")} | {"phi": 0.9}
    exact = sweep.thread.eyelet(base)
    for error in (1e-3, 1e-5):
        got = sweep.thread.eyelet(base | {"P": exact.L[0] - 8.0 + error})
        assert got.length_error[0] == pytest.approx(error, rel=1e-9)
        assert got.dq[0] == pytest.approx(got.weight[0] * error, rel=2.0 * error)


def test_weighted_difference_is_refused_where_the_guides_are_off_their_line():
    designs = np.array([list(EYELET.values())])
    out = np.empty((1, 1)), np.empty((1, 1)), np.empty((1, 1), np.uint8)
    eyelet.weighted_difference(designs, np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), *out)
    assert out[2][0, 0] == st.INVALID_INPUT
    assert np.isnan(out[0][0, 0])


def test_length_sensitivities_of_the_eyelet_are_those_of_the_complex_step():
    designs = np.array([list(EYELET.values())])
    phi = PHI[None]
    jacobian, status = np.empty((7, 1, PHI.size)), np.empty((1, PHI.size), np.uint8)
    eyelet.length_sensitivities(designs, np.cos(phi), np.sin(phi), jacobian, status)
    for k in range(7):
        moved = designs.astype(complex)
        moved[0, k] += 1e-30j
        exact = family("eyelet").poses(moved, Angles.of(phi), frozenset({"L"}))["L"].imag / 1e-30
        np.testing.assert_allclose(jacobian[k], exact, rtol=1e-13, atol=1e-14)


def guided_displacement(phi):
    p = 10 * mp.cos(phi) + 3 * mp.sin(2 * phi)
    return reference.follower(60 + p, mp.mpf(12), mp.mpf(2))


def test_follower_of_the_guided_cam_and_its_profile_are_those_of_plain_geometry():
    got = sweep.evaluate("guided_cam", GUIDED, ["S", "dS", "d2S", "pressure_angle", "X_P", "Y_P", "curvature"], phi=PHI)
    least = sweep.summarise("guided_cam", GUIDED, ["least_displacement"], accuracy=1e-8).least_displacement[0]
    with mp.workdps(40):
        for k, phi in enumerate(PHI):
            for order, name in enumerate(("S", "dS", "d2S")):
                expected = mp.diff(guided_displacement, mp.mpf(phi), order)
                assert float(abs(got[name][k] - expected)) <= 64.0 * 2.0**-53 * 60.0

            def point(x):
                radius = 30 + guided_displacement(x) - mp.mpf(least)
                return radius * mp.cos(x), -radius * mp.sin(x)

            x, y = point(mp.mpf(phi))
            assert float(abs(got.X_P[k] - x) + abs(got.Y_P[k] - y)) <= 1e-13
            dx, dy = (mp.diff(lambda t, c=c: point(t)[c], mp.mpf(phi)) for c in (0, 1))
            ax, ay = (mp.diff(lambda t, c=c: point(t)[c], mp.mpf(phi), 2) for c in (0, 1))
            # The follower moves along the radius; the pressure angle is between it and the normal of the profile.
            normal = abs((-dy * x + dx * y) / mp.sqrt((dx**2 + dy**2) * (x**2 + y**2)))
            assert got.pressure_angle[k] == pytest.approx(float(mp.acos(normal)), abs=1e-10)
            curvature = -(dx * ay - dy * ax) / mp.sqrt(dx**2 + dy**2) ** 3
            assert got.curvature[k] == pytest.approx(float(curvature), rel=1e-10)


def test_least_radius_of_the_guided_cam_brings_the_pressure_angle_to_the_jamming_angle():
    tight = GUIDED | {"mu1": 0.6, "mu2": 0.7}
    size = sweep.summarise("guided_cam", tight, ["least_radius", "phi_least_radius", "jam_angle"], accuracy=1e-8)
    assert size.least_radius[0] > 1.0
    at = tight | {"R0": size.least_radius[0]}
    got = sweep.summarise("guided_cam", at, ["max_pressure_angle"], accuracy=1e-8)
    assert got.max_pressure_angle[0] == pytest.approx(size.jam_angle[0], rel=1e-9)
    there = sweep.evaluate("guided_cam", at, ["pressure_angle"], phi=[size.phi_least_radius[0]])
    assert there.pressure_angle[0] == pytest.approx(size.jam_angle[0], rel=1e-12)


def test_the_profile_of_the_guided_cam_counts_from_the_deepest_of_several_valleys():
    """Of six valleys one stands on a sample of the search, the two deepest between samples."""
    row = GUIDED | {"A1": 0.02, "B2": 0.0, "A6": 2.0, "mu1": 0.6, "mu2": 0.7}
    found = sweep.summarise("guided_cam", row, ["least_displacement", "least_radius"], accuracy=1e-8).iloc[0]
    turn = sweep.evaluate("guided_cam", row, ["S", "dS"], phi=np.linspace(0.0, 2.0 * np.pi, 200_001))
    least, jams = turn.S.min(), math.tan(math.atan2(1.0 - 0.42, 1.3))
    # poses 3e-5 rad apart miss the top of a wave of order 6 by 36 x (1.6e-5)^2/2 = 5e-9 of its height, here 2.5
    assert abs(found.least_displacement - least) <= 2e-8
    assert abs(found.least_radius - (np.abs(turn.dS) / jams - (turn.S - least)).max()) <= 1e-7


@settings(deadline=None, max_examples=50)
@given(mu1=some.floats(0.0, 0.9), mu2=some.floats(0.0, 0.9))
def test_jamming_angle_solves_the_equilibrium_of_the_follower_and_the_printed_root_its_complement(mu1, mu2):
    got = sweep.thread.follower({"L": 5.0, "Z1": 1.0, "e": 0.0, "X1": 0.0, "mu1": mu1, "mu2": mu2}).iloc[0]
    theta = got.theta_jam
    assert math.cos(theta) - mu1 * math.sin(theta) == pytest.approx(
        mu2 * (math.sin(theta) + mu1 * math.cos(theta)), abs=1e-15
    )
    assert got.tan_half_theta_jam == pytest.approx(math.tan(0.5 * theta), rel=1e-14)
    both = mu1 + mu2
    if both > 1e-3:
        # (29) as printed: tan(theta/2) = (-1 + sqrt(1 + both^2))/both; its tangent is both, without mu1 mu2.
        printed = 2.0 * math.atan((-1.0 + math.sqrt(1.0 + both**2)) / both)
        assert math.tan(printed) == pytest.approx(both, rel=1e-9)
        complement = 0.5 * math.pi - printed
        assert complement == pytest.approx(math.atan2(1.0, both), rel=1e-9)
        assert abs(complement - theta) == pytest.approx(
            abs(math.atan(mu1) + math.atan(mu2) - math.atan(both)), abs=1e-12
        )


def test_follower_says_when_the_thread_is_too_short_or_just_long_enough():
    got = sweep.thread.follower({"L": [6.0, 10.0, 11.0], "dL": 1.0, "Z1": 3.0, "e": 4.0, "X1": 0.0})
    assert list(got.status) == [st.NOT_ASSEMBLED, st.DEAD_POINT, st.OK]
    assert np.isnan(got.S[0]) and got.S[1] == 0.0 and np.isnan(got.dS[1])


def test_guided_cam_whose_thread_is_too_short_somewhere_has_no_profile_anywhere():
    short = GUIDED | {"P_h": 30.0}
    got = sweep.evaluate("guided_cam", short, ["S", "X_P"], phi=[0.0, 3.1])
    assert list(got.status) == [st.NOT_ASSEMBLED, st.NOT_ASSEMBLED]
    assert np.isfinite(sweep.evaluate("guided_cam", short, ["S"], phi=[0.0]).S[0])
    assert sweep.summarise("guided_cam", short, ["least_radius"], accuracy=1e-8).status[0] == st.NOT_ASSEMBLED


def test_compiled_take_ups_equal_plain_python_bit_for_bit():
    phi = np.linspace(0.0, 6.0, 5)[None]
    cos, sin = np.cos(phi), np.sin(phi)
    matrices = {
        name: np.array(
            [[({p.name: p.default for p in family(name).parameters} | base)[p] for p in family(name).parameter_names]]
        )
        for name, base in (("eyelet", EYELET), ("guided_cam", GUIDED), ("free_cam", BARE))
    }
    friction, place = np.array([[1.4, 0.1, 0.25]]), np.cos(np.arange(15.0).reshape(1, 5, 3))
    calls = [
        (eyelet.poses, (matrices["eyelet"], cos, sin), 8, True),
        (guided_cam.poses, (matrices["guided_cam"], cos, sin), 10, True),
        (free_cam.poses, (matrices["free_cam"], cos, sin), 10, True),
        (free_cam.limit_points, (matrices["free_cam"], friction, cos, sin), 2, True),
        (free_cam.march, (friction, 2, matrices["free_cam"], cos, sin), 5, True),
        (eyelet.length_sensitivities, (matrices["eyelet"], cos, sin), 0, False),
        (thread_over_point, (np.ones((1, 6)), place, 0.0 * place + 1.0, 0.0 * place - 1.0), 4, True),
    ]  # fmt: skip
    for kernel, arguments, count, first in calls:
        results = []
        for function in (kernel, kernel.py_func):
            status, outputs = np.zeros((1, 5), np.uint8), [np.empty((1, 5)) for _ in range(count)]
            if kernel is guided_cam.poses:
                outputs[-1] = np.empty((2, 1, 5))
            if first:
                records = {
                    eyelet.poses: eyelet.Outputs, guided_cam.poses: cam_motion.Outputs,
                    free_cam.poses: free_cam.Outputs, free_cam.march: free_cam.MarchOutputs,
                }  # fmt: skip
                record = records.get(kernel)
                given = [record(*outputs)] if record else outputs
                function(*arguments, status, *given)
            else:
                outputs = [np.empty((7, 1, 5))]
                function(*arguments, *outputs, status)
            results.append([status, *outputs])
        for compiled, plain in zip(*results, strict=True):
            np.testing.assert_array_equal(compiled, plain)
    lines = []
    for function in (guide_line, guide_line.py_func):
        out = [np.empty(1) for _ in range(3)]
        function(np.arange(6.0)[None] ** 2, np.array([[1.0, 5.0, -2.0]]), *out)
        lines.append(out)
    np.testing.assert_array_equal(*lines)


def test_mean_tension_of_a_thread_that_changes_its_place_on_the_edge_is_within_its_error():
    """The tension has the jumps and kinks of the wrap: it was taken for smooth, and off by 3e-6 beside 1e-10."""
    row = {"a": 0.384, "X1": 0.9954, "Y1": -2.0974, "Z1": -4.1689, "X2": 3.6722, "Y2": -0.7207, "Z2": 3.5398,
           "thread_tension": 82.1, "eyelet_radius": 3.263}  # fmt: skip
    n = 200_000
    poses = sweep.evaluate("free_cam", row, ["tension"], phi=(np.arange(n) + 0.5) * 2.0 * np.pi / n)
    exact = np.sqrt((poses.tension**2).mean())
    found = sweep.summarise("free_cam", row, ["rms_tension"], accuracy=1e-8).iloc[0]
    assert found.status == st.OK
    # a jump of 0.4 moves the mean of so many poses by 1e-8
    assert abs(found.rms_tension - exact) <= found.err_rms_tension + 5e-8 * exact
