"""Entries of D1-D3: reactions, driving torque and inertia without friction and with it, for every kind of linkage.

Outputs with friction change abruptly where a joint nearly stops: the functions here vanish at these places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from kernels import status as st
from kernels.effects.coupler import CouplerMotion, coupler_point
from kernels.linkage.bodies import SLIDE
from sweep.effects import kinetostatics, link_loads, loads
from sweep.effects.base import Advice, Effect, about, largest
from sweep.effects.link_loads import rod, tree_of
from sweep.effects.load_passing import FRICTION, LOADS, compute_friction, compute_loads
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT
from sweep.effects.scene import Scene
from sweep.families import family
from sweep.families.base import Array, Output
from sweep.families.curve_features import Bends
from sweep.families.link_tree import LinkJoint, LinkTree
from sweep.families.outputs import kinked
from sweep.numerics.records import Indices

_V, _OMEGA, _ALONG, _PLACE = slice(3, 6), slice(9, 12), slice(15, 18), slice(24, 27)  # of bodies.PER_BODY


def ball_slowness(scene: Scene) -> Array:
    """Squared angular velocities of the coupler relative to crank and follower per unit crank speed, (n, m, 2)."""
    poses, designs = scene.records
    omega, origin = np.empty((*scene.shape, 3)), np.zeros((len(designs), 3))
    coupler_point(poses, designs, origin, scene.inputs["finger"], scene.status(), CouplerMotion(omega=omega))
    crank, axis, turns = designs[:, None, :3], designs[:, None, 3:6], designs[:, None, 16:17]
    of_follower = turns * poses[:, :, 22:23] * axis
    return np.stack([((omega - other) ** 2).sum(axis=2) for other in (crank, of_follower)], axis=2)


def tree_bends(tree: LinkTree, outputs: tuple[str, ...]) -> tuple[Bends, ...]:
    """Bends of outputs with friction: where a shaft reverses, and where another joint nearly stops."""
    found = Bends(frozenset(outputs), reversals), Bends(frozenset(outputs), slowness, squares=True)
    return found if _others(tree) else found[:1]


def reversals(scene: Scene) -> Array:
    """Angular velocity of each shaft in its bearings, (n, m, q)."""
    shafts = [j for j in tree_of(scene).joints if j.kind == "shaft"]
    return np.stack([(relative(scene, joint)[0] * axis_of(scene, joint)).sum(axis=2) for joint in shafts], axis=2)


def slowness(scene: Scene) -> Array:
    """Squared angular velocities, and sliding velocities, of all other joints, (n, m, q)."""
    squares = []
    for joint in _others(tree_of(scene)):
        turn, slip = relative(scene, joint)
        if joint.kind == "sleeve":
            axis = axis_of(scene, joint)
            radius = scene.inputs[f"radius_{joint.name}"][:, None]
            squares.append((radius * (turn * axis).sum(axis=2)) ** 2 + _slid(scene, joint.body, slip))
            continue
        squares.append((turn * turn).sum(axis=2))
        if joint.kind == "contact":
            squares.append((slip * slip).sum(axis=2))
    return np.stack(squares, axis=2)


def _slid(scene: Scene, body: int, slip: Array) -> Array:
    """Square of the sliding along the ways that a body has on its parent, (n, m); the block of a fork has two."""
    own = (scene.links.freedoms == (body, SLIDE)).all(axis=2)[:, None, :]
    along = np.einsum("nmx,nmdx->nmd", slip, scene.links.axes)
    found: Array = np.where(own, along**2, 0.0).sum(axis=2)
    return found


def axis_of(scene: Scene, joint: LinkJoint) -> Array:
    """Axis of a shaft or a sleeve, (n, m, 3)."""
    return scene.links.axes[:, :, tree_of(scene).freedom(joint)]


def _others(tree: LinkTree) -> list[LinkJoint]:
    return [j for j in tree.joints if j.kind != "shaft"]


def relative(scene: Scene, joint: LinkJoint) -> tuple[Array, Array]:
    """Compute angular and sliding velocity of one body of a joint relative to the other, (n, m, 3), for friction.

    The components about a rod's own axis and along a contact's lines are removed.
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


def _rates(bodies: Array, body: Indices, place: Array) -> tuple[Array, Array]:
    """Compute angular velocity of one body of each design and its velocity at a place, (n, m, 3); 0 for the frame."""
    every = np.take_along_axis(bodies, np.maximum(body, 0)[:, None, None, None], axis=2)[:, :, 0]
    omega = every[:, :, _OMEGA]
    velocity = every[:, :, _V] + np.cross(omega, place - every[:, :, :3])
    moving = (body >= 0)[:, None, None]
    return np.where(moving, omega, 0.0), np.where(moving, velocity, 0.0)


def _across(vector: Array, line: Array) -> Array:
    found: Array = vector - (vector * line).sum(axis=2, keepdims=True) * line
    return found


