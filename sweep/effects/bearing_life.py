"""B2: loads, mean load over the turn and life of a shaft's two rolling bearings; entry of the rocker's bearings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from kernels import status as st
from kernels.effects.bearings import bearing_loads
from kernels.types import EPS, TWO_PI, Status
from sweep.effects import loads
from sweep.effects.base import DesignResult, about
from sweep.effects.bearings import CATALOGUE, SUPPORTS
from sweep.effects.load_effects import KINETOSTATICS
from sweep.effects.load_passing import reactions
from sweep.effects.scene import Scene, refuse
from sweep.families.base import Accuracy, Array, Columns, Output, floats
from sweep.families.capabilities import Assembly
from sweep.families.curve_features import Bends
from sweep.families.poses import chosen, filled_all
from sweep.numerics.curves import TableCurve
from sweep.numerics.events import sign_changes, with_events
from sweep.numerics.quadrature import integrate
from sweep.numerics.records import Indices
from sweep.numerics.singularities import crowded, singularities, turn_edges

PANEL = 1.0  # length of the first panels of a turn relative to the distance of the nearest singularity
LOOK = 1.0 / 16.0  # spacing of the poses that bracket kinks and jumps, relative to that distance
SIZING = 64  # poses that determine the size of the loads, so that no power of a load overflows
BLOCK = 256  # designs at once: bisections need one pose of each kink


def load_names(shaft: str) -> tuple[str, ...]:
    """Names of the loads of a shaft's two bearings, in the order of :func:`bearing_loads`."""
    radial, equivalent = f"radial_load_{shaft}", f"equivalent_load_{shaft}"
    return f"{radial}1", f"{radial}2", f"axial_load_{shaft}", f"{equivalent}1", f"{equivalent}2"


def load_outputs(shaft: str, text: str) -> tuple[Output, ...]:
    """List the loads of a shaft's two bearings; ``text`` names the shaft.

    An equivalent load jumps where the axial load exceeds e_limit.
    """
    words = (
        "radial load of support 1", "radial load of support 2", "axial load", "equivalent load of rolling bearing 1",
        "equivalent load of rolling bearing 2",
    )  # fmt: skip
    return tuple(
        Output(name, "force", f"{one}, from the joint reactions: {text}", kinks="equivalent" in one)
        for name, one in zip(load_names(shaft), words, strict=True)
    )


def turn_outputs(shaft: str, text: str) -> tuple[Output, ...]:
    """Mean loads and lives of a shaft's two bearings."""
    return tuple(
        o
        for k in "12"
        for o in (
            Output(f"mean_load_{shaft}{k}", "force", f"load of equal effect over the turn, by travel: {text}, bearing "
                   f"{k}"),
            Output(f"life_{shaft}{k}", "time", f"running time that 90 % of bearings {k} of {text} reach; travel "
                   "counted as turns"),
        )
    )  # fmt: skip


@dataclass(frozen=True)
class BearingShaft:
    """A shaft on two rolling bearings.

    Parameters
    ----------
    name : name of the shaft in the names of outputs and supports
    tail : suffix of the names of its catalogue inputs
    columns : of its force and its moment among the reactions of :func:`sweep.effects.load_passing.reactions`
    axis : returns the axis of rotation, (n, m or 1, 3), of a scene
    turning : returns the angular velocity in the bearings per unit crank speed, (n, m), of a scene
    """

    name: str
    tail: str
    columns: tuple[int, int]
    axis: Callable[[Scene], Array]
    turning: Callable[[Scene], Array]

    def given(self, scene: Scene, name: str) -> Array:
        """Input of the shaft's catalogue, (n,)."""
        return scene.inputs[f"{name}{self.tail}"]

    def data(self, scene: Scene) -> Array:
        """Columns of :mod:`kernels.effects.bearings`; the radius, which is not used here, is 0."""
        supports = (f"support_{self.name}{k}" for k in "12")
        names = (*supports, *(f"{p.name}{self.tail}" for p in CATALOGUE))
        return np.column_stack([np.zeros(len(scene.designs)), scene.table(names)])

    def loads(self, scene: Scene, wanted: frozenset[str]) -> Columns:
        """Compute the wanted loads of :func:`load_outputs`, and the status."""
        forces, status = reactions(scene)
        status, names = status.copy(), load_names(self.name)
        refuse(status, loads.together(scene, self.name))
        arguments = (forces, *self.columns, np.ascontiguousarray(self.axis(scene)), self.data(scene))
        return filled_all(bearing_loads, arguments, names, wanted & frozenset(names), status)

    def values(self, scene: Scene, which: slice) -> list[Array]:
        """Compute some of these loads, (n, m) each."""
        names = load_names(self.name)[which]
        return floats(self.loads(scene, frozenset(names)), *names)


