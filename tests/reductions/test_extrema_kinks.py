"""Extrema of loads with friction: jumps however small, bumps between two kinks, and errors that are told."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Family, Output, Parameter
from sweep.families.names import error_of
from sweep.quantities.kinds import Request
from sweep.reductions import panels
from sweep.reductions.peak_search import PeakSearch
from sweep.reductions.sampling import pose_columns
from tests.support.frictional import FAMILIES, dense, frictional
from tests.support.rssr_designs import random_designs

TARGET = 1e-6
# A grid attains its values up to the rounding of two ways to one pose.
ROUNDING = 1e-12


def found(full, designs, wanted, target=TARGET):
    return design_outputs(full, designs, wanted=wanted, accuracy=Accuracy(target=target))


def exceeded(got, seen, wanted, target=TARGET):
    """Outputs and designs whose status is OK and a pose higher than the error allows, or the error too large."""
    sure = (got["status"] == st.OK) & (seen["status"] == st.OK)
    assert sure.mean() > 0.5, "most designs turn and do not jam"
    faults = []
    for name in wanted:
        value, err = got[name], got[error_of(name)]
        high = ~(seen[name] - value <= err + ROUNDING * np.abs(seen[name]))
        loose = err > target * np.abs(value) * (1.0 + 1e-9)
        faults += [(name, int(k)) for k in np.flatnonzero(sure & (high | loose))]
    return faults


# Designs of which the search by samples said OK: too low behind a kink by up to 2 %, or an error of up to a tenth.
@pytest.mark.parametrize(
    ("name", "output", "rows"),
    [
        ("spherical_looper_friction", "load_support_a11", [6, 8]),
        ("spherical_looper_friction", "load_support_a21", [4]),
        ("swivel_friction", "load_support_a1", [1, 4, 9, 10]),
        ("friction", "load_support_d2", [12, 19, 30, 32]),
    ],
)
def test_maxima_beside_kinks_and_small_jumps_are_attained_and_exceeded_nowhere(name, output, rows):
    full, _, designs = frictional(name, max(rows) + 1)
    designs, largest = designs[rows], f"max_abs_{output}"
    got = found(full, designs, (largest, f"phi_{largest}"))
    assert (got["status"] == st.OK).all()
    assert exceeded(got, dense(full, designs, (largest,), 20_000), (largest,)) == []
    # Steps to both sides: at a jump the maximum is the limit from one of them.  The slope times the step is below 1e-6.
    near = got[f"phi_{largest}"][:, None] + np.array([-1e-9, 0.0, 1e-9])
    poses, _ = pose_columns(full.precise(), designs, near, [output])
    attained = np.abs(poses[output]).max(axis=1)
    np.testing.assert_allclose(attained, got[largest], rtol=1e-6)


def test_the_search_by_samples_is_wrong_about_the_same_designs(monkeypatch):
    """The control: without panels the faults are there, so the check sees them."""
    full, _, designs = frictional("friction", 33)
    wanted = ("max_abs_load_support_d2",)
    monkeypatch.setattr(panels, "has_kinks", lambda family, request, jumps: False)
    monkeypatch.setattr(PeakSearch, "_late", lambda search, turn, number, size, which: which & False)  # to panels, too
    faults = exceeded(found(full, designs, wanted), dense(full, designs, wanted, 20_000), wanted)
    assert len({k for _, k in faults}) > 2


@pytest.mark.parametrize("target", [1e-3, 1e-9])
def test_no_pose_of_random_linkages_with_friction_exceeds_the_maximum_by_more_than_its_error(target):
    full, wanted, designs = frictional("friction", 100)
    assert exceeded(found(full, designs, wanted, target), dense(full, designs, wanted, 20_000), wanted, target) == []


@pytest.mark.long
@pytest.mark.parametrize("name", FAMILIES)
def test_no_pose_of_100_random_designs_exceeds_the_maximum_by_more_than_its_error(name):
    full, wanted, designs = frictional(name, 100)
    assert exceeded(found(full, designs, wanted), dense(full, designs, wanted, 20_000), wanted) == []


def test_an_extremum_does_not_depend_on_what_is_wanted_beside_it():
    full, wanted, designs = frictional("friction", 5)
    together = found(full, designs, wanted)
    for name in ("max_abs_load_support_d2", "max_abs_drive_torque_friction"):
        for key in (name, error_of(name)):
            np.testing.assert_array_equal(found(full, designs[::-1], (name,))[key][::-1], together[key])


def made(curve) -> Family:
    """A mechanism whose one output is a given curve with kinks, JAMMED where it is nan; its design shifts it."""

    def poses(designs, angles, wanted):
        values = np.asarray(curve(np.mod(angles.phi - designs[:, :1], 2.0 * np.pi)), np.float64)
        return {"y": values, "status": np.where(np.isnan(values), st.JAMMED, st.OK).astype(np.uint8)}

    output = Output("y", "1", "a curve", kinks=True)
    return Family(
        name="curve", title="a curve", parameters=(Parameter("shift", "angle", "shift"),), pose_outputs=(output,),
        poses=poses, position="y",
    )  # fmt: skip


def searched(curve, mode, target=1e-9) -> tuple[Array, Array, Array, Array]:
    value, err, away, _, status = placed(curve, mode, target)
    return value, err, away, status


SHIFTS = np.random.default_rng(2).uniform(0.0, 6.0, (40, 1))


def placed(curve, mode, target) -> tuple[Array, Array, Array, Array, Array]:
    request = Request("y", mode)
    answers, status = panels.extrema(made(curve), SHIFTS, [request], target, True)
    answer = answers[request]
    away = np.mod(answer.phi - SHIFTS[:, 0] + 1.0, 2.0 * np.pi) - 1.0
    return answer.value, answer.err, away, answer.err_phi, status


@pytest.mark.parametrize("jump", [1.0, 1e-2, 1e-5, 1e-9])
def test_the_limit_beside_a_jump_of_any_size_is_the_maximum(jump):
    """Once the top lies before the jump, once it is the limit from the left."""

    def curve(x):
        return np.where(x < 4.0, np.cos(x - 3.6), np.cos(0.4) - jump + 0.2 * (4.0 - x))

    def rising(x):
        return np.where(x < 4.0, np.sin(0.3 * x), np.sin(1.2) - jump - 0.1 * (x - 4.0))

    for shape, top, place in ((curve, 1.0, 3.6), (rising, np.sin(1.2), 4.0)):
        value, err, away, status = searched(shape, 1)
        assert (status == st.OK).all()
        assert (np.abs(value - top) <= err).all()
        assert (err <= 1e-9).all()
        assert (np.abs(away - place) <= 1e-6).all()


@pytest.mark.parametrize("mode", [0, 1, -1])
def test_the_tip_of_a_kink_is_found_to_the_target(mode):
    sign = -1.0 if mode == -1 else 1.0
    value, err, away, status = searched(lambda x: sign * (1.0 - np.abs(np.sin(0.5 * (x - 2.0)))), mode)
    assert (status == st.OK).all()
    assert (np.abs(value - sign) <= err).all()
    assert (err <= 1e-9).all()
    assert (np.abs(away - 2.0) <= 1e-8).all()


@pytest.mark.parametrize("target", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize(
    "curve",
    [
        lambda x: 3.0 * np.cos(x - 2.0) + np.where(x < 5.0, 0.0, 0.2 * (x - 5.0)),  # a smooth top
        lambda x: np.where(x < 2.0, 1.5 * (x - 2.0), 1.8 * (2.0 - x)),  # a tip
        lambda x: np.where(x < 2.0, 1.5 * (x - 2.0), 0.5 * np.expm1(2.0 - x)),
    ],
)
def test_the_place_of_a_top_errs_by_no_more_than_it_says(curve, target):
    """Tops next to the end of a panel among them: 40 of one curve, shifted along the turn."""
    _, _, away, err_phi, _ = placed(curve, 1, target)
    assert (np.abs(away - 2.0) <= err_phi).all()


def test_a_jam_between_the_first_poses_is_called_a_jam():
    """The status said that an input was invalid."""
    with np.errstate(invalid="ignore"):
        *_, status = searched(lambda x: np.where(np.abs(x - 2.0) < 1e-4, np.nan, -np.abs(x - 2.0)), 1)
    assert (status == st.JAMMED).all()


@pytest.mark.parametrize("target", [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10])
def test_of_two_zeros_the_first_counts_at_any_target(target):
    """One that happened to be met more closely was taken: their errors may differ by orders of magnitude."""
    request = Request("y", -1, place=True)
    curve = made(lambda x: np.abs(np.sin(x) * (1.0 + 0.3 * np.cos(x + 1.0))))
    answers, status = panels.extrema(curve, SHIFTS, [request], target, False)
    first = np.mod(SHIFTS[:, 0], np.pi)
    assert (status == st.OK).all()
    assert (np.abs(answers[request].phi - first) <= answers[request].err_phi).all()


def test_the_place_of_a_dwell_errs_by_as_much_as_the_dwell_is_long():
    """Level from 2 to 3.5 rad, but for rounding; of 13 across the angle 0 the part on one side of it counted alone."""
    _, _, away, err_phi, _ = placed(lambda x: 1.0 - np.maximum(np.abs(x - 2.75) - 0.75, 0.0) ** 2, 1, 1e-8)
    # Rounding takes the dwell on by sqrt(4 eps) to either side; a panel is 0.1 rad.
    assert (away >= 2.0 - 1e-3).all() and (away <= 3.5 + 1e-3).all()
    assert (np.maximum(away - 2.0, 3.5 - away) <= err_phi + 0.1).all()
    assert (err_phi <= 1.5 + 0.1).all()


@pytest.mark.parametrize(("start", "output", "end"), [(1.0, "x_r", 1.0), (-0.7, "s", 5.583185307179586)])
def test_a_rest_cut_into_panels_is_one_hill_wherever_the_cam_begins(start, output, end):
    """The rest begins at start + 2.5: tops of its level panels stand as far apart as the panels are wide."""
    cam = {"lift": 1.0, "r0": 3.0, "e": 0.4, "law": 2.0, "rise": 1.0, "dwell": 0.5, "fall": 1.0, "start": start}
    found = sweep.summarise("cam", cam, f"phi_min_{output}", accuracy=1e-8).iloc[0]
    place, error = found[f"phi_min_{output}"], found[f"err_phi_min_{output}"]
    assert found.status == st.OK
    for edge in (start + 2.5, end):  # both are as low as what is between
        away = abs(np.remainder(edge - place + np.pi, 2.0 * np.pi) - np.pi)
        assert away <= error + 1e-3


LEVER = {"lift": 0.4, "r0": 3.0, "c": 5.0, "e": 6.0, "law": 2.0, "rise": 1.0, "dwell": 0.7, "fall": 1.3}
# The rocker behind the lever swings from 3.00 to 3.38 rad, over the cut of its angle.
BEHIND = {"a2": 1.0, "b2": 2.3, "c2": 1.9, "e2": 4.0, "f2": 0.2, "g2": 0.1, "alpha2": 0.3, "offset2": -1.0}


@pytest.mark.parametrize("start", [0.0, 0.37, -2.0, 4.5])
@pytest.mark.parametrize("branch", [1.0, -1.0])
@pytest.mark.parametrize("chain", [False, True])
def test_the_place_of_a_levers_dwell_errs_by_its_whole_length(start, branch, chain):
    """Any angle of a dwell would do; a shifted start moved phi0 by 0.18 rad, and its error was that of rounding."""
    design = LEVER | {"start": start, "branch": branch}
    if chain:
        design = {f"{name}1": value for name, value in design.items()} | BEHIND | {"kappa2": branch}
    psi = "psi2" if chain else "psi"
    names = [f"phi_max_{psi}", f"phi_min_{psi}", "phi_ext", "phi_fold", "phi0"]
    found = sweep.summarise(["cam_lever", "rssr"] if chain else "cam_lever", design, names, accuracy=1e-8).iloc[0]
    assert found.status == st.OK
    dwells = [(start + 1.0, 0.7), (start + 3.0, 2.0 * np.pi - 3.0)]
    spans = []
    for name in names[:4]:
        away = [np.mod(found[name] - begins + 0.1, 2.0 * np.pi) - 0.1 for begins, _ in dwells]
        which = int(-1e-3 <= away[1] <= dwells[1][1] + 1e-3)  # beyond its end the angle rises by less than its rounding
        assert -1e-3 <= away[which] <= dwells[which][1] + 1e-3
        assert max(away[which], dwells[which][1] - away[which]) <= found[f"err_{name}"] + 1e-3
        spans.append(which)
    assert {spans[0], spans[1]} == {spans[2], spans[3]} == {0, 1}
    assert found.err_phi0 == pytest.approx(found.err_phi_ext + found.err_phi_fold)


@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_places_of_what_rests_with_a_lever_err_by_the_whole_dwell(offset):
    """A slider that follows a lever, a point on it and that point's speed: errors were 1e-7 to 1e-3 rad."""
    slider = {"a": 1.0, "b": 3.0, "e": 0.4, "offset": 0.3}
    chain = {f"{name}1": x for name, x in (LEVER | {"start": -offset}).items()} | {
        f"{k}2": x for k, x in slider.items()
    }
    ends = sweep.summarise(["cam_lever", "slider_crank"], chain, ["phi_max_s", "phi_min_s"], accuracy=1e-8)
    member = {"family": "cam_lever", "tip": [1.0, 2.0, 0.5], "offset": offset}
    machine = sweep.machine({"lever": member}, {"pace": {"speed": ["lever.tip"]}})
    names = ["lever.phi_max_tip_x", "lever.phi_min_tip_x", "phi_min_pace"]
    tips = sweep.summarise(machine, {f"lever.{k}": x for k, x in LEVER.items()}, names, accuracy=1e-8)
    assert ends.status[0] == tips.status[0] == st.OK
    for name, found in [*((name, ends) for name in ("phi_max_s", "phi_min_s")), *((name, tips) for name in names)]:
        away = [np.mod(found[name][0] + offset - begins + 0.1, 2.0 * np.pi) - 0.1 for begins in (1.0, 3.0)]
        which = int(not -1e-3 <= away[0] <= 0.7 + 1e-3)
        long = (0.7, 2.0 * np.pi - 3.0)[which]
        assert -1e-3 <= away[which] <= long + 1e-3, name
        assert max(away[which], long - away[which]) <= found[f"err_{name}"][0] + 1e-3, name


