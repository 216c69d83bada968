"""Yield of a machine whose members and their places are off, against circles and spheres that share no code with it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sweep
from sweep.evaluation.curves import motion_curves
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise.manufacture.sample import sampled_designs
from sweep.quantities.limits import Limit, meets
from sweep.study.study import Tolerance
from tests.families.machines.test_stitch_reference import ROWS, machine_of
from tests.reference import stitch

LENGTHS, ANGLES, TILTS, PHASE = 0.03, 1e-3, 5e-4, 4e-3
MADE, POSES = 1024, 720
SPEEDS = [50.0, 300.0, 900.0]
NAMES = ("a_clearance", "a_rise", "phi_a", "min_apart")
# The standard deviation of a share p of n mechanisms is sqrt(p (1 - p)/n); both samples have one, of 1024 each.
SHARE = 4.0 * np.sqrt(2.0 * 0.25 / MADE)
PLACED = ("needle", "looper")


def made(given, rng, n):
    """``n`` machines near one, every input a column (n, 1): dimensions, origin and direction of each member."""
    found = {name: float(x) + np.zeros((n, 1)) for name, x in stitch.flat(given).items()}

    def off(name, width):
        found[name] = found[name] + rng.normal(0.0, width / 3.0, (n, 1))

    for name in [name for name in found if ".p." in name]:
        kind = name.rpartition(".")[2]
        if kind not in ("branch", "kappa"):
            off(name, ANGLES if kind in ("alpha", "lam") else LENGTHS)
    for name, width in (("offset", ANGLES), ("turn", ANGLES), ("shift", LENGTHS)):
        off(f"needle.stages.1.{name}", width)
    off("looper.offset", PHASE)
    for member in PLACED:
        for k in range(3):
            off(f"{member}.at.{k}", LENGTHS)
        turned = Rotation.from_euler("xyz", rng.normal(0.0, TILTS / 3.0, (n, 3)))
        for way in ("axis", "zero"):
            vector = turned.apply(given[member][way])
            found |= {f"{member}.{way}.{k}": vector[:, [k]] for k in range(3)}
    # the phase of the needle's drive is a dimension of its member too
    return found, rng.normal(0.0, ANGLES / 3.0, (n, 1))


def outputs(p, phase, sense):
    """Clearance, rise and angle of the passage, least distance of point and tip; nan without one passage."""
    n = len(phase)

    def at(phi):
        # the needle's crank stands ahead by its phase, the looper's does not
        moved = p | {"looper.offset": p["looper.offset"] - p["looper.ratio"] * phase}
        return stitch.passing(moved, phi + phase), moved, phi + phase

    grid = np.arange(POSES)[None, :] * (2.0 * np.pi / POSES)
    found, moved, turned = at(grid)
    x = found["across"]
    change = (x * np.roll(x, -1, axis=1) < 0.0) & (sense * (np.roll(x, -1, axis=1) - x) > 0.0)
    change &= (found["height"] > 0.0) & (found["height"] < p["needle.point"])
    one = change.sum(axis=1) == 1
    left = grid[0, change.argmax(axis=1)][:, None]
    right = left + 2.0 * np.pi / POSES
    for _ in range(40):
        middle = 0.5 * (left + right)
        before = sense * at(middle)[0]["across"] < 0.0
        left, right = np.where(before, middle, left), np.where(before, right, middle)
    there = at(left)[0]
    # depth and distance are smooth: of 720 samples a parabola through three has 1e-8 of them.
    point, _ = stitch.guided(moved, turned)
    tip = stitch.carried(moved, "looper", "tip", turned)
    apart = np.sqrt(sum((a - b) ** 2 for a, b in zip(point, tip, strict=True)))
    columns = {
        "a_clearance": there["side"][:, 0] - 0.5 * p["needle.diameter"][:, 0],
        "a_rise": parabola(found["depth"]) - there["depth"][:, 0],
        "phi_a": left[:, 0],
        "above_eye": p["needle.eye"][:, 0] - there["height"][:, 0],
        "below_scarf_end": there["height"][:, 0] - p["needle.scarf_end"][:, 0],
        "min_apart": -parabola(-apart),
    }
    return {name: np.where(one, x, np.nan).reshape(n) for name, x in columns.items()}


def parabola(values):
    """Largest value of periodic samples (n, m)."""
    k, rows = values.argmax(axis=1), np.arange(len(values))
    a, b, c = (values[rows, (k + j) % POSES] for j in (-1, 0, 1))
    return b + (a - c) ** 2 / (8.0 * (2.0 * b - a - c))


@pytest.mark.parametrize("row", [0, 2])
def test_shares_and_scatter_of_relations_are_those_of_an_independent_sample(row):
    given, sense = json.loads(json.dumps(ROWS[row])), 0
    given["upper"], given["seam"] = given["looper"] | {"back": [0.0, 0.0, 0.0]}, [0.0, 0.0, 0.0]
    for name in ("eye", "hold"):
        given["looper"].setdefault(name, [1.0, 2.0, 3.0])
    relations = {
        "a": {"take": ["thin", "blade"], "fields": {"slow": [0.0, 1e3], "fast": [0.0, 1e3]}},
        "apart": {"distance": ["needle.point", "looper.tip"]},
    }
    nominal = None
    for sense in (1, -1):
        relations["a"]["sense"] = sense
        machine, design = machine_of(given, relations, tips=("looper",))
        nominal = sweep.summarise(machine, design, list(NAMES), accuracy=1e-9).iloc[0]
        if nominal["status"] == 0:
            break
    assert nominal is not None and nominal["status"] == 0
    whole = family(machine)
    own = {name: TILTS for name in whole.parameter_names if name.endswith("_tilt")} | {"looper.offset": PHASE}
    own |= {name: 0.0 for name in whole.parameter_names if name.startswith("upper.") or name.endswith("_tip")}
    tolerance = Tolerance(LENGTHS, ANGLES, own=tuple(own.items()))
    designs = sampled_designs(whole, design_matrix(whole, design)[0][0], tolerance, 7, MADE)
    ours = design_outputs(whole, designs, list(NAMES), Accuracy(target=1e-8))
    theirs = outputs(*made(given, np.random.default_rng(8), MADE), sense)
    both, spread = np.ones((2, MADE), np.bool_), {}
    for name in NAMES:
        a, b = np.asarray(ours[name], float), theirs[name]
        spread[name] = np.nanstd(b)
        # standard errors of a mean and of a standard deviation, of both samples
        assert np.nanmean(a) == pytest.approx(np.nanmean(b), abs=4.0 * spread[name] * np.sqrt(2.0 / MADE)), name
        assert np.nanstd(a) == pytest.approx(spread[name], rel=4.0 / np.sqrt(MADE)), name
        assert np.nanmean(b) == pytest.approx(nominal[name], abs=spread[name]), name
        limit = Limit(name, float(nominal[name] - 0.8 * spread[name]), float(nominal[name] + 1.5 * spread[name]))
        kept = np.array([meets(limit, values) for values in (a, b)])
        assert kept[0].mean() == pytest.approx(kept[1].mean(), abs=SHARE), name
        both &= kept
    assert 0.2 < both[1].mean() < 0.8
    assert both[0].mean() == pytest.approx(both[1].mean(), abs=SHARE)
    # At every speed the window of the rise is another one, and the clearance has to take the loop.
    rise, room = float(nominal["a_rise"]), float(nominal["a_clearance"])
    slow, fast = (rise - spread["a_rise"], rise + 9.0 * spread["a_rise"]), (rise - spread["a_rise"], rise)
    take = [room - spread["a_clearance"], room + 2.0 * spread["a_clearance"]]
    relations["a"]["fields"] = {"slow": list(slow), "fast": list(fast)}
    relations["sews"] = {"sew": ["a"], "speeds": SPEEDS, "clearance": take}
    sewing, _ = machine_of(given, relations, tips=("looper",))
    names = [f"sews_at_{60.0 * speed / (2.0 * np.pi):.6g}" for speed in SPEEDS]
    ends = [name.replace("_at_", f"_{end}_at_") for name in names for end in ("above", "below")]
    found = design_outputs(family(sewing), designs, [*names, *ends], Accuracy(target=1e-8))
    shares = []
    for speed, name in zip(SPEEDS, names, strict=True):
        part = (speed - SPEEDS[0]) / (SPEEDS[-1] - SPEEDS[0])
        low, high = (x + part * (y - x) for x, y in zip(slow, fast, strict=True))
        kept = {"above": theirs["a_rise"] >= low, "below": theirs["a_rise"] <= high}
        for end, own in kept.items():
            part = found[name.replace("_at_", f"_{end}_at_")]
            assert (part >= 0.0).mean() == pytest.approx(own.mean(), abs=SHARE), end
        inside = kept["above"] & kept["below"]
        inside &= (theirs["above_eye"] >= 0.0) & (theirs["below_scarf_end"] >= 0.0)
        inside &= (theirs["a_clearance"] >= take[0]) & (theirs["a_clearance"] <= take[1])
        shares.append(inside.mean())
        assert (found[name] >= 0.0).mean() == pytest.approx(shares[-1], abs=SHARE), name
    assert shares[0] > shares[-1] + 0.1


def test_a_looper_that_lags_stands_where_its_lag_puts_it():
    given = json.loads(json.dumps(ROWS[0]))
    given["upper"], given["seam"] = given["looper"] | {"back": [0.0, 0.0, 0.0]}, [0.0, 0.0, 0.0]
    given["looper"] |= {"eye": [1.0, 2.0, 3.0], "hold": [3.0, 2.0, 1.0]}
    fields = {"slow": [0.0, 1e3], "fast": [0.0, 1e3]}
    relations = {"a": {"take": ["thin", "blade"], "fields": fields}}
    relations["sews"] = {"sew": ["a"], "speeds": SPEEDS, "clearance": [0.0, 1e3]}
    machine, design = machine_of(given, relations)
    design |= {"looper.speed": SPEEDS[0], "looper.driven_inertia": 2e-3, "looper.stiffness": 1e4}
    names = [f"sews_at_{60.0 * speed / (2.0 * np.pi):.6g}" for speed in SPEEDS]
    found = sweep.summarise(machine, design, [*names, "looper.max_abs_lag", "phi_a"], accuracy=1e-9).iloc[0]
    assert found["status"] == 0
    ratio = given["looper"]["ratio"]
    for speed, name in zip(SPEEDS, names, strict=True):
        fast = design | {"looper.speed": speed * ratio}
        bent = sweep.evaluate(machine, fast, ["looper.lag", "looper.dpsi"], phi=[found["phi_a"]]).iloc[0]
        ahead = bent["looper.lag"] / bent["looper.dpsi"]
        moved = design | {"looper.offset": given["looper"]["offset"] + ratio * ahead}
        keys = ["a_clearance", "a_above_eye", "a_below_scarf_end"]
        there = sweep.summarise(machine, moved, keys, accuracy=1e-9).iloc[0]
        assert found[name] == pytest.approx(there[keys].min(), abs=1e-9), name
    assert abs(ahead) > 1e-4
    assert not [name for name in motion_curves(family(machine)) if name.startswith("sews")]  # it has no poses
