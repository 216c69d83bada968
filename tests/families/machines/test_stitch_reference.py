"""Moments A, B and C of 200 random machines against the dense turn of tests/reference/stitch.py, hard ones included."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import sweep
from kernels import status as st
from tests.reference import stitch
from tests.support.selection import mostly_long

TABLE = json.loads((Path(__file__).parents[2] / "oracle" / "machine_open.json").read_text())["rows"]
ROWS = [row["inputs"] for row in TABLE if row["kind"] == "moment_A" and row["case"] == "passage"]
pytestmark = pytest.mark.slow
MACHINES = (60, pytest.param(200, marks=pytest.mark.long))
FACTOR = 64.0 * 2.0**-53
CLOSE = 1e-11  # extremes nearer to 0 than this, in lengths of some 50, may be undecidable
DECIDED = (st.OK, st.WRONG_SIDE)
PLACE = ("at", "axis", "zero")


def machine_of(given, relations, tips=()):
    """Return the machine of a needle and two loopers, and its design; members in ``tips`` have their tip as a point."""
    needle = given["needle"]
    members = {
        "needle": {
            "chain": [s["family"] for s in needle["stages"]],
            "place": {k: needle[k] for k in PLACE} | {"stage": 1},
        }
    }
    design = {}
    for n, stage in enumerate(needle["stages"], start=1):
        design |= {f"needle.{k}{n}": v for k, v in stage["p"].items()}
        design |= {f"needle.{k}{n}": stage[k] for k in ("kappa", "offset", "shift", "turn") if k in stage}
    for name in ("looper", "upper"):
        one = given[name]
        place = {k: one[k] for k in PLACE}
        members[name] = {"family": "rssr", "ratio": one["ratio"], "offset": one["offset"], "place": place}
        members[name] |= {"tip": one["tip"]} if name in tips else {}
        design |= {f"{name}.{k}": v for k, v in one["p"].items()}
    thin = {key: needle[key] for key in ("sense", "scarf", "diameter", "scarf_end", "eye", "point")}
    tools = {
        "thin": {"on": "needle.point", "line": "line"} | thin,
        "blade": {"on": "looper"} | {k: given["looper"][k] for k in ("tip", "back", "eye", "hold")},
        "other": {"on": "upper"} | {k: given["upper"][k] for k in ("tip", "back")},
        "seam": {"at": given["seam"]},
    }
    return sweep.machine(members, relations, tools=tools), design


def moved(rng, trial):
    """Return inputs near those of a row of the table; of each five machines one with crossings a hair apart or none."""
    given = json.loads(json.dumps(ROWS[trial % len(ROWS)]))
    looper = given["looper"]
    looper["at"] = [x + rng.normal(0.0, 6.0) for x in looper["at"]]
    looper["offset"] += rng.normal(0.0, 0.3)
    looper["eye"], looper["hold"] = ([x + rng.normal(0.0, 15.0) for x in looper["tip"]] for _ in range(2))
    given["upper"] = json.loads(json.dumps(looper))
    given["upper"]["at"] = [x + rng.normal(0.0, 8.0) for x in looper["at"]]
    given["upper"]["offset"] += rng.normal(0.0, 0.8)
    given["upper"]["ratio"] = int(rng.choice([1, 2]))
    given["seam"] = [x + rng.normal(0.0, 25.0) for x in looper["at"]]
    if trial % 5 == 0:
        apart = 0.0 if trial % 10 == 0 else float(rng.choice([-1, 1])) * 10.0 ** rng.uniform(-9.0, -4.0)
        for _ in range(4):
            shift_extreme(given, apart)
    return given


def shift_extreme(given, apart):
    """Move the looper so that an extreme of the way across, beside the needle if any is, is ``apart`` from it."""
    p = stitch.flat(given)
    phi = stitch.extremes(lambda x: stitch.passing(p, x)["across"])
    found = stitch.passing(p, phi)
    beside = (found["height"] > 0) & (found["height"] < p["needle.point"])
    k = int(np.flatnonzero(beside)[0]) if beside.any() else 0
    _, n = stitch.guided(p, phi[k : k + 1])
    n = [x[0] if np.ndim(x) else x for x in n]
    scarf = [p[f"needle.scarf.{j}"] for j in range(3)]
    u = stitch.unit(stitch.cross(n, scarf))
    step = apart - found["across"][k]
    given["looper"]["at"] = [float(x + step * y) for x, y in zip(given["looper"]["at"], u, strict=True)]


def agrees(worst, read, p, phi, found):
    """Hold what was found at a passage to the reference, in units of its condition."""
    names = [name for name in found if name != "phi"]
    sums, exact = stitch.conditions(read, p, phi), {k: v[0] for k, v in read(p, np.array([phi])).items()}
    error = {"phi": abs(np.mod(found["phi"] - phi + stitch.TURN / 2, stitch.TURN) - stitch.TURN / 2)}
    error |= {name: abs(found[name] - exact[name]) for name in names}
    for name, off in error.items():
        size = max(sums[name], abs(exact.get(name, phi)))
        worst[name] = max(worst.get(name, 0.0), float(off / size) / FACTOR)


@pytest.mark.parametrize("machines", MACHINES)
def test_moment_a_of_random_machines_is_that_of_the_reference(machines):
    rng, worst, seen = np.random.default_rng(31), {}, {}
    for trial in range(machines):
        given, sense = moved(rng, trial), int(rng.choice([-1, 1]))
        machine, design = machine_of(given, {"a": {"take": ["thin", "blade"], "sense": sense}})
        names = ["phi_a", "count_a", "a_clearance", "a_rise", "a_above_eye", "a_gauge", "a_reach", "a_back_side"]
        got = sweep.summarise(machine, design, names, accuracy=1e-9).iloc[0]
        p = stitch.flat(given)
        tops = stitch.extremes(lambda x, p=p: stitch.passing(p, x)["across"])
        heights, across = (stitch.passing(p, tops)[k] for k in ("height", "across"))
        touching = (np.abs(across) < CLOSE) & (heights > 0) & (heights < p["needle.point"])
        status = int(got["status"])
        seen[status] = seen.get(status, 0) + 1
        if touching.any():
            assert status == st.TANGENT or np.abs(across[touching]).min() > CLOSE / 100, (trial, status)
            continue
        phi = stitch.roots(lambda x, p=p: stitch.passing(p, x)["across"])
        exact = stitch.passing(p, phi)
        turned = np.sign(stitch.slope(lambda x, p=p: stitch.passing(p, x)["across"], phi))
        beside = (exact["height"] > 0) & (exact["height"] < p["needle.point"])
        right = np.flatnonzero(beside & (turned == sense))
        assert got["count_a"] == right.size, trial
        expected = st.TWICE if right.size > 1 else st.WRONG_WAY if beside.any() else st.NEVER
        if right.size != 1:
            assert status == expected, trial
            continue
        k = int(right[0])
        assert status == (st.WRONG_SIDE if exact["side"][k] <= 0 else st.OK)
        low = stitch.extremes(lambda x, p=p: stitch.passing(p, x)["depth"])
        depth = stitch.passing(p, low)["depth"]
        low = low[depth > depth.max() - 1e-9]  # a guide that passes its own dead point is lowest twice, alike
        low, depth = low[np.mod(phi[k] - low, stitch.TURN).argmin()], depth.max()
        found = {
            "phi": got["phi_a"], "side": got["a_clearance"] + 0.5 * given["needle"]["diameter"],
            "height": given["needle"]["eye"] - got["a_above_eye"],
        }  # fmt: skip
        agrees(worst, stitch.passing, p, phi[k], found)
        scale = float(abs(depth)) + stitch.conditions(stitch.passing, p, phi[k])["depth"]
        off = abs(got["a_rise"] - (depth - exact["depth"][k]))
        worst["rise"] = max(worst.get("rise", 0.0), float(off / scale) / FACTOR)
        x_low = stitch.passing(p, np.array([low]))["across"][0]
        # The reference takes the lowest angle from depths alone, which know it to the root of their rounding.
        assert got["a_gauge"] == pytest.approx(float(-sense * x_low), abs=1e-6)
        assert got["a_reach"] == pytest.approx(float((-sense * across).max()), abs=1e-12 * 100.0)
        assert got["a_back_side"] == pytest.approx(float(exact["side"][(k + 1) % phi.size]), rel=1e-6, abs=1e-6)
    assert max(worst.values()) < 1.0, worst
    assert {st.OK, st.TWICE, st.TANGENT, st.NEVER, st.WRONG_WAY, st.WRONG_SIDE} <= set(seen), seen


@pytest.mark.parametrize("by", mostly_long(["needle", "upper"], ["needle"]))
@pytest.mark.parametrize("machines", MACHINES)
def test_moments_b_and_c_of_random_machines_are_those_of_the_reference(by, machines):
    rng, worst, seen = np.random.default_rng(32), {}, {}
    for trial in range(machines):
        given, sense = moved(rng, trial), int(rng.choice([-1, 1]))
        start, width = rng.uniform(0.0, 6.2), rng.uniform(1.0, 6.0)
        tools = ["thin" if by == "needle" else "other", "blade", "seam"]
        table = {"enter": tools, "sense": sense, "window": [start, start + width]}
        machine, design = machine_of(given, {"b": table})
        names = ["phi_b", "count_b", "b_from_blade", "b_from_thread", "b_from_seam", "b_margin"]
        got = sweep.summarise(machine, design, names, accuracy=1e-9).iloc[0]
        p = stitch.flat(given)
        phi = stitch.roots(lambda x, p=p: stitch.entering(p, x, by)["across"])
        turned = np.sign(stitch.slope(lambda x, p=p: stitch.entering(p, x, by)["across"], phi))
        inside = np.mod(phi - start, stitch.TURN) <= width
        right = np.flatnonzero(inside & (turned == sense))
        status = int(got["status"])
        seen[status] = seen.get(status, 0) + 1
        assert got["count_b"] == right.size, trial
        if right.size != 1:
            assert status == (st.TWICE if right.size > 1 else st.WRONG_WAY if inside.any() else st.NEVER)
            continue
        k = int(right[0])
        found = {"phi": got["phi_b"]} | {side: got[f"b_from_{side}"] for side in ("blade", "thread", "seam")}
        agrees(worst, partial(stitch.entering, by=by), p, phi[k], found)
        least = min(found[side] for side in ("blade", "thread", "seam"))
        assert status == (st.WRONG_SIDE if least <= 0 else st.OK)
        radius = 0.5 * given["needle"]["diameter"] if by == "needle" else 0.0
        assert got["b_margin"] == pytest.approx(least - radius, abs=1e-12)
    assert max(worst.values()) < 1.0, worst
    expected = {st.OK, st.NEVER, st.WRONG_WAY, st.WRONG_SIDE} | ({st.TWICE} if by == "upper" else set())
    assert expected <= set(seen), seen


def test_gap_while_the_needle_goes_down_is_that_of_the_reference():
    rng, taken = np.random.default_rng(33), 0
    for trial in range(60):
        given = moved(rng, trial)
        machine, design = machine_of(given, {"a": {"take": ["thin", "blade"]}})
        got = sweep.summarise(machine, design, ["a_free", "phi_a"], accuracy=1e-9).iloc[0]
        if np.isnan(got["phi_a"]) or taken == 12:
            continue
        taken, p = taken + 1, stitch.flat(given)
        ends = stitch.extremes(lambda x, p=p: stitch.passing(p, x)["depth"])
        depth = stitch.passing(p, ends)["depth"]
        lows, tops = ends[depth > depth.max() - 1e-9], ends[depth < depth.min() + 1e-9]
        low = lows[np.mod(got["phi_a"] - lows, stitch.TURN).argmin()]
        grid = low + np.mod(low - tops, stitch.TURN).min() * np.linspace(-1.0, 0.0, 1500)
        for _ in range(4):
            values = stitch.gap(p, grid)
            k, step = int(values.argmin()), grid[1] - grid[0]
            near = np.linspace(-min(k, 1), min(grid.size - 1 - k, 1), 41)
            grid = grid[k] + step * near
        # The reference looks along the needle on a grid of 41 places in six rounds: 1e-8 of its length.
        assert got["a_free"] == pytest.approx(float(values.min()), abs=1e-6), trial
    assert taken == 12
