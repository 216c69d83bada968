"""Members and shafts that stand or are turned a little elsewhere carry all of their points with them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sweep

AT, AXIS, ZERO = (3.0, -4.0, 5.0), (0.2, 1.0, -0.3), (1.0, 0.1, 0.0)
LINKS = {"a": 1.0, "b": 4.0, "c": 3.0, "e": 3.5, "f": 1.0, "g": 0.5, "alpha": 0.4, "branch": 1}
MOVE, TILT = np.array([0.3, -0.2, 0.1]), np.array([0.02, -0.05, 0.03])
PHI = np.linspace(0.0, 6.0, 7)
NAMES = [f"x.tip_{axis}" for axis in "xyz"]


def moved(name):
    given = {f"{name}{x}_at": at + step for x, at, step in zip("xyz", AT, MOVE, strict=True)}
    return given | {f"{name}{x}_tilt": angle for x, angle in zip("xyz", TILT, strict=True)}


@pytest.mark.parametrize("kind", ["member", "shaft"])
def test_points_move_with_the_place_of_their_member_or_shaft(kind):
    place = {"at": AT, "axis": AXIS, "zero": ZERO}
    member = {"family": "rssr", "tip": [2.0, 1.0, -1.0]}
    if kind == "member":
        machine, name = sweep.machine({"x": member | {"place": place}}), "x."
    else:
        shafts = {"main": {}, "upper": place | {"ratio": -2}}
        machine, name = sweep.machine({"x": member | {"shaft": "upper", "shift": 6.0}}, shafts=shafts), "upper_"
    design = {f"x.{key}": value for key, value in LINKS.items()}
    here, there = (sweep.evaluate(machine, design | more, NAMES, phi=PHI)[NAMES] for more in ({}, moved(name)))
    turned = Rotation.from_euler("xyz", TILT)  # about x, then y, then z of axes that stand still
    expected = turned.apply(here.to_numpy() - AT) + AT + MOVE
    np.testing.assert_allclose(there.to_numpy(), expected, rtol=0.0, atol=1e-13)


def test_the_phase_of_a_shaft_is_a_key_of_all_that_sits_on_it():
    shafts = {"main": {}, "upper": {"axis": AXIS, "zero": ZERO, "ratio": -2}}
    machine = sweep.machine({"x": {"family": "rssr", "tip": [2.0, 1.0, -1.0], "shaft": "upper"}}, shafts=shafts)
    design = {f"x.{key}": value for key, value in LINKS.items()}
    by = [sweep.evaluate(machine, design | more, NAMES, phi=PHI) for more in ({"upper_phase": 0.3}, {"x.key": 0.3})]
    np.testing.assert_array_equal(by[0][NAMES].to_numpy(), by[1][NAMES].to_numpy())
