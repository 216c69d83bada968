"""What is asked of a search for extrema, and what it answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernels import status as st
from sweep.families.base import Array
from sweep.quantities.reduction import Mode


class Request(NamedTuple):
    """An extremum that is wanted: of which pose output, and which (0 largest magnitude, +1 largest, -1 least).

    Each is searched for as if it were the only one, so that no bit of it depends on what is wanted beside it.
    """

    pose: str
    mode: Mode
    windowed: bool = False  # only poses whose position lies in the search's window count
    place: bool = False  # its crank angle is wanted, to the target [rad]


class Extremum(NamedTuple):
    """Extremum of every design, each (n,): the measured value, its crank angle in [0, 2 pi), and their errors."""

    value: Array
    phi: Array
    err: Array
    err_phi: Array

    @classmethod
    def unknown(cls, count: int) -> Extremum:
        """Return a record that is all nan."""
        return cls(*(np.full(count, np.nan) for _ in range(4)))


# What a pose's status means for its design; the others keep their meaning.
DESIGN_STATUS = np.arange(256, dtype=np.uint8)
DESIGN_STATUS[st.NOT_ASSEMBLED] = st.NOT_ROTATABLE
DESIGN_STATUS[st.DEAD_POINT] = st.UNDECIDABLE