def _share_of_inertia(scene: Scene, name: str, size: Callable[[Array], Array], quantity: str) -> Advice | None:
    """Share of the ``size`` of an output over the turn due to inertia and weight; 1 without a useful load."""
    names = frozenset({name})
    whole = compute_loads(scene, names)
    still = {
        name: np.zeros_like(x) if name.startswith(("m_", "j_", "line_mass_")) else x for name, x in scene.inputs.items()
    }
    alone = compute_loads(replace(scene, inputs=still, memo={}), names)
    turns = (np.asarray(whole["status"]) == st.OK).all(axis=1)
    most, useful = (np.where(turns, size(np.asarray(found[name], np.float64)), np.nan) for found in (whole, alone))
    return Advice.of_turning(quantity, np.abs(most - useful) / np.where(most > 0.0, most, 1.0), 0.1)


def _advise_closed(scene: Scene) -> Advice | None:
    words = "share of the largest force at C that is not due to loads"
    return _share_of_inertia(scene, "force_c", partial(np.max, axis=1), words)


def _advise_tree(scene: Scene) -> Advice | None:
    words = "share of the driving torque's range that is not due to loads"
    return _share_of_inertia(scene, "drive_torque", partial(np.ptp, axis=1), words)


def _closed(kind: loads.Follower) -> Effect:
    return Effect(
        **about(f"{kind.prefix}kinetostatics"),
        followers=(kind.name,),
        needs=("coupler",),
        inputs=kind.parameters,
        tool_inputs=loads.TOOLS,
        outputs=(
            *loads.vector_outputs(kinetostatics.vectors(kind.name)),
            *loads.scalar_outputs(kinetostatics.COUPLES | kinetostatics.INERTIAS),
        ),
        compute=compute_loads,
        takes_load=LOADS,
        advise=_advise_closed,
    )


def _closed_friction(kind: loads.Follower) -> Effect:
    vectors = kinetostatics.vectors(kind.name, FRICTION_SUFFIX, FRICTION_TEXT)
    scalars = kinetostatics.COUPLES_WITH_FRICTION | kinetostatics.losses(kind)
    contraction = "rho(L), bound of its rate; below 1 the solution is unique"
    outputs = kinked((
        *loads.vector_outputs(vectors),
        *loads.scalar_outputs(scalars, *loads.PASSES),
        Output(kinetostatics.CONTRACTION, "1", contraction),
    ))  # fmt: skip
    return replace(
        _closed(kind),
        **about(f"{kind.prefix}friction"),
        needs=(f"{kind.prefix}kinetostatics",),
        inputs=(*kind.parameters, *kinetostatics.friction_inputs(kind)),
        outputs=outputs,
        compute=compute_friction,
        takes_load=FRICTION,
        bends=(Bends(frozenset(o.name for o in outputs), ball_slowness, squares=True),),
        advise=largest(compute_friction, kinetostatics.CONTRACTION, "contraction rho(L)", 0.01),
    )


@lru_cache
def loads_of(name: str) -> Effect:
    """Make the entry of the loads of a family with a tree of links."""
    tree = family(name).the(LinkTree)
    return Effect(
        **about("loads", name),
        inputs=link_loads.inputs(tree),
        outputs=(
            *loads.vector_outputs(link_loads.vectors(tree) | link_loads.TOOL_VECTOR),
            *loads.scalar_outputs(link_loads.SCALARS),
        ),
        compute=compute_loads,
        takes_load=LOADS,
        requires=LinkTree,
        tree=tree,
        advise=_advise_tree,
    )


@lru_cache
def friction_of(name: str) -> Effect:
    """Make the entry of the friction of a family with a tree of links."""
    bare, tree = loads_of(name), family(name).the(LinkTree)
    torque = {link_loads.TORQUE_WITH_FRICTION: ("torque", f"torque that drives the cranks{FRICTION_TEXT}")}
    supports = {at: ("force", words) for at, (_, _, words) in link_loads.support_loads(tree).items()}
    scalars = torque | link_loads.losses(tree) | supports
    outputs = kinked((
        *loads.vector_outputs(link_loads.vectors(tree, FRICTION_SUFFIX, FRICTION_TEXT)),
        *loads.scalar_outputs(scalars, *loads.PASSES),
    ))  # fmt: skip
    return replace(
        bare,
        **about("friction", name),
        needs=(bare.name,),
        inputs=(*bare.inputs, *(p for joint in tree.joints for p in link_loads.friction_inputs(joint))),
        outputs=outputs,
        compute=compute_friction,
        takes_load=FRICTION,
        bends=tree_bends(tree, tuple(o.name for o in outputs)),
        advise=largest(compute_friction, next(iter(loads.PASSES)), "number of passes of the friction iteration", 4.0),
    )


KINETOSTATICS, SLIDER_KINETOSTATICS = _closed(loads.ROCKER), _closed(loads.SLIDER)
CLOSED_FRICTION, SLIDER_FRICTION = _closed_friction(loads.ROCKER), _closed_friction(loads.SLIDER)
