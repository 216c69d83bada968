"""Entries of the effects on the thread over an eyelet: tension over the contour, with speed, and by Euler's law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kernels.effects.thread import capstan, thread_contour, thread_speed
from kernels.types import Status
from sweep.effects.base import Effect, about
from sweep.effects.loads import CHANGE
from sweep.effects.scene import Scene, refuse
from sweep.families.base import Array, Columns, Output, Parameter, floats
from sweep.families.capabilities import ThreadPath
from sweep.families.curve_features import Bends
from sweep.families.machines import thread_balance as balance
from sweep.families.poses import chosen, filled_each

# Inputs have names of their own: a take-up uses symbols such as alpha for its geometry.
BEFORE = Parameter("thread_tension", "none", "tension in front of the eyelet, gf", not_negative=True)
CONTOUR_INPUTS = (
    BEFORE,
    Parameter("eyelet_radius", "none", "radius of the eyelet's contour, mm; measured 0.125 to 7.5", not_negative=True),
    replace(balance.ALPHA, name="thread_adhesion"),
    replace(balance.BETA, name="thread_friction"),
    replace(balance.BENDING, name="thread_bending"),
    replace(balance.COUNT, name="thread_count"),
    replace(balance.DENSITY, name="thread_density"),
)
SPEED_INPUTS = (
    Parameter("speed", "speed", "speed of the crank"),
    CHANGE,
    Parameter("thread_speed_ref", "none", "speed at which the tension is known, mm/s; reported 1230", positive=True,
              default=balance.MM_PER_M * float(balance.REFERENCE_SPEED.default or 0.0)),
    replace(balance.SHARE, name="thread_speed_share"),
    replace(balance.EXPONENT, name="thread_speed_exponent"),
    Parameter("thread_speed_low", "none", "lowest speed of the measurements, mm/s: a slower thread counts as this fast",
              not_negative=True, default=balance.MM_PER_M * balance.MEASURED_SPEED.low),
    Parameter("thread_speed_high", "none", "highest speed of the measurements, mm/s: a faster one counts as this fast",
              positive=True, default=balance.MM_PER_M * balance.MEASURED_SPEED.high),
)  # fmt: skip
MEASURED = ("thread_speed_low", "thread_speed_high")
CAPSTAN_INPUTS = (BEFORE, Parameter("mu_eyelet", "ratio", "coefficient of friction of the eyelet", not_negative=True))

CONTOUR_OUTPUTS = (
    Output("tension", "1", "tension of the thread behind the eyelet, gf"),
    Output("tension_euler", "1", "its part from the tension in front of the eyelet, gf"),
    Output("tension_bending", "1", "its part from bending round the contour, gf"),
    Output("tension_adhesion", "1", "its part from adhesion, gf"),
)
SPEED_OUTPUTS = (
    Output("thread_speed", "length/s", "speed at which thread is taken up"),
    Output("thread_acceleration", "length/s^2", "acceleration at which thread is taken up"),
    Output(
        "speed_ratio",
        "1",
        "tension at that speed, within the measured speeds, over the tension at the reference speed",
        kinks=True,
    ),
)
CAPSTAN_OUTPUTS = (
    Output("capstan_tension", "1", "tension behind the eyelet by Euler's law, gf"),
    Output("eyelet_force", "1", "force of the thread on the eyelet, gf"),
)


def _wrap(scene: Scene) -> tuple[Array, Status]:
    """Wrap angle [rad] and the poses' status."""
    name = scene.family.the(ThreadPath).wrap
    found = scene.family.poses(scene.designs, scene.angles, frozenset({name}))
    return np.ascontiguousarray(found[name], dtype=np.float64), np.array(found["status"], np.uint8)


def _tension(scene: Scene) -> Array:
    """Tension in front of the eyelet at every pose, (n, m)."""
    return np.ascontiguousarray(np.broadcast_to(scene.inputs["thread_tension"][:, None], scene.shape))


def contour(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the tension after the eyelet and its components."""
    wrap, status = _wrap(scene)
    # The constants are per degree.
    arguments = _tension(scene), np.degrees(wrap), scene.table(tuple(p.name for p in CONTOUR_INPUTS[1:]))
    outputs = *(o.name for o in CONTOUR_OUTPUTS), "radius of the thread, which nobody asks for"
    return filled_each(thread_contour, arguments, outputs, wanted, status)


def euler(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the tension by Euler's law and the force on the eyelet."""
    wrap, status = _wrap(scene)
    arguments = _tension(scene), wrap, scene.inputs["mu_eyelet"]
    return filled_each(capstan, arguments, tuple(o.name for o in CAPSTAN_OUTPUTS), wanted, status)


def speed(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute speed and acceleration of the thread, and the ratio of tensions due to the speed."""
    path = scene.family.the(ThreadPath)
    found = scene.family.poses(scene.designs, scene.angles, frozenset({path.rate, path.rate2}))
    first, second = floats(found, path.rate, path.rate2)
    turning, change = scene.crank()
    status = np.array(found["status"], np.uint8)
    of_thread = np.ascontiguousarray(first * turning)
    columns: Columns = {"thread_speed": of_thread}
    columns["thread_acceleration"] = second * turning * turning + first * change
    if "speed_ratio" in wanted:
        ratio = np.empty(scene.shape)
        data = scene.table(("thread_speed_ref", "thread_speed_share", "thread_speed_exponent"))
        low, high = (scene.inputs[name][:, None] for name in MEASURED)
        refuse(status, (high < low)[:, 0])
        thread_speed(np.clip(np.abs(of_thread), low, high), data, status, ratio)
        columns["speed_ratio"] = ratio
    return chosen(columns, wanted, status)


def measured_ends(scene: Scene) -> Array:
    """Functions that change sign where the thread's speed enters or leaves the measured range, (n, m, 4)."""
    (of_thread,) = floats(speed(scene, frozenset({"thread_speed"})), "thread_speed")
    ends = [way * scene.inputs[name][:, None] for name in MEASURED for way in (-1.0, 1.0)]
    return np.stack([of_thread - end for end in ends], axis=2)


CONTOUR = Effect(
    **about("thread_contour"),
    inputs=CONTOUR_INPUTS,
    outputs=CONTOUR_OUTPUTS,
    compute=contour,
    requires=ThreadPath,
)
SPEED = Effect(
    **about("thread_speed"),
    inputs=SPEED_INPUTS,
    outputs=SPEED_OUTPUTS,
    compute=speed,
    bends=(Bends(frozenset({"speed_ratio"}), measured_ends),),
    requires=ThreadPath,
)
CAPSTAN = Effect(
    **about("capstan"),
    inputs=CAPSTAN_INPUTS,
    outputs=CAPSTAN_OUTPUTS,
    compute=euler,
    requires=ThreadPath,
)
