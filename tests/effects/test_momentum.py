"""Every family that turns has loads: a machine of it, and of a chain with it, obeys the laws of momentum and of power.

The reference takes from the project where bodies are and how their axes lie, no rate: those come from the Fourier
transform of the turn.  Force and moment on the machine's frame are minus the rate of momentum, the torque is the power
over the speed, weights apart.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.effects.scene import first_scene
from sweep.families import NAMES, family
from sweep.families.base import Angles, Turn
from sweep.families.capabilities import OutputLink
from sweep.families.chain import Chain
from sweep.families.link_tree import LinkTree
from tests.reference.momentum import balance, body_momentum, triads
from tests.support.selection import mostly_long

N = 256
PHI = 2.0 * np.pi * np.arange(N) / N
OMEGA = 7.0
# Of the largest force or torque: three derivatives by the Fourier transform.  Largest seen 2e-10.
NEAR = 1e-9
IDLE = 1e-11  # of the largest moment: a torque that is zero, seen 3e-12
AT, AXIS, ZERO = np.array([3.0, -5.0, 2.0]), np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
ROTATION = np.column_stack([ZERO, np.cross(AXIS, ZERO), AXIS])
STILL = np.tile(np.eye(3), (N, 1, 1))
MOVING = [name for name in NAMES if isinstance(family(name).domain, Turn)]
# Fourier tables and lively drives instead of laws with corners: the transform needs derivatives of all orders.
SMOOTH = {
    "cam": {"law": 4.0, "c1": 0.5, "s2": 0.1},
    "cam_lever": {"law": 4.0, "c1": 0.5, "s2": 0.1},
    "heddle": {"O3D": 40.0, "O4F": 45.0, "O3O4": 120.0, "DF": 120.2, "EG": 300.0, "x_s": 120.0},
}
GENTLE = {"a": 1.0, "b": 5.5, "c": 4.0, "e": 4.6, "f": 0.4, "g": -0.3, "alpha": 0.5}


def dimensions(name):
    own = {p.name: p.default for p in family(name).parameters if p.default is not None}
    return own | dict(family(name).example) | SMOOTH.get(name, {})


def chained(name):
    """A chain with the family and a crank-rocker, which follows it where it can drive a crank."""
    return [name, "rssr"] if family(name).find(OutputLink) is not None else ["rssr", name]


def bodies_of(of, rng):
    """Body names of a stage, their inputs, and (mass, centre, tensor) of each, without any symmetry."""
    tree = of.find(LinkTree)
    follower = "slider" if tree is None and "psi" not in of.pose_names and of.position == "s" else "rocker"
    follower = "rocker" if of.name == "guide" else follower
    slender = {b.name: b.slender for b in tree.bodies} if tree else dict.fromkeys(("crank", "coupler", follower), False)
    size = max(abs(x) for x in dimensions(of.name).values()) / 5.0
    table, found = {}, {}
    for name, thin in slender.items():
        m, centre = rng.uniform(0.5, 2.0), size * rng.uniform(-0.5, 0.5, 3)
        half = rng.uniform(-0.5, 0.5, (3, 3))
        tensor = size**2 * (half @ half.T + 0.2 * np.eye(3))
        table |= {f"m_{name}": m, f"com_{name}_x": centre[0]}
        if thin:
            centre, tensor = np.array([centre[0], 0.0, 0.0]), np.diag([0.0, tensor[0, 0], tensor[0, 0]])
            table[f"j_{name}"] = tensor[1, 1]
        else:
            table |= {f"com_{name}_{x}": centre[k] for k, x in enumerate("xyz")}
            table |= {f"j_{name}_{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i in range(3) for j in range(i, 3)}
        found[name] = (m, centre, tensor)
    return table, found


def poses_of(scene):
    """Origins and axes of the bodies of a stage in their order, in its own frame."""
    if scene.family.find(LinkTree) is not None:
        bodies = scene.links.bodies[0]
        return [(bodies[:, k, :3], bodies[:, k, 15:24].reshape(-1, 3, 3)) for k in range(bodies.shape[1])]
    poses, design = scene.records[0][0], scene.records[1][0]
    b, c, turns = poses[:, 0:3], poses[:, 3:6], design[16] == 1.0
    u = design[0:3]
    rho = poses[:, 15:18]
    follower = np.stack([rho, poses[:, 18:21], np.cross(rho, poses[:, 18:21])], axis=1)
    frames = triads(b, c, u, (poses[:, 9:12], poses[:, 12:15]), follower, design[15], True)
    first, last = np.broadcast_to(design[6:9], b.shape), np.broadcast_to(design[9:12], b.shape) if turns else c
    return list(zip((first, b, last), frames, strict=True))


MECHANISMS = [[name] for name in MOVING] + [chained(name) for name in MOVING]


@pytest.mark.parametrize("names", mostly_long(MECHANISMS, MECHANISMS[::2]), ids="+".join)
def test_shaking_is_minus_the_rate_of_momentum_and_torque_the_power_over_the_speed(names):
    machine, design, expected = reference(names)
    axes = [f"{what}_{x}" for what in ("f", "f_moment") for x in "xyz"]
    found = sweep.evaluate(machine, design, [*axes, "t"], phi=PHI)
    assert (found["status"] == 0).all()
    given = found[axes[:3]].to_numpy(), found[axes[3:]].to_numpy(), found["t"].to_numpy()
    for values, exact in zip(given, expected, strict=True):
        assert np.abs(values - exact).max() < NEAR * np.abs(exact).max() + IDLE * np.abs(expected[1]).max()


def reference(names):
    """A placed machine of these stages, a design with bodies of it, and what momentum and power ask for."""
    rng = np.random.default_rng(len(names[0]))
    spot = {"at": AT.tolist(), "axis": AXIS.tolist(), "zero": ZERO.tolist()} | ({"stage": 1} if names[1:] else {})
    member = {"place": spot} | ({"chain": names} if names[1:] else {"family": names[0]})
    numbers = [str(k + 1) for k in range(len(names))] if names[1:] else [""]
    machine = sweep.machine({"x": member}, {"f": {"shaking": [f"x{k}" for k in numbers]}, "t": {"torque": ["x"]}})
    design, parts = {f"speed{numbers[0]}": OMEGA}, []
    design |= {"offset2": 0.4, "shift2": 1.5, "turn2": 0.7} if names[1:] else {}
    for one, number in zip(names, numbers, strict=True):
        sizes = GENTLE if names[1:] and one == "rssr" else dimensions(one)
        table, masses = bodies_of(family(one), rng)
        design |= {f"{key}{number}": x for key, x in (sizes | table).items()}
        parts.append(masses)
    of = family(machine).member("x").family
    matrix = np.array([[design.get(p.name, p.default) for p in of.parameters]], float)
    scene = first_scene(of, matrix, Angles.of(PHI[None]), {})
    placed = of.frames(matrix) if isinstance(of, Chain) else None
    momenta = []
    for k, masses in enumerate(parts):
        inner = (placed[k].rotation[0], placed[k].at[0]) if placed else (np.eye(3), np.zeros(3))
        turn, at = ROTATION @ inner[0], AT + ROTATION @ inner[1]
        for (origin, axes), (m, centre, tensor) in zip(poses_of(scene.stage(k)), masses.values(), strict=True):
            origin, axes = origin @ turn.T + at, axes @ turn.T
            if tensor[0, 0] == 0.0:  # a slender rod: two halves on its line, since its spin is nobody's
                arms = centre[0] + np.array([1.0, -1.0]) * np.sqrt(tensor[1, 1] / m)
                ends = [origin + x * axes[:, 0] for x in arms]
                momenta += [(body_momentum(x, STILL, m / 2, np.zeros(3), 0 * tensor, OMEGA), m / 2) for x in ends]
                continue
            momenta.append((body_momentum(origin, axes, m, centre, tensor, OMEGA), m))
    force, moment, power = balance(momenta, np.zeros(3), OMEGA)
    return machine, {f"x.{key}": x for key, x in design.items()}, (-force, -moment, power / OMEGA)
