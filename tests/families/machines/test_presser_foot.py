"""The foot of a machine is that of the family alone at a shifted angle, and its cyclogram is what its heights show."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq

import sweep
from sweep.families.foot import EVENT_OUTPUTS
from sweep.study import study_from_data
from tests.families.foot.test_fabric import SWINGING

TURN = 2.0 * math.pi
# The rack of the study feed208 [mm, rad], and its foot [t, N/mm, N, rad/s].
RACK = {
    "h_a": 2.0, "h_b": 34.0, "h_c": 16.0, "h_e": 35.0, "rh": 12.0, "dh": math.radians(-17.0), "xE": 56.0, "yE": 7.0,
    "rE": 0.9, "dE": math.radians(45.0), "q": 26.0, "fx": -17.0, "fy": 6.0, "tx": -3.0, "ty": 9.0, "y_plate": 14.8,
    "h_sigma": -1.0, "bar_branch": -1.0,
}  # fmt: skip
FOOT = {"m": 6e-5, "k": 2.0, "F0": 40.0, "omega": math.radians(7000.0 * 6.0)}
FLYING = FOOT | {"F0": 20.0}
OFFSET = 0.7
PRESS = {"foot": {"press": "feed"}}
# What carries the crank, and its angle at that of 0 of the main shaft, by docs/machines.md.
MOUNTS = {
    "offset": ({"offset": OFFSET}, None, 1, OFFSET),
    "backwards": ({"offset": OFFSET, "ratio": -1}, None, -1, OFFSET),
    "key": ({"shaft": "main", "key": 0.4, "turn": 0.1}, {"main": {}}, 1, 0.3),
    "against the shaft": ({"shaft": "main", "key": 0.4, "sense": -1}, {"main": {}}, -1, -0.4),
    "twice backwards": (
        {"shaft": "low", "key": 0.4, "sense": -1}, {"main": {}, "low": {"ratio": -1, "phase": 0.2}}, 1, -0.6,
    ),
}  # fmt: skip


def machine_with(mount="offset"):
    """Machine of a feed and its foot; turns of the feed's crank for one of the main shaft, and its angle there at 0."""
    member, shafts, ratio, phase = MOUNTS[mount]
    return sweep.machine({"feed": {"family": "feed"} | member}, PRESS, shafts), ratio, phase


def of_machine(foot):
    named = {f"foot_{'speed' if name == 'omega' else name}": value for name, value in foot.items()}
    return {f"feed.{name}": value for name, value in RACK.items()} | named


@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("mount", [name for name, (_, _, ratio, _) in MOUNTS.items() if ratio == 1])
def test_foot_of_a_machine_is_the_foot_alone_at_a_shifted_angle(mount, restitution):
    machine, _, phase = machine_with(mount)
    foot, names = FLYING | {"restitution": restitution}, [o.name for o in EVENT_OUTPUTS]
    alone = sweep.summarise("feed_foot", RACK | foot, names).iloc[0]
    own = {name: f"phi_foot_{name[4:]}" if name.startswith("phi_") else f"foot_{name}" for name in names}
    found = sweep.summarise(machine, of_machine(foot), list(own.values()), samples=720).iloc[0]
    assert found["status"] == alone["status"] == 0 and alone["flights"] >= 1.0
    for name, other in own.items():
        if name.startswith("phi_"):
            assert found[other] == pytest.approx((alone[name] - phase) % TURN, abs=1e-15)
        else:
            assert found[other] == alone[name], name