def test_a_rest_at_zero_is_one_hill_although_rounding_falls_below_it_behind_its_end():
    """The cycloidal rise begins with -1e-18: the place was the end of the rest, with an error of 2e-4 rad."""
    cams = {"lift": [0.3, 0.4, 0.5], "rise": [1.1, 1.5, 0.9], "dwell": [0.7, 0.4, 1.2], "fall": [1.2, 1.3, 1.1]}
    cams |= {"r0": [3.0] * 3, "e": [0.4] * 3, "law": [3.0] * 3}
    for accuracy in (1e-3, 1e-6, 1e-9):
        found = sweep.summarise("cam", cams, ["phi_min_s"], accuracy=accuracy)
        begins = np.array(cams["rise"]) + cams["dwell"] + cams["fall"]
        before = np.mod(found.phi_min_s - begins + 0.1, 2.0 * np.pi) - 0.1
        assert (np.maximum(before, 2.0 * np.pi - begins - before) <= found.err_phi_min_s + 1e-3).all()


def test_a_curve_that_is_all_noise_is_not_converged_and_its_error_says_so():
    """Noise of 1e-6 of the size: no halving makes it agree to 1e-9."""
    value, err, _, status = searched(lambda x: np.cos(x) + 1e-6 * np.sin(1e9 * x), 0)
    assert (status == st.NOT_CONVERGED).all()
    assert (np.abs(value - 1.0) <= 1.1e-6).all()
    assert ((err > 1e-9) & (err < 1e-4)).all()


