"""Joint loads next to Pinocchio: time per pose and agreement; part of ``make bench-peers``.

One crank-rocker with heavy links.  Pinocchio has no closed loops: its model is a tree whose loop is cut at the ball, so
positions come from Newton's method, rates and forces from multipliers (tests/support/multibody.py), in Python round
its compiled algorithms.  Its recursive Newton-Euler alone, for given positions and rates, is timed beside it.
"""

from __future__ import annotations

import argparse
from importlib.metadata import version
from pathlib import Path

import numpy as np

import sweep
from studies.accuracy.machine import description
from studies.accuracy.timing import seconds
from tests.support.multibody import Array, Multibody

DESIGN = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2}
SPEED, CHANGE = 50.0, 300.0
GRAVITY = np.array([900.0, -9810.0, 400.0])
POSES, MANY = 24, 7200
WANTED = [f"force_{joint}_{axis}" for joint in "abcd" for axis in "xyz"] + ["drive_torque"]


def main() -> None:
    """Time both, compare forces and torque, keep the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.peer_loads", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    out: Path = parser.parse_args().out

    import pandas as pd

    table = DESIGN | _inputs() | {"speed": SPEED, "speed_change": CHANGE, "finger": 1.0}
    phi, many = 2.0 * np.pi * np.arange(POSES) / POSES, 2.0 * np.pi * np.arange(MANY) / MANY
    ours = sweep.evaluate("rssr", table, WANTED, phi=phi)[WANTED].to_numpy()
    model = _model()
    theirs = np.array([_forces(model, angle) for angle in phi])
    gap = np.abs(theirs - ours).max(axis=0) / np.abs(ours).max(axis=0)

    def closed() -> None:
        for angle in phi:
            model.at(angle, SPEED, CHANGE)

    rates = np.ones(model.model.nv)
    named = f"Pinocchio {version('pin')}"
    rows = [
        (f"{named}: closed loop, forces, drive torque", seconds(closed) / POSES),
        (f"{named}: recursive Newton-Euler of the tree alone",
         seconds(lambda: model.pin.rnea(model.model, model.data, model.q, rates, rates))),
        ("linksweep: evaluate, motion included",
         seconds(lambda: sweep.evaluate("rssr", table, WANTED, phi=many)) / MANY),
    ]  # fmt: skip
    found = pd.DataFrame([{"what": what, "ns_per_pose": 1e9 * took, "ratio": rows[0][1] / took} for what, took in rows])
    found["largest_difference"] = float(gap.max())
    out.mkdir(parents=True, exist_ok=True)
    found.to_parquet(out / "peer_loads.parquet", index=False)
    print(f"{description()}\n{found.to_string(index=False)}")


def _body(k: int) -> tuple[float, Array, Array]:
    """Mass, centre and tensor of a body without any symmetry."""
    tensor = np.array([[0.05 + 0.01 * k, 0.004, -0.006], [0.004, 0.08, 0.005], [-0.006, 0.005, 0.07]])
    return 1e-4 * (1 + k), np.array([9.0 - k, 2.0 + k, -3.0]), tensor


def _inputs() -> dict[str, float]:
    found = {f"gravity_{x}": float(g) for x, g in zip("xyz", GRAVITY, strict=True)}
    for k, body in enumerate(("crank", "coupler", "rocker")):
        mass, centre, tensor = _body(k)
        found[f"m_{body}"] = mass
        found |= {f"com_{body}_{x}": float(centre[i]) for i, x in enumerate("xyz")}
        found |= {f"j_{body}_{'xyz'[i]}{'xyz'[j]}": float(tensor[i, j]) for i in range(3) for j in range(i, 3)}
    return found


def _model() -> Multibody:
    """Crank and rocker on the frame, the coupler on the crank by the finger's two axes, the loop cut at C."""
    frame = sweep.joints("rssr", DESIGN, [0.0]).set_index("joint")
    a, b, c, d = (frame.loc[name, ["x", "y", "z"]].to_numpy(np.float64) for name in "abcd")
    u, k = np.array([0.0, np.sin(DESIGN["alpha"]), np.cos(DESIGN["alpha"])]), np.array([0.0, 0.0, 1.0])
    s, rho_b, rho = (c - b) / DESIGN["b"], (b - a) / DESIGN["a"], (c - d) / DESIGN["c"]
    n = np.cross(u, s)
    n /= np.linalg.norm(n)
    model = Multibody()
    parts = (
        ("crank", None, a, [("turn", u)], (rho_b, np.cross(u, rho_b), u)),
        ("coupler", "crank", b, [("turn", u), ("turn", n)], (s, np.cross(n, s), n)),
        ("rocker", None, d, [("turn", k)], (rho, np.cross(k, rho), k)),
    )
    for number, (name, parent, place, freedoms, axes) in enumerate(parts):
        mass, centre, tensor = _body(number)
        triad = np.stack(axes)
        model.hang(name, parent, place, freedoms, mass, place + centre @ triad, triad.T @ tensor @ triad, GRAVITY)
    model.close("rocker", "coupler", c)
    model.drive("crank")
    return model.finish()


def _forces(model: Multibody, angle: float) -> Array:
    (on_rocker,), torque, _ = model.at(angle, SPEED, CHANGE)
    return np.concatenate(
        [model.held("crank")[0], model.held("coupler")[0], on_rocker, model.held("rocker")[0], [torque]]
    )


if __name__ == "__main__":
    main()
