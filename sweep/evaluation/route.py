"""What a route is: some design outputs that are computed together, by whatever computes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sweep.families.base import Accuracy, Array, Columns, Work
from sweep.reductions.turn import Group

Part: TypeAlias = tuple[float, float] | None
"""A window of the stroke as two fractions, or none."""
RunFunction: TypeAlias = Callable[[Array, Accuracy, Part], Columns]


@dataclass(frozen=True)
class Route:
    """Some design outputs that are computed together.

    Parameters
    ----------
    name : what computes them
    outputs : their names
    ns_per_design : estimate of the time that it takes
    run : ``run(designs, accuracy, window)`` gives the outputs, perhaps their ``err_``, and ``status``, each (n,)
    general : which general reduction it is; "" for a family's own step or an effect
    order : kind of work, and its place among routes of that kind
    columns : how many of the first columns of the design matrix ``run`` looks at; None for all
    """

    name: str
    outputs: tuple[str, ...]
    ns_per_design: float
    run: RunFunction | None = None
    general: Group | Literal[""] = ""
    order: tuple[Work, int] = (Work.SEARCH, 0)
    columns: int | None = None
