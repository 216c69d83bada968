"""Cranks that turn backwards: oracle friction through the public functions, losses, steady states, and what refuses 0.

Friction opposes the motion whichever way it goes; loads of inertia go with the square of the speed and do not change.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from sweep.errors import InputError, StudyError
from sweep.study import study_from_data
from tests.effects.test_link_loads import DESIGNS, TOOL, WEIGHT, design, masses, rubbing
from tests.effects.test_motor_line import BODIES, CRANK_ROCKER, LINKS, OMEGA, PHI, RUBBING, left_for_the_motor, slope
from tests.reference.momentum import derivative
from tests.support.oracle_rows import factor, rows

PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")


def public(row):
    """Parameters and inputs of an oracle row under their public names."""
    i, f = row["inputs"], row["inputs"]["friction"]
    table = {name: i[name] for name in ("a", "b", "c", "e", "f", "g", "alpha", "phi")} | {"branch": i["sigma"]}
    for k, body in enumerate(("crank", "coupler", "rocker"), 1):
        table[f"m_{body}"] = i[f"m{k}"]
        table |= {f"com_{body}_{x}": i[f"com{k}"]["xyz".index(x)] for x in "xyz"}
        table |= {f"j_{body}_{p}": i[f"J{k}"]["xyz".index(p[0])]["xyz".index(p[1])] for p in PAIRS}
    table |= {f"gravity_{x}": i["gravity"][k] for k, x in enumerate("xyz")}
    table |= {
        f"{ours}_{j.lower()}": f[f"{theirs}_{j}"] for j in "ABCD" for ours, theirs in (("mu", "mu"), ("radius", "r"))
    }
    table |= {f"thrust_radius_{j.lower()}": f[f"rt_{j}"] for j in "AD"}
    table |= {f"support_{j.lower()}{k}": f[f"z{j}{k}"] for j in "AD" for k in "12"}
    finger = {"driven": 0, "driving": 1}[i["construction"]]
    return table | {"load_torque": i["M_load"], "speed": i["omega"], "speed_change": i["epsilon"], "finger": finger}


NAMES = {"M_drive": "drive_torque_friction", "F_A1": "load_support_a1", "F_A2": "load_support_a2",
         "F_D1": "load_support_d1", "F_D2": "load_support_d2", "m_finger": "finger_couple_friction"}  # fmt: skip
FORCES = {"R_A": "force_a_friction", "R_B": "force_b_friction", "R_C": "force_c_friction", "R_D": "force_d_friction"}


def test_every_row_of_oracle_friction_is_reached_by_evaluate_in_both_senses():
    table = rows("friction")
    assert sum(row["inputs"]["omega"] < 0.0 for row in table) >= 2
    wanted = [*NAMES.values(), *(f"{name}_{x}" for name in FORCES.values() for x in "xyz")]
    for row in table:
        found = sweep.evaluate("rssr", public(row), wanted).iloc[0]
        assert found["status"] == st.OK
        force = max(mp.norm([mp.mpf(x) for x in row["expected"][name]]) for name in FORCES)
        for name, ours in NAMES.items():
            scale = force * (row["inputs"]["b"] if name[0] in "Mm" else 1)
            assert factor(found[ours], row["expected"][name], scale) < 16, (row["case"], name)
        for name, ours in FORCES.items():
            got = [found[f"{ours}_{x}"] for x in "xyz"]
            assert factor(np.array(got), row["expected"][name], force) < 16, (row["case"], name)


@pytest.mark.parametrize("case", ["rssr", *DESIGNS])
def test_friction_takes_power_in_both_senses_and_frictionless_loads_do_not_change(case):
    if case == "rssr":
        name, table = "rssr", CRANK_ROCKER | RUBBING
    else:
        name, d = design(case)
        table = d | masses(name)[0] | TOOL | WEIGHT | {"speed": 30.0} | rubbing(name, 0.02)
    names = ["drive_torque", "drive_torque_friction"]
    ahead, back = (sweep.evaluate(name, table | {"speed": s * table["speed"]}, names, phi=PHI) for s in (1.0, -1.0))
    assert (ahead["status"] == st.OK).all() and (back["status"] == st.OK).all()
    np.testing.assert_array_equal(ahead["drive_torque"], back["drive_torque"])
    size = np.abs(ahead["drive_torque"]).max()
    for found, sense in ((ahead, 1.0), (back, -1.0)):
        power = sense * (found["drive_torque_friction"] - found["drive_torque"])
        assert power.min() > -1e-12 * size and power.max() > 1e-6 * size


@pytest.mark.parametrize("suffix", ["", "_friction"])
def test_motor_of_a_crank_that_turns_backwards_gives_what_its_line_says(suffix):
    table = CRANK_ROCKER | (RUBBING if suffix else {})
    table |= {"motor_slope": slope(CRANK_ROCKER)}
    torque, speed, _ = left_for_the_motor("rssr", table, suffix)
    names = [f"crank_speed{suffix}", f"crank_acceleration{suffix}"]
    # kinks of friction leave up to 2e-3 of the torque, as in tests/effects/test_link_bearings.py
    near = (1e-7 if not suffix else 2e-3) * np.abs(torque).max()
    back = sweep.evaluate("rssr", table | {"speed": -OMEGA}, names, phi=PHI)
    assert (back["status"] == st.OK).all()
    own, change = (back[n].to_numpy() for n in names)
    assert (own < 0.0).all() and np.ptp(own) > 1e-4 * OMEGA
    posed = table | {"speed": own, "speed_change": change, "phi": PHI}
    driven = sweep.evaluate("rssr", posed, [f"drive_torque{suffix}"]).iloc[:, 0].to_numpy()
    left = driven + table["flywheel"] * change + table["motor_slope"] * (own + OMEGA)
    size = np.abs(sweep.evaluate("rssr", table, [f"drive_torque{suffix}"], phi=PHI).iloc[:, 0]).max()
    assert np.ptp(left) < max(near, 1e-7 * size)
    assert np.mean(1.0 / own) == pytest.approx(-1.0 / OMEGA, rel=1e-9 if not suffix else 1e-5)
    numbers = sweep.summarise("rssr", table | {"speed": -OMEGA}, [f"fastest{suffix}", f"slowest{suffix}"]).iloc[0]
    assert numbers[f"fastest{suffix}"] >= np.abs(own).max() * (1.0 - 1e-9)
    assert 0.0 < numbers[f"slowest{suffix}"] <= np.abs(own).min() * (1.0 + 1e-9)
    assert np.abs(np.abs(own) - speed).max() > 1e-5 * OMEGA  # not the mirrored numbers of the other sense


def test_senses_side_by_side_in_one_table_are_those_alone():
    table = CRANK_ROCKER | RUBBING | {"motor_slope": slope(CRANK_ROCKER)}
    elastic = LINKS | {"driven_inertia": 0.6, "stiffness": 2e4, "damping": 3.0}
    for given, names in ((table, ["unevenness", "fastest"]), (elastic, ["floquet", "max_abs_lag_dynamic"])):
        both = sweep.summarise("rssr", given | {"speed": [OMEGA, -OMEGA]}, names)
        for k, speed in enumerate((OMEGA, -OMEGA)):
            alone = sweep.summarise("rssr", given | {"speed": speed}, names)
            np.testing.assert_array_equal(both.iloc[k], alone.iloc[0])


@pytest.mark.parametrize("behind", [False, True])
def test_elastic_coupler_solves_its_equation_backwards_too_and_stays_stable(behind):
    n = 241
    phi = 2.0 * np.pi * np.arange(n) / n
    elastic = {"driven_inertia": 0.6, "stiffness": 2e4, "damping": 3.0, "load_torque": -900.0, "speed": -OMEGA}
    tip = {"m_tool": 2e-5, "tool_x": 70.0} if behind else {}
    poses = sweep.evaluate("rssr", LINKS | elastic | tip, ["lag_dynamic", "t_tau", "d2psi"], phi=phi)
    assert (poses["status"] == st.OK).all()
    eta, p = poses["lag_dynamic"].to_numpy(), poses["t_tau"].to_numpy() * LINKS["c"]
    inertia = 0.6 + (2e-5 * 70.0**2 if behind else 0.0)
    rate, bend = derivative(eta), derivative(derivative(eta))
    left = inertia * OMEGA**2 * bend - 3.0 * OMEGA * p**2 * rate
    left += (2e4 * p**2 - 3.0 * OMEGA * p * derivative(p)) * eta
    right = -900.0 - inertia * OMEGA**2 * poses["d2psi"].to_numpy()
    # second derivative by the Fourier transform: rounding times N^2/4 of the series, whose tail is 1e-9
    assert np.abs(left - right).max() < 1e-6 * np.abs(right).max()
    floquet = [
        sweep.summarise("rssr", LINKS | elastic | tip | {"speed": s}, ["floquet"])["floquet"][0]
        for s in (OMEGA, -OMEGA)
    ]
    assert floquet[1] < 1.0 and floquet[1] == pytest.approx(floquet[0], rel=1e-6)


def test_lives_count_turns_whichever_way_they_go():
    bearing = {"radial_factor": 0.56, "axial_factor": 1.5, "e_limit": 0.3, "dynamic_capacity": 6000.0,
               "required_life": 2e7, "support_d1": -20.0, "support_d2": 30.0, "resisting_torque": 500.0}  # fmt: skip
    names = ["life_d1", "max_rolling_utilisation", "max_frequency_ratio"]
    elastic = {"driven_inertia": 0.6, "stiffness": 2e4}
    ahead, back = (
        sweep.summarise("rssr", LINKS | BODIES | bearing | elastic | {"speed": s * OMEGA}, names, accuracy=1e-8)
        for s in (1.0, -1.0)
    )
    np.testing.assert_array_equal(ahead[names], back[names])


def test_a_crank_at_rest_is_refused_by_name_in_tables_and_studies(tmp_path):
    with pytest.raises(InputError, match=r"speed.*non-zero"):
        sweep.evaluate("rssr", CRANK_ROCKER | {"speed": 0.0}, ["drive_torque"], phi=PHI)
    data = {
        "study": {"name": "still", "title": "t", "question": "q"},
        "mechanism": {"family": "swivel"},
        "scene": {"speed": "0 rpm", "want": ["max_abs_drive_torque"]},
        "design": {"a": "1 mm", "e": {"from": 2.0, "to": 3.0, "count": 2, "unit": "mm"}},
    }
    with pytest.raises(StudyError, match=r"scene.speed.*non-zero"):
        study_from_data(data, tmp_path / "study.toml")
    data["scene"]["speed"] = "-300 rpm"
    study = study_from_data(data, tmp_path / "study.toml")
    assert study.speed == pytest.approx(-300.0 * 2.0 * np.pi / 60.0)
