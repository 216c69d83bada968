"""Loads of a crank-rocker and of its mirror image, and of mechanisms in other units of length, mass and time."""

from __future__ import annotations

import re

import numpy as np
import pytest

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import applicable, extended
from sweep.families import family
from tests.effects.test_motor_line import CRANK_ROCKER, RUBBING

PHI = np.linspace(0.07, 6.2, 31)
# Without any symmetry; seen through z = 0 these change their sign, and alpha becomes pi - alpha.
SKEW = {"com_crank_y": 3.0, "com_coupler_z": -4.0, "com_rocker_z": 5.0, "j_crank_xy": 0.02, "j_crank_yz": -0.03,
        "j_coupler_xz": 0.01, "j_coupler_yz": 0.02, "j_rocker_xz": -0.03, "j_rocker_yz": 0.04, "gravity_z": 4000.0,
        "tool_force_z": 7.0, "tool_z": -9.0, "speed_change": 3e4}  # fmt: skip
TURNED = {*SKEW, "g", "speed", "support_d1", "support_d2"}
LOADED = CRANK_ROCKER | RUBBING | SKEW | {"m_tool": 2e-5, "tool_x": 70.0, "tool_force_x": -5.0, "j_crank_xx": 0.2}
LENGTH, MASS, TIME = 1.7, 0.37, 0.61
POWERS = {"length": (1, 0, 0), "mass": (0, 1, 0), "time": (0, 0, 1), "rad": (0, 0, 0), "1": (0, 0, 0), "s": (0, 0, 1)}
POWERS |= {"force": (1, 1, -2), "torque": (2, 1, -2), "inertia": (2, 1, 0), "pressure": (-1, 1, -2)}
POWERS |= {"speed": (0, 0, -1), "acceleration": (1, 0, -2), "angular_acceleration": (0, 0, -2)}
POWERS |= {"line_mass": (-1, 1, 0), "stiffness": (0, 1, -2), "damping": (0, 1, -1), "rotary_damping": (2, 1, -1)}
POWERS |= dict.fromkeys(("angle", "ratio", "sign", "choice", "count", "none"), (0, 0, 0))


def test_a_mirrored_crank_rocker_that_turns_backwards_has_the_mirrored_loads() -> None:
    mirrored = {name: -x if name in TURNED else x for name, x in LOADED.items()} | {"alpha": np.pi - LOADED["alpha"]}
    vectors = [f"force_{k}{tail}" for tail in ("", "_friction") for k in "abcd"]
    vectors += [f"{what}{tail}" for tail in ("", "_friction") for what in ("moment_a", "moment_d", "shaking_moment")]
    numbers = ["ball_couple_b", "ball_couple_c", *(f"load_support_{k}" for k in ("a1", "a2", "d1", "d2"))]
    turning = ["drive_torque", "drive_torque_friction", "shaft_torque_a"]
    names = [*(f"{v}_{x}" for v in vectors for x in "xyz"), *numbers, *turning, "shaft_torque_d"]
    one = sweep.evaluate("rssr", LOADED, names, phi=PHI)
    other = sweep.evaluate("rssr", mirrored, names, phi=-PHI)
    assert (one["status"] == st.OK).all() and (other["status"] == st.OK).all()
    for name in names:
        sign = -1.0 if name in turning else 1.0
        if name[-2:] in ("_x", "_y", "_z"):  # forces are seen as arrows are, moments as turning is
            sign = (-1.0 if name.endswith("_z") else 1.0) * (-1.0 if "moment" in name else 1.0)
        size = one[[like for like in names if like[:-2] == name[:-2]]].abs().to_numpy().max()  # of the whole vector
        np.testing.assert_allclose(sign * other[name], one[name], rtol=0.0, atol=1e-11 * size, err_msg=name)


def scale(unit: str) -> float:
    """Factor of a quantity in the other units."""
    total = np.zeros(3)
    for sign, word, power in re.findall(r"(^|[*/])(\w+)(?:\^(\d))?", unit):
        total += (-1 if sign == "/" else 1) * int(power or 1) * np.array(POWERS[word])
    return float(np.prod(np.power([LENGTH, MASS, TIME], total)))


@pytest.mark.parametrize(
    ("name", "effect"),
    [("rssr", effect) for effect in ("friction", "bearing_life", "rolling_bearings", "sliding_bearings",
                                     "dynamic_elasticity", "speed_fluctuation", "tip_tool")]
    + [("slotted", f"slotted_{effect}") for effect in ("contact", "rolling_bearings", "sliding_bearings")]
    + [("cam", "cam_roller")],
)  # fmt: skip
def test_every_output_in_other_units_has_its_dimension(name: str, effect: str) -> None:
    (placed,) = (p for p in applicable(family(name)) if p.name == effect)
    curves = [o for o in placed.pose_outputs if o.name != "friction_passes"]
    full = extended(family(name), [o.name for o in placed.outputs])
    table = {p.name: ordinary(full, 3)[:, k] for k, p in enumerate(full.parameters)}
    other = {p.name: table[p.name] * scale(p.unit) for p in full.parameters}
    for outputs, accuracy in ((curves, 1e-11), (placed.design_outputs, 1e-7)):
        names = [o.name for o in outputs]
        if not names:
            continue
        if outputs is curves:
            ours, theirs = (sweep.evaluate(name, t, names, phi=PHI) for t in (table, other))
        else:
            ours, theirs = (sweep.summarise(name, t, names) for t in (table, other))
        assert (ours["status"] == theirs["status"]).all() and (ours["status"] == st.OK).any()
        for o in outputs:
            size = accuracy * ours[o.name].abs().max()
            np.testing.assert_allclose(
                theirs[o.name] / scale(o.unit), ours[o.name], rtol=0.0, atol=size, err_msg=o.name
            )
