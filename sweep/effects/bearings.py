"""B1: sliding and rolling bearings of the rocker under a resisting torque, massless estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from kernels.effects import bearings, permissible
from sweep.effects.base import ComputeFunction, Effect, about, largest
from sweep.effects.loads import SPEED, together
from sweep.effects.pressure import components
from sweep.effects.scene import Scene, refuse
from sweep.families.base import Array, Columns, Output, Parameter
from sweep.families.curve_features import Bends
from sweep.families.poses import filled_all, filled_each

SUPPORTS = (
    Parameter("support_d1", "length", "first support along the rocker axis, from D, the plane of C"),
    Parameter("support_d2", "length", "second support along the rocker axis, from D"),
)
_COMMON = (
    Parameter("resisting_torque", "torque", "torque the rocker overcomes", positive=True),
    *SUPPORTS,
)
SLIDING_INPUTS = (
    *_COMMON,
    Parameter("journal_diameter", "length", "diameter of both journals", positive=True),
    *(Parameter(f"journal_length{k}", "length", f"length of journal {k}", positive=True) for k in (1, 2)),
    Parameter("collar_diameter", "length", "outer diameter of the thrust collar", positive=True),
    Parameter("journal_factor", "ratio", "1 point contact, 4/pi run-in, pi/2 new", default=1.0, positive=True),
    Parameter("thrust_radius_d", "length", "mean thrust radius of the collar", default=0.0, not_negative=True),
    Parameter("mu_d", "ratio", "coefficient of friction of the rocker bearing", not_negative=True),
)
SLIDING_OUTPUTS = (
    *(Output(f"journal_load{k}", "force", f"radial load of journal {k}") for k in (1, 2)),
    Output("thrust_load", "force", "axial load of the collar"),
    *(Output(f"journal_pressure{k}", "pressure", f"mean pressure of journal {k}") for k in (1, 2)),
    Output("collar_pressure", "pressure", "mean pressure of the collar"),
)
CATALOGUE = (
    Parameter("rotation_factor", "ratio", "V of the bearing catalogue", default=1.0, positive=True),
    Parameter("radial_factor", "ratio", "X of the bearing catalogue", not_negative=True),
    Parameter("axial_factor", "ratio", "Y of the bearing catalogue", not_negative=True),
    Parameter("e_limit", "ratio", "e of the bearing catalogue", not_negative=True),
    Parameter("life_exponent", "ratio", "3 for balls, 10/3 for rollers", default=3.0, positive=True),
    Parameter("dynamic_capacity", "force", "C_dyn of the bearing catalogue", positive=True),
    Parameter("shock_factor", "ratio", "K_b", default=1.0, positive=True),
    Parameter("axial_support", "choice", "support that takes the axial load", default=1.0, choices=(1.0, 2.0)),
)
ROLLING_INPUTS = (*_COMMON, *CATALOGUE)
ROLLING_OUTPUTS = (
    *(Output(f"equivalent_load{k}", "force", f"equivalent load of rolling bearing {k}") for k in (1, 2)),
    *(Output(f"life{k}", "1", f"L10 of bearing {k} at this load, in 10^6 turns") for k in (1, 2)),
)


PERMISSIBLE = (
    Parameter("permissible_pressure1", "pressure", "permissible mean pressure of journal 1", positive=True),
    Parameter("permissible_pressure2", "pressure", "permissible mean pressure of journal 2", positive=True),
    Parameter("permissible_pressure3", "pressure", "permissible mean pressure of the collar", positive=True),
)
REQUIRED_LIFE = Parameter("required_life", "time", "running time that 90 % of the bearings must reach", positive=True)
LIFE = (REQUIRED_LIFE, SPEED)
SLIDING_LIMITS = (
    Output("sliding_utilisation", "1", "largest bearing pressure over its permissible value"),
    Output("permissible_theta1", "rad", "largest radial pressure angle the sliding bearings permit"),
    Output("theta1_reserve", "rad", "permissible minus actual radial pressure angle, sliding bearings"),
)
ROLLING_LIMITS = (
    Output("rolling_utilisation", "1", "larger equivalent load over the permissible one"),
    Output("permissible_theta1_rolling", "rad", "largest radial pressure angle the rolling bearings permit"),
    Output("theta1_reserve_rolling", "rad", "permissible minus actual radial pressure angle, rolling bearings"),
)


def _data(scene: Scene, inputs: tuple[Parameter, ...]) -> Array:
    """Columns of the bearing kernels: radius c at which the coupler force acts, then all inputs except the torque."""
    return np.column_stack([scene.records[1][:, 14], scene.table(tuple(p.name for p in inputs[1:]))])


def _compute(
    kernel: Callable[..., None], inputs: tuple[Parameter, ...], results: tuple[Output, ...],
    permissible: Callable[[Scene], Array] | None, scene: Scene, wanted: frozenset[str],
) -> Columns:  # fmt: skip
    direction, status = components(scene)
    refuse(status, together(scene, "d"))
    if "collar_diameter" in (p.name for p in inputs):
        refuse(status, scene.inputs["collar_diameter"] <= scene.inputs["journal_diameter"])
    arguments = [*direction, scene.inputs["resisting_torque"], _data(scene, inputs)]
    if permissible is not None:
        arguments.append(permissible(scene))
    filling = filled_all if permissible is None else filled_each
    return filling(kernel, arguments, tuple(o.name for o in results), wanted, status)


def _thrust(scene: Scene) -> Array:
    """Component of the coupler direction along the shaft, whose magnitude loads the collar."""
    return components(scene)[0][2][:, :, None]


def _formula(scene: Scene) -> Array:
    """Axial component of the coupler direction, and the excess of the axial load over e V times the radial one."""
    (t_tau, t_rho, t_k), _ = components(scene)
    c, z1, z2 = (x[:, None] for x in (scene.records[1][:, 14], *_supports(scene)))
    z = np.where(scene.inputs["axial_support"][:, None] == 1.0, z2, z1)
    share = (scene.inputs["e_limit"] * scene.inputs["rotation_factor"])[:, None] / np.abs(z2 - z1)
    return np.stack([t_k, np.abs(t_k) - share * np.hypot(z * t_tau, z * t_rho + c * t_k)], axis=2)


def _eased(scene: Scene) -> Array:
    """Functions at whose zeros the permissible values of the bearings have narrow peaks and kinks.

    There no force acts along the shaft, or none radially, or theta1 does not load one of the supports.
    """
    (_, t_rho, t_k), _ = components(scene)
    c, z1, z2 = (x[:, None] for x in (scene.records[1][:, 14], *_supports(scene)))
    return np.stack([t_k, t_rho, c * t_k + z1 * t_rho, c * t_k + z2 * t_rho], axis=2)


def _supports(scene: Scene) -> tuple[Array, Array]:
    return scene.inputs["support_d1"], scene.inputs["support_d2"]


def permissible_load(scene: Scene, tail: str = "") -> Array:
    """C_dyn (60 n L_h/10^6)^(-1/p) at the turns of the crank, (n, 1); ``tail`` is the suffix of the inputs' names."""
    capacity, life, exponent = (
        scene.inputs[f"{n}{tail}"] for n in ("dynamic_capacity", "required_life", "life_exponent")
    )
    turns = np.abs(scene.inputs["speed"]) / (2.0 * np.pi) * life
    load: Array = capacity * (turns * 1e-6) ** (-1.0 / exponent)
    return load[:, None]