@pytest.mark.parametrize("mount", MOUNTS)
def test_foot_is_lost_where_nothing_presses_it_and_lands_where_its_free_flight_ends(mount):
    machine, ratio, phase = machine_with(mount)
    names = ["phi_foot_loss", "phi_foot_land", "foot_flights"]
    loss, land, flights, *_ = sweep.summarise(machine, of_machine(FLYING), names).iloc[0]
    ends = np.array([loss, land]) * ratio + phase
    y, dy, d2y = sweep.evaluate("feed", RACK, "y_t, dy_t, d2y_t", phi=ends)[["y_t", "dy_t", "d2y_t"]].to_numpy().T
    mass, spring, preload, speed = FLYING.values()
    y = np.maximum(y - RACK["y_plate"], 0.0)
    # the march interpolates curvature between its nodes: a contact force to 1e-7 of the preload
    assert preload + spring * y[0] + mass * speed**2 * d2y[0] == pytest.approx(0.0, abs=1e-6 * preload)
    natural, t = math.sqrt(spring / mass), ((land - loss) % TURN) / speed
    rest, rate = -preload / spring, dy[0] * ratio * speed
    free = rest + (y[0] - rest) * math.cos(natural * t) + rate / natural * math.sin(natural * t)
    assert free == pytest.approx(y[1], abs=1e-10) and flights == 1.0


def test_errors_cover_what_a_far_finer_march_finds():
    machine, _, _ = machine_with()
    names = ["foot_least_force", "foot_most_force", "foot_impact_speed"]
    found = sweep.summarise(machine, of_machine(FOOT), names, accuracy=1e-8).iloc[0]
    fine = sweep.evaluate("feed_foot", RACK | FOOT, "y_rack, force", phi=np.arange(14400) * (TURN / 14400))
    force = fine.force.to_numpy()
    lowest = int(np.where(fine.y_rack > 0.0, force, np.inf).argmin())
    a, b, c = force[lowest - 1 : lowest + 2]
    least = b - (c - a) ** 2 / (8.0 * (a - 2.0 * b + c))
    assert abs(found.foot_least_force - least) <= found.err_foot_least_force < 1e-9 * FOOT["F0"]
    assert abs(found.foot_most_force - fine.force.max()) <= found.err_foot_most_force + 1e-12


def test_error_of_the_angle_of_loss_covers_where_no_force_is_left():
    """A march of twice the nodes errs alike in places: of 200 such errors 13 were too small, up to 108 times."""
    machine, _, _ = machine_with("offset")
    preload = np.linspace(17.0, 29.5, 80)
    found = sweep.summarise(machine, of_machine(FOOT | {"F0": preload}), "phi_foot_loss", accuracy=1e-8)
    mass, spring, _, speed = FOOT.values()

    def force(phi):
        at = sweep.evaluate("feed", RACK | {"phi": phi}, "y_t, d2y_t")
        return preload + spring * (at.y_t - RACK["y_plate"]) + mass * speed**2 * at.d2y_t

    loss, step = found.phi_foot_loss + OFFSET, 1e-5
    off = np.abs(2.0 * step * force(loss) / (force(loss + step) - force(loss - step)))
    assert (found.status == 0).all() and (off <= found.err_phi_foot_loss).all()
    assert np.median(found.err_phi_foot_loss) < 3e-8


@pytest.mark.parametrize("mount", MOUNTS)
def test_rows_of_a_foot_that_keeps_contact_are_the_events_of_its_feed(mount):
    machine, ratio, phase = machine_with(mount)
    rows = sweep.cyclogram(machine, of_machine(FOOT)).query("member == 'foot'")
    feed = sweep.summarise("feed", RACK, "phi_entry, phi_leave, rise", accuracy=1e-12).iloc[0]

    def slope(phi):
        return sweep.evaluate("feed", RACK, "dy_t", phi=[phi]).dy_t[0]

    top = brentq(slope, feed.phi_entry, feed.phi_leave + TURN, xtol=1e-15)
    ends = [((phi - phase) * ratio) % TURN for phi in (feed.phi_entry, top, feed.phi_leave)][::ratio]
    found = rows.set_index("name")
    assert sorted(found.index) == ["falls", "low", "rises"]
    for name, start, end, size in (
        ("rises", ends[0], ends[1], feed.rise), ("falls", ends[1], ends[2], -feed.rise), ("low", ends[2], ends[0], 0.0),
    ):  # fmt: skip
        assert found.loc[name, ["start", "end", "size"]].to_list() == pytest.approx([start, end, size], abs=1e-11)
    assert found.loc["low", "kind"] == "dwell"


