"""Effects at their limits: close to jamming, all but stalled, undamped, and inputs that exclude each other."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.effects import permissible
from sweep.errors import InputError
from tests.effects.test_balance import FRICTION, OMEGA, PHI, RSSR, RSSR_LOADS
from tests.effects.test_demand import PHI as FEW
from tests.effects.test_families import CHAIN, SLIDE, SLIDER, numbered
from tests.effects.test_turn import table

JOINTS = ["force_b_friction", "force_c_friction", "ball_couple_b", "ball_couple_c", "drive_torque_friction"]


def test_friction_is_found_right_up_to_where_it_jams():
    """Wherever rho(L) proves a solution there is one, and the couples are those of the forces that come with them."""
    steep = np.linspace(0.1, 6.0, 60)
    given = {name: np.full(60, x) for name, x in (RSSR_LOADS | FRICTION).items()} | {"mu_d": steep, "mu_c": steep}
    poses = sweep.evaluate("rssr", given | {"phi": np.full(60, 5.0)}, [*JOINTS, "friction_contraction"])
    rho, jammed = poses["friction_contraction"], poses["status"] == st.JAMMED
    assert ((rho > 0.9) & (rho < 0.99)).any()
    assert jammed.any()
    assert not jammed[rho < 0.99].any()
    found = poses[~jammed]
    for joint, mu in (("b", 0.08), ("c", steep[~jammed])):
        expected = mu * FRICTION[f"radius_{joint}"] * found[f"force_{joint}_friction"]
        np.testing.assert_allclose(found[f"ball_couple_{joint}"], expected, rtol=1e-11)


def test_friction_that_settles_slowly_is_no_jam():
    """Just below the coefficient that jams each pass takes a small share of what is left: 200 were too few."""
    steep = FRICTION | {"mu_a": 3.5696, "mu_b": 1.7842, "mu_d": 1.708, "mu_c": 5.188471177944861}
    (row,) = sweep.evaluate("rssr", RSSR_LOADS | steep | {"phi": 6.0023}, [*JOINTS, "friction_passes"]).itertuples()
    assert row.status == st.OK and row.friction_passes > 200
    assert row.ball_couple_c == pytest.approx(steep["mu_c"] * steep["radius_c"] * row.force_c_friction, rel=1e-11)
    assert row.ball_couple_b == pytest.approx(steep["mu_b"] * steep["radius_b"] * row.force_b_friction, rel=1e-11)


def test_a_jam_that_grows_beyond_float64_is_a_jam():
    """Couples that grow a hundredfold in each pass overflow: infinity less infinity is not standing still."""
    rough = SLIDER | SLIDE | {"mu_c": 100.0, "mu_d": 50.0}
    poses = sweep.evaluate("rssp", rough, [*JOINTS, "friction_contraction"], phi=PHI)
    assert poses["friction_contraction"].min() > 35.0
    assert (poses["status"] == st.JAMMED).all()
    assert poses[JOINTS].isna().all(axis=None)


def test_friction_that_loads_a_coupler_at_rest_rubs_in_its_ball_joints():
    """The rocker's weight rests on its shaft: without friction the coupler carries nothing, with it both balls rub."""
    idle = {name: 0.0 for name in RSSR_LOADS if name[:2] in ("m_", "j_", "co", "gr", "lo")}
    given = RSSR_LOADS | FRICTION | idle | {"m_rocker": 3e-4, "gravity_z": -9810.0, "mu_b": 0.5, "mu_c": 0.5}
    poses = sweep.evaluate("rssr", given, [*JOINTS, "force_b"], phi=FEW)
    smooth = sweep.evaluate("rssr", given | {"mu_b": 0.0, "mu_c": 0.0}, JOINTS, phi=FEW)
    assert (poses["force_b"] == 0.0).all()
    assert (poses["status"] == st.OK).all()
    np.testing.assert_allclose(poses["ball_couple_b"], 0.5 * 5.0 * poses["force_b_friction"], rtol=1e-12)
    assert (poses["drive_torque_friction"] > 1.01 * smooth["drive_torque_friction"]).all()