@pytest.mark.parametrize("target", [1e-2, 1e-3, 1e-4])
def test_means_of_angles_that_jump_say_what_they_miss(target):
    """From one end of a right angle to the other: the squares have a kink there, in no known place."""
    wanted = ["rms_theta2", "rms_theta3"]
    full = extended(family("rssr"), wanted)
    designs = random_designs(200, 3, rotatable=True)
    matrix = np.column_stack([designs, np.zeros((len(designs), len(full.parameters) - designs.shape[1]))])
    got, true = found(full, matrix, wanted, target), found(full, matrix, wanted, 1e-9)
    sure = (got["status"] == st.OK) & (true["status"] == st.OK)
    assert sure.sum() > 150
    for name in wanted:
        off = np.abs(got[name] - true[name])[sure]
        assert (off <= (got[error_of(name)] + true[error_of(name)])[sure]).all()


def test_friction_settles_next_to_the_zero_of_a_load():
    """The load of the key that holds the shaft passes through zero: its last digits are those of the other loads.

    The poses there were JAMMED.  The least load had no value, or that of the nearest pose that settled, 2e-4 N.
    """
    full, _, designs = frictional("cylindrical_looper_friction", 46)
    got = found(full, designs[[7, 19, 45]], ("min_force_hold_friction",), 1e-8)
    assert (got["status"] == st.OK).all()
    assert (got["min_force_hold_friction"] <= got["err_min_force_hold_friction"]).all()
    assert (got["err_min_force_hold_friction"] < 1e-6).all()


