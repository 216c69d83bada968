"""How an effect says where curves of its outputs have kinks, jumps or narrow peaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sweep.families.base import Array

if TYPE_CHECKING:
    from sweep.effects.base import Scene


@dataclass(frozen=True)
class Bend:
    """Functions of the crank angle at whose zeros some pose outputs of an effect have kinks, jumps or narrow peaks.

    ``curves(scene)`` gives their values, (n, m, q); ``outputs`` are the effect's own names.  Of ``squares``, which are
    never negative, the places count where they nearly vanish.
    """

    outputs: tuple[str, ...]
    curves: Callable[[Scene], Array]
    squares: bool = False