def test_a_later_stage_at_a_dead_point_is_no_jam():
    """Friction of the first stage says what kinetostatics says: the reason is the second stage's motion."""
    short = CHAIN | numbered(1, FRICTION) | numbered(2, FRICTION) | {"b2": 90.0}
    plain, rubbing = (
        sweep.evaluate(["rssr", "guide"], short, [name], phi=PHI)["status"]
        for name in ("drive_torque1", "drive_torque_friction1")
    )
    assert (plain == st.NOT_ASSEMBLED).any()
    assert (rubbing[plain != st.OK] == plain[plain != st.OK]).all()


def test_without_damping_the_multiplier_is_one_and_the_steady_state_is_given():
    given = table(["floquet", "max_abs_lag_dynamic"], 200) | {"damping": 0.0}
    got = sweep.summarise("rssr", given, ["floquet", "max_abs_lag_dynamic"])
    bounded = got["floquet"] == 1.0
    assert bounded.mean() > 0.9
    assert not got["status"][bounded].isin([st.NOT_CONVERGED]).any()
    assert (got["floquet"][~bounded] > 1.0 + 1e-6).all()


@pytest.mark.parametrize("force", [-1e4, -2e5, -5e5])
def test_a_crank_that_all_but_stops_keeps_its_mean_speed(force):
    """1/omega has a peak that the samples of inertia and torque do not show."""
    given = RSSR_LOADS | {"load_torque": force}
    poses = sweep.evaluate("rssr", given, ["crank_speed"], phi=2.0 * np.pi * np.arange(4096) / 4096)
    got = sweep.summarise("rssr", given, ["slowest", "fastest"])
    assert (poses["status"] == st.OK).all()
    assert (1.0 / poses["crank_speed"]).mean() * OMEGA == pytest.approx(1.0, rel=1e-10)
    assert got["slowest"][0] == pytest.approx(poses["crank_speed"].min(), rel=3e-3)
    if force == -5e5:
        assert got["slowest"][0] < 0.02 * OMEGA


def test_a_plane_linkage_at_its_best_angle_permits_what_its_neighbours_do():
    """No radial and no axial force: theta2 = 0, not the right angle that an axial force alone would make."""
    data = np.array([[20.0, -18.0, 22.0, 10.0, 12.0, 14.0, 18.0, 1.0, 6.0, 0.1]])
    found = []
    for rho in (0.0, 1e-9):
        components = (np.array([[x]]) for x in (1.0, rho, 0.0))
        angle, status = np.empty((1, 1)), np.zeros((1, 1), np.uint8)
        permissible.bearing_limits(
            *components, np.array([900.0]), data, np.full((1, 3), 2.0), status, None, angle, None
        )  # fmt: skip
        found.append(angle[0, 0])
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    assert found[0] > 0.1


def test_a_rolling_bearing_permits_no_angle_beyond_one_that_overloads_it_before_its_load_steps_down():
    """With X + Y e below 1 the equivalent load steps down where the axial load passes e V R."""
    torque, z1, z2, e = 1000.0, -5.0, 30.0, 0.2
    row = RSSR | {
        "resisting_torque": torque, "support_d1": z1, "support_d2": z2, "radial_factor": 0.2, "axial_factor": 0.3,
        "e_limit": e, "required_life": 2e6 * np.pi / OMEGA, "speed": OMEGA, "dynamic_capacity": 1.0,
    }  # fmt: skip
    poses = sweep.evaluate("rssr", row, ["t_rho", "t_k"], phi=PHI)
    axial = row["c"] * (poses.t_k / poses.t_rho).to_numpy()
    with np.errstate(invalid="ignore"):
        step = e * z2 / np.sqrt(((z2 - z1) * axial / row["c"]) ** 2 - (e * (z2 + axial)) ** 2)
    square = 0.999**2 * (z2**2 + ((z2 + axial) * step) ** 2)
    # Tangents of theta1 at which the load is 0.999 of that at the step, of bearings 1 and 2.
    with np.errstate(invalid="ignore"):
        first, second = (np.sqrt(square - z**2) / np.abs(z + axial) for z in (z2, z1))
    known = first < second
    assert known.sum() > 20
    capacity = torque / (row["c"] * (z2 - z1)) * np.sqrt(square[known])
    table = row | {"phi": PHI[known], "dynamic_capacity": capacity}
    found = sweep.evaluate("rssr", table, ["permissible_theta1_rolling"]).permissible_theta1_rolling
    np.testing.assert_allclose(found, np.arctan(first[known]), rtol=1e-9)