def test_friction_settles_next_to_the_zero_of_the_load_of_a_slide():
    """Poses there were JAMMED: of every second of these designs the least load was up to 0.02 N, its error 1e-8 N."""
    random, n = np.random.default_rng(3), 24
    crank = {"a": 20.0 * random.uniform(0.8, 1.2, n), "b": 90.0 * random.uniform(0.8, 1.2, n), "m_crank": 2e-4}
    bodies = {"m_coupler": 1e-4, "com_coupler_x": 45.0, "m_slider": 3e-4, "speed": 520.0}
    supports = {"support_a1": -30.0, "support_a2": -60.0, "support_d1": -20.0, "support_d2": 30.0}
    rubs = {"mu_a": 0.05, "mu_b": 0.1, "mu_c": 0.0, "mu_d": 0.15, "radius_a": 8.0, "radius_b": 5.0, "radius_c": 5.0}
    table = crank | bodies | supports | rubs | {"load_force": random.uniform(-100.0, 100.0, n)}
    found = sweep.summarise("slider_crank", table, ["min_force_d_friction"], accuracy=1e-8)
    assert (found.status == st.OK).all()
    assert (found.min_force_d_friction <= found.err_min_force_d_friction).all()
    assert (found.err_min_force_d_friction < 1e-5).all()
