"""Joint loads and driving torque against Pinocchio: every family with loads, chains, a machine; with tools and without.

What is ours in its models and what is its own: studies/accuracy/multibody.py.  `make test-long` installs it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from studies.accuracy.multibody import Multibody
from sweep.evaluation.joints import parts
from sweep.families import family
from sweep.families.capabilities import JointRecords
from sweep.study import load_study
from tests.reference.linked import POSES, READERS, Z
from tests.test_export import LINKED, scaled
from tests.test_link_loads import DESIGNS, FORCE, GRAVITY, TIPS, TOOL, WEIGHT, design, masses, vectors

pytestmark = pytest.mark.long

SPEED, CHANGE = 30.0, 200.0
TURNS = np.linspace(0.0, 6.0, 9)
# Of the largest force, and of that times the largest length for moments.  Both programs sum some hundred terms, and the
# closure is solved to 1e-14 of the lengths; largest seen 2e-13.
NEAR = 1e-12
ROOT = Path(__file__).resolve().parents[1]


def off(ours, theirs):
    """Largest difference over the largest value."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    return np.abs(ours - theirs).max() / np.abs(ours).max()


# Of the loopers: body, its parent, the joint by which it hangs, its freedoms; and the balls that close the loops.
TURNING = {"five_link": ("h", "b"), "spherical_looper": ("os",)}


def looper(name, d, first, given, tool):
    """The model of a looper at the pose of the one-row frame ``first``; the numbers of its balls by joint."""
    bodies, joints, carrier, axes = READERS[name](d, first)
    at = {joint: np.atleast_2d(place)[0] for joint, (place, _, _) in joints.items()}
    triad = {body: np.reshape(t, (-1, 3, 3))[0] for body, (_, t) in bodies.items()}
    origin = {body: np.atleast_2d(o)[0] for body, (o, _) in bodies.items()}
    along = {joint: np.atleast_2d(axis)[0] for joint, axis in axes.items()}
    model = Multibody()

    def hang(body, parent, joint, *freedoms):
        mass, centre, tensor = given[body]
        frame = triad[body]
        model.hang(body, parent, at[joint], freedoms, mass, origin[body] + centre @ frame,
                   frame.T @ tensor @ frame, GRAVITY)  # fmt: skip

    def crank(body, joint):
        hang(body, None, joint, ("turn", triad[body][2]))
        model.drive(body)

    def rod(body, parent, joint):
        # a rod does not spin: two axes across it
        hang(body, parent, joint, ("turn", triad[body][1]), ("turn", triad[body][2]))

    balls = {}
    if name == "five_link":
        crank("crank", "a")
        hang("cross", "crank", "b", ("turn", along["b"]))
        hang("coupler", "cross", "h", ("turn", along["h"]))
        hang("rocker", None, "d", ("turn", Z))
        balls["c"] = model.close("rocker", "coupler", at["c"])
    elif name == "slotted":
        crank("crank", "a")
        hang("link", None, "d", ("turn", Z))
        t = triad["link"][0]
        hang("arm", "link", "c", ("slide", t), ("slide", Z) if d["k"] == 0.0 else ("turn", t))
        balls["b"] = model.close("arm", "crank", at["b"])
    elif name == "swivel":
        crank("crank", "a")
        # block and rod from the frame: the block turns about the rod's cross axes, the rod slides in it
        model.hang("block", None, at["q"], [("turn", triad["rod"][1]), ("turn", triad["rod"][2])])
        hang("rod", "block", "q", ("slide", triad["rod"][0]))
        balls["b"] = model.close("rod", "crank", at["b"])
    elif name == "spherical_looper":
        crank("crank1", "a1")
        crank("crank2", "a2")
        hang("carrier", None, "d1", ("turn", Z))
        hang("looper", "carrier", "os", ("turn", along["os"]))
        rod("coupler1", "crank1", "b1")
        rod("coupler2", "crank2", "b2")
        balls = {"c1": model.close("carrier", "coupler1", at["c1"]), "c2": model.close("looper", "coupler2", at["c2"])}
    else:
        crank("crank1", "a1")
        crank("crank2", "a2")
        hang("shaft", None, "d", ("turn", Z), ("slide", Z))
        hang("rocker", "shaft", "key", ("slide", Z))
        rod("coupler1", "crank1", "b1")
        rod("coupler2", "crank2", "b2")
        balls = {"c1": model.close("rocker", "coupler1", at["c1"]), "c2": model.close("shaft", "coupler2", at["c2"])}
        held = [(model.coordinate["rocker", 0], 1.0)]
        held += [] if d["slides"] else [(model.coordinate["shaft", 1], 1.0)]
        model.couple(held)
    if tool:
        tip = np.array(TIPS[name](d) if name in TIPS else [d[f"tip_{x}"] for x in "xyz"])
        place = origin[carrier] + tip @ triad[carrier]
        own = model.ids[carrier]
        point = model.pin.Inertia(0.8, place - model.origin[own], np.zeros((3, 3)))
        model.model.appendBodyToJoint(own, point, model.pin.SE3.Identity())
        model.load(carrier, place, 0.8 * GRAVITY + FORCE)
    return model.finish(), balls, joints


