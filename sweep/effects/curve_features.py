"""What effects bring to the curves of a family between even samples: see :mod:`sweep.families.curve_features`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sweep.effects.base import Placed
from sweep.effects.evaluation import bend_curves
from sweep.effects.scene import stages_of
from sweep.families.base import Array, Family, Output, Parameter
from sweep.families.curve_features import Bends, Crossing, of_order, of_table
from sweep.numerics.curves import Curve, TableCurve


def bent(effects: tuple[Placed, ...], curves: Mapping[str, Curve]) -> list[Output]:
    """Pose outputs of effects: between the points of a table of loads they may have a narrow peak."""
    tables = any(isinstance(curve, TableCurve) for curve in curves.values())
    found = [o for placed in effects for o in placed.pose_outputs]
    return [replace(o, kinks=not (o.wraps or o.jumps)) for o in found] if tables else found


def paces(curves: Mapping[str, Curve]) -> list[object]:
    """Where the tables among loads bend, and how many waves the series have."""
    of = curves.values()
    return [of_table(c.phi) if isinstance(c, TableCurve) else of_order(max(len(c.cos), len(c.sin))) for c in of]


def piercing(family: Family, added: tuple[Parameter, ...]) -> list[Crossing]:
    """Where a tool pierces: at a place of the follower of its stage."""
    columns = {p.name: len(family.parameters) + k for k, p in enumerate(added)}
    found = []
    for stage, number in stages_of(family):
        force, at = columns.get(f"pierce_force{number}"), columns.get(f"pierce_at{number}")
        if force is not None and at is not None:
            position = f"{stage.position}{number}"
            found.append(Crossing(position, partial(_column, at), partial(_is_given, force)))
    return found


def bends(
    family: Family, effects: tuple[Placed, ...], added: tuple[Parameter, ...], curves: Mapping[str, Curve]
) -> list[Bends]:
    """Where outputs of effects bend, from the most accurate poses: a cut beside a narrow peak is none."""
    found = []
    for placed in effects:
        for bend in placed.entry.bends:
            of = frozenset(name for name, own in placed.own.items() if own in bend.outputs)
            parts = family.precise(), placed, bend, added, curves, len(family.parameters)
            found += [Bends(of, partial(bend_curves, *parts), bend.squares)] if of else []
    return found


def _column(column: int, designs: Array) -> Array:
    values: Array = designs[:, column]
    return values


def _is_given(column: int, designs: Array) -> NDArray[np.bool_]:
    given: NDArray[np.bool_] = designs[:, column] != 0.0
    return given