@pytest.mark.parametrize(("preload", "restitution"), [(20.0, 0.0), (40.0, 0.0), (40.0, 0.3)])
def test_rows_are_what_a_dense_look_at_the_marched_heights_shows(preload, restitution):
    machine, _, phase = machine_with()
    foot = FOOT | {"F0": preload, "restitution": restitution}
    every = sweep.cyclogram(machine, of_machine(foot))
    rows = every.query("member == 'foot'")
    phi = np.arange(7200) * (TURN / 7200)
    look = sweep.evaluate("feed_foot", RACK | foot, "y_rack, y_foot, force", phi=phi)
    rack, height, force = (look[name].to_numpy() for name in ("y_rack", "y_foot", "force"))
    rising = np.roll(rack, -1) > np.roll(rack, 1)
    shown = np.where(force == 0.0, "flies", np.where(rack <= 0.0, "low", np.where(rising, "rises", "falls")))
    assert (height[shown == "low"] == 0.0).all() and (height[shown == "rises"] == rack[shown == "rises"]).all()
    assert (height[shown == "flies"] > np.maximum(rack, 0.0)[shown == "flies"]).all()
    told = np.zeros(phi.size)
    for row in rows.itertuples():
        since, lasts = (phi - phase - row.start) % TURN, (row.end - row.start) % TURN
        inside = (since > 1e-6) & (since < lasts - 1e-6)
        told += inside
        # a look between two nodes to either side of a top sees it rise or fall
        sure = inside & ((shown == "flies") | (np.abs(np.roll(rack, -1) - np.roll(rack, 1)) > 1e-6))
        assert set(shown[sure]) <= {row.name}, row
        if row.kind == "stroke":
            ends = np.interp([row.start + phase, row.end + phase], phi, height, period=TURN)
            assert row.size == pytest.approx(ends[1] - ends[0], abs=2e-3)
    assert told.max() == 1.0 and told.sum() > phi.size - 3 * len(rows)
    events = every.query("kind == 'event'").set_index("name")["start"]
    flights = rows.query("kind == 'flight'")
    found = sweep.summarise(machine, of_machine(foot), "foot_flights, foot_settled").iloc[0]
    assert len(flights) == found.foot_flights and found.foot_settled == 1.0
    assert set(events.index) == ({"foot_loss", "foot_land"} if found.foot_flights else set())
    if len(flights):
        pairs = flights[["start", "end"]].to_numpy()
        assert np.abs(pairs - [events["foot_loss"], events["foot_land"]]).max(axis=1).min() < 1e-12


def test_chart_hatches_the_flight_from_loss_to_landing():
    machine, _, _ = machine_with()
    rows = sweep.cyclogram(machine, of_machine(FLYING)).set_index("name")
    axes = sweep.plot.cyclogram(machine, of_machine(FLYING))
    (bar,) = (one for one in axes.collections if one.get_hatch())
    ends = np.concatenate([path.vertices[:, 0] for path in bar.get_paths()])
    loss, land = np.degrees(rows.loc[["foot_loss", "foot_land"], "start"])
    # The flight goes on over the zero of the main shaft, or it does not: its pieces end there.
    expected = {loss, land} if loss < land else {loss, 360.0, 0.0, land}
    assert set(np.round(ends, 9)) - {0.0} == set(np.round(list(expected), 9)) - {0.0}


