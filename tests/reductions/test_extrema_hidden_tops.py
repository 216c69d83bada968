"""Tops that searches once missed with status OK, each lower than a pose by far more than its error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import chebyshev

import sweep
from kernels import status as st
from sweep.families.names import error_of
from sweep.numerics import panel_search
from sweep.numerics.chebyshev import NODES, basis, product, summits
from sweep.numerics.panel_search import Panels

TURN = 2.0 * np.pi
ROUNDING = 1e-12  # of a value: two ways to one pose

# A ball joint nearly stops where the crank points along the frame: its friction turns over within 5e-5 rad.
TURNING = {
    "a": 17.94521, "b": 95.28113, "c": 52.02574, "e": 62.75325, "f": 13.93756, "g": 13.93742, "alpha": 2.936334e-05,
    "finger": 1.0, "m_crank": 0.0001259783, "com_crank_x": 1.78931, "com_crank_y": 13.02679, "com_crank_z": 5.199414,
    "j_crank_zz": 0.1228815, "m_coupler": 8.596168e-05, "com_coupler_x": 41.17722, "com_coupler_y": 4.684812,
    "com_coupler_z": -4.388265, "j_coupler_xx": 0.006162266, "j_coupler_yy": 0.125842, "j_coupler_zz": 0.07802236,
    "m_rocker": 0.0003464231, "com_rocker_x": 38.60103, "com_rocker_y": 5.530353, "com_rocker_z": 11.53609,
    "j_rocker_xx": 0.3903973, "j_rocker_yy": 0.0682949, "j_rocker_zz": 0.2845561, "gravity_z": -7067.408,
    "load_torque": -783.742, "speed": 585.1545, "mu_a": 0.07560874, "mu_b": 0.1198869, "mu_c": 0.08442335,
    "mu_d": 0.05664647, "radius_a": 12.86511, "radius_b": 3.837004, "radius_c": 3.409199, "radius_d": 4.427434,
    "thrust_radius_a": 2.07764, "thrust_radius_d": 3.809953, "support_a1": -46.65249, "support_a2": -63.51164,
    "support_d1": -26.88519, "support_d2": 33.41417, "tool_force_x": -4.574364, "tool_force_y": -17.06723,
    "tool_force_z": 11.00836, "tool_x": -8.507539, "tool_y": -1.117881, "tool_z": 31.47364,
}  # fmt: skip
STOPPING = {
    "a": 21.65005, "b": 80.82652, "c": 50.38731, "e": 72.43282, "f": 12.45254, "g": 12.42197, "alpha": 0.00968711,
    "branch": -1.0, "m_crank": 0.0001842155, "com_crank_x": -7.430751, "com_crank_y": 1.613024,
    "com_crank_z": -18.08021, "j_crank_zz": 0.1333874, "m_coupler": 9.620274e-05, "com_coupler_x": 63.72174,
    "com_coupler_y": -1.124929, "com_coupler_z": 11.35227, "j_coupler_xx": 0.003222496, "j_coupler_yy": 0.05909258,
    "j_coupler_zz": 0.09832951, "m_rocker": 0.0002548429, "com_rocker_x": 26.66752, "com_rocker_y": 6.628811,
    "com_rocker_z": 9.012801, "j_rocker_xx": 0.2078218, "j_rocker_yy": 0.06984018, "j_rocker_zz": 0.390285,
    "gravity_z": -7339.101, "load_torque": -343.8316, "speed": 759.5112, "mu_a": 0.06540366, "mu_b": 0.1036488,
    "mu_c": 0.09749701, "mu_d": 0.0362672, "radius_a": 6.560649, "radius_b": 3.087184, "radius_c": 6.27146,
    "radius_d": 7.635804, "thrust_radius_a": 1.381532, "thrust_radius_d": 3.407623, "support_a1": -34.06866,
    "support_a2": -60.82598, "support_d1": -17.6982, "support_d2": 27.87848, "tool_force_x": -5.952646,
    "tool_force_y": -23.0001, "tool_force_z": 7.108292, "tool_x": 2.071885, "tool_y": -9.636151, "tool_z": 9.432974,
}  # fmt: skip
# The moment on the frame passes close to zero in the middle of a panel.
PASSING = {
    "a": 18.46184, "b": 91.98046, "c": 56.94053, "e": 73.08672, "f": 13.62978, "g": 13.53486, "alpha": 0.02285933,
    "branch": -1.0, "m_crank": 0.0001355919, "j_crank_zz": 0.2268489, "m_coupler": 0.0001448472,
    "com_coupler_x": 52.77899, "com_coupler_y": 1.781865, "j_coupler_xx": 0.005856055, "j_coupler_yy": 0.1124085,
    "j_coupler_zz": 0.09879429, "m_rocker": 0.0004620962, "com_rocker_x": 20.03614, "j_rocker_xx": 0.1960835,
    "j_rocker_yy": 0.06353941, "j_rocker_zz": 0.3497915, "gravity_z": -11255.71, "load_torque": -419.9006,
    "speed": 782.585, "mu_a": 0.03183316, "mu_b": 0.1062833, "mu_c": 0.06245741, "mu_d": 0.05909257,
    "radius_a": 6.46446, "radius_b": 4.51647, "radius_c": 3.959017, "radius_d": 8.017007, "support_a1": -24.59578,
    "support_a2": -95.49282, "support_d1": -12.80118, "support_d2": 43.95083,
}  # fmt: skip
# A dwell begins 9e-4 rad behind the top of the pressure angle, 3.6e-10 below it.
BEFORE_A_DWELL = {
    "lift": 0.421052413, "rise": 1.80506598, "dwell": 1.78722533, "fall": 1.57764389, "start": 0.229668714,
    "law": 3.0, "r0": 9134.06525, "c": 5.75921698, "e": 9138.01728, "branch": 1.0,
}  # fmt: skip
# Poses between 5.0847 and 5.0878 rad are not found; a turn of 1024 samples steps over that.
GAP = {
    "h_a": 0.24412326043234775, "h_b": 2.7330574692838185, "h_c": 4.173652487226656, "h_e": -4.007643720176322,
    "h_f": 0.0017650494351732118, "h_g": -0.018450279156383944, "h_alpha": 0.3811231096158711,
    "rh": 1.0512385312670232, "dh": 0.4970265577636297, "xE2": -2.7763920011847194, "yE2": 5.904266009383323,
    "rE2": 0.2915165355632413, "dE2": -0.24693392924364027, "xE3": -6.297548476503752, "yE3": -1.712414557037253,
    "rE3": 0.39027229007210523, "dE3": 0.17430272171454034, "f1x": 1.8912246251551674, "f1y": -0.1677609536105573,
    "f2x": -0.5943613407418962, "f2y": 1.1778084700133855, "f3x": 0.5607583713874585, "f3y": -0.38227567830356096,
    "q1": 1.2362248634422701, "q2": 3.4423665172338995, "q3": 3.862404075668435, "x0": -3.8532564918980277,
    "y0": 1.8000311038474457, "chi0": 0.36780405989114023, "h_sigma": -1.0,
}  # fmt: skip

# Two tops stand closer together than two samples, 0.016 and 0.0025 rad; the samples show one.
TWINS = {
    "k": 1.608479486, "a": -0.1978622555, "n": 3.0, "mesh": -1.0, "m_carrier": 1.099555691e-05,
    "m_planet": 6.655382509e-06, "m_link": 1.710511042e-05, "m_tool": 2.130094572e-05, "tool_force_y": -8.878258294,
    "tool_x": 1.05091262, "planet_radius": 1.424655241, "speed": 631.2580826,
}  # fmt: skip
CLOSE_TWINS = {
    "a": 1.653489512, "e": -1.645912541, "f": 0.3989102893, "g": 0.3833156727, "alpha": 0.5214709831,
    "Lw": -3.621771364, "gravity_x": 0.06868948802, "gravity_y": -0.03128765202, "gravity_z": 0.03518066538,
    "m_tool": 0.01877467659, "tool_force_x": 0.03614139272, "tool_force_y": -9.055211669,
    "tool_force_z": 0.0202736093, "speed": 1286.019782, "speed_change": -0.05934607833,
}  # fmt: skip
# The force falls to 2.3 N and rises again within 0.001 rad before a dwell begins, in which it is 4.0 N.
BESIDE_A_DWELL = {
    "lift": 0.2847655157, "rise": 1.516154323, "dwell": 1.634076167, "fall": 1.5121245, "start": -0.06194717157,
    "r0": 3.142854256, "c": 2095.267188, "e": 2096.35893, "branch": -1.0, "m_cam": 1.960478176e-05,
    "m_lever": 8.61223306e-06, "m_tool": 2.229599773e-05, "tool_force_y": -3.968032453, "tool_x": 2.482597182,
    "speed": 297.2732688,
}  # fmt: skip


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8])
@pytest.mark.parametrize(
    ("family", "row", "output", "kind", "place"),
    [
        ("epicyclic_dwell", TWINS, "tool_load", "max", 5.258609919860764),
        ("swivel", CLOSE_TWINS, "tool_load", "max", 3.258325968448641),
        ("cam_lever", BESIDE_A_DWELL, "force_d", "min", 4.598405267519598),
    ],
)
def test_no_pose_beside_what_samples_show_exceeds_the_extremum_by_more_than_its_error(
    family, row, output, kind, place, accuracy
):
    got = sweep.summarise(family, row, [f"{kind}_{output}"], accuracy=accuracy).iloc[0]
    value, sign = got[f"{kind}_{output}"], -1.0 if kind == "min" else 1.0
    poses = sweep.evaluate(family, row, [output], phi=place + np.linspace(-1e-4, 1e-4, 9))[output].to_numpy()
    assert got["status"] == st.OK
    assert (sign * poses).max() <= sign * value + got[f"err_{kind}_{output}"] + ROUNDING * np.abs(poses).max()


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("row", "output", "kind", "place"),
    [
        (TURNING, "moment_a_friction_x", "max", 6.283178856595499),
        (TURNING, "moment_a_friction_y", "max_abs", 6.2831788568610865),
        (TURNING, "finger_couple_friction", "max", 6.2831788566030085),
        (STOPPING, "friction_contraction", "min", 3.152110537236744),
        (PASSING, "moment_a_friction", "min", 1.8161441318209364),
    ],
)
def test_no_pose_where_friction_turns_over_exceeds_the_extremum_by_more_than_its_error(
    row, output, kind, place, accuracy
):
    name = f"{kind}_{output}"
    got = sweep.summarise("rssr", row, [name], accuracy=accuracy).iloc[0]
    near = place + np.array([-1e-4, -1e-5, -1e-6, 0.0, 1e-6, 1e-5, 1e-4])
    poses = sweep.evaluate("rssr", row, [output], phi=near)[output].to_numpy()
    value, sign = got[name], -1.0 if kind == "min" else 1.0
    highest = np.abs(poses).max() if kind == "max_abs" else (sign * poses).max()
    assert got["status"] == st.OK
    assert highest <= sign * value + got[error_of(name)] + ROUNDING * np.abs(poses).max()


def test_the_tip_of_a_tent_anywhere_on_a_panel_is_within_what_the_panel_may_reach():
    """In the middle three of the last coefficients nearly vanish; 1e-12 is the rounding of values near 1."""
    tips = np.linspace(-1.0, 1.0, 4001)
    values = -np.abs(basis()[0] - tips[:, None])
    series = product(values, basis()[1].T)
    none = np.zeros(tips.size)
    held = Panels(none.astype(np.intp), none - 1.0, none + 1.0, series, values.max(axis=1), none, none)
    assert (panel_search._upper(held, 1) >= -1e-12).all()


@pytest.mark.parametrize("mode", [0, 1, -1])
def test_the_highest_point_of_a_polynomial_is_found_wherever_its_tops_are(mode):
    """Against 4001 places; 1e-12 is the rounding of sums of eight terms."""
    random = np.random.default_rng(3)
    series = random.normal(size=(2000, NODES)) * 10.0 ** (-random.uniform(0.0, 1.0, (2000, 1)) * np.arange(NODES))
    place, value = summits(series, mode)
    values = chebyshev.chebval(np.linspace(-1.0, 1.0, 4001), series.T)
    highest = (np.abs(values) if mode == 0 else mode * values).max(axis=1)
    assert (highest <= value + 1e-12 * np.abs(series).sum(axis=1)).all()
    there = chebyshev.chebval(place, series.T, tensor=False)
    np.testing.assert_allclose(np.abs(there) if mode == 0 else mode * there, value, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["max_pressure_angle", "max_abs_pressure_angle"])
def test_a_top_just_before_a_dwell_is_found_to_its_error(name):
    got = sweep.summarise("cam_lever", BEFORE_A_DWELL, [name], accuracy=1e-6).iloc[0]
    near = np.linspace(5.397, 5.4, 301)
    poses = sweep.evaluate("cam_lever", BEFORE_A_DWELL, ["pressure_angle"], phi=near)["pressure_angle"]
    assert got["status"] == st.OK
    assert poses.max() <= got[name] + got[error_of(name)]


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("k", "a", "n", "mesh"),
    [
        (1.5109003630263478, -0.44143896590495213, 32.0, -1.0),  # two samples further stands one of another top
        (1.1160634095337718, -0.10964571465510486, 32.0, -1.0),  # the samples rise past the top
        (1.1538683711754216, -0.15166493424043193, 60.0, -1.0),
        (1.337249768141263, 0.2042551157298044, 48.0, 1.0),
    ],
)
def test_of_two_tops_beside_a_dwell_the_higher_one_is_found(k, a, n, mesh, accuracy):
    """The sine reaches 1 where the angle passes a quarter of a turn; beside it it stops 1e-5 to 4e-7 below."""
    row = {"k": k, "a": a, "n": n, "mesh": mesh}
    got = sweep.summarise("epicyclic_dwell", row, ["max_sin_psi", "min_sin_psi"], accuracy=accuracy).iloc[0]
    assert got["status"] == st.OK
    assert abs(got["max_sin_psi"] - 1.0) <= got["err_max_sin_psi"] + 1e-15  # one rounding of 1
    assert abs(got["min_sin_psi"] + 1.0) <= got["err_min_sin_psi"] + 1e-15


@pytest.mark.parametrize("wanted", ["max_abs_x_t", "rms_x_t", "stroke", "max_determinant"])
def test_a_gap_between_samples_in_which_no_pose_is_found_has_its_status(wanted):
    poses = sweep.evaluate("feed_triad", GAP, ["x_t"], phi=np.linspace(5.083, 5.09, 50))
    assert (poses["status"] != st.OK).any(), "the control: the gap is there"
    assert sweep.summarise("feed_triad", GAP, [wanted], accuracy=1e-6)["status"].iloc[0] != st.OK


@pytest.mark.parametrize(
    "drive",
    [
        {"a": 0.567073, "b": 2.7048, "c": 3.064, "e": 2.13737, "xi": -1.12881, "eta": 0.998897, "lam": -1.90155},
        {"a": 0.906426, "b": 2.9956, "c": 2.20911, "e": 3.60229, "xi": -1.9823, "eta": 1.02632, "lam": -1.52806},
        {"a": 0.226634, "b": 3.05308, "c": 2.97830, "e": 2.63819, "xi": -2.40248, "eta": -0.267198, "lam": 1.82065},
        {"a": 0.427985, "b": 2.19127, "c": 1.7514, "e": 2.3542, "xi": -2.77207, "eta": 0.863569, "lam": -0.839122,
         "branch": -1.0},
    ],
)  # fmt: skip
def test_a_top_between_two_samples_that_are_both_outside_a_narrow_window_counts(drive):
    """The follower passes the window within less than a step of the first samples; ends of the window alone counted."""
    part, drive = (0.2, 0.25), drive | {"h": 0.0}
    found = sweep.summarise("guide", drive, ["max_dev"], accuracy=1e-9, window=part).iloc[0]
    phi = np.linspace(0.0, TURN, 40_000, endpoint=False)
    poses = sweep.evaluate("guide", drive, ["s", "dev"], phi=phi)
    s, dev = poses["s"].to_numpy(), poses["dev"].to_numpy()
    low, high = s.min() + np.array(part) * np.ptp(s)
    assert found.status == st.OK
    assert dev[(s >= low) & (s <= high)].max() <= found.max_dev + found.err_max_dev


# Two tops 1.4 samples apart: the samples rise over the higher one to the lower one, 8e-6 below it.
SHOULDER = {
    "h_a": 0.375058, "h_b": 3.265787, "h_c": 1.932631, "h_e": 3.820732, "h_f": -0.033506, "h_g": 0.034227,
    "h_alpha": -0.007729, "rh": 1.209538, "dh": -0.363911, "xE": 4.344025, "yE": 0.762974, "rE": 0.191921,
    "dE": 0.864060, "q": 2.134218, "fx": -1.719096, "fy": 0.582336, "tx": -0.288098, "ty": 0.935314,
    "tooth": 0.024756, "pitch": -0.031249, "y_plate": 1.745665, "h_sigma": -1.0, "bar_branch": -1.0,
}  # fmt: skip


@pytest.mark.parametrize("target", [1e-3, 1e-5, 1e-8])
def test_a_higher_top_on_the_shoulder_of_another_is_found(target):
    poses = sweep.evaluate("feed", SHOULDER, ["y_f"], phi=np.linspace(0.6, 1.1, 50_001))
    values = poses.y_f.to_numpy()
    inner = values[1:-1]
    tops = inner[(inner > values[:-2]) & (inner >= values[2:])]
    assert len(tops) == 2 and 5e-6 < tops[0] - tops[1] < 1.5e-5
    found = sweep.summarise("feed", SHOULDER, ["max_y_f", "phi_max_y_f"], accuracy=target).iloc[0]
    assert found.status == st.OK and 0.6 < found.phi_max_y_f < 0.75
    # poses 1e-5 rad apart lie 1e-11 below a top at most
    assert abs(found.max_y_f - tops[0]) <= found.err_max_y_f + 1e-11
