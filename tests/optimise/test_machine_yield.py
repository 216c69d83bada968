"""Yield of a machine whose members and their places are off, against circles and spheres that share no code with it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sweep
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise.manufacture.tolerance import deviating
from sweep.quantities.limits import Limit, meets
from sweep.study.study import Tolerance
from tests.families.test_stitch_reference import ROWS, machine_of
from tests.reference import stitch

LENGTHS, ANGLES, TILTS, PHASE = 0.03, 1e-3, 5e-4, 4e-3
MADE, POSES = 1024, 720
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
    given = json.loads(json.dumps(ROWS[row]))
    given["upper"], given["seam"] = given["looper"] | {"back": [0.0, 0.0, 0.0]}, [0.0, 0.0, 0.0]
    for name in ("eye", "hold"):
        given["looper"].setdefault(name, [1.0, 2.0, 3.0])
    relations = {"a": {"take": ["thin", "blade"], "sense": 1}, "apart": {"distance": ["needle.point", "looper.tip"]}}
    nominal, sense = None, 0
    for sense in (1, -1):
        relations["a"]["sense"] = sense
        machine, design = machine_of(given, relations, tips=("looper",))
        nominal = sweep.summarise(machine, design, list(NAMES), accuracy=1e-9).iloc[0]
        if nominal["status"] == 0:
            break
    assert nominal is not None and nominal["status"] == 0
    whole = family(machine)
    exact = {f"upper.{p.name}" for p in next(m for m in whole.members if m.name == "upper").family.parameters}
    own = {
        name: 0.0 for name in whole.parameter_names if name.startswith("upper.") or name.endswith("_tip")
    } | dict.fromkeys(exact, 0.0)
    own |= {name: TILTS for name in whole.parameter_names if name.endswith("_tilt") and not name.startswith("upper.")}
    own["looper.offset"] = PHASE
    tolerance = Tolerance(LENGTHS, ANGLES, own=tuple(own.items()))
    designs = deviating(whole, design_matrix(whole, design)[0][0], tolerance, 7, MADE)
    ours = design_outputs(whole, designs, list(NAMES), Accuracy(target=1e-8))
    theirs = outputs(*made(given, np.random.default_rng(8), MADE), sense)
    kept = [np.ones(MADE, np.bool_), np.ones(MADE, np.bool_)]
    for name in NAMES:
        a, b = np.asarray(ours[name], float), theirs[name]
        spread = np.nanstd(b)
        # standard errors of a mean and of a standard deviation, of both samples
        assert np.nanmean(a) == pytest.approx(np.nanmean(b), abs=4.0 * spread * np.sqrt(2.0 / MADE)), name
        assert np.nanstd(a) == pytest.approx(spread, rel=4.0 / np.sqrt(MADE)), name
        assert np.nanmean(b) == pytest.approx(nominal[name], abs=spread), name
        limit = Limit(name, float(nominal[name] - 0.8 * spread), float(nominal[name] + 1.5 * spread))
        own_kept = [meets(limit, values) for values in (a, b)]
        assert own_kept[0].mean() == pytest.approx(own_kept[1].mean(), abs=SHARE), name
        kept = [x & y for x, y in zip(kept, own_kept, strict=True)]
    assert 0.2 < kept[1].mean() < 0.8
    assert kept[0].mean() == pytest.approx(kept[1].mean(), abs=SHARE)
