"""Events, residence and speeds between the members of a machine, against dense grids and differences.

A dense grid finds a passage to its step squared where the slope is steady; central differences of step 1e-5 are right
to 1e-9 of a length of some 100.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import mpmath as mp
import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import StudyError
from sweep.study import load_study, study_from_data
from tests.evaluation.test_machines import LOOPER, TABLE, two
from tests.reference import spherical_looper
from tests.reference.space import exact

MEMBERS = {
    "needle": ["rssr", "guide"],
    "looper": {
        "family": "rssr", "tip": [30.0, 1.0, -2.0], "offset": 0.3,
        "place": {"at": [-80.0, 60.0, 4.0], "axis": [0.6, 0.8, 0.0], "zero": [0.0, 0.0, 1.0]},
    },
}  # fmt: skip
RELATIONS = {
    "clearance": {"distance": ["needle.point", "looper.tip"]},
    "pace": {"speed": ["looper.tip"]},
    "arrive": {"event": "clearance", "level": 35.0, "rising": False},
    "leave": {"event": "clearance", "level": 35.0},
    "plane": {"event": "looper.tip_z", "level": 30.0},
    "stay": {"timing": ["phi_arrive", "phi_leave"]},
}


def grid(machine: object, name: str) -> tuple[np.ndarray, np.ndarray]:
    phi = np.linspace(0.0, 2.0 * np.pi, 20001)
    return phi, sweep.evaluate(machine, TABLE, [name], phi=phi)[name].to_numpy()


def passages(values: np.ndarray, phi: np.ndarray, level: float, rising: bool) -> np.ndarray:
    off = (values - level) if rising else (level - values)
    k = np.flatnonzero((off[:-1] < 0.0) & (off[1:] >= 0.0))
    return np.asarray(phi[k] - off[k] * (phi[k + 1] - phi[k]) / (off[k + 1] - off[k]))


@pytest.mark.parametrize(
    ("event", "output", "level", "rising"),
    [("arrive", "clearance", 35.0, False), ("leave", "clearance", 35.0, True), ("plane", "looper.tip_z", 30.0, True)],
)
def test_event_is_where_a_dense_grid_passes_the_level(event: str, output: str, level: float, rising: bool) -> None:
    machine = sweep.machine(MEMBERS, RELATIONS)
    found = sweep.summarise(machine, TABLE, [f"phi_{event}", f"count_{event}"], accuracy=1e-8)
    phi, values = grid(machine, output)
    places = passages(values, phi, level, rising)
    assert len(places) > 0
    assert found[f"count_{event}"][0] == len(places)
    assert found[f"phi_{event}"][0] == pytest.approx(places[0], abs=1e-6)
    at = sweep.evaluate(machine, TABLE, [output], phi=[found[f"phi_{event}"][0]])[output][0]
    assert at == pytest.approx(level, abs=1e-11)


@pytest.mark.parametrize("level", [0.0, 1.0, 3.0, 4.0])
@pytest.mark.parametrize("ratio", [1, 2, -1])
def test_follower_that_turns_fully_passes_a_level_once_a_turn_and_never_back(level: float, ratio: int) -> None:
    """Its angle leaps by a full turn: that was a passage against its sense, at the sample before the leap."""
    k, a = 0.5, 0.2
    p, q = (a + mp.mpf(k)) / 2, (a - mp.mpf(k)) / 2
    on = mp.findroot(lambda al: al - mp.atan2(p * mp.sin(al), 1 + q * mp.cos(al)) - level, level)
    first = float(mp.fmod(on / ratio + 2 * mp.pi, 2 * mp.pi))
    events = {name: {"event": "n.psi", "level": level, "rising": name == "up"} for name in ("up", "down")}
    machine = sweep.machine({"n": {"family": "geared_dwell", "ratio": ratio}}, events)
    with_, against = ("up", "down") if ratio > 0 else ("down", "up")
    found = sweep.summarise(machine, {"n.k": k, "n.a": a}, [f"phi_{with_}", f"count_{with_}"]).iloc[0]
    assert found["status"] == st.OK and found[f"count_{with_}"] == abs(ratio)
    # mpmath's root is good to 15 digits of a double, as level and k are.
    assert abs(found[f"phi_{with_}"] - first) <= found[f"err_phi_{with_}"] + 1e-15 * (1.0 + first)
    never = sweep.summarise(machine, {"n.k": k, "n.a": a}, [f"phi_{against}"]).iloc[0]
    assert never["status"] == st.NO_EVENT and np.isnan(never[f"phi_{against}"])


def test_passage_at_the_start_of_the_turn_is_the_first_one() -> None:
    """A pin twice as fast rises through 0 at 0 and at pi: the one at 0 was taken for the last one."""
    machine = sweep.machine({"n": {"family": "slider_crank", "ratio": 2}}, {"up": {"event": "n.y_b"}})
    found = sweep.summarise(machine, {"n.a": 1.0, "n.b": 3.0, "n.e": 0.0}, ["phi_up", "count_up"]).iloc[0]
    assert found["phi_up"] == 0.0 and found["count_up"] == 2


@pytest.mark.parametrize(
    ("offset", "below"), [(0.0, 1e-6), (0.0, 1e-9), (0.0, 1e-13), (0.0, 3e-15), (0.7, 1e-6), (2.0, 1e-8)]
)
def test_error_of_a_passage_just_below_a_top_is_that_of_the_flat_curve_there(offset: float, below: float) -> None:
    """A pin at r sin(phi + offset); the error was 1e-14 of a slope between samples, that of the angle up to 1e-8."""
    radius, level = 3.7, 3.7 * (1.0 - below)
    rises = {"up": {"event": "n.y_b", "level": level}}
    machine = sweep.machine({"n": {"family": "slider_crank", "offset": offset}}, rises)
    found = sweep.summarise(machine, {"n.a": radius, "n.b": 9.0}, ["phi_up"], accuracy=1e-8).iloc[0]
    with mp.workdps(40):
        true = mp.asin(mp.mpf(level) / mp.mpf(radius)) - mp.mpf(offset)
        off = float(abs(mp.fmod(mp.mpf(float(found["phi_up"])) - true + mp.pi, 2 * mp.pi) - mp.pi))
    # The slope there is sqrt(2 below) of the radius.  The error is that of a few roundings of the radius, doubled till
    # the curve leaves them: at most some 60 units of 2^-53 over the slope.
    assert off <= found["err_phi_up"] <= 64.0 * 2.0**-53 / np.sqrt(2.0 * below)


def test_residence_below_a_level_is_the_timing_of_two_events() -> None:
    machine = sweep.machine(MEMBERS, RELATIONS)
    found = sweep.summarise(machine, TABLE, ["stay", "phi_arrive", "phi_leave"], accuracy=1e-8)
    phi, values = grid(machine, "clearance")
    inside = np.mean(values[:-1] < 35.0) * 2.0 * np.pi
    assert np.remainder(found["stay"][0], 2.0 * np.pi) == pytest.approx(inside, abs=2.0 * phi[1])


def test_event_that_never_happens_has_its_status_and_no_value() -> None:
    machine = sweep.machine(MEMBERS, {"far": {"event": "looper.tip_z", "level": 1e4}})
    found = sweep.summarise(machine, TABLE, ["phi_far", "count_far"], accuracy=1e-8)
    assert np.isnan(found["phi_far"][0]) and found["count_far"][0] == 0 and found["status"][0] != 0


def test_speed_of_a_point_is_the_difference_of_its_places() -> None:
    for members in (MEMBERS, MEMBERS | {"looper": MEMBERS["looper"] | {"ratio": 2}}):
        machine = sweep.machine(members, RELATIONS)
        phi, h = np.linspace(0.1, 6.0, 7), 1e-5
        names = [f"looper.tip_{axis}" for axis in "xyz"]
        ends = [sweep.evaluate(machine, TABLE, names, phi=phi + sign * h)[names].to_numpy() for sign in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * h)
        found = sweep.evaluate(machine, TABLE, ["pace", *(f"looper.dtip_{axis}" for axis in "xyz")], phi=phi)
        np.testing.assert_allclose(found[[f"looper.dtip_{axis}" for axis in "xyz"]], slope, atol=1e-7)
        np.testing.assert_allclose(found["pace"], np.linalg.norm(slope, axis=1), atol=1e-7)


def test_value_at_an_event_is_that_of_the_pose_there() -> None:
    relations = RELATIONS | {
        "nearing": {"speed": ["needle.point", "looper.tip"]},
        "hit": {"value": ["nearing", "phi_arrive"]},
        "nearest": {"value": ["pace", "phi_min_clearance"]},
    }
    machine = sweep.machine(MEMBERS, relations)
    names = ["hit", "nearest", "phi_arrive", "phi_min_clearance"]
    found = sweep.summarise(machine, TABLE, names, accuracy=1e-10)
    for name, of, place in (("hit", "nearing", "phi_arrive"), ("nearest", "pace", "phi_min_clearance")):
        at = sweep.evaluate(machine, TABLE, [of], phi=[found[place][0]])[of][0]
        assert found[name][0] == pytest.approx(at, rel=1e-13)
        assert 0.0 <= found[f"err_{name}"][0] < 1e-6
    # the tip comes nearer by what it moves towards the needle, so no faster than it moves against it
    phi, clearance = grid(machine, "clearance")
    k = np.searchsorted(phi, found["phi_arrive"][0])
    assert abs(np.diff(clearance)[k] / phi[1]) <= found["hit"][0]
    never = sweep.machine(
        MEMBERS, RELATIONS | {"far": {"event": "clearance", "level": 1e4}, "x": {"value": ["pace", "phi_far"]}}
    )
    assert np.isnan(sweep.summarise(never, TABLE, ["x"])["x"][0])


def test_value_of_a_derivative_has_its_unit() -> None:
    values = {name: {"value": [of, "looper.phi_max_psi"]} for name, of in VALUES.items()}
    machine = sweep.machine(MEMBERS, RELATIONS | values)
    units = sweep.summarise(machine, TABLE, [*VALUES]).attrs["units"]
    assert [units[name] for name in VALUES] == ["length", "length/rad", "length/rad^2", "length/rad", "1"]


VALUES = {"here": "needle.s", "quick": "needle.ds", "hit": "needle.d2s", "swift": "pace", "turning": "looper.d2psi"}


def test_error_of_a_value_knows_the_rounding_of_poses_where_the_slope_tells_nothing() -> None:
    """At the least clearance the slope is zero: the error of the value was 0."""
    machine = sweep.machine(MEMBERS, RELATIONS | {"least": {"value": ["clearance", "phi_min_clearance"]}})
    found = sweep.summarise(machine, TABLE, ["least", "min_clearance"], accuracy=1e-10).iloc[0]
    assert abs(found["least"] - found["min_clearance"]) <= found["err_least"]
    assert 2.0**-53 * found["least"] <= found["err_least"] <= 1e-11 * found["least"]


def test_guided_point_moves_at_the_rate_of_its_places() -> None:
    machine = sweep.machine(MEMBERS, {"pace": {"speed": ["needle.point"]}})
    phi, h = np.linspace(0.1, 6.0, 7), 1e-5
    names = [f"needle.point_{axis}" for axis in "xyz"]
    ends = [sweep.evaluate(machine, TABLE, names, phi=phi + sign * h)[names].to_numpy() for sign in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2.0 * h)
    found = sweep.evaluate(machine, TABLE, ["pace", *(f"needle.dpoint_{axis}" for axis in "xyz")], phi=phi)
    np.testing.assert_allclose(found[[f"needle.dpoint_{axis}" for axis in "xyz"]], slope, atol=1e-6)
    np.testing.assert_allclose(found["pace"], np.linalg.norm(slope, axis=1), atol=1e-6)
    alone = sweep.evaluate("guide", sweep.families.family("guide").example, ["dx_m", "d2x_m", "ds", "ddev"], phi=phi)
    lam = sweep.families.family("guide").example["lam"]
    np.testing.assert_allclose(alone.dx_m, alone.ds * np.cos(lam) - alone.ddev * np.sin(lam), rtol=1e-14, atol=1e-14)


def test_speed_of_a_tip_is_radius_times_rate() -> None:
    found = sweep.evaluate(two(), TABLE, ["looper.dpsi", "looper.dtip_x", "looper.dtip_y", "looper.dtip_z"], phi=[1.0])
    size = np.linalg.norm(found[["looper.dtip_x", "looper.dtip_y", "looper.dtip_z"]].to_numpy()[0])
    assert size == pytest.approx(np.hypot(30.0, 1.0) * abs(found["looper.dpsi"][0]), rel=1e-14)


def test_speed_relative_to_a_point_that_moves_alike_is_zero() -> None:
    members = {"one": {"family": "rssr", "tip": [9.0, 0.0, 0.0]}, "two": {"family": "rssr", "tip": [9.0, 0.0, 0.0]}}
    machine = sweep.machine(members, {"apart": {"speed": ["one.tip", "two.tip"]}, "own": {"speed": ["two.tip"]}})
    table = {f"{m}.{name}": value for m in members for name, value in LOOPER.items()}
    found = sweep.evaluate(machine, table, ["apart", "own"], phi=[0.2, 2.0])
    assert (found["apart"] == 0.0).all() and (found["own"] > 0.0).all()


def test_slopes_of_a_residence_are_those_of_differences() -> None:
    import pandas as pd

    from sweep.optimise.manufacture.tolerance import sensitivities

    machine = sweep.machine(MEMBERS, RELATIONS)
    names = list(machine.parameter_names)
    design = np.array([TABLE.iloc[0].get(n, p.default) for n, p in zip(names, machine.parameters, strict=True)], float)
    rows = pd.DataFrame(sensitivities(machine, design, ["stay"]))
    for name in ("looper.a", "looper.x_at"):
        ends = []
        for sign in (1.0, -1.0):
            moved = design.copy()
            moved[names.index(name)] += sign * 1e-3
            ends.append(
                sweep.summarise(machine, dict(zip(names, moved, strict=True)), ["stay"], accuracy=1e-12)["stay"][0]
            )
        own = rows[(rows["parameter"] == name) & (rows["output"] == "stay")]["growing"].iloc[0]
        # Both are differences: of step 1e-3 here, whose square counts, and of the optimiser's own there.
        assert own == pytest.approx((ends[0] - ends[1]) / 2e-3, rel=1e-3, abs=1e-6), name


@pytest.mark.parametrize(
    ("relations", "word"),
    [
        ({"x": {"event": "looper.tip_q"}}, "did you mean 'looper.tip_"),
        ({"x": {"event": "looper.psi", "levle": 1.0}}, "did you mean 'level'"),
        ({"x": {"event": "looper.psi", "level": "1 rad"}}, "a number"),
        ({"x": {"event": "looper.psi", "rising": 1}}, "true or false"),
        ({"x": {"speed": ["needle.b"]}}, "needle.point"),
        ({"x": {"value": ["pacr", "phi_arrive"]}}, "a pose output of the machine"),
        ({"x": {"value": ["looper.tip_x"]}}, "a crank angle"),
        ({"x": {"speed": ["looper.tip", "looper.tip", "looper.tip"]}}, "two"),
    ],
)
def test_what_is_no_event_or_speed_is_refused_with_the_remedy(relations: dict, word: str) -> None:
    with pytest.raises(sweep.InputError, match=word):
        sweep.machine(MEMBERS, relations)


@pytest.mark.parametrize(
    ("given", "wrong", "word"),
    [
        ({"timing": ["needle.stroke", "phi_arrive"]}, "timing = 'needle.stroke'", ""),
        ({"timing": ["phi_arrive", "phi_leav"]}, "timing = 'phi_leav'", "did you mean 'phi_leave'"),
        ({"timing": ["x", "phi_arrive"]}, "timing = 'x'", ""),
        ({"value": ["pace", "min_clearance"]}, "value = 'min_clearance'", "did you mean 'phi_min_clearance'"),
    ],
)
def test_timing_of_what_is_no_crank_angle_is_refused(given: dict, wrong: str, word: str) -> None:
    machine = sweep.machine(MEMBERS, RELATIONS | {"x": given})
    with pytest.raises(sweep.InputError, match=f"machine.relations.x: {wrong}; allowed: a crank angle.*{word}"):
        sweep.summarise(machine, TABLE, ["x"], accuracy=1e-8)


def test_study_file_with_a_timing_of_what_is_no_crank_angle_names_its_key() -> None:
    more = {"stay": {"timing": ["phi_arrive", "phi_leav"]}}
    with pytest.raises(StudyError, match=r"relations\.stay\.timing = 'phi_leav'; allowed: a crank angle"):
        study_with(more, event="looper.tip_y", level="2 cm")


def study_with(more: Mapping[str, object] = MappingProxyType({}), /, **event: object) -> object:
    fixed = {
        name: (f"{value} {'rad' if name.startswith(('alpha', 'offset')) else 'mm'}") for name, value in LOOPER.items()
    }
    data = {
        "study": {"name": "x"},
        "machine": {"looper": {"family": "rssr", "tip": ["30 mm", "0 mm", "0 mm"]}},
        "relations": {"arrive": event, **more},
        "scene": {"want": ["phi_arrive"]},
        "design": {"looper": {k: v for k, v in fixed.items() if k != "branch"}},
    }
    return study_from_data(data, "x")


def test_study_file_gives_the_level_in_its_unit() -> None:
    assert study_with(event="looper.tip_y", level="2 cm").family.events[0].level == 20.0
    assert study_with(event="looper.psi", level="90 deg", rising=False).family.events[0].level == np.pi / 2
    assert study_with(event="looper.dpsi", level=0.5).family.events[0].level == 0.5


@pytest.mark.parametrize("level", ["2 deg", 3.0, "3"])
def test_study_file_with_a_level_of_another_unit_is_refused(level: object) -> None:
    with pytest.raises(StudyError, match="a length"):
        study_with(event="looper.tip_y", level=level)


def test_pressure_angle_of_a_member_with_two_stages_can_be_searched() -> None:
    import pandas as pd

    from sweep.optimise.manufacture.tolerance import sensitivities

    machine = two()
    names = list(machine.parameter_names)
    design = np.array([TABLE.iloc[0].get(n, p.default) for n, p in zip(names, machine.parameters, strict=True)], float)
    rows = pd.DataFrame(sensitivities(machine, design, ["needle.max_pressure_angle"]))
    alone = pd.DataFrame(
        sensitivities(
            sweep.families.family(["rssr", "guide"]),
            machine.members[0].designs(design[None, :])[0],
            ["max_pressure_angle"],
        )
    )
    own = rows[rows["parameter"].str.startswith("needle.")].assign(parameter=lambda r: r["parameter"].str[7:])
    both = own.merge(alone, on="parameter")
    assert len(both) == len(alone) > 10
    np.testing.assert_allclose(both["growing_x"], both["growing_y"], rtol=1e-9, atol=1e-12)


# Design 10372 of studies/looper-sphere, whose looper comes within 0.5 mm of a needle 60 mm away from the origin.
GOES_ALONG = {
    "a1": 4.603196346747248, "b1": 35.072, "c1": 22.656, "e1": 28.058, "f1": 28.355, "g1": -8.831,
    "alpha1": 1.5707963267948966, "branch1": -1.0, "o": 19.517, "delta": 1.285, "gamma": 5.3027, "c0x": 7.319,
    "c0y": 16.241, "c0z": -6.796, "p0x": -8.883336635011608, "p0y": 20.84001539041491, "p0z": 30.9230679501075,
    "a2": 7.410353096877263, "b2": 59.953, "x2": 0.0, "y2": 45.018, "z2": 0.0, "theta2": 1.5707963267948966,
    "beta2": 1.5707963267948966, "offset2": 1.419343745708947, "branch2": 1.0,
}  # fmt: skip
PLACE = {"offset": 4.095310633472646, "x_at": 40.76227666369813, "y_at": -25.469502725522137, "z_at": -37.5966759953173}


def test_error_of_an_event_covers_the_rounding_of_what_the_level_is_passed_by() -> None:
    """A small distance of places far out is known no better than these; the error was that of the level alone."""
    machine = load_study(Path(sweep.__file__).parents[1] / "studies" / "looper-sphere").bare
    table = {"needle.a": 12.25, "needle.b": 60.0} | {f"looper.{k}": x for k, x in (GOES_ALONG | PLACE).items()}
    found = sweep.summarise(machine, table, ["phi_arrive"], accuracy=1e-8).iloc[0]
    start = float(found["phi_arrive"])
    pose = sweep.evaluate("spherical_looper", GOES_ALONG, ["psi", "chi"], phi=[start + PLACE["offset"]]).iloc[0]
    near = {name: mp.mpf(float(pose[name])) for name in ("psi", "chi")}
    offset, *at = exact(PLACE.values())

    def off(phi: mp.mpf) -> mp.mpf:
        needle = 12.25 * mp.cos(phi) + mp.sqrt(60**2 - (12.25 * mp.sin(phi)) ** 2)  # down x, its lowest at 0
        tip = spherical_looper.position(exact(GOES_ALONG.values()), phi + offset, near)
        x, y, z = at[0] + tip["x_p"], at[1] + tip["z_p"], at[2] - tip["y_p"]  # its axis is y of the machine
        return mp.sqrt((x - needle) ** 2 + y**2 + z**2) - mp.mpf("0.5")

    with mp.workdps(100):
        true = mp.findroot(off, (mp.mpf(start), mp.mpf(start) + mp.mpf(10) ** -12), tol=mp.mpf(10) ** -30)
        error = abs(float(mp.mpf(start) - true))
    assert error <= found["err_phi_arrive"] < 1e-12
