"""Limits in words, and where the result stands against them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sweep.chunks.cascade import compared, meets
from sweep.quantities.names import error_of, is_flag
from sweep.report.quantities import Quantity, number, quantity

if TYPE_CHECKING:
    from sweep.report.dataset import Dataset
    from sweep.study import Limit

Row: TypeAlias = Mapping[str, Any]
ACTIVE = 1e-5  # a limit is called active if the optimum is this near to it, relative to its size


@dataclass(frozen=True)
class LimitState:
    """One limit and where the result stands; ``state`` is "active", "met", "missed" or "unknown".

    ``room`` is the distance to the limit relative to its size, negative where it is missed.
    """

    shown: Quantity
    bound: str
    value: str
    reference: str
    slack: str
    state: str
    room: float = 0.0


def limited(data: Dataset, name: str) -> Quantity:
    """Return an output under a limit; a parameter keeps its own name."""
    shown = quantity(name, data.units.get(name, ""))
    return replace(shown, symbol=name, words=name) if name in data.study.family.parameter_names else shown


def limit_state(
    limit: Limit, row: Row | None, reference: Row | None, shown: Quantity, active_names: frozenset[str]
) -> LimitState:
    """Return whether a design keeps a limit, and with how much room."""
    value, other = value_of(row, limit.output), value_of(reference, limit.output)
    if _is_flag(limit.output):
        words = {1.0: "yes", 0.0: "no"}
        state = "unknown" if math.isnan(value) else "met" if meets(limit, np.array([value]))[0] else "missed"
        return LimitState(shown, bound_words(limit, shown), words.get(value, "–"), words.get(other, "–"), "", state)
    size = compared(limit.output, value)
    rooms = []
    if limit.minimum is not None:
        rooms.append((size - limit.minimum, limit.minimum))
    if limit.maximum is not None:
        rooms.append((limit.maximum - size, limit.maximum))
    room, bound = min(rooms, key=lambda pair: pair[0]) if not math.isnan(size) else (math.nan, math.nan)
    tolerance = ACTIVE * max(abs(bound), 1e-12)
    known = value_of(row, error_of(limit.output))
    if bound == 0.0 and known > tolerance:
        tolerance = known  # no share of 0 says how near is near enough: the error of the value does
    if math.isnan(room):
        state = "unknown"
    elif room < -tolerance:
        state = "missed"
    elif room <= tolerance or limit.output in active_names:
        state = "active"
    else:
        state = "met"
    slack = "" if state in ("unknown", "active") else shown.show(abs(room), 3)
    return LimitState(
        shown,
        bound_words(limit, shown),
        shown.show(value),
        shown.show(other),
        slack,
        state,
        room / max(abs(bound), 1e-12),
    )


def bound_words(limit: Limit, shown: Quantity) -> str:
    """Return ``at most 45°``, ``24.4 to 24.6 mm``."""
    if _is_flag(limit.output):
        return "must turn fully"
    if limit.minimum is not None and limit.maximum is not None:
        if limit.minimum == limit.maximum:
            return f"exactly {shown.show(limit.maximum)}"
        return f"{number(limit.minimum * shown.factor)} to {shown.show(limit.maximum)}"
    if limit.maximum is not None:
        return f"at most {shown.show(limit.maximum)}"
    return f"at least {shown.show(limit.minimum if limit.minimum is not None else math.nan)}"


def limit_states(data: Dataset) -> list[LimitState]:
    """Return every limit of the study at the result of the study."""
    row = data.result
    active = frozenset(data.active)
    return [limit_state(x, row, data.reference, limited(data, x.output), active) for x in data.study.limits]


def value_of(row: Row | None, name: str) -> float:
    """Return a number of a row; nan where there is no row, or no number."""
    value = None if row is None else row.get(name)
    return math.nan if value is None else float(value)


def _is_flag(name: str) -> bool:
    return is_flag(name)
