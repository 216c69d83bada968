"""A whole machine as a MuJoCo model: bodies on hinges and slides in the machine's frame, loops closed by connects.

The model is built from one pose; every other pose, all rates and accelerations are MuJoCo's own.  Its units are SI.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

from kernels.linkage.bodies import DRIVEN, SLIDE
from sweep.effects.scene import first_scene
from sweep.families.base import Angles
from sweep.families.chain import Chain
from sweep.families.link_tree import LinkTree
from tests.effects.test_momentum import poses_of

PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")
TINY = 1e-12  # kg and kg m^2: MuJoCo requires a mass for every moving body


class Body(NamedTuple):
    """A body at the pose from which the model is built, in the machine's frame [mm, t]."""

    name: str
    parent: str
    at: Any
    axes: Any
    joint: Any
    freedoms: tuple[tuple[str, Any], ...]  # hinge or slide, and the axis
    mass: tuple[float, Any, Any]


def mass_of(given, body, number, slender=False):
    """Return mass, centre and tensor of a body from inputs."""
    m = given.get(f"m_{body}{number}", 0.0)
    centre = np.array([given.get(f"com_{body}_{x}{number}", 0.0) for x in "xyz"])
    if slender:
        j = given.get(f"j_{body}{number}", 0.0)
        return m, centre, np.diag([0.0, j, j])
    xx, xy, xz, yy, yz, zz = (given.get(f"j_{body}_{p}{number}", 0.0) for p in PAIRS)
    return m, centre, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def stage_bodies(prefix, scene, frame, given, number):
    """Return the bodies of a stage and its loops (body, body, place), with the names of its driven joints."""
    turn, at = frame.rotation[0], frame.at[0]
    placed = [(origin[0] @ turn.T + at, axes[0] @ turn.T) for origin, axes in poses_of(scene)]
    tree = scene.family.find(LinkTree)
    if tree is None:
        design, poses = scene.records[1][0], scene.records[0][0, 0]
        u, k, c = turn @ design[0:3], turn @ design[3:6], turn @ poses[3:6] + at
        (a, x), (b, y), (d, z) = placed
        spatial = scene.family.name == "rssr"
        rod = (("hinge", y[1]), ("hinge", y[2])) if spatial else (("hinge", k),)
        found = [
            Body(f"{prefix}crank", "", a, x, a, (("hinge", u),), mass_of(given, "crank", number)),
            Body(f"{prefix}coupler", f"{prefix}crank", b, y, b, rod, mass_of(given, "coupler", number)),
            Body(f"{prefix}rocker", "", d, z, d, (("hinge", k),), mass_of(given, "rocker", number)),
        ]
        return found, [(f"{prefix}coupler", f"{prefix}rocker", c)], [f"{prefix}crank 0"]
    links, found, driven = scene.links, [], []
    names = [f"{prefix}{body.name}" for body in tree.bodies]
    for k, body in enumerate(tree.bodies):
        own = [which for which in range(len(tree.freedoms)) if links.freedoms[0, which, 0] == k]
        kinds = [int(links.freedoms[0, which, 1]) for which in own]
        freedoms = tuple(
            ("slide" if kind == SLIDE else "hinge", turn @ links.axes[0, 0, w])
            for w, kind in zip(own, kinds, strict=True)
        )
        driven += [f"{names[k]} {i}" for i, kind in enumerate(kinds) if kind == DRIVEN]
        parent = names[body.parent] if body.parent >= 0 else ""
        joint = turn @ links.bodies[0, 0, k, 24:27] + at
        found.append(
            Body(names[k], parent, *placed[k], joint, freedoms, mass_of(given, body.name, number, body.slender))
        )
    loops = {}
    for which, (one, other) in enumerate(tree.ends):
        place = turn @ links.lines[0, 0, which, :3] + at
        loops[one, other, tuple(place.round(9))] = (names[one], names[other], place)
    return found, list(loops.values()), driven


def text(values):
    return " ".join(repr(float(x)) for x in np.ravel(values))