def _effect(
    name: str, inputs: tuple[Parameter, ...], results: tuple[Output, ...], compute: ComputeFunction,
    bends: tuple[Bends, ...], kind: str = "",
) -> Effect:  # fmt: skip
    return Effect(
        **about(name),
        followers=("rocker",),
        needs=("pressure",),
        inputs=inputs,
        outputs=tuple(replace(o, kinks=True) for o in results),  # magnitudes, and the larger of several
        compute=compute,
        even_crank=SPEED in inputs,
        least=tuple(o.name for o in results if o.name.startswith(("life", "permissible", "theta1_reserve"))),
        bends=bends,
        advise=largest(compute, f"{kind}_utilisation", f"utilisation of the {kind} bearings", 0.5) if kind else None,
    )


_PRESSURES: Callable[[Scene], Array] = lambda scene: scene.table(tuple(p.name for p in PERMISSIBLE))  # noqa: E731
_SLIDING = partial(_compute, bearings.sliding_bearings, SLIDING_INPUTS, SLIDING_OUTPUTS, None)
_ROLLING = partial(_compute, bearings.rolling_bearings, ROLLING_INPUTS, ROLLING_OUTPUTS, None)
_SLIDING_LIMITS = partial(_compute, permissible.bearing_limits, SLIDING_INPUTS, SLIDING_LIMITS, _PRESSURES)
_ROLLING_LIMITS = partial(_compute, permissible.bearing_limits, ROLLING_INPUTS, ROLLING_LIMITS, permissible_load)


def _bent(results: tuple[Output, ...], curves: Callable[[Scene], Array]) -> Bends:
    return Bends(frozenset(o.name for o in results), curves)


SLIDING = _effect(
    "sliding_bearings", SLIDING_INPUTS, SLIDING_OUTPUTS, _SLIDING, (_bent(SLIDING_OUTPUTS, _thrust),),
)  # fmt: skip
ROLLING = _effect(
    "rolling_bearings", ROLLING_INPUTS, ROLLING_OUTPUTS, _ROLLING, (_bent(ROLLING_OUTPUTS, _formula),),
)  # fmt: skip
SLIDING_LIMIT = _effect(
    "sliding_limits", (*SLIDING_INPUTS, *PERMISSIBLE), SLIDING_LIMITS, _SLIDING_LIMITS,
    (_bent(SLIDING_LIMITS[:1], _thrust), _bent(SLIDING_LIMITS[1:], _eased)), "sliding",
)  # fmt: skip
ROLLING_LIMIT = _effect(
    "rolling_limits", (*ROLLING_INPUTS, *LIFE), ROLLING_LIMITS, _ROLLING_LIMITS,
    (_bent(ROLLING_LIMITS[:1], _formula), _bent(ROLLING_LIMITS[1:], _eased)), "rolling",
)  # fmt: skip
