"""B1, B2: sliding and rolling bearings of the rocker under the coupler force of a resisting torque."""

from __future__ import annotations

import numpy as np

from kernels.effects import bearings
from sweep.effects.base import Effect, Scene
from sweep.effects.pressure import bearing_directions
from sweep.families.base import Columns, Output, Parameter, optional_outputs

EQUATION = "dynamics sheet 4, (15)-(17)"

_COMMON = (
    Parameter("resisting_torque", "torque", "torque the rocker overcomes", positive=True),
    Parameter("support_d1", "length", "first support along the rocker axis, rocker plane at zero"),
    Parameter("support_d2", "length", "second support along the rocker axis"),
)
SLIDING_INPUTS = (
    *_COMMON,
    Parameter("journal_diameter", "length", "diameter of both journals", positive=True),
    Parameter("journal_length1", "length", "length of journal 1", positive=True),
    Parameter("journal_length2", "length", "length of journal 2", positive=True),
    Parameter("collar_diameter", "length", "outer diameter of the thrust collar", positive=True),
    Parameter("journal_factor", "ratio", "1 point contact, 4/pi run-in, pi/2 new", default=1.0),
    Parameter("thrust_radius_d", "length", "mean thrust radius of the collar", default=0.0),
    Parameter("mu_d", "ratio", "coefficient of friction of the rocker bearing"),
)
SLIDING_OUTPUTS = (
    Output("journal_load1", "force", "radial load of journal 1", EQUATION),
    Output("journal_load2", "force", "radial load of journal 2", EQUATION),
    Output("thrust_load", "force", "axial load of the collar", EQUATION),
    Output("journal_pressure1", "pressure", "mean pressure of journal 1", EQUATION),
    Output("journal_pressure2", "pressure", "mean pressure of journal 2", EQUATION),
    Output("collar_pressure", "pressure", "mean pressure of the collar", EQUATION),
)
ROLLING_INPUTS = (
    *_COMMON,
    Parameter("rotation_factor", "ratio", "V of the bearing catalogue", default=1.0),
    Parameter("radial_factor", "ratio", "X of the bearing catalogue"),
    Parameter("axial_factor", "ratio", "Y of the bearing catalogue"),
    Parameter("e_limit", "ratio", "e of the bearing catalogue"),
    Parameter("life_exponent", "ratio", "3 for balls, 10/3 for rollers", default=3.0),
    Parameter("dynamic_capacity", "force", "C_dyn of the bearing catalogue", positive=True),
    Parameter("shock_factor", "ratio", "K_b", default=1.0),
    Parameter("axial_support", "choice", "support that takes the axial load", default=1.0, choices=(1.0, 2.0)),
)
ROLLING_OUTPUTS = (
    Output("equivalent_load1", "force", "equivalent load of rolling bearing 1", EQUATION),
    Output("equivalent_load2", "force", "equivalent load of rolling bearing 2", EQUATION),
    Output("life1", "1", "L10 of bearing 1 at this load, in 10^6 turns", EQUATION),
    Output("life2", "1", "L10 of bearing 2 at this load, in 10^6 turns", EQUATION),
)


def _data(scene: Scene, inputs: tuple[Parameter, ...]) -> np.ndarray:
    radius = scene.records[1][:, 14]  # c, the radius at which the coupler force acts
    return np.column_stack([radius, scene.table(tuple(p.name for p in inputs[1:]))])


def sliding(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted loads and pressures of the journals and the collar."""
    cos1, sin1, axial, status = bearing_directions(scene)
    names = tuple(o.name for o in SLIDING_OUTPUTS)
    outputs = optional_outputs(names, wanted, scene.shape)
    torque = np.ascontiguousarray(scene.inputs["resisting_torque"])
    bearings.sliding_bearings(cos1, sin1, axial, torque, _data(scene, SLIDING_INPUTS), status, *outputs)
    found: Columns = {name: out for name, out in zip(names, outputs, strict=True) if out is not None}
    return found | {"status": status}


def rolling(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted equivalent loads and lives."""
    cos1, sin1, axial, status = bearing_directions(scene)
    names = tuple(o.name for o in ROLLING_OUTPUTS)
    outputs = optional_outputs(names, wanted, scene.shape)
    torque = np.ascontiguousarray(scene.inputs["resisting_torque"])
    bearings.rolling_bearings(cos1, sin1, axial, torque, _data(scene, ROLLING_INPUTS), status, *outputs)
    found: Columns = {name: out for name, out in zip(names, outputs, strict=True) if out is not None}
    return found | {"status": status}


SLIDING = Effect(
    key="B1",
    name="sliding_bearings",
    title="sliding bearings of the rocker: loads and mean pressures, massless estimate",
    equation=EQUATION,
    families=("rssr",),
    needs=("pressure",),
    inputs=SLIDING_INPUTS,
    outputs=SLIDING_OUTPUTS,
    compute=sliding,
    ns_per_pose=60.0,
    called_for="bearing choice while the linkage is being synthesised",
    negligible="other members govern",
)
ROLLING = Effect(
    key="B1",
    name="rolling_bearings",
    title="rolling bearings of the rocker: equivalent loads and lives, massless estimate",
    equation=EQUATION,
    families=("rssr",),
    needs=("pressure",),
    inputs=ROLLING_INPUTS,
    outputs=ROLLING_OUTPUTS,
    compute=rolling,
    ns_per_pose=60.0,
    called_for="bearing choice while the linkage is being synthesised",
    negligible="other members govern",
)
