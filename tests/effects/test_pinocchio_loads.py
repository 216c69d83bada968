"""Joint loads and driving torque against Pinocchio: every family with loads, chains, a machine; with tools and without.

What is ours in its models and what is its own: tests/support/multibody.py.  `make test-long` installs it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.joints import parts
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.capabilities import JointRecords
from tests.effects.test_link_loads import GRAVITY, WEIGHT
from tests.exchange.test_export import LINKED, scaled
from tests.support.multibody import Multibody

pytestmark = pytest.mark.long

SPEED, CHANGE = 30.0, 200.0
TURNS = np.linspace(0.0, 6.0, 9)
# Of the largest force, and of that times the largest length for moments.  Both programs sum some hundred terms, and the
# closure is solved to 1e-14 of the lengths; largest seen 2e-13.
NEAR = 1e-12
ROOT = Path(__file__).resolve().parents[2]


def off(ours, theirs):
    """Largest difference over the largest value."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    return np.abs(ours - theirs).max() / np.abs(ours).max()


# Of the loopers: body, its parent, the joint by which it hangs, its freedoms; and the balls that close the loops.
def bodies(follower, mass=1e-4):
    """Bodies without any symmetry: (mass, centre, tensor) and their inputs."""
    table, found = {}, {}
    for k, body in enumerate(("crank", "coupler", follower)):
        m, centre = mass * (1 + k), np.array([9.0 - k, 2.0 + k, -3.0])
        tensor = np.array([[0.05 + 0.01 * k, 0.004, -0.006], [0.004, 0.08, 0.005], [-0.006, 0.005, 0.07]])
        found[body] = (m, centre, tensor)
        table[f"m_{body}"] = m
        table |= {f"com_{body}_{x}": centre[i] for i, x in enumerate("xyz")}
        table |= {f"j_{body}_{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i in range(3) for j in range(i, 3)}
    return table, found


def add_stage(model, prefix, part, follower, given, finger, tool):
    """Crank, coupler and follower of one stage at the reference pose; the coupler hangs on the link with the finger."""
    a, b, c = (part.joints[name][0] for name in "abc")
    d = part.joints["d"][0] if follower == "rocker" else c
    u = part.axes["a"]
    s = (c - b) / np.linalg.norm(c - b)
    rho_b = (b - a) / np.linalg.norm(b - a)
    crank = np.stack([rho_b, np.cross(u, rho_b), u])
    if follower == "rocker":
        k, rho = part.axes["d"], (c - d) / np.linalg.norm(c - d)
        triad = np.stack([rho, np.cross(k, rho), k])
        freedom = ("turn", k)
    else:
        tau = next(axis for name, axis in part.axes.items() if part.kinds[name] == "slide")
        x = np.cross(tau, u) / np.linalg.norm(np.cross(tau, u))  # the common perpendicular of slide and crank axis
        triad = np.stack([x, tau, np.cross(x, tau)])
        freedom = ("slide", tau)
    branch = np.sign(s @ triad[1])
    w = triad[0] if finger == 0.0 else u
    n = np.cross(w, s) * (branch if finger == 0.0 else 1.0)
    n /= np.linalg.norm(n)
    frames = {"crank": (a, crank), "coupler": (b, np.stack([s, np.cross(n, s), n])), follower: (d, triad)}

    def hang(body, parent, place, freedoms):
        origin, frame = frames[body]
        mass, centre, tensor = given[body]
        model.hang(f"{prefix}{body}", parent, place, freedoms, mass, origin + centre @ frame,
                   frame.T @ tensor @ frame, GRAVITY)  # fmt: skip

    hang("crank", None, a, [("turn", u)])
    hang(follower, None, d, [freedom])
    on, place = ("crank", b) if finger == 1.0 else (follower, c)
    hang("coupler", f"{prefix}{on}", place, [("turn", w), ("turn", n)])
    ball = (
        model.close(f"{prefix}{follower}", f"{prefix}coupler", c)
        if finger == 1.0
        else model.close(f"{prefix}coupler", f"{prefix}crank", b)
    )
    extra = []
    if tool is not None:
        extra.append((f"{prefix}coupler", part.joints["point"][0], tool))
    return ball, extra


def found(model, prefix, follower, ball, balls, finger):
    """The six vectors of kinetostatics by name."""
    a, d = model.held(f"{prefix}crank"), model.held(f"{prefix}{follower}")
    on_coupler, _ = model.held(f"{prefix}coupler")
    b, c = (on_coupler, balls[ball]) if finger == 1.0 else (balls[ball], -on_coupler)
    return {"force_a": a[0], "force_b": b, "force_c": c, "force_d": d[0], "moment_a": a[1], "moment_d": d[1]}


def on_line(points):
    """Forces of needle bars on their couplers, from Pinocchio's own acceleration of the guided points."""

    def forces(model):
        found = []
        for body, place, (mass, force, lam) in points:
            joint = model.ids[body]
            local = place - model.origin[joint]
            needed = mass * (model.acceleration(joint, local) @ lam - GRAVITY @ lam) - force
            found.append((joint, local, -needed * lam))
        return found

    return forces


def judged(ours, theirs, number=""):
    names = [f"{v}_{x}{number}" for v in ("force_a", "force_b", "force_c", "force_d", "moment_a", "moment_d")
             for x in "xyz"]  # fmt: skip
    for kind in ("force", "moment"):
        chosen = [n for n in names if n.startswith(kind)]
        size = np.abs(ours[chosen]).max().max()
        for n in chosen:
            gap = np.abs(ours[n] - [row[n] for row in theirs]).max()
            assert gap < NEAR * size, (n, gap / size)
    assert off(ours[f"drive_torque{number}"], [row[f"drive_torque{number}"] for row in theirs]) < NEAR


WANTED = [f"{v}_{x}" for v in ("force_a", "force_b", "force_c", "force_d", "moment_a", "moment_d") for x in "xyz"]


@pytest.mark.parametrize("finger", [0.0, 1.0])
@pytest.mark.parametrize("tool", [False, True])
@pytest.mark.parametrize("name", LINKED)
def test_joints_of_a_linkage_bear_what_pinocchio_finds(name, tool, finger):
    of = family(name)
    if tool and name != "guide":
        tool = name == "rssr"
    follower = of.find(JointRecords).follower
    table, given = bodies(follower)
    d = scaled(name)
    more = WEIGHT | {"speed": SPEED, "speed_change": CHANGE, "finger": finger}
    lam = np.array([np.cos(d.get("lam", 0.0)), np.sin(d.get("lam", 0.0)), 0.0])
    if tool and name == "guide":
        more |= {"m_tool": 2e-4, "tool_force": -30.0}
    elif tool:
        more |= {"m_tool": 2e-4, "tool_x": 40.0, "tool_y": -9.0, "tool_z": 5.0 + d["g"]}
        more |= {"tool_force_x": 20.0, "tool_force_z": -9.0}
    ours = sweep.evaluate(name, d | table | more, [*WANTED, "drive_torque"], phi=TURNS)
    assert (ours["status"] == st.OK).all()
    (part,) = parts(name, d, [0.0])
    model = Multibody()
    hung = (2e-4, -30.0, lam) if tool and name == "guide" else None
    ball, extra = add_stage(model, "", part, follower, given, finger, hung)
    if tool and name == "rssr":
        k, c, foot = part.axes["d"], part.joints["c"][0], part.joints["d"][0]
        rho = (c - foot) / np.linalg.norm(c - foot)
        place = foot + 40.0 * rho - 9.0 * np.cross(k, rho) + 5.0 * k
        own = model.ids["rocker"]
        model.model.appendBodyToJoint(
            own, model.pin.Inertia(2e-4, place - foot, np.zeros((3, 3))), model.pin.SE3.Identity()
        )
        model.load("rocker", place, 2e-4 * GRAVITY + np.array([20.0, 0.0, -9.0]))
    model.drive("crank")
    model.finish()
    theirs = []
    for turn in TURNS:
        balls, torque, rest = model.at(turn, SPEED, CHANGE, on_line(extra))
        assert rest < 1e-9 * np.abs(ours["drive_torque"]).max()
        row = {f"{v}_{x}": f[i] for v, f in found(model, "", follower, ball, balls, finger).items()
               for i, x in enumerate("xyz")}  # fmt: skip
        theirs.append(row | {"drive_torque": torque})
    judged(ours, theirs)


def axes_of_stages(families, design):
    """Axes of the frame of each stage in that of the first, as columns."""
    chain = family(families)
    matrix, _ = design_matrix(chain, {n: x for n, x in design.items() if n in chain.parameter_names})
    return [frame.rotation[0] for frame in chain.frames(matrix)]


def chain_model(families, design, given, tool, kappa, axes):
    """Stages in the frame of the first, the crank of each turning with the rocker before it."""
    model, ball, extra = Multibody(), [], []
    for k, part in enumerate(parts(families, design, [0.0])):
        lam = design.get(f"lam{k + 1}", 0.0)
        hung = (*tool, axes[k] @ [np.cos(lam), np.sin(lam), 0.0]) if tool and families[k] == "guide" else None
        one, more = add_stage(model, str(k + 1), part, "rocker", given, 0.0, hung)
        ball.append(one)
        extra += more
    model.couple([(model.coordinate["2crank", 0], 1.0), (model.coordinate["1rocker", 0], -kappa)])
    model.drive("1crank")
    return model.finish(), ball, on_line(extra)


def chain_rows(model, ball, extra, turns, axes):
    theirs = []
    for turn in turns:
        balls, torque, _ = model.at(turn, SPEED, CHANGE, extra)
        row = {"drive_torque1": torque, "drive_torque2": model.couples[0]}
        for k in (0, 1):
            vectors = found(model, str(k + 1), "rocker", ball[k], balls, 0.0)
            if k == 0:  # what the next stage takes of the rocker is a load of ours, not a moment of its bearing
                vectors["moment_d"] = vectors["moment_d"] * np.array([1.0, 1.0, 0.0])
            else:
                u = model.axis2
                vectors["moment_a"] = vectors["moment_a"] + (model.couples[0] - vectors["moment_a"] @ u) * u
            row |= {f"{v}_{x}{k + 1}": (f @ axes[k])[i] for v, f in vectors.items() for i, x in enumerate("xyz")}
        theirs.append(row)
    return theirs


@pytest.mark.parametrize("kappa", [1.0, -1.0])
@pytest.mark.parametrize(("families", "tool"), [
    (["rssr", "guide"], None), (["rssr", "guide"], (2e-4, -30.0)), (["rssr", "rssr"], None),
])  # fmt: skip
def test_joints_of_a_chain_bear_what_pinocchio_finds(families, tool, kappa):
    d = {f"{key}{k + 1}": x for k, name in enumerate(families) for key, x in scaled(name).items()}
    d |= {"kappa2": kappa, "offset2": 0.4}
    table, given = bodies("rocker")
    loads = {f"{key}{k}": x for k in (1, 2) for key, x in (table | WEIGHT).items()}
    loads |= {"speed1": SPEED, "speed_change1": CHANGE}
    axes = axes_of_stages(families, d)
    # One field of gravity, in the frame of each stage.
    loads |= {f"{name}2": x for name, x in zip(WEIGHT, GRAVITY @ axes[1], strict=True)}
    if tool:
        loads |= {"m_tool2": tool[0], "tool_force2": tool[1]}
    names = [f"{v}{k}" for k in (1, 2) for v in WANTED]
    ours = sweep.evaluate(families, d | loads, [*names, "drive_torque1", "drive_torque2"], phi=TURNS)
    assert (ours["status"] == st.OK).all()
    model, ball, extra = chain_model(families, d, given, tool, kappa, axes)
    model.axis2 = parts(families, d, [0.0])[1].axes["a"]
    theirs = chain_rows(model, ball, extra, TURNS, axes)
    judged(ours, theirs, "1")
    judged(ours, theirs, "2")
