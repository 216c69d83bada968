"""Joint loads against MuJoCo: its recursive Newton-Euler on the exported model, whose loop is cut, against ours.

MuJoCo gets the exported file alone.  Positions close its own loop by Newton, rates and accelerations follow from its
own Jacobians, so no number of ours enters but the design and the crank's speed.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import sweep
from sweep.families import family
from sweep.study import load_study
from tests.exchange.test_export import LINKED, scaled, solved

SPEED, CHANGE = 50.0, 300.0
# Largest seen 4.4e-14 of the largest force (torque) over the turn: a hundred roundings of both programs' sums.
NEAR = 2e-13


def bodies(follower):
    """Bodies without any symmetry, in t and t mm^2: no entry of a tensor and no coordinate of a centre is zero."""
    found = {}
    for k, body in enumerate(("crank", "coupler", follower)):
        found |= {
            f"m_{body}": 1e-4 * (1 + k),
            f"com_{body}_x": 9.0 - k,
            f"com_{body}_y": 2.0 + k,
            f"com_{body}_z": -3.0,
        }
        found |= {f"j_{body}_xx": 0.05 + 0.01 * k, f"j_{body}_yy": 0.08, f"j_{body}_zz": 0.07}
        found |= {f"j_{body}_xy": 0.004, f"j_{body}_xz": -0.006, f"j_{body}_yz": 0.005}
    return found


class Loop:
    """A model in the pose of a crank angle, at the speed of the crank, and the forces that this asks for."""

    def __init__(self, file, speed, change):
        self.model = mujoco.MjModel.from_xml_path(str(file))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        self.speed, self.change = speed, change
        self.crank = self.model.joint("crank").dofadr[0]
        one, two = self.model.eq_obj1id[0], self.model.eq_obj2id[0]
        self.ends = one, two
        self.closing = self.model.equality(0).name  # B or C, the joint that the constraint closes

    def at(self, phi):
        model, data = self.model, self.data
        data.xfrc_applied[:] = 0.0
        rows = solved(model, data, phi)
        free = [k for k in range(model.nv) if k != self.crank]
        point = data.xpos[self.ends[0]] + data.xmat[self.ends[0]].reshape(3, 3) @ model.eq_data[0, :3]
        rates = np.zeros(model.nv)
        rates[self.crank] = self.speed
        rates[free] = np.linalg.lstsq(rows[:, free], -rows[:, self.crank] * self.speed, rcond=None)[0]
        data.qvel[:], data.qacc[:] = rates, 0.0
        apart = self.acceleration(0, point) - self.acceleration(1, point)
        jacobian = self.jacobian(0, point) - self.jacobian(1, point)
        second = np.zeros(model.nv)
        second[self.crank] = self.change
        wanted = -apart - jacobian[:, self.crank] * self.change
        second[free] = np.linalg.lstsq(jacobian[:, free], wanted, rcond=None)[0]
        data.qacc[:] = second
        model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
        mujoco.mj_inverse(model, data)
        model.opt.disableflags = 0
        unknown = np.column_stack([jacobian.T, np.eye(model.nv)[self.crank]])
        found, *_ = np.linalg.lstsq(unknown, data.qfrc_inverse, rcond=None)
        rest = np.abs(unknown @ found - data.qfrc_inverse).max()
        force, torque = found[:3], found[3]
        for body, sign in zip(self.ends, (1.0, -1.0), strict=True):
            data.xfrc_applied[body, :3] = sign * force
            data.xfrc_applied[body, 3:] = np.cross(point - data.xipos[body], sign * force)
        mujoco.mj_rnePostConstraint(model, data)
        return force, torque, rest

    def acceleration(self, which, point):
        """Of a point of a body, less gravity, at the rates and accelerations of the data."""
        model, data = self.model, self.data
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        body, six = self.ends[which], np.zeros(6)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, six, 0)
        speed = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, speed, 0)
        reach = point - data.xpos[body]
        return six[3:] + np.cross(six[:3], reach) + np.cross(speed[:3], np.cross(speed[:3], reach))

    def jacobian(self, which, point):
        rows = np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, rows, None, point, self.ends[which])
        return rows

    def held(self, body):
        """Force of the body's parent on it."""
        return self.data.cfrc_int[self.model.body(body).id, 3:]


