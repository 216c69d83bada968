"""Where joints nearly stop, and their friction turns at once: functions that vanish there."""

from __future__ import annotations

import numpy as np

from kernels.effects.coupler import coupler_point
from sweep.effects.base import Bend
from sweep.effects.link_loads import rod, tree_of
from sweep.effects.scene import Index, Scene
from sweep.families.base import Array
from sweep.families.link_tree import LinkJoint, LinkTree

_V, _OMEGA, _ALONG, _PLACE = slice(3, 6), slice(9, 12), slice(15, 18), slice(24, 27)  # of bodies.PER_BODY


def ball_slowness(scene: Scene) -> Array:
    """Squares of the turning of coupler against crank and against follower per unit crank speed, (n, m, 2)."""
    poses, designs = scene.records
    omega, origin = np.empty((*scene.shape, 3)), np.zeros((len(designs), 3))
    coupler_point(
        poses, designs, origin, scene.inputs["finger"], scene.status(), None, None, None, None, omega, None, None
    )
    crank, axis, turns = designs[:, None, :3], designs[:, None, 3:6], designs[:, None, 16:17]
    of_follower = turns * poses[:, :, 22:23] * axis
    return np.stack([((omega - other) ** 2).sum(axis=2) for other in (crank, of_follower)], axis=2)


def tree_bends(tree: LinkTree, outputs: tuple[str, ...]) -> tuple[Bend, ...]:
    """Places where outputs with friction bend: where a shaft reverses, and where another joint nearly stops."""
    found = [Bend(outputs, reversals)]
    return (*found, Bend(outputs, slowness, squares=True)) if _others(tree) else tuple(found)


def reversals(scene: Scene) -> Array:
    """Compute the turning of each shaft in its bearings, (n, m, q)."""
    rates = []
    for joint in _shafts(tree_of(scene)):
        turn, _ = _relative(scene, joint)
        rates.append((turn * scene.links.axes[:, :, joint.freedom]).sum(axis=2))
    return np.stack(rates, axis=2)


def slowness(scene: Scene) -> Array:
    """Squares of the turning, and of the sliding, of all other joints, (n, m, q)."""
    squares = []
    for joint in _others(tree_of(scene)):
        turn, slip = _relative(scene, joint)
        if joint.kind == "sleeve":
            axis = scene.links.axes[:, :, joint.freedom]
            radius = scene.inputs[f"radius_{joint.name}"][:, None]
            squares.append((radius * (turn * axis).sum(axis=2)) ** 2 + (slip * axis).sum(axis=2) ** 2)
            continue
        squares.append((turn * turn).sum(axis=2))
        if joint.kind == "contact":
            squares.append((slip * slip).sum(axis=2))
    return np.stack(squares, axis=2)


def _shafts(tree: LinkTree) -> list[LinkJoint]:
    return [j for j in tree.joints if j.kind == "shaft"]


def _others(tree: LinkTree) -> list[LinkJoint]:
    return [j for j in tree.joints if j.kind != "shaft"]


def _relative(scene: Scene, joint: LinkJoint) -> tuple[Array, Array]:
    """Compute turning and sliding of one body of a joint against the other, (n, m, 3), as friction sees them.

    A rod is free about its own axis, a contact slides across its lines.
    """
    bodies, first = scene.links.bodies, joint.lines[0]
    if joint.lines[1] == 0:
        pair = np.array([joint.body, scene.links.parents[joint.body]])
        ends, place = np.tile(pair, (len(scene.designs), 1)), bodies[:, :, joint.body, _PLACE]
    else:
        ends, place = scene.links.ends[:, first], scene.links.lines[:, :, first, :3]
    (turn, slip), (turned, slid) = (_rates(bodies, ends[:, k], place) for k in (0, 1))
    turn, slip = turn - turned, slip - slid
    slender = rod(tree_of(scene), joint)
    if slender >= 0:
        turn = _across(turn, bodies[:, :, slender, _ALONG])
    if joint.kind == "contact":
        for which in range(first, first + joint.lines[1]):
            slip = _across(slip, scene.links.lines[:, :, which, 3:])
    return turn, slip


def _rates(bodies: Array, body: Index, place: Array) -> tuple[Array, Array]:
    """Compute the turning of one body of each design and its velocity at a place, (n, m, 3); none of the frame."""
    every = np.take_along_axis(bodies, np.maximum(body, 0)[:, None, None, None], axis=2)[:, :, 0]
    omega = every[:, :, _OMEGA]
    velocity = every[:, :, _V] + np.cross(omega, place - every[:, :, :3])
    moving = (body >= 0)[:, None, None]
    return np.where(moving, omega, 0.0), np.where(moving, velocity, 0.0)


def _across(vector: Array, line: Array) -> Array:
    found: Array = vector - (vector * line).sum(axis=2, keepdims=True) * line
    return found
