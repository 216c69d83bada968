"""Measure what everything takes and write sweep/costs.toml and docs/costs.md: ``python -m tests.bench.costs``.

Nothing but estimates depends on the figures: how long a study will take, how many designs are worked on at once.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from kernels.status import OK
from sweep.chunks.plan import spread_designs
from sweep.costs import TABLE, table
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Accuracy, Array, Family
from sweep.families.capabilities import InSeries
from sweep.families.chain import Chain
from sweep.quantities.dimensions import size_step
from sweep.reductions.steps import POSES_EVENT, POSES_PEAK, POSES_SEARCH, certified_travel
from sweep.study import Study, load_study
from sweep.study.space import Axis, DesignSpace
from sweep.synthesis.fit import fit_line
from tests.bench import effect_costs as effects
from tests.bench.families import ROUNDS, Run, least, margin_runs, pose_runs, sized, step_costs
from tests.support.own_code import own_code

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "costs.md"
HEAD = """# Nanoseconds on one core, written by `make bench`; not edited by hand.
# sweep/costs.py says what the sections mean. No value depends on a figure of this table.
"""
Sections = dict[str, dict[str, float]]
SAMPLES, BLOCK, MANY = 720, 4096, 20_000
PROVEN = Accuracy(target=1e-8, certify=True)

PAGE_HEAD = """# What a pose of each family takes

Times of one pose, with the position and all derivatives that the family gives, on one core (`make bench`). An interval
is passed there and back, a march on its grid. A reason is given if a pose takes more than three times as long as the
crank-rocker's. `sweep check` estimates from `sweep/costs.toml`, which has the same figures and those of steps, effects
and searches; no value depends on them. [accuracy.md](accuracy.md) says what accuracy costs in time.
"""

# Why a pose takes more than three times what the crank-rocker's does.
REASONS = {
    "five_link": "the root of the closure equation is found by iteration and proved to be the only one of its branch",
    "free_cam": "iteration finds every minimum of the thread's length over the edge, so that the least one is found",
    "free_cam_friction": "the thread's path is followed in order, with an iteration wherever it begins to slide",
    "backrest": "forces of yarn, spring and guide at every radius, with a square root for each of four lengths",
    "backrest_tension": "the bracket angle is searched on 400 cells; every root of the equilibrium in them is refined",
    "backrest_closure": "as backrest_tension",
    "feed": "closures one after the other, an arctangent for each, and two derivatives of the tooth through all",
    "feed_triad": "Newton's method in three unknowns, over 180 nodes besides the poses, to stay on the chosen assembly",
    "foot": "the motion is marched over four turns of 720 nodes for every 360 poses that are kept",
    "feed_foot": "as foot, on the path of the rack",
}


def work(poses: dict[str, float], rounds: int) -> dict[str, float]:
    """Searches, fits, parameters, all on the needle drive's designs and one core, given the times of poses."""
    names = ("needle208", "crank-rocker-atlas", "looper-sphere")
    study, atlas, sphere = (load_study(ROOT / "studies" / name) for name in names)
    chain, fine, grid = study.bare, Accuracy(target=1e-8), Accuracy(samples=SAMPLES)
    apart = _unfused(chain)
    spread = spread_designs(study, 20_000)
    turning = _turning(study, spread)
    size, proof = size_step(chain), certified_travel(chain)
    assert size is not None and proof is not None and atlas.locus is not None
    rows = {p.name: np.ascontiguousarray(turning[:, k]) for k, p in enumerate(chain.parameters)}
    asked = atlas.space.columns(0, BLOCK)
    runs = {
        "fit": sized(spread, partial(_fit, study)),
        "event": sized(spread_designs(sphere, 4000), partial(_outputs, sphere.family, ["phi_arrive"], fine)),
        "one peak": sized(turning, partial(_outputs, apart, ["max_abs_d2s"], fine)),
        "two peaks": sized(turning, partial(_outputs, apart, ["max_abs_d2s", "max_abs_ds"], fine)),
        "fused extremum": sized(turning, partial(_outputs, chain, ["max_abs_d2s"], fine)),
        "one scan": sized(turning, partial(_outputs, chain, ["max_d2s"], grid)),
        "three scans": sized(turning, partial(_outputs, chain, ["max_d2s", "min_d2s", "max_abs_d2s"], grid)),
        "size": sized(np.tile(turning, (50, 1)), lambda some: size.run(some, frozenset({"size"}), fine)),
        "certified travel": sized(turning, lambda some: proof.run(some, frozenset({"max_abs_d2s"}), PROVEN)),
        "parameter": Run(lambda: design_matrix(chain, rows), turning.size),
        "locus": Run(lambda: atlas.locus.links(asked), BLOCK),  # type: ignore[union-attr]
    }
    for label, space in _spaces().items():
        runs[label] = Run(partial(space.columns, 0, BLOCK), BLOCK * len(space.axes))
    found = least(runs, rounds)
    pose = poses["rssr"] + poses["guide"]
    one, two = found.pop("one peak"), found.pop("two peaks")
    found["peak"] = (two - one - POSES_PEAK * pose) / 2.0  # of each stage
    found["search"] = max((one - (POSES_SEARCH + POSES_PEAK) * pose) / 2.0 - found["peak"], 0.0)
    found["scan"] = (found.pop("three scans") - found.pop("one scan")) / (2 * SAMPLES)
    found["event"] = max(found["event"] - POSES_EVENT * poses["spherical_looper"], 0.0)
    found["certified travel"] /= 2.0
    found["fused extremum"] /= 2.0
    return found


