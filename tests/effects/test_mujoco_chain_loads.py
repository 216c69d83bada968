"""Loads of a chain against MuJoCo: inverse dynamics of the exported model, its loops and its shaft cut."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from tests.effects.test_mujoco_loads import NEAR, Loop, bodies
from tests.exchange.test_export import chain_design, solved

SPEED, CHANGE = 50.0, 300.0
CHAIN = ["rssr", "guide"]
GRAVITY = {"gravity_x": 900.0, "gravity_y": -9810.0, "gravity_z": 400.0}
JOINTS = [f"force_{joint}_{axis}{k}" for k in (1, 2) for joint in "abcd" for axis in "xyz"]


def turned(design):
    """Axes of the frame of stage 2 in that of stage 1, which is the model's, as columns."""
    chain = family(CHAIN)
    matrix, _ = design_matrix(chain, {n: x for n, x in design.items() if n in chain.parameter_names})
    return chain.frames(matrix)[1].rotation[0]


class Stages(Loop):
    """The model of a chain: a loop in each stage, and the equation that couples second crank and first rocker."""

    def __init__(self, file):
        self.model = mujoco.MjModel.from_xml_path(str(file))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        self.crank = self.model.joint("crank 1").dofadr[0]
        kinds = self.model.eq_type
        self.loops = [k for k in range(self.model.neq) if kinds[k] == mujoco.mjtEq.mjEQ_CONNECT]
        assert self.model.neq == len(self.loops) + 1

    def at(self, phi):
        """Forces of both loops on the first of their bodies, those of all joints in the tree, both torques."""
        model, data = self.model, self.data
        data.xfrc_applied[:] = 0.0
        solved(model, data, phi, "crank 1")
        free = [k for k in range(model.nv) if k != self.crank]
        rows, points, ends = [], [], []
        for loop in self.loops:
            self.ends = int(model.eq_obj1id[loop]), int(model.eq_obj2id[loop])
            body = self.ends[0]
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ model.eq_data[loop, :3]
            rows.append(self.jacobian(0, point) - self.jacobian(1, point))
            points.append(point)
            ends.append(self.ends)
        coupling = np.zeros((1, model.nv))
        coupling[0, model.joint("crank 2").dofadr[0]] = 1.0
        coupling[0, model.joint("rocker 1").dofadr[0]] = 1.0  # kappa2 = -1
        rows = np.concatenate([*rows, coupling])
        rates, second = np.zeros(model.nv), np.zeros(model.nv)
        rates[self.crank], second[self.crank] = SPEED, CHANGE
        rates[free] = np.linalg.lstsq(rows[:, free], -rows[:, self.crank] * SPEED, rcond=None)[0]
        data.qvel[:], data.qacc[:] = rates, 0.0
        apart = []
        for self.ends, point in zip(ends, points, strict=True):
            apart.append(self.acceleration(0, point) - self.acceleration(1, point))
        apart = np.concatenate([*apart, [0.0]])
        second[free] = np.linalg.lstsq(rows[:, free], -apart - rows[:, self.crank] * CHANGE, rcond=None)[0]
        data.qacc[:] = second
        model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
        mujoco.mj_inverse(model, data)
        model.opt.disableflags = 0
        unknown = np.column_stack([rows.T, np.eye(model.nv)[self.crank]])
        found, *_ = np.linalg.lstsq(unknown, data.qfrc_inverse, rcond=None)
        rest = np.abs(unknown @ found - data.qfrc_inverse).max()
        forces = [found[3 * k : 3 * k + 3] for k in range(len(ends))]
        for pair, point, force in zip(ends, points, forces, strict=True):
            for body, sign in zip(pair, (1.0, -1.0), strict=True):
                data.xfrc_applied[body, :3] += sign * force
                data.xfrc_applied[body, 3:] += np.cross(point - data.xipos[body], sign * force)
        mujoco.mj_rnePostConstraint(model, data)
        return forces, found[-1], found[-2], rest


def gaps(design, file, phis):
    """Largest differences of joint forces and of both driving torques, each over its largest value."""
    ours = sweep.evaluate(CHAIN, design, [*JOINTS, "drive_torque1", "drive_torque2"], phi=phis)
    assert (ours["status"] == st.OK).all()
    stages, theirs = Stages(file), []
    axes = {1: np.eye(3), 2: turned(design)}
    for phi in phis:
        forces, torque, coupling, rest = stages.at(phi)
        assert rest < 1e-10 * max(1.0, abs(torque))
        row = {"drive_torque1": 1000.0 * torque, "drive_torque2": 1000.0 * coupling}
        for k, (loop, force) in enumerate(zip(stages.loops, forces, strict=True), start=1):
            joints = {"a": stages.held(f"crank {k}"), "d": stages.held(f"rocker {k}")}
            on = stages.held(f"coupler {k}")
            # the coupler hangs on the crank, or on the rocker where that holds the finger
            closes_c = stages.model.equality(loop).name.startswith("C")
            joints |= {"b": on, "c": -force} if closes_c else {"b": -force, "c": -on}
            row |= {f"force_{j}_{x}{k}": (axes[k].T @ f)[i] for j, f in joints.items() for i, x in enumerate("xyz")}
        theirs.append(row)
    found = {}
    for names in ([n for n in JOINTS if n[-1] == "1"], [n for n in JOINTS if n[-1] == "2"], ["drive_torque1"],
                  ["drive_torque2"]):  # fmt: skip
        size = np.abs(ours[names]).to_numpy().max()
        found[names[0]] = max(np.abs(ours[n] - [row[n] for row in theirs]).max() for n in names) / size
    return found


@pytest.mark.parametrize("finger", [0.0, 1.0])
def test_joint_loads_of_a_chain_agree_with_the_inverse_dynamics_of_the_exported_model(finger, tmp_path):
    design = chain_design()
    for k in (1, 2):
        design |= {f"{key}{k}": x for key, x in (bodies("rocker") | GRAVITY | {"finger": finger}).items()}
    # One field of gravity, in the frame of each stage.
    pull = turned(design).T @ list(GRAVITY.values())
    design |= {f"{name}2": x for name, x in zip(GRAVITY, pull.tolist(), strict=True)}
    file = sweep.export(CHAIN, design, tmp_path / "m.xml", phi=0.2)
    loads = design | {"speed1": SPEED, "speed_change1": CHANGE}
    phis = np.linspace(0.2, 6.4, 21)
    found = gaps(loads, file, phis)
    assert max(found.values()) < 5.0 * NEAR, found  # two stages, one after the other
    heavier = loads | {"m_coupler2": loads["m_coupler2"] + 1e-8}
    assert max(gaps(heavier, file, phis[:3]).values()) > 1e-6  # a hundredth of a gram more is seen
