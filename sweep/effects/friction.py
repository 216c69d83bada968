"""D2: joint reactions and driving torque with friction, for a rocker and for a slider."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from kernels.effects.friction import friction_loads
from sweep.effects import ball_stops, loads
from sweep.effects.base import Effect, Scene, largest, refuse, take_over
from sweep.effects.bearings import together
from sweep.effects.bend import Bend
from sweep.effects.handed import FRICTION
from sweep.effects.handed import behind as handed_behind
from sweep.effects.kinetostatics import bodies, drive, force_outputs, vector_columns, wanted_groups
from sweep.effects.tool import weighs
from sweep.families.base import Columns, Output, Parameter, optional_outputs

KEY = FRICTION
EQUATION = "D2 (1)-(4)"
FORMULAS = (
    "(1) ball joints: E = -mu r |R| w/|w|, w the speed of the coupler relative to crank or rocker",
    "(2) shafts: t = -sign(speed) mu [r (F1 + F2) + r_t |F_axial|], F1 and F2 the loads of the two supports;",
    "    slider: two shoes that move with it, force -sign(s') mu (F1 + F2), ours",
    "(3) iterated until the couples change by less than 1e-14; L_ij = mu_i r_i |d R_i/d couple_j|,",
    "    rho(L) < 1 proves one solution",
    "(4) the moment at A holds the drive torque and leaves the shaft's friction torque out; force and moment at D hold",
    "    what rubs there",
)
SUFFIX = "_friction"
PASSES = "friction_passes"

_JOINTS = {"a": "crank bearing", "b": "ball joint at B", "c": "ball joint at C"}
_TEXT = ", friction included"


def _data(kind: loads.Follower) -> tuple[Parameter, ...]:
    rocker = kind is loads.ROCKER
    joints = _JOINTS | {"d": f"{kind.name} bearing" if rocker else "slide"}
    along, place = ("rocker axis", "D") if rocker else ("slide, moving with the slider", "C")
    thrust = tuple(
        Parameter(
            f"thrust_radius_{j}", "length", f"mean thrust radius of the {joints[j]}", default=0.0, not_negative=True
        )
        for j in ("ad" if rocker else "a")
    )
    return (
        *(
            Parameter(f"mu_{j}", "ratio", f"coefficient of friction of the {text}", not_negative=True)
            for j, text in joints.items()
        ),
        *(
            Parameter(f"radius_{j}", "length", f"friction radius of the {text}", not_negative=True)
            for j, text in joints.items()
            if rocker or j != "d"
        ),
        *thrust,
        Parameter("support_a1", "length", "first support along the crank axis, from A"),
        Parameter("support_a2", "length", "second support along the crank axis, from A"),
        Parameter("support_d1", "length", f"first support along the {along}, from {place}"),
        Parameter("support_d2", "length", f"second support along the {along}, from {place}"),
    )


# In the order of the columns of kernels.effects.friction.Friction; a slide has an arm of 1 and no thrust.
COLUMNS = tuple(p.name for p in _data(loads.ROCKER))
_OF_A_SLIDE = {"radius_d": 1.0, "thrust_radius_d": 0.0}
_COUPLES = {
    "finger_couple_friction": ("torque", "couple of the finger along n x w" + _TEXT),
    "drive_torque_friction": ("torque", "torque that drives the crank" + _TEXT),
}


def _losses(kind: loads.Follower) -> dict[str, tuple[str, str]]:
    """Return what the kernel gives as losses, in its order."""
    rocker = kind is loads.ROCKER
    follower = ("torque", "friction torque on the rocker about its axis")
    found = {
        "shaft_torque_a": ("torque", "friction torque on the crank about its axis"),
        **({"shaft_torque_d": follower} if rocker else {"slide_friction": ("force", "friction force on the slider")}),
        "ball_couple_b": ("torque", "magnitude: friction couple of the ball joint at B"),
        "ball_couple_c": ("torque", "magnitude: friction couple of the ball joint at C"),
    }
    supports = ("load_support_a1", "load_support_a2", "load_support_d1", "load_support_d2")
    found |= {name: ("force", f"load across the axis of the support {name[-2:]}{_TEXT}") for name in supports}
    return found | {PASSES: ("1", "passes of the friction iteration")}


def _outputs(kind: loads.Follower) -> tuple[Output, ...]:
    scalars = _COUPLES | _losses(kind)
    found = (
        *force_outputs(kind.name, SUFFIX, _TEXT, EQUATION),
        *(Output(name, unit, text, EQUATION, name == PASSES) for name, (unit, text) in scalars.items()),
        Output("friction_contraction", "1", "rho(L), bound of its rate; below 1 the solution is unique", EQUATION),
    )
    return tuple(replace(o, kinks=not o.jumps) for o in found)


def behind(scene: Scene) -> Columns | None:
    """Return the driving torque with friction and status of the next stage; None at the end of the chain."""
    return handed_behind(scene, KEY, frozenset({"drive_torque_friction"}))


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted quantities with friction; status JAMMED where the iteration does not contract."""
    status, handed_back, kind = scene.status(), behind(scene), loads.follower(scene)
    if handed_back is not None:
        take_over(status, handed_back["status"])
    refuse(status, together(scene, "a") | together(scene, "d"))
    losses = tuple(_losses(kind))
    forces, couples, _ = wanted_groups(wanted, SUFFIX)
    asked = ((18, forces), (2, couples), (len(losses), not wanted.isdisjoint(losses)))
    out = [np.empty((*scene.shape, size)) if some else None for size, some in asked]
    (contraction,) = optional_outputs(("friction_contraction",), wanted, scene.shape)
    data = np.column_stack(
        [scene.inputs.get(name, np.full(len(scene.designs), _OF_A_SLIDE.get(name, np.nan))) for name in COLUMNS]
    )
    load = drive(scene, handed_back, "drive_torque_friction")
    poses, designs = scene.records
    tool = weighs(scene, load, False)
    finger = scene.inputs["finger"]
    friction_loads(
        poses, designs, bodies(scene), load, data, finger, status, out[0], out[1], out[2], contraction, tool.coupler,
        tool.follower,
    )  # fmt: skip
    columns = vector_columns(out[0], scene.records, wanted, SUFFIX)
    for names, values in ((tuple(_COUPLES), out[1]), (losses, out[2])):
        if values is not None:
            columns |= {name: values[:, :, k] for k, name in enumerate(names) if name in wanted}
    if contraction is not None:
        columns["friction_contraction"] = contraction
    return columns | {"status": status}


def _effect(kind: loads.Follower) -> Effect:
    results = _outputs(kind)
    return Effect(
        key=KEY,
        name=f"{kind.prefix}friction",
        title=f"friction of ball joints, crank shaft and {kind.name} by successive approximations",
        equation=EQUATION,
        formulas=FORMULAS,
        followers=(kind.name,),
        needs=(f"{kind.prefix}kinetostatics",),
        inputs=(*kind.parameters, *_data(kind)),
        tool_inputs=loads.TOOLS,
        outputs=results,
        compute=compute,
        called_for="losses, drive sizing, a check against jamming",
        negligible="contraction rho(L) below 0.01: joint loads change by less than 1 %",
        takes_load=KEY,
        bends=(Bend(tuple(o.name for o in results), ball_stops.slowness, squares=True),),
        advise=partial(
            largest,
            compute=compute,
            name="friction_contraction",
            quantity="largest contraction rho(L)",
            threshold=0.01,
        ),
    )


EFFECT = _effect(loads.ROCKER)
SLIDER = _effect(loads.SLIDER)