def _unfused(family: Family) -> Family:
    """The same chain, whose extrema are searched for on poses."""
    assert isinstance(family, Chain)
    stages = []
    for stage in family.stages:
        others = tuple(one for one in stage.family.capabilities if not isinstance(one, InSeries))
        stages.append(replace(stage, family=replace(stage.family, capabilities=others)))
    return replace(family, stages=tuple(stages))


def _fit(study: Study, designs: Array) -> object:
    assert study.fit is not None
    return fit_line(study.family, designs, study.fit, study.window)


def _outputs(mechanism: Family, names: list[str], accuracy: Accuracy, designs: Array) -> object:
    return design_outputs(mechanism, designs, names, accuracy)


def _turning(study: Study, spread: Array) -> Array:
    """Those designs whose guide can be fitted and that turn fully."""
    assert study.fit is not None
    fitted, fate = fit_line(study.family, spread, study.fit, study.window)
    fitted = fitted[fate == OK]
    turns = design_outputs(study.bare, fitted, ["rotatable"], Accuracy(target=1e-8))["rotatable"]
    turning = fitted[np.asarray(turns, np.bool_)]
    return np.tile(turning, (-(-MANY // len(turning)), 1))


def _spaces() -> dict[str, DesignSpace]:
    """By row of the table a space of three parameters that are swept in that way."""
    names, ends = ("a", "b", "c"), (1.0, 10.0)
    lattice = tuple(Axis.lattice(name, ends, 40) for name in names)
    plain = tuple(Axis.sampled(name, ends) for name in names)
    log = tuple(Axis.sampled(name, ends, scale="log") for name in names)
    return {
        "axis of a lattice": DesignSpace(names, lattice, {}),
        "axis of a sample": DesignSpace(names, plain, {}, "sobol", 2**16, 1),
        "axis of a sample, log": DesignSpace(names, log, {}, "sobol", 2**16, 1),
    }


def measured(rounds: int) -> Sections:
    """The whole table, measured now."""
    poses, margins = least(pose_runs(), rounds), least(margin_runs(), rounds)
    steps, samples = step_costs(rounds)
    per_pose, per_design = {}, {}
    joints = 0.0
    for cost in effects.costs(repeats=rounds):
        if cost.effect == effects.MOTION:
            joints = cost.ns
        elif cost.outputs == "all":
            per_pose[cost.effect] = max(cost.ns, 1.0)
        elif cost.outputs == "design outputs":
            per_design[cost.effect] = cost.ns
    found = work(poses, rounds) | {"joint records": joints}
    return {
        "poses": poses, "margins": margins, "steps": steps, "samples": samples, "effects": per_pose,
        "effects_design": per_design, "work": dict(sorted(found.items())),
    }  # fmt: skip


def written(sections: Sections) -> str:
    """The table as its file has it: two digits, as more are not repeatable."""
    lines = [HEAD]
    for name, rows in sections.items():
        lines += [f"[{name}]", *(f'"{row}" = {float(f"{ns:.2g}")}' for row, ns in rows.items()), ""]
    return "\n".join(lines)


def page(poses: Mapping[str, float]) -> str:
    """docs/costs.md: what a pose of every family takes next to the crank-rocker's, and why where it is much more."""
    lines = [PAGE_HEAD, "| family | ns per pose | times `rssr` | reason |", "|---|---|---|---|"]
    for name, ns in poses.items():
        times = ns / poses["rssr"]
        lines.append(f"| `{name}` | {ns:g} | {float(f'{times:.2g}'):g} | {REASONS.get(name, '')} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the table beside what it was, and write it unless told not to."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--dry", action="store_true", help="print the figures, write nothing")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of which the fastest counts")
    given = parser.parse_args()
    with own_code():
        sections, was = measured(given.rounds), table()
    for section, rows in sections.items():
        print(f"\n{section:40s} {'ns':>10s} {'was':>10s}")
        for row, ns in rows.items():
            print(f"  {row:38s} {ns:10.2g} {was.get(section, {}).get(row, np.nan):10.2g}")
    far = [f"{n}: {x / sections['poses']['rssr']:.1f}" for n, x in sections["poses"].items()
           if x > 3.0 * sections["poses"]["rssr"] and n not in REASONS]  # fmt: skip
    if far:
        print("\nmore than three times the crank-rocker's, without a reason in REASONS:", ", ".join(far))
    if not given.dry:
        TABLE.write_text(written(sections))
        table.cache_clear()
        PAGE.write_text(page(table()["poses"]))


if __name__ == "__main__":
    main()