def bends(shaft: BearingShaft, *more: str) -> tuple[Bends, ...]:
    """Kinks of the equivalent loads of a shaft's bearings, and of outputs computed from them.

    They occur where the equivalent load changes its formula, and where a support is nearly unloaded.
    """
    names = frozenset((*load_names(shaft.name)[3:], *more))
    return Bends(names, partial(formula, shaft=shaft)), Bends(names, partial(squares, shaft=shaft), squares=True)


def per_turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy, shaft: BearingShaft) -> Columns:
    """Compute mean loads and lives, on samples without errors, or with integrals refined to the accuracy.

    The travel has a kink where the shaft turns back, and a load jumps where the axial load exceeds e_limit: the
    integrals are split at these places, and refined on panels elsewhere.  An unloaded bearing, or a shaft that does not
    turn, has no life: INVALID_INPUT.
    """
    n = len(scene.designs)
    look = scene.on_grid(accuracy.samples or SIZING)
    load, way, worst = _loads(look, shaft)
    size = np.maximum(load.max(axis=1, initial=0.0), np.finfo(float).tiny)
    # Poses that do not assemble, or lie at a dead point, belong to a crank that does not turn.
    status = _of_turn(worst)
    good = np.flatnonzero(status == st.OK)
    exponent = shaft.given(scene, "life_exponent")
    total, err = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    if accuracy.target is None:
        values = _integrands(load[good], way[good], size[good], exponent[good])
        total[good] = values.mean(axis=1) * TWO_PI
    else:
        total[good], err[good], status[good] = _refined(scene, good, size[good], accuracy.target, shaft)
    travel, err_travel = total[:, 2], err[:, 2]
    columns: Columns = {}
    for k, bearing in enumerate("12"):
        mean_name, life_name = f"mean_load_{shaft.name}{bearing}", f"life_{shaft.name}{bearing}"
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = size[:, k] * (total[:, k] / travel) ** (1.0 / exponent)
            share = err[:, k] / total[:, k] + err_travel / travel + 8.0 * EPS
            life = 1e6 * (shaft.given(scene, "dynamic_capacity") / mean) ** exponent
            life *= TWO_PI**2 / (travel * np.abs(scene.inputs["speed"]))
        err_mean = np.where(mean > 0.0, mean * np.expm1(np.log1p(share) / exponent), 0.0)
        columns |= {mean_name: mean, f"err_{mean_name}": err_mean}
        columns |= {life_name: life, f"err_{life_name}": life * (share + err_travel / travel)}
        for name, values in ((mean_name, mean), (life_name, life)):
            if name in wanted:
                status[(status == st.OK) & ~np.isfinite(values)] = st.INVALID_INPUT
        life[~np.isfinite(life)] = np.nan
    return chosen(columns, wanted, status)


def _of_turn(worst: Status) -> Status:
    return np.where(worst == st.OK, st.OK, np.maximum(worst, st.NOT_ROTATABLE)).astype(np.uint8)


def _loads(scene: Scene, shaft: BearingShaft) -> tuple[Array, Array, Status]:
    """Equivalent loads of both bearings (n, m, 2), rate of travel (n, m), worst status of each design."""
    names = load_names(shaft.name)[3:]
    found = shaft.loads(scene, frozenset(names))
    load = np.stack(floats(found, *names), axis=2)
    return load, np.abs(shaft.turning(scene)), np.asarray(found["status"].max(axis=1), np.uint8)


def _integrands(load: Array, way: Array, size: Array, exponent: Array) -> Array:
    """(P/size)^p |w| of both bearings and |w|, (k, m, 3)."""
    power = (load / size[:, None, :]) ** exponent[:, None, None]
    return np.concatenate([power * way[:, :, None], way[:, :, None]], axis=2)


def _switches(scene: Scene, shaft: BearingShaft) -> Array:
    """Functions that change sign where the integrands have kinks or jumps, (k, m, 3).

    They are the shaft's turning, the axial load, and its excess over the part e V of the radial load of its bearing.
    """
    first, second, axial = shaft.values(scene, slice(3))
    radial = np.where(shaft.given(scene, "axial_support")[:, None] == 1.0, first, second)
    limit = (shaft.given(scene, "e_limit") * shaft.given(scene, "rotation_factor"))[:, None] * radial
    return np.stack([shaft.turning(scene), axial, np.abs(axial) - limit], axis=2)


