"""What lies between the first samples of a turn: short phases, fast waves, narrow peaks and jumps, kinks, chance.

Each of these was once missed with status OK: a value that is no extremum, or a mean far from the true one.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs
from sweep.effects import extended
from sweep.families import family
from sweep.families.base import Family, Output, Parameter
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema
from sweep.reductions.refine import first_peaks, sharpen

TURN = 2.0 * np.pi
TARGET = 1e-6
FINE = np.linspace(0.0, TURN, 40_000, endpoint=False) + 1e-5
# A grid finds no more than the extremum, and of a smooth curve nearly as much.
NEARLY = 1e-4


def summary(mechanism, table, want, **more):
    return sweep.summarise(mechanism, table, want, accuracy=TARGET, **more).iloc[0]


def curve(mechanism, table, output, phi=FINE, **more):
    return sweep.evaluate(mechanism, table, [output], phi=phi, **more)[output].to_numpy()


def assert_largest(found, output, values, nearly=NEARLY):
    """No pose is higher than the maximum allows, and some pose is nearly as high; the estimate keeps the target."""
    value, err = found[f"max_abs_{output}"], found[f"err_max_abs_{output}"]
    assert found["status"] == st.OK
    assert value - err <= np.abs(values).max() * (1.0 + nearly)
    assert np.abs(values).max() <= value + err
    assert err <= 2.0 * TARGET * value


@pytest.mark.parametrize("rise", [0.05, 0.01])
@pytest.mark.parametrize("start", [0.1, 1.0, 2.03])
def test_a_rise_between_two_samples_has_its_stroke_and_its_largest_acceleration(rise, start):
    """Of the 3-4-5 polynomial the largest second derivative is 10/sqrt(3) lifts over the square of the rise."""
    cam = {"lift": 0.05, "rise": rise, "dwell": 0.0, "fall": rise, "start": start, "law": 1.0, "r0": 3.0, "e": 0.1}
    found = summary("cam", cam, ["max_abs_d2s", "stroke", "max_s"])
    assert found["status"] == st.OK
    exact = 0.05 * 10.0 / np.sqrt(3.0) / rise**2
    for name, true in (("max_abs_d2s", exact), ("stroke", 0.05), ("max_s", 0.05)):
        assert abs(found[name] - true) <= found[f"err_{name}"] <= 2.0 * TARGET * true
    lever = summary("cam_lever", cam | {"c": 5.0, "e": 6.0, "branch": 1.0}, ["swing", "max_abs_dpsi"])
    assert lever["status"] == st.OK
    assert abs(abs(lever["swing"]) - 0.05) <= lever["err_swing"] + 1e-14
    # 15/8 lifts over the rise; the lever's angle is small, so its sine does not matter.
    assert abs(lever["max_abs_dpsi"] - 0.05 * 1.875 / rise) <= lever["err_max_abs_dpsi"]


@pytest.mark.parametrize("rise", [1.465, 0.3])
def test_the_mean_of_a_jerk_that_jumps_is_that_of_its_closed_form(rise):
    """Cycloidal: (2 pi)^2 cos(2 pi x) lifts over the cube of rise or fall."""
    cam = {"lift": 1.0, "rise": rise, "dwell": 1.45, "fall": 1.57, "start": -0.04, "law": 3.0, "r0": 2.6, "e": 0.4}
    found = sweep.summarise("cam", cam, ["rms_d3s"], accuracy=1e-4).iloc[0]
    exact = np.sqrt((TURN**4 / 2.0) * (rise**-5.0 + 1.57**-5.0) / TURN)
    assert found["status"] == st.OK
    assert abs(found["rms_d3s"] - exact) <= found["err_rms_d3s"] <= 1e-4 * exact


@pytest.mark.parametrize("distance", [1.3e-4, 1e-3])
def test_a_thread_that_comes_to_lie_beside_a_guide_next_to_the_plane_of_the_cam_has_its_peak(distance):
    cam = {"a": 0.576, "X1": 0.1513, "Y1": 0.8186, "Z1": distance, "X2": 0.3376, "Y2": 0.9163, "Z2": -7.37}
    share = distance / (distance + 7.37)
    x, y = 0.1513 + share * (0.3376 - 0.1513), 0.8186 + share * (0.9163 - 0.8186)

    def depth(phi):  # of the straight line between the guides in the material
        return x * np.cos(phi) + y * np.sin(phi) - 0.576 * (y * np.cos(phi) - x * np.sin(phi)) ** 2

    begins = brentq(depth, 0.0, 1.0)
    near = begins + np.geomspace(1e-9, 0.1, 4000)
    found = summary("free_cam", cam, ["max_abs_d2P", "max_d2P"])
    assert_largest(found, "d2P", curve("free_cam", cam, "d2P", near))
    assert abs(found["max_d2P"] - found["max_abs_d2P"]) <= found["err_max_d2P"]


@pytest.mark.parametrize(("n", "mesh"), [(31.0, 1.0), (35.0, 1.0), (53.0, -1.0), (63.0, 1.0)])
def test_a_planet_that_turns_as_fast_as_samples_stand_is_seen(n, mesh):
    drive = {"k": 1.17, "a": 0.2, "n": n, "mesh": mesh}
    found = summary("epicyclic_dwell", drive, ["max_abs_y_b", "max_abs_d2psi", "rms_d2psi"])
    for output in ("y_b", "d2psi"):
        assert_largest(found, output, curve("epicyclic_dwell", drive, output))
    exact = np.sqrt((curve("epicyclic_dwell", drive, "d2psi") ** 2).mean())
    assert abs(found["rms_d2psi"] - exact) <= found["err_rms_d2psi"] + 1e-12 * exact


@pytest.mark.parametrize("ratio", [33, -31, 64])
def test_a_member_that_turns_as_fast_as_samples_stand_is_seen(ratio):
    members = {"needle": "slider_crank", "looper": {"family": "rssr", "ratio": ratio, "tip": [30.0, 0.0, 0.0]}}
    machine = sweep.machine(members, {"clearance": {"distance": ["needle.c", "looper.tip"]}})
    table = {f"needle.{k}": v for k, v in family("slider_crank").example.items()}
    table |= {f"looper.{k}": v for k, v in family("rssr").example.items()} | {"looper.x_at": 40.0, "looper.z_at": 20.0}
    found = summary(machine, table, ["max_abs_clearance", "min_clearance", "rms_clearance"])
    values = curve(machine, table, "clearance")
    assert_largest(found, "clearance", values)
    assert (
        found["min_clearance"] - found["err_min_clearance"] <= values.min() <= found["min_clearance"] * (1.0 + NEARLY)
    )
    exact = np.sqrt((values**2).mean())
    assert abs(found["rms_clearance"] - exact) <= found["err_rms_clearance"] + 1e-10 * exact


def loaded(name, outputs):
    full = extended(family(name), outputs)
    return dict(zip(full.parameter_names, map(float, designs(full, 1)[0]), strict=True))


def test_a_load_of_as_many_waves_as_samples_has_its_mean():
    row, loads = loaded("rssr", ["drive_torque"]), {"load_torque": {"mean": 0.0, "cos": [0.0] * 63 + [3000.0]}}
    found = summary("rssr", row, ["rms_drive_torque"], loads=loads)
    exact = np.sqrt((curve("rssr", row, "drive_torque", loads=loads) ** 2).mean())
    assert abs(found["rms_drive_torque"] - exact) <= found["err_rms_drive_torque"] + 1e-10 * exact


@pytest.mark.parametrize("at", [1.0, 2.05, 4.4])
def test_a_short_load_of_a_table_counts(at):
    """A force over 0.06 rad, a third of what two samples span, larger than all else."""
    row = loaded("rssr", ["drive_torque"])
    loads = {"load_torque": ([0.0, at - 0.03, at, at + 0.03, 6.0], [0.0, 0.0, 300000.0, 0.0, 0.0])}
    found = summary("rssr", row, ["max_abs_drive_torque", "rms_drive_torque"], loads=loads)
    values = curve("rssr", row, "drive_torque", loads=loads)
    assert_largest(found, "drive_torque", values)
    # Of a curve with kinks the even sum errs by the square of the spacing.
    exact = np.sqrt((values**2).mean())
    assert abs(found["rms_drive_torque"] - exact) <= found["err_rms_drive_torque"] + 1e-6 * exact


@pytest.mark.parametrize("share", [0.1, 0.01, 1e-3, 1e-5])
def test_a_tool_that_pierces_just_before_its_turning_point_is_loaded_there(share):
    row = loaded("guide", ["tool_load", "drive_torque"])
    ends = summary("guide", row, ["max_s", "min_s"])
    stroke = ends["max_s"] - ends["min_s"]
    row |= {"pierce_force": 400.0, "pierce_at": ends["max_s"] - share * stroke, "pierce_sense": 1.0, "m_tool": 1e-9}
    wanted = ["max_abs_tool_load", "rms_tool_load", "max_abs_drive_torque"]
    found = summary("guide", row, wanted)
    values = curve("guide", row, "tool_load")
    assert_largest(found, "tool_load", values)
    # The force acts from its entry to the turning point: a grid knows both to a pose.
    pierced = (np.abs(values) > 200.0).mean()
    assert abs((found["rms_tool_load"] / 400.0) ** 2 - pierced) <= 2.0 / FINE.size
    # In one table with a tool that does not pierce both have the bits that they have alone.
    idle = summary("guide", row | {"pierce_force": 0.0}, wanted)
    both = {name: [value, value] for name, value in row.items()} | {"pierce_force": [0.0, 400.0]}
    together = sweep.summarise("guide", both, wanted, accuracy=TARGET)
    for name in together:
        assert together[name].tolist() == [idle[name], found[name]]


@pytest.mark.parametrize("gap", [0.02, 0.01, 0.003])
def test_an_eyelet_that_passes_close_to_a_guide_has_its_narrow_peak(gap):
    take_up = {"a": 2.0, "e": 2.0 + gap, "f": 0.0, "alpha": 0.0, "Z1": 0.0, "Z2": 4.0, "phi_h": 1.08}
    found = summary("eyelet", take_up, ["max_abs_d2P", "rms_d2P"])
    values = curve("eyelet", take_up, "d2P")
    assert_largest(found, "d2P", values, nearly=5e-3)
    exact = np.sqrt((values**2).mean())  # a periodic curve, and 30 poses in the width of its peak
    assert abs(found["rms_d2P"] - exact) <= found["err_rms_d2P"] + 1e-9 * exact


def locking(gap):
    """A feed rack whose lift coupler comes close to lying in line with the rack; where, and how close."""
    rack = dict(family("feed").example)
    found = sweep.evaluate("feed", rack, ["x_h", "y_h", "x_e", "y_e"], phi=FINE)
    away = np.hypot(found["x_h"] - found["x_e"], found["y_h"] - found["y_e"]).to_numpy()
    return rack | {"q": (away.max() - np.hypot(rack["fx"], rack["fy"])) * (1.0 + gap)}, FINE[away.argmax()]


@pytest.mark.parametrize("gap", [1e-4, 1e-5, 1e-6])
def test_a_feed_rack_close_to_locking_has_its_narrow_peak(gap):
    rack, place = locking(gap)
    found = summary("feed", rack, ["max_abs_d2chi", "rms_dchi"])
    near = place + 20.0 * np.sqrt(gap) * np.linspace(-1.0, 1.0, 8001)
    assert_largest(found, "d2chi", curve("feed", rack, "d2chi", near))


@pytest.mark.parametrize(
    ("name", "design", "output"),
    [
        ("swivel", {"a": 1.0, "e": 1.003, "f": 2e-3, "g": 0.0, "alpha": 0.0, "Lw": 2.0}, "d2y_p"),
        ("inverted_slider_crank", {"a": 1.0, "e": 1.003, "h": 0.0}, "d2psi"),
        ("slotted", {"a": 1.0, "e": 1.00003}, "d2psi"),
        ("epicyclic_dwell", {"k": 1.9, "a": -0.103, "n": 1.0}, "d2psi"),
    ],
)
def test_a_pin_that_passes_close_to_what_it_turns_has_its_narrow_peak(name, design, output):
    """The swivel, the slot and the slotted link turn within a few thousandths of a radian, at phi = 0."""
    found = summary(name, design, [f"max_abs_{output}", f"rms_{output}"])
    near = np.pi * np.linspace(-1.0, 1.0, 200_001) ** 5
    values = curve(name, design, output, near)
    assert_largest(found, output, values)
    exact = np.sqrt(np.trapezoid(values**2, near) / TURN)
    assert abs(found[f"rms_{output}"] - exact) <= found[f"err_rms_{output}"] + 1e-5 * exact


@pytest.mark.parametrize("gap", [7.5e-4, 1e-3, 1.6e-3])
def test_a_pin_that_most_samples_just_resolve_has_its_peak_to_a_strict_target(gap):
    """A peak as wide as eight of the most samples: they left it NOT_CONVERGED."""
    pin = {"a": 1.0, "e": 1.0 + gap, "alpha": 0.4, "Lw": 5.0}
    found = sweep.summarise("swivel", pin, ["max_abs_d3rho", "max_abs_d3x_p"], accuracy=1e-8).iloc[0]
    for name in ("d3rho", "d3x_p"):
        highest = np.abs(curve("swivel", pin, name, np.linspace(-5e-3, 5e-3, 100_001))).max()
        # poses 1e-7 rad apart miss (5e-8/gap)^2 of a peak, some 5e-9 times the order's square
        assert_largest(found, name, np.array([highest]), 1e-7)


@pytest.mark.parametrize(("a", "e"), [(2.0, 1.5), (3.7, 1.1)])
def test_a_ball_that_passes_through_the_driven_axis_has_no_largest_velocity(a, e):
    """Of square axes the crank circle is seen as a segment: psi jumps by pi where that meets the driven axis."""
    for output in ("dpsi", "d2psi", "d3psi"):
        found = summary("slotted", {"a": a, "e": e, "alpha": 0.5 * np.pi}, [f"max_abs_{output}"])
        assert found["status"] == st.NOT_CONVERGED


def test_the_least_pressure_angle_of_a_cam_is_zero_within_its_error():
    """It is a magnitude: a kink, where the quartic through five samples goes below zero or stays above by chance."""
    random = np.random.default_rng(5)
    cams = {"lift": random.uniform(0.5, 2.0, 60), "rise": random.uniform(0.8, 1.6, 60), "dwell": 0.7, "fall": 1.3}
    cams |= {
        "r0": random.uniform(3.0, 6.0, 60),
        "e": random.uniform(-0.3, 0.3, 60),
        "law": random.choice([1, 2, 3], 60),
    }
    for target in (1e-3, 1e-6):
        found = sweep.summarise("cam", cams, ["min_pressure_angle", "max_pressure_angle"], accuracy=target)
        assert (found["status"] == st.OK).all()
        assert (found["min_pressure_angle"] >= 0.0).all()
        off = found["min_pressure_angle"].to_numpy() - found["err_min_pressure_angle"].to_numpy()
        assert (off <= 0.0).all()


def made(values) -> Family:
    def poses(given, angles, wanted):
        y = np.asarray(values(np.mod(angles.phi - given[:, :1], TURN)), np.float64)
        return {"y": y, "status": np.zeros(y.shape, np.uint8)}

    return Family(
        name="curve", title="a curve", parameters=(Parameter("shift", "angle", "shift"),), poses=poses, position="y",
        pose_outputs=(Output("y", "1", "a curve"),),
    )  # fmt: skip


@pytest.mark.parametrize("target", [1e-2, 1e-4, 1e-6, 1e-8])
def test_the_error_of_an_unknown_kink_is_told(target):
    """A tip at 400 places between samples: at some of them the fourth difference of the samples vanishes."""
    shifts = np.linspace(0.0, 0.4, 400)[:, None]
    answers, status = true_extrema(
        made(lambda x: 1.0 - np.abs(np.sin(0.5 * (x - 2.0)))), shifts, [Request("y", 1)], target
    )
    found = answers[Request("y", 1)]
    assert (status == st.OK).all()
    assert (np.abs(found.value - 1.0) <= found.err).all()
    assert (found.err <= target).all()


def test_a_kink_whose_fourth_difference_vanishes_is_not_taken_for_a_smooth_top():
    """Two thirds of a step beside the middle sample the fourth difference of -|x| is zero."""
    around = -np.abs(np.arange(-3.0, 4.0) - 2.0 / 3.0)[None]
    first = first_peaks(np.zeros(1), np.ones(1), around)
    assert first.err_height[0] > 0.3
    peaks = sharpen(lambda which, phi: -np.abs(phi - 2.0 / 3.0), first, np.full(1, 1e-9), np.full(1, np.inf))
    assert abs(peaks.height[0]) <= peaks.err_height[0] <= 1e-7


def test_a_thread_that_leaves_its_edge_has_its_largest_length():
    random = np.random.default_rng(3)
    spread = np.exp(random.uniform(-0.15, 0.15, (6, 7)))
    names = ("a", "X1", "Y1", "Z1", "X2", "Y2", "Z2")
    cams = {name: family("free_cam").example[name] * spread[:, k] for k, name in enumerate(names)}
    found = sweep.summarise("free_cam", cams, ["max_abs_P", "rms_contact"], accuracy=1e-4)
    values = sweep.evaluate("free_cam", cams, ["P", "contact"], phi=FINE[::8])
    every = values["P"].to_numpy().reshape(6, -1)
    assert (np.abs(every).max(axis=1) <= found["max_abs_P"] + found["err_max_abs_P"]).all()
    on = values["contact"].to_numpy().reshape(6, -1).mean(axis=1)
    # Two edges of the contact, each known to a pose of the grid.
    assert (np.abs(found["rms_contact"] ** 2 - on) <= 4.0 / every.shape[1] + 1e-3).all()


# A lift coupler within rounding of locking the rack.
LOCKED = {
    "h_a": 0.25408090414650203, "h_b": 2.9744619353160444, "h_c": 3.131542498334712, "h_e": -0.6493191446012545,
    "h_alpha": -0.08514024228371112, "rh": 0.3889513185511589, "dh": -0.5460003931988747, "xE": 3.3365689323813803,
    "yE": 0.5221543693506001, "rE": 0.2657207636706481, "dE": 0.8097467229605483, "q": 4.730425414832597,
    "fx": -0.9071710443443637, "fy": -0.3819641581085895, "tx": 0.3678820086688903, "ty": 1.2280081853211795,
    "y_plate": -1.583411100410582, "h_sigma": -1.0, "bar_branch": 1.0,
}  # fmt: skip


def test_the_error_of_a_peak_near_locking_covers_the_rounding_of_poses():
    """Poses within 10^-9 rad of the top differ by rounding alone; the estimate once knew of interpolation only."""
    found = sweep.summarise("feed", LOCKED, ["max_abs_dy_t", "phi_max_abs_dy_t"], accuracy=1e-8).iloc[0]
    beside = found["phi_max_abs_dy_t"] + 1e-9 * np.linspace(-1.0, 1.0, 101)
    spread = np.ptp(np.abs(curve("feed", LOCKED, "dy_t", beside)))
    assert found["status"] == st.OK
    assert 1e-9 <= spread <= 2.0 * found["err_max_abs_dy_t"]


@pytest.mark.parametrize(
    ("sense", "drive"),
    [
        (-1.0, {"O2B": 16.1672, "BC": 244.142, "O3C": 120.805, "O2O3": 139.571, "O4E": 128.13, "chi_mid": 2.01468}),
        (-1.0, {"O2B": 18.6526, "BC": 202.778, "O3C": 139.288, "O2O3": 85.3617, "O4E": 238.492, "chi_mid": 2.18138}),
        (1.0, {"O2B": 27.3949, "BC": 129.567, "O3C": 61.6648, "O2O3": 159.722, "O4E": 125.85, "chi_mid": 1.98508,
               "side_C": -1.0}),
    ],
)  # fmt: skip
def test_of_tops_as_high_as_each_other_the_place_is_that_of_the_first(sense, drive):
    """A heddle that stands twice at one end in a turn: rounding chose one place or the other by the accuracy."""
    kind = "max" if sense > 0.0 else "min"
    values = sense * curve("heddle", drive, "y")
    tops = FINE[(values > np.roll(values, 1)) & (values >= np.roll(values, -1)) & (values > values.max() - 1e-5)]
    assert len(tops) == 2
    for target in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10):
        found = sweep.summarise("heddle", drive, [f"phi_{kind}_y", f"{kind}_y"], accuracy=target).iloc[0]
        assert abs(found[f"phi_{kind}_y"] - tops[0]) <= found[f"err_phi_{kind}_y"] + 2.0 * TURN / FINE.size
        assert abs(found[f"{kind}_y"] - sense * values.max()) <= found[f"err_{kind}_y"] + 1e-5


@pytest.mark.parametrize(
    ("k", "n", "output"), [(0.3, 2.0, "min_dpsi"), (0.3, 4.0, "max_d3psi"), (1.0, 4.0, "min_dpsi")]
)
def test_a_top_at_the_beginning_of_the_turn_is_the_first(k, n, output):
    """Rounding put it a hair before the end of the turn, behind its equals."""
    for target in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        drive = {"k": k, "a": 0.0, "n": n}
        found = sweep.summarise("epicyclic_dwell", drive, [f"phi_{output}"], accuracy=target).iloc[0]
        place = found[f"phi_{output}"]
        assert min(place, TURN - place) <= 2.0 * found[f"err_phi_{output}"]