@pytest.mark.parametrize(("output", "wrong"), [
    ("load_support_d1", {"support_d2": -20.0}), ("force_c_friction", {"support_a1": -60.0}),
    ("radial_load_d1", {"support_d2": -20.0}), ("life_d1", {"support_d2": -20.0}),
    ("journal_load1", {"support_d1": 0.0, "support_d2": 0.0}), ("permissible_theta1", {"collar_diameter": 1e-3}),
    ("unevenness", {"m_crank": 0.0, "m_coupler": 0.0, "m_rocker": 0.0}),
])  # fmt: skip
def test_inputs_that_exclude_each_other_are_invalid_and_give_no_number(output, wrong):
    given = {name: x[0] for name, x in table([output], 1).items()} | RSSR | {"support_d1": -20.0, "support_a2": -60.0}
    if output == "unevenness":
        wrong = wrong | {name: 0.0 for name in given if name[:2] == "j_"} | {"flywheel": 0.0}
    whole = output in ("life_d1", "unevenness")

    def found(inputs):
        return sweep.summarise("rssr", inputs, [output]) if whole else sweep.evaluate("rssr", inputs, [output], phi=0.3)

    assert found(given)["status"][0] == st.OK
    bad = found(given | wrong)
    assert bad["status"][0] == st.INVALID_INPUT
    assert np.isnan(bad[output][0])


@pytest.mark.parametrize(("output", "wrong"), [
    ("force_c", {"m_crank": -1e-4}), ("force_c", {"j_rocker_zz": -1.0}), ("force_c_friction", {"mu_b": -0.1}),
    ("lag", {"damping": -1.0}), ("unevenness", {"flywheel": -1.0}), ("life1", {"life_exponent": 0.0}),
])  # fmt: skip
def test_an_input_of_the_wrong_sign_is_refused(output, wrong):
    ((name, value),) = wrong.items()
    given = table([output], 2) | {name: np.array([0.5, value])}
    with pytest.raises(InputError, match=rf"column {name}, row 1: .*(non-negative|positive)"):
        sweep.summarise("rssr", given, [output if output == "unevenness" else f"max_{output}"])


@pytest.mark.parametrize("failing", ["max_abs_lag", "rms_lag", "max_abs_lag_dynamic", "max_force_c_friction"])
def test_an_effect_that_fails_takes_nothing_from_the_others(failing):
    """A soft coupler and a shaft that jams: what is wanted beside them keeps its bits."""
    soft = {"stiffness": 300.0, "driven_inertia": 1.0, "damping": 0.1, "flywheel": 20.0}
    given = RSSR_LOADS | FRICTION | soft | {"mu_d": 8.0}
    wanted = ["max_abs_force_c", "rms_drive_torque", "fastest", "max_abs_d2psi"]
    alone, beside = (sweep.summarise("rssr", given, names).iloc[0] for names in (wanted, [failing, *wanted]))
    assert alone["status"] == st.OK
    assert beside["status"] in (st.NOT_LINEAR, st.JAMMED)
    assert np.isnan(beside[failing])
    for name in wanted:
        assert beside[name] == alone[name], name