@pytest.mark.parametrize("tool", [False, True])
@pytest.mark.parametrize("case", DESIGNS)
def test_joints_of_a_looper_bear_what_pinocchio_finds(case, tool):
    name, d = design(case)
    table, given = masses(name)
    table |= WEIGHT | (TOOL if tool else {}) | {"speed": SPEED, "speed_change": CHANGE}
    ours = sweep.evaluate(name, d | table, [*vectors(name), "drive_torque"], phi=TURNS)
    assert (ours["status"] == st.OK).all()
    first = sweep.evaluate(name, d, POSES[name], phi=[0.0])
    model, balls, joints = looper(name, d, first, given, tool)
    fixed = {"d"} if "cylindrical" in name else set()
    theirs = []
    for turn in TURNS:
        forces, torque, rest = model.at(turn, SPEED, CHANGE)
        row = {"drive_torque": torque, "rest": rest / max(np.abs(f).max() for f in forces)}
        for joint, (place, on, _) in joints.items():
            place = np.atleast_2d(place)[0] if joint in fixed else None
            force, moment = (forces[balls[joint]], np.zeros(3)) if joint in balls else model.held(on, place)
            if name == "swivel" and joint == "q":
                force = model.held("rod")[0]
            if "cylindrical" in name and joint in ("key", "hold"):
                force, moment = model.held("rocker")
                along = model.couples[0] * Z
                force = along if joint == "hold" else force - (force @ Z) * Z
            if "cylindrical" in name and joint == "d":
                force = force - (force @ Z) * Z
            for k, x in enumerate("xyz"):
                row[f"force_{joint}_{x}"], row[f"moment_{joint}_{x}"] = force[k], moment[k]
        theirs.append(row)
    theirs = pd.DataFrame(theirs)
    assert theirs["rest"].max() < 1e-10
    for kind in ("force", "moment"):
        names = [n for n in vectors(name) if n.startswith(kind)]
        # a rod's moment about its own ball is nothing
        size = np.abs(ours[names]).max().max()
        for n in names:
            assert np.abs(ours[n] - theirs[n]).max() < NEAR * size, n
    assert off(ours["drive_torque"], theirs["drive_torque"]) < NEAR


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
        more |= {"m_tool": 2e-4, "tip_x": 40.0, "tip_y": -9.0, "tip_z": 5.0, "tool_force_x": 20.0, "tool_force_z": -9.0}
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


def chain_model(families, design, given, tool, kappa, offset):
    """Stages side by side, the crank of each turning with the rocker before it."""
    model, ball, extra = Multibody(), [], []
    for k, part in enumerate(parts(families, design, [0.0])):
        lam = design.get(f"lam{k + 1}", 0.0)
        hung = (*tool, np.array([np.cos(lam), np.sin(lam), 0.0])) if tool and families[k] == "guide" else None
        one, more = add_stage(model, str(k + 1), part, "rocker", given, 0.0, hung)
        ball.append(one)
        extra += more
    model.couple([(model.coordinate["2crank", 0], 1.0), (model.coordinate["1rocker", 0], -kappa)])
    model.drive("1crank")
    return model.finish(), ball, on_line(extra)