def test_cyclogram_of_a_harmonic_foot_is_its_closed_form():
    lift, depth = 1.5, 0.5
    p = {"m": 5e-5, "k": 3.0, "F0": 6.0, "omega": 100.0, "Y": lift, "p": depth}
    rows = sweep.cyclogram("foot", p).set_index("name")
    entry, rise = math.asin(depth / lift), lift - depth
    for name, expected in (
        ("rises", [entry, 0.5 * math.pi, rise]), ("falls", [0.5 * math.pi, math.pi - entry, -rise]),
        ("low", [math.pi - entry, entry, 0.0]),
    ):  # fmt: skip
        assert rows.loc[name, ["start", "end", "size"]].to_list() == pytest.approx(expected, abs=1e-13)
    assert len(rows) == 3 and len(sweep.cyclogram("feed_foot", RACK | FOOT)) == 3


def test_a_foot_whose_turns_differ_has_events_only_and_one_on_fabric_flights_only():
    far = sweep.summarise("foot", SWINGING, "settled, flights").iloc[0]
    assert far.settled == 0.0 and set(sweep.cyclogram("foot", SWINGING)["kind"]) <= {"event"}
    soft = RACK | FLYING | {"kf": 1e3, "cf": 0.5}
    assert sweep.summarise("feed_foot", soft, "settled, flights").iloc[0][["settled", "flights"]].to_list() == [
        1.0,
        1.0,
    ]
    rows = sweep.cyclogram("feed_foot", soft).set_index("name")
    assert rows["kind"].value_counts().to_dict() == {"event": 2, "flight": 1}
    assert rows.loc["flies", ["start", "end"]].to_list() == rows.loc[["loss", "land"], "start"].to_list()


@pytest.mark.parametrize(
    ("members", "relation", "words"),
    [
        ({"feed": "feed"}, {"press": "fed"}, "feed"),
        ({"feed": "feed_triad"}, {"press": "feed"}, "family feed; feed is of feed_triad"),
        ({"feed": {"family": "feed", "ratio": 2}}, {"press": "feed"}, "ratio 1 or -1: feed rises 2 times a turn"),
        ({"arm": "rssr", "feed": {"family": "feed", "driver": "arm.psi"}}, {"press": "feed"}, "main shaft drives"),
        ({"feed": "feed"}, {"press": "feed", "sense": 1}, "press alone"),
    ],
)
def test_a_foot_without_a_rack_that_rises_once_a_turn_is_refused(members, relation, words):
    with pytest.raises(sweep.InputError, match=words):
        sweep.machine(members, {"foot": relation})


def test_the_least_preload_that_presses_with_a_force_is_found_as_an_optimum(tmp_path):
    """The least force grows with the preload, one for one, and the greatest one is the preload."""
    lengths = {"h_a", "h_b", "h_c", "h_e", "rh", "xE", "yE", "rE", "q", "fx", "fy", "tx", "ty", "y_plate"}
    feed = {k: f"{v!r} mm" if k in lengths else f"{v!r} rad" if k in ("dh", "dE") else v for k, v in RACK.items()}
    study = {
        "study": {"name": "press"},
        "machine": {"feed": {"family": "feed"}},
        "relations": PRESS,
        "scene": {"speed": "7000 rpm", "want": ["foot_flights"]},
        "design": {
            "feed": feed,
            "foot_m": "60 g",
            "foot_k": "2 N/mm",
            "foot_F0": {"from": 25, "to": 45, "count": 3, "unit": "N"},
        },
        "limits": {"foot_least_force": {"min": 1.0, "unit": "N"}},
        "objective": {"minimise": "foot_most_force"},
        "optimise": {"starts": 1, "seed": 1},
    }
    folder = sweep.run(study_from_data(study, "study.toml"), out=tmp_path / "designs", jobs=1)
    assert sweep.load(folder)["foot_F0"].to_list() == [35.0, 45.0]
    alone = sweep.summarise("feed_foot", RACK | FOOT, "least_force").least_force[0]
    best = pd.read_parquet(folder.parent / "_optimum.parquet").query("role == 'optimum'").iloc[0]
    assert best["foot_F0"] == pytest.approx(FOOT["F0"] + 1.0 - alone, rel=1e-8)
