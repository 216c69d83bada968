"""Look for poses of a crank-rocker with larger errors than any known: ``make search-worse`` (minutes, not part of CI).

Differential evolution over the links and the crank angle maximises the error of what ``evaluate`` gives, or with
``--poses sweeps`` that of the kernel of the sweeps, against 60 digits in units of 2^-53 max(cond, |y|).  What is worse
than the table's record for its kernel, output and region is appended to tests/oracle/worst_found.json, which the fast
tests replay.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import numpy as np

from kernels import status as st
from sweep.families import family
from sweep.families.base import Angles
from tests.support.sixty_digits import ORDERS, angle_error, condition, transfer_functions

TABLE = Path(__file__).resolve().parents[1] / "oracle" / "worst_found.json"
NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
POSES = {"evaluate": family("rssr").precise(), "sweeps": family("rssr")}
# How the unit cube is spread: decades of the lengths over the crank, offsets, angle between the axes.
REGIONS = {
    "ordinary": {"links": (0.0, 1.0), "offsets": 3.0, "alpha": (-math.pi, math.pi)},
    "long links": {"links": (0.0, 6.0), "offsets": 1e6, "alpha": (-math.pi, math.pi)},
    "nearly parallel axes": {"links": (0.0, 1.0), "offsets": 1e4, "alpha": (-1e-4, 1e-4)},
    "tiny crank": {"links": (3.0, 9.0), "offsets": 1e9, "alpha": (-math.pi, math.pi)},
    "near a dead point": {"links": (0.0, 1.0), "offsets": 3.0, "alpha": (-math.pi, math.pi), "edge": (-14.0, -3.0)},
    "pin near rocker axis": {"links": (0.0, 1.0), "offsets": 0.0, "alpha": (-math.pi, math.pi), "axis": (-12.0, -2.0)},
    "short coupler": {"links": (0.0, 0.1), "offsets": 0.1, "alpha": (-0.2, 0.2), "near": (-4.0, -0.5)},
}  # fmt: skip


def pose(x, region):
    """Design and crank angle of a point of the unit cube: joints are placed first, so most poses assemble."""
    spread = REGIONS[region]
    low, high = spread["links"]
    c = 10.0 ** (low + (high - low) * x[0])
    e, f, g = (
        spread["offsets"] * math.copysign(10.0 ** (6.0 * abs(t) - 6.0), t) * (t != 0.0) for t in 2.0 * x[1:4] - 1.0
    )
    alpha = spread["alpha"][0] + (spread["alpha"][1] - spread["alpha"][0]) * x[4]
    phi, psi = 2.0 * math.pi * x[5], 2.0 * math.pi * x[6]
    if "near" in spread:  # crank and rocker nearly alike, one nearly above the other
        gap = 10.0 ** (spread["near"][0] + (spread["near"][1] - spread["near"][0]) * x[7])
        c, psi = 1.0 + gap * (2.0 * x[0] - 1.0), phi + gap * (2.0 * x[6] - 1.0)
        e, f, g, alpha = gap * e, gap * f, gap * g, gap * alpha
    if "axis" in spread:  # crank pin at a small distance from the rocker axis
        gap = 10.0 ** (spread["axis"][0] + (spread["axis"][1] - spread["axis"][0]) * x[7])
        e = math.cos(phi) + gap
        f = -math.cos(alpha) * math.sin(phi) / math.sin(alpha) if abs(math.sin(alpha)) > 1e-3 else f
        g = 3.0 * x[1]
    joint = np.array([e + c * math.cos(psi), c * math.sin(psi), g])
    pin = np.array([
        math.cos(phi),
        f * math.sin(alpha) + math.cos(alpha) * math.sin(phi),
        f * math.cos(alpha) - math.sin(alpha) * math.sin(phi),
    ])  # fmt: skip
    b = float(np.linalg.norm(joint - pin))
    across = float((joint - pin) @ np.array([-math.sin(psi), math.cos(psi), 0.0]))
    if "edge" in spread:  # shorten the coupler to almost the shortest, or lengthen it to almost the longest
        x0, y0 = pin[0] - e, pin[1]
        radius = math.hypot(x0, y0)
        end = math.hypot(c - radius if x[8] < 0.5 else c + radius, g - pin[2])
        step = 10.0 ** (spread["edge"][0] + (spread["edge"][1] - spread["edge"][0]) * x[7])
        b = end * (1.0 + step if x[8] < 0.5 else 1.0 - step)
    return np.array([1.0, b, c, e, f, g, alpha, math.copysign(1.0, across)]), phi


def factors(design, phi, poses="evaluate"):
    """Errors of psi and its derivatives in units of 2^-53 max(cond, |y|), lower orders counting; zero where not OK."""
    columns = POSES[poses].poses(design[None, :], Angles.of(np.array([[phi]])), frozenset(ORDERS))
    if columns["status"][0, 0] != st.OK:
        return [0.0] * 4
    exact, cond = transfer_functions(design, phi), condition(design, phi)
    if not all(math.isfinite(c) for c in cond) or isinstance(exact[0], complex) or getattr(exact[0], "imag", 0) != 0:
        return [0.0] * 4
    got = [float(columns[name][0, 0]) for name in ORDERS]
    errors = [angle_error(got[0], exact[0])] + [abs(float(g - y)) for g, y in zip(got[1:], exact[1:], strict=True)]
    sizes = [max(cond[0], 1.0)]
    sizes += [max(max(cond[m], abs(float(exact[m]))) for m in range(1, k + 1)) for k in range(1, 4)]
    # A pose whose every digit is lost to one rounding of its inputs carries no float64 information.
    lost = cond[0] * 2.0**-53 > 1e-3
    return [0.0 if lost else e / (2.0**-53 * s) for e, s in zip(errors, sizes, strict=True)]


def search(region, output, seed, generations, poses):
    """The worst pose that differential evolution finds for one output in one region."""
    from scipy.optimize import differential_evolution

    def negative(x):
        try:
            return -factors(*pose(x, region), poses)[ORDERS.index(output)]
        except (ZeroDivisionError, OverflowError):
            return 0.0  # a made-up linkage that the 60-digit reference itself cannot close

    found = differential_evolution(
        negative, [(0.0, 1.0)] * 9, seed=seed, maxiter=generations, popsize=12, polish=False, init="sobol", tol=0.0
    )
    design, phi = pose(found.x, region)
    return -float(found.fun), design, phi


def known():
    """Rows found so far."""
    return json.loads(TABLE.read_text())["rows"] if TABLE.exists() else []


def main():
    parser = argparse.ArgumentParser(prog="python -m tests.search.worse", description=__doc__)
    parser.add_argument("--generations", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--poses", choices=list(POSES), default="evaluate")
    parser.add_argument("--region", choices=list(REGIONS), action="append")
    arguments = parser.parse_args()
    rows = known()
    for region in arguments.region or REGIONS:
        for output in ORDERS:
            factor, design, phi = search(region, output, arguments.seed, arguments.generations, arguments.poses)
            key = {"poses": arguments.poses, "region": region, "output": output}
            record = max((r["factor"] for r in rows if key.items() <= r.items()), default=0.0)
            print(f"{region:26} {output:6} {factor:8.2f}   known {record:8.2f}", flush=True)
            if factor > record:
                inputs = dict(zip((*NAMES, "phi"), [*map(float, design), phi], strict=True))
                hexes = {name: value.hex() for name, value in inputs.items()}
                rows.append(key | {"factor": factor, "inputs": inputs, "hex": hexes})
    about = (
        "Poses of crank-rockers with the largest errors found, in units of 2^-53 max(cond, |y|), lower derivatives "
        "counting, by tests/search/worse.py; inputs are exact doubles, the reference is computed anew in 60 digits."
    )
    TABLE.write_text(json.dumps({"about": about, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
