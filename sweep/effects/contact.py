"""Contact of balls and pins in slots and of straps on eccentrics: sliding speed, Hertz stress, p v."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from kernels import status as st
from kernels.linkage.bodies import TURN
from kernels.types import Array, Status
from sweep.effects.base import Effect, about, largest
from sweep.effects.link_loads import tree_of
from sweep.effects.load_effects import axis_of, loads_of, relative
from sweep.effects.load_passing import compute_loads
from sweep.effects.loads import magnitude
from sweep.effects.scene import Scene, refuse, take_over
from sweep.families import family
from sweep.families.base import Columns, Output, Parameter, floats
from sweep.families.curve_features import Bends
from sweep.families.link_tree import LinkJoint, LinkTree
from sweep.families.sites import AXES

# Steel on steel; from both moduli 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
MODULUS = Parameter("contact_modulus", "pressure", "E* of both surfaces: 1/E* = sum of (1 - nu^2)/E", default=115e3,
                    positive=True)  # fmt: skip
NARROW = 3.0  # least ratio of R1 to half the width of a strap's contact for which Hertz's formula is used


def ball_stress(force: Array, modulus: Array, radius: Array) -> Array:
    """Largest pressure of a ball on a flat wall, (10)."""
    return np.cbrt(6.0 * force * modulus**2 / (np.pi**3 * radius**2))


def line_stress(force: Array, modulus: Array, radius: Array, length: Array) -> Array:
    """Largest pressure of a line contact, (11)."""
    return np.sqrt(force * modulus / (np.pi * length * radius))


def half_width(force: Array, modulus: Array, radius: Array, length: Array) -> Array:
    """Half the width of a line contact, (11)."""
    return np.sqrt(4.0 * force * radius / (np.pi * length * modulus))


def touching(tree: LinkTree) -> tuple[LinkJoint, ...]:
    """Joints of a tree with a point contact, a line contact, or a strap."""
    return tuple(joint for joint in tree.joints if joint.touch)


def _inputs(joint: LinkJoint) -> tuple[Parameter, ...]:
    name, text = joint.name, joint.text
    found = [Parameter(f"contact_radius_{name}", "length", f"radius of ball, pin or eccentric: {text}", positive=True)]
    if joint.touch != "ball":
        found.append(Parameter(f"contact_length_{name}", "length", f"length of the contact: {text}", positive=True))
    if joint.touch == "strap":
        found.append(Parameter(f"bore_radius_{name}", "length", f"radius of the strap's bore: {text}", positive=True))
    return tuple(found)


def _outputs(joint: LinkJoint) -> tuple[Output, ...]:
    name, text = joint.name, joint.text
    return (
        Output(f"sliding_{name}", "length/time", f"sliding speed: {text}"),
        Output(f"stress_{name}", "pressure", f"largest pressure of the contact (Hertz): {text}", kinks=True),
        Output(f"pv_{name}", "pressure*length/time", f"mean pressure times sliding speed: {text}", kinks=True),
    )


def _of_joint(scene: Scene, joint: LinkJoint, force: Array, status: Status) -> list[Array]:
    """Compute sliding speed, largest pressure, and mean pressure times speed of a joint, (n, m)."""
    given = {p.name.removesuffix(f"_{joint.name}"): scene.inputs[p.name][:, None] for p in _inputs(joint)}
    modulus, radius = scene.inputs[MODULUS.name][:, None], given["contact_radius"]
    speed = np.abs(scene.crank()[0])
    turn, slip = relative(scene, joint)
    if joint.touch == "ball":
        # a block that also turns on the bar is no ball in a slot
        kinds = scene.links.freedoms
        refuse(status, np.any((kinds[:, :, 0] == joint.body) & (kinds[:, :, 1] == TURN), axis=1))
        stress = ball_stress(force, modulus, radius)
        mean, sliding = 2.0 / 3.0 * stress, magnitude(slip) * speed
    elif joint.touch == "line":
        stress = line_stress(force, modulus, radius, given["contact_length"])
        mean, sliding = 0.25 * np.pi * stress, magnitude(slip) * speed
    else:
        length, bore = given["contact_length"], given["bore_radius"]
        refuse(status, (bore <= radius)[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            both = 1.0 / (1.0 / radius - 1.0 / bore)
            stress = line_stress(force, modulus, both, length)
            narrow = half_width(force, modulus, both, length) * NARROW < radius
        np.copyto(status, st.NOT_LINEAR, where=~narrow & (status == st.OK))
        mean = force / (2.0 * radius * length)
        sliding = np.abs((turn * axis_of(scene, joint)).sum(axis=2)) * radius * speed
    return [sliding, stress, mean * sliding]


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted outputs of the joints with contacts."""
    joints = [joint for joint in touching(tree_of(scene)) if not wanted.isdisjoint(o.name for o in _outputs(joint))]
    loads = compute_loads(scene, frozenset(f"force_{joint.name}" for joint in joints))
    status = scene.status()
    columns: dict[str, Array] = {}
    take_over(status, loads["status"])
    for joint in joints:
        force = np.asarray(loads[f"force_{joint.name}"], np.float64)
        found = _of_joint(scene, joint, force, status)
        columns |= {o.name: x for o, x in zip(_outputs(joint), found, strict=True) if o.name in wanted}
    good = status == st.OK
    found_columns: Columns = {name: np.where(good, x, np.nan) for name, x in columns.items()}
    return found_columns | {"status": status}


def _across(scene: Scene, joint: LinkJoint) -> Array:
    """Signed force on a joint across the slot of the output link, (n, m, 1): it passes zero as it changes walls."""
    names = [f"force_{joint.name}_{x}" for x in AXES]
    force = np.stack(floats(compute_loads(scene, frozenset(names)), *names), axis=2)
    wall = scene.links.bodies[:, :, tree_of(scene).output, 18:21]
    across: Array = (force * wall).sum(axis=2, keepdims=True)
    return across


@lru_cache
def contact_of(name: str) -> Effect:
    """Make the entry of the contacts of a family with a tree of links."""
    bare, joints = loads_of(name), touching(family(name).the(LinkTree))
    return replace(
        bare,
        **about("contact", name),
        needs=(bare.name,),
        inputs=(*bare.inputs, MODULUS, *(p for joint in joints for p in _inputs(joint))),
        only_for={p.name: tuple(o.name for o in _outputs(joint)) for joint in joints for p in _inputs(joint)},
        outputs=tuple(o for joint in joints for o in _outputs(joint)),
        compute=compute,
        bends=tuple(
            Bends(frozenset(o.name for o in _outputs(joint)[1:]), partial(_across, joint=joint), zero=True)
            for joint in joints
            if joint.touch != "strap"
        ),
        advise=largest(compute, f"stress_{joints[0].name}", "pressure", 100.0, "MPa"),
    )
