"""Members and shafts that stand or are turned a little elsewhere carry all of their points with them."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp
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


def lever_tip(phi, place, tip, tilt):
    """x of the tip of a lever that a cam turns three times backwards, by 40 digits; 3-4-5 law, on its way up."""
    with mp.workdps(40):
        z, x = (mp.matrix(place[key]) for key in ("axis", "zero"))
        z /= mp.norm(z)
        x -= (x.T * z)[0] * z
        x /= mp.norm(x)
        y = mp.matrix([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
        share = ((mp.mpf(0.7) - 3 * phi - mp.mpf(0.2)) % (2 * mp.pi)) / mp.mpf(1.5)
        rest = mp.pi - mp.acos((45**2 + 35**2 - 22**2) / mp.mpf(2 * 45 * 35))
        psi = mp.mpf(0.4) * (10 * share**3 - 15 * share**4 + 6 * share**5) - rest
        along, across = tip[0] * mp.cos(psi) - tip[1] * mp.sin(psi), tip[0] * mp.sin(psi) + tip[1] * mp.cos(psi)
        point = (45 + along) * x + across * y + tip[2] * z
        for k, angle in enumerate(map(mp.mpf, tilt)):
            i, j = (k + 1) % 3, (k + 2) % 3
            cos, sin = mp.cos(angle), mp.sin(angle)
            point[i], point[j] = cos * point[i] - sin * point[j], sin * point[i] + cos * point[j]
        return place["at"][0] + point[0]


def test_error_of_an_event_counts_the_rounding_of_the_place_of_its_member():
    """The coordinate is small beside its terms, and the directions of a place, which round too, are no inputs."""
    worst = 0.0
    cam = {"lift": 0.4, "rise": 1.5, "dwell": 0.5, "fall": 1.5, "start": 0.2, "r0": 22.0, "c": 35.0, "e": 45.0}
    design = {f"x.{key}": value for key, value in cam.items()} | {"x.branch": -1.0}
    for seed in range(40, 50):
        rng = np.random.default_rng(seed)
        tip, axis, zero = (rng.normal(0.0, size, 3).tolist() for size in (15.0, 1.0, 1.0))
        place = {"at": [0.0, 0.0, 0.0], "axis": axis, "zero": zero}
        tilt = rng.uniform(-0.5, 0.5, 3).tolist()
        lowest, highest = (float(lever_tip(mp.mpf((0.5 - x) / 3.0), place, tip, tilt)) for x in (0.01, 1.49))
        place["at"][0] = -(0.35 * lowest + 0.65 * highest)
        event = {"event": "x.tip_x", "rising": lowest > highest}  # the cam turns backwards
        member = {"family": "cam_lever", "ratio": -3, "offset": 0.7, "place": place, "tip": tip}
        turned = {f"x.{x}_tilt": angle for x, angle in zip("xyz", tilt, strict=True)}
        made = sweep.machine({"x": member}, {"up": event})
        got = sweep.summarise(made, design | turned, ["phi_up"], accuracy=1e-10).iloc[0]
        near = [lever_tip(mp.mpf(got["phi_up"]) + k * mp.mpf(10) ** -7, place, tip, tilt) for k in (-1, 0, 1)]
        off = abs(near[1] / (near[2] - near[0])) * 2 * mp.mpf(10) ** -7
        assert off <= got["err_phi_up"] < 1e-12, seed
        worst = max(worst, float(off))
    assert worst > 1e-15