def apart(name, design, file, phis):
    """Largest difference of the four forces and the torque over the positions, each relative to its largest value."""
    kind = "slider" if family(name).position == "s" and name != "guide" else "rocker"
    wanted = [f"force_{joint}_{axis}" for joint in "abcd" for axis in "xyz"] + ["drive_torque"]
    ours = sweep.evaluate(name, design, wanted, phi=phis)
    loop = Loop(file, design["speed"], design["speed_change"])
    theirs = []
    for phi in phis:
        force, torque, rest = loop.at(phi)
        assert rest < 1e-10 * max(1.0, abs(torque))  # the finger takes what is left: no torque is missing
        frame = {"a": loop.held("crank"), "d": loop.held(kind)}
        if loop.closing == "C":  # the coupler hangs on the crank; force is that of the follower on the coupler
            joints = frame | {"b": loop.held("coupler"), "c": -force}
        else:  # it hangs on the follower; force is that of the coupler on the crank
            joints = frame | {"b": -force, "c": -loop.held("coupler")}
        theirs.append([*(x for joint in "abcd" for x in joints[joint]), 1000.0 * torque])
    theirs, found = np.array(theirs), ours[wanted].to_numpy()
    columns = {joint: slice(3 * k, 3 * k + 3) for k, joint in enumerate("abcd")} | {"torque": slice(12, 13)}
    gaps = {of: np.abs(theirs[:, at] - found[:, at]).max() for of, at in columns.items()}
    return {of: gap / np.abs(found[:, columns[of]]).max() for of, gap in gaps.items()}


@pytest.mark.parametrize("finger", [0.0, 1.0])
@pytest.mark.parametrize("name", LINKED)
def test_joint_loads_agree_with_the_inverse_dynamics_of_the_exported_model(name, finger, tmp_path):
    follower = "slider" if name in ("rssp", "slider_crank") else "rocker"
    design = scaled(name) | bodies(follower) | {"gravity_x": 900.0, "gravity_y": -9810.0, "gravity_z": 400.0}
    design |= {"finger": finger, "speed": SPEED, "speed_change": CHANGE}
    file = sweep.export(name, model_of(design), tmp_path / "m.xml", phi=0.2)
    gaps = apart(name, design, file, np.linspace(0.2, 6.4, 25))
    assert max(gaps.values()) < NEAR, gaps


def model_of(design):
    return {key: value for key, value in design.items() if key not in ("speed", "speed_change")}


def test_a_hundredth_of_a_gram_more_is_seen(tmp_path):
    design = scaled("rssr") | bodies("rocker") | {"speed": SPEED, "speed_change": CHANGE}
    file = sweep.export("rssr", model_of(design), tmp_path / "m.xml")
    heavier = design | {"m_coupler": design["m_coupler"] + 1e-8}
    assert max(apart("rssr", heavier, file, np.linspace(0.2, 6.4, 5)).values()) > 1e-6


def test_loads_of_the_joint_loads_study_agree(tmp_path):
    study = load_study(Path(__file__).parents[2] / "studies" / "joint-loads")
    columns = study.space.columns(0, study.space.count)
    designs = [k for k in range(0, study.space.count, 97) if columns["alpha"][k] > 0.0][:3]
    assert len(designs) == 3
    for k in designs:
        design = dict(study.space.fixed) | {name: float(values[k]) for name, values in columns.items()}
        own = {p.name for p in family("rssr").parameters}
        masses = {
            name: x for name, x in design.items() if name in own or name.startswith(("m_", "j_", "com_", "gravity"))
        }
        gaps = apart("rssr", masses | {"speed": design["speed"], "speed_change": 0.0},
                     sweep.export("rssr", masses, tmp_path / "m.xml"), np.linspace(0.0, 6.0, 13))  # fmt: skip
        assert max(gaps.values()) < NEAR, gaps