class WholeMachine:
    """The model of a machine, built at one angle of its main shaft."""

    def __init__(self, machine, design, phi):
        self.start, bodies, loops, self.driven, couplings = phi, [], [], [], []
        for m in machine.members:
            matrix = np.array([[design.get(p.name, p.default) for p in machine.parameters]], float)
            own, given = m.designs(matrix), {m.own(k): x for k, x in design.items() if m.own(k)}
            first = first_scene(m.family, own, Angles.of(m.ratio * np.array([[phi]]) + m.phase(matrix)[:, None]), {})
            frames = m.frames(matrix)
            for k in range(len(frames)):
                number = str(k + 1) if isinstance(m.family, Chain) else ""
                prefix = f"{m.name}{number} "
                parts, closed, turned = stage_bodies(prefix, first.stage(k), frames[k], given, number)
                bodies, loops = bodies + parts, loops + closed
                if k == 0:
                    self.driven += [(name, m.ratio) for name in turned]
                else:
                    couplings.append((turned[0], f"{m.name}{k} rocker 0", own[0, m.family.stages[k].kappa]))
        self.bodies = bodies
        self.model = mujoco.MjModel.from_xml_string(self.xml(loops, couplings))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        self.loops = loops

    def xml(self, loops, couplings):
        tree = "".join(self.body(b) for b in self.bodies if not b.parent)
        closed = "".join(
            f'<connect body1="{one}" body2="{other}" anchor="{text(1e-3 * (p - self.place(one)))}"/>'
            for one, other, p in loops
        )
        closed += "".join(
            f'<joint joint1="{crank}" joint2="{rocker}" polycoef="0 {kappa} 0 0 0"/>'
            for crank, rocker, kappa in couplings
        )
        compiler = '<compiler angle="radian" autolimits="true" boundmass="0" boundinertia="0"/>'
        options = '<option gravity="0 0 0"/>'
        return f"<mujoco>{compiler}{options}<worldbody>{tree}</worldbody><equality>{closed}</equality></mujoco>"

    def place(self, name):
        return next(b.at for b in self.bodies if b.name == name)

    def body(self, b):
        m, centre, tensor = b.mass
        above = self.place(b.parent) if b.parent else np.zeros(3)
        inertia = 1e-3 * b.axes.T @ tensor @ b.axes + TINY * np.eye(3)  # t mm^2 are 1e-3 kg m^2
        numbers = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        middle = text(1e-3 * b.axes.T @ centre)
        inside = f'<inertial pos="{middle}" mass="{1e3 * m + TINY!r}" fullinertia="{text(numbers)}"/>'
        for k, (kind, axis) in enumerate(b.freedoms):
            inside += (
                f'<joint name="{b.name} {k}" type="{kind}" pos="{text(1e-3 * (b.joint - b.at))}" axis="{text(axis)}"/>'
            )
        inside += "".join(self.body(child) for child in self.bodies if child.parent == b.name)
        return f'<body name="{b.name}" pos="{text(1e-3 * (b.at - above))}">{inside}</body>'

    def at(self, phi, speed):
        """Close the loops at an angle of the main shaft; set all joint rates and accelerations at constant speed."""
        model, data = self.model, self.data
        led = np.array([model.joint(name).dofadr[0] for name, _ in self.driven])
        rates = np.array([ratio * speed for _, ratio in self.driven], float)
        free = np.setdiff1d(np.arange(model.nv), led)
        data.qvel[:], data.qacc[:] = 0.0, 0.0
        for (name, ratio), _ in zip(self.driven, led, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = ratio * (phi - self.start)
        for _ in range(40):
            mujoco.mj_forward(model, data)
            gap, rows = data.efc_pos[: data.ne].copy(), data.efc_J.reshape(-1, model.nv)[: data.ne].copy()
            if np.abs(gap).max() < 1e-16:
                break
            step = np.zeros(model.nv)
            step[free] = np.linalg.lstsq(rows[:, free], -gap, rcond=None)[0]
            data.qpos += step  # hinges and slides only
        mujoco.mj_forward(model, data)
        rows = data.efc_J.reshape(-1, model.nv)[: data.ne].copy()
        second = np.zeros(model.nv)
        velocity = np.zeros(model.nv)
        velocity[led] = rates
        velocity[free] = np.linalg.lstsq(rows[:, free], -rows[:, led] @ rates, rcond=None)[0]
        data.qvel[:] = velocity
        bend = []
        for k, (one, other, _) in enumerate(self.loops):
            point = data.xpos[model.body(one).id] + data.xmat[model.body(one).id].reshape(3, 3) @ model.eq_data[k, :3]
            bend.append(self.acceleration(one, point) - self.acceleration(other, point))
        bend = np.concatenate([*bend, np.zeros(data.ne - 3 * len(self.loops))])
        second[free] = np.linalg.lstsq(rows[:, free], -bend, rcond=None)[0]
        data.qacc[:] = second

    def moving(self, name):
        """Return place, angular velocity, velocity, angular acceleration and acceleration of a body's origin [m, s]."""
        model, data = self.model, self.data
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        body, v, a = model.body(name).id, np.zeros(6), np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, v, 0)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, a, 0)
        return data.xpos[body].copy(), v[:3].copy(), v[3:].copy(), a[:3].copy(), a[3:].copy()

    def acceleration(self, name, point):
        at, w, _, e, a = self.moving(name)
        return a + np.cross(e, point - at) + np.cross(w, np.cross(w, point - at))

    def placed(self, name, point):
        """Return the present place [mm] of a body's point that was at ``point`` when the model was built."""
        body = self.model.body(name).id
        return 1e3 * self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ (point - self.place(name))

    def shaking(self):
        """Return shaking force [N] and moment about the origin [N mm], power [N mm/s] of all bodies, (5), (6)."""
        force, moment, power = np.zeros(3), np.zeros(3), 0.0
        for b in self.bodies:
            at, w, v, e, a = self.moving(b.name)
            turn = self.data.xmat[self.model.body(b.name).id].reshape(3, 3)
            m, centre, tensor = b.mass
            arm = turn @ (1e-3 * b.axes.T @ centre)
            fast, slow = a + np.cross(e, arm) + np.cross(w, np.cross(w, arm)), v + np.cross(w, arm)
            inertia = turn @ (1e-3 * b.axes.T @ tensor @ b.axes) @ turn.T
            spin = inertia @ e + np.cross(w, inertia @ w)
            force -= 1e3 * m * fast
            moment -= 1e3 * (np.cross(at + arm, 1e3 * m * fast) + spin)
            power += 1e3 * (1e3 * m * slow @ fast + w @ spin)
        return force, moment, power