def chain_rows(model, ball, extra, turns, kappa):
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
            row |= {f"{v}_{x}{k + 1}": f[i] for v, f in vectors.items() for i, x in enumerate("xyz")}
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
    if tool:
        loads |= {"m_tool2": tool[0], "tool_force2": tool[1]}
    names = [f"{v}{k}" for k in (1, 2) for v in WANTED]
    ours = sweep.evaluate(families, d | loads, [*names, "drive_torque1", "drive_torque2"], phi=TURNS)
    assert (ours["status"] == st.OK).all()
    model, ball, extra = chain_model(families, d, given, tool, kappa, 0.4)
    model.axis2 = parts(families, d, [0.0])[1].axes["a"]
    theirs = chain_rows(model, ball, extra, TURNS, kappa)
    judged(ours, theirs, "1")
    judged(ours, theirs, "2")


def test_members_of_the_machine_stitch208_bear_what_pinocchio_finds():
    """The needle's chain with its bar and the slotted looper with a tool at its tip, on one shaft."""
    study = load_study(ROOT / "studies" / "stitch208")
    values = {k: float(x[0]) for k, x in study.space.columns(0, 1).items()} | dict(study.space.fixed)
    geometry = {k: v for k, v in values.items() if k in study.family.parameter_names}
    needle = {k.removeprefix("needle."): v for k, v in geometry.items() if k.startswith("needle.")}
    looper_ = {k.removeprefix("looper."): v for k, v in geometry.items() if k.startswith("looper.")}
    own = {p.name for p in family("slotted").parameters}
    looper_ = {k: v for k, v in looper_.items() if k in own}
    looper_ = {p.name: p.default for p in family("slotted").parameters if p.default is not None} | looper_
    table, given = bodies("rocker")
    of_link, link_given = masses("slotted")
    tip = {"tip_x": 30.0, "tip_y": 0.0, "tip_z": 0.0}
    loads = {f"needle.{key}{k}": x for k in (1, 2) for key, x in (table | WEIGHT).items()}
    loads |= {
        "needle.speed1": SPEED,
        "needle.speed_change1": CHANGE,
        "needle.m_tool2": 2e-4,
        "needle.tool_force2": -30.0,
    }
    loads |= {f"looper.{k}": x for k, x in (of_link | WEIGHT | TOOL | tip).items()}
    loads |= {"looper.speed": SPEED, "looper.speed_change": CHANGE}
    names = [f"needle.{v}{k}" for k in (1, 2) for v in WANTED]
    wanted = [*names, "needle.drive_torque1", "needle.drive_torque2", "looper.drive_torque",
              *(f"looper.{v}" for v in vectors("slotted"))]  # fmt: skip
    ours = sweep.evaluate(study.family, geometry | loads, wanted, phi=TURNS)
    assert (ours["status"] == st.OK).all()
    chain = ["rssr", "guide"]
    kept = {k: v for k, v in needle.items() if k in family(chain).parameter_names}
    start = kept.get("offset", 0.0)
    kappa = kept.get("kappa2", 1.0)
    model, ball, extra = chain_model(chain, kept, given, (2e-4, -30.0), kappa, 0.0)
    model.axis2 = parts(chain, kept, [0.0])[1].axes["a"]
    theirs = chain_rows(model, ball, extra, TURNS, kappa)
    mine = ours.rename(columns=lambda n: n.removeprefix("needle."))
    assert start == 0.0
    judged(mine, theirs, "1")
    judged(mine, theirs, "2")
    offset = geometry.get("looper.offset", 0.0)
    first = sweep.evaluate("slotted", looper_, POSES["slotted"], phi=[offset])
    tree, _, _ = looper("slotted", looper_ | tip, first, link_given, True)
    torque = [tree.at(turn, SPEED, CHANGE)[1] for turn in TURNS]
    assert off(ours["looper.drive_torque"], torque) < NEAR
