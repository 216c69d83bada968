"""Joint loads of loopers, alone and in the machine stitch208, against Pinocchio (models: test_pinocchio_loads.py)."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.joints import parts
from sweep.families import family
from sweep.study import load_study
from tests.effects.test_link_loads import DESIGNS, FORCE, GRAVITY, TOOL, WEIGHT, design, masses, tool_from_axis, vectors
from tests.effects.test_pinocchio_loads import (
    CHANGE,
    NEAR,
    ROOT,
    SPEED,
    TURNS,
    WANTED,
    axes_of_stages,
    bodies,
    chain_model,
    chain_rows,
    judged,
    off,
)
from tests.reference.linked import POSES, READERS, Z
from tests.support.multibody import Multibody

pytestmark = pytest.mark.long

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
        tip = tool_from_axis(name, d)
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


def test_members_of_the_machine_stitch208_bear_what_pinocchio_finds():
    """The needle's chain with its bar and the slotted looper with a tool at its tip, on one shaft."""
    study = load_study(ROOT / "tests" / "studies" / "earlier" / "stitch208")
    values = {k: float(x[0]) for k, x in study.space.columns(0, 1).items()} | dict(study.space.fixed)
    geometry = {k: v for k, v in values.items() if k in study.family.parameter_names}
    needle = {k.removeprefix("needle."): v for k, v in geometry.items() if k.startswith("needle.")}
    looper_ = {k.removeprefix("looper."): v for k, v in geometry.items() if k.startswith("looper.")}
    own = {p.name for p in family("slotted").parameters}
    looper_ = {k: v for k, v in looper_.items() if k in own}
    looper_ = {p.name: p.default for p in family("slotted").parameters if p.default is not None} | looper_
    table, given = bodies("rocker")
    of_link, link_given = masses("slotted")
    tip = {"tool_x": 30.0, "tool_y": 0.0, "tool_z": 0.0}
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
    axes = axes_of_stages(chain, kept)
    np.testing.assert_array_equal(axes[1], np.eye(3))  # one field of gravity is the same in both frames
    model, ball, extra = chain_model(chain, kept, given, (2e-4, -30.0), kappa, axes)
    model.axis2 = parts(chain, kept, [0.0])[1].axes["a"]
    theirs = chain_rows(model, ball, extra, TURNS, axes)
    mine = ours.rename(columns=lambda n: n.removeprefix("needle."))
    assert start == 0.0
    judged(mine, theirs, "1")
    judged(mine, theirs, "2")
    offset = geometry.get("looper.offset", 0.0)
    first = sweep.evaluate("slotted", looper_, POSES["slotted"], phi=[offset])
    tree, _, _ = looper("slotted", looper_ | tip, first, link_given, True)
    torque = [tree.at(turn, SPEED, CHANGE)[1] for turn in TURNS]
    assert off(ours["looper.drive_torque"], torque) < NEAR