def _pierced(scene: Scene) -> list[Array]:
    """Functions that change sign where a tool begins or ceases to pierce and its load jumps, (k, m, 2) each."""
    found = []
    for which, inputs in enumerate((scene.inputs, *(driven.inputs for driven in scene.after))):
        if "pierce_force" not in inputs:
            continue
        stage = scene.stage(which)
        position, rate = stage.family.position, stage.family.derivative_of[stage.family.position]
        place, speed = stage.family.values(stage.designs, stage.angles, position, rate)
        driving = 1.0 if stage.rates is None else stage.rates[0]
        both = np.stack([place - inputs["pierce_at"][:, None], speed * driving], axis=2)
        found.append(np.where(inputs["pierce_force"][:, None, None] != 0.0, both, 1.0))
    return found


def formula(scene: Scene, shaft: BearingShaft) -> Array:
    """Functions that change sign where an equivalent load has a kink or jumps, (n, m, 2)."""
    return _switches(scene, shaft)[:, :, 1:]


def squares(scene: Scene, shaft: BearingShaft) -> Array:
    """Squares of the supports' radial loads, (n, m, 2)."""
    return np.stack([np.square(load) for load in shaft.values(scene, slice(2))], axis=2)


def _discriminant(scene: Scene, rows: Indices, stage: int, name: str, which: Indices, phi: Array) -> Array:
    posed = scene.posed(rows[which], phi).stage(stage)
    return posed.family.values(posed.designs, posed.angles, name)[0]


def _refined(
    scene: Scene, rows: Indices, size: Array, target: float, shaft: BearingShaft
) -> tuple[Array, Array, Status]:
    """Integrate the three integrands over the turn of some designs; return integrals, errors and status."""
    status, scene = np.zeros(rows.size, np.uint8), scene.precise()  # plain poses may be noise near a change point
    exponent = shaft.given(scene, "life_exponent")[rows]

    def integrands(which: Indices, origins: Indices, phi: Array) -> Array:
        load, way, worst = _loads(scene.posed(rows[which], phi), shaft)
        bad = worst != st.OK
        status[which[bad]] = worst[bad]
        return np.where(bad[:, None, None], np.nan, _integrands(load, way, size[which], exponent[which]))

    def switches(which: Indices, phi: Array) -> Array:
        posed = scene.posed(rows[which], phi)
        return np.concatenate([_switches(posed, shaft), *_pierced(posed)], axis=2)

    families = [scene.family, *(driven.family for driven in scene.after)]
    curves = [
        partial(_discriminant, scene, rows, stage, loop.discriminant)
        for stage, one in enumerate(families)
        for loop in one.every(Assembly)
    ]
    near = singularities(curves, rows.size)
    places = sign_changes(switches, crowded(near, LOOK))
    edges = with_events(turn_edges(near, PANEL), *places)
    points = np.array([phi for curve in scene.every_curve if isinstance(curve, TableCurve) for phi in curve.phi])
    edges = with_events(edges, np.repeat(np.arange(rows.size), points.size), np.tile(points % TWO_PI, rows.size))
    # The mean load is a root of order p, so it is as accurate as the integrals at least where p >= 2.
    found = integrate(integrands, edges, 0.25 * target)
    turns = _of_turn(status)
    turns[(turns == st.OK) & ~found.settled] = st.NOT_CONVERGED
    return found.value, found.err, turns


# Columns of the joint reactions: force and moment of the frame on the rocker.
ROCKER = BearingShaft(
    "d", "", (9, 15), lambda scene: scene.records[1][:, None, 3:6], lambda scene: scene.records[0][:, :, 22]
)
_TEXT = "the rocker's bearings"

EFFECT = replace(
    KINETOSTATICS,
    **about("bearing_life"),
    needs=("kinetostatics",),
    inputs=(*loads.ROCKER.parameters, *SUPPORTS, *CATALOGUE),
    outputs=load_outputs("d", _TEXT),
    compute=ROCKER.loads,
    even_crank=True,
    advise=None,
    bends=bends(ROCKER),
    design_result=DesignResult(turn_outputs("d", _TEXT), partial(per_turn, shaft=ROCKER), BLOCK),
)
