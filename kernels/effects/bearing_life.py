"""B1, B2: loads and mean pressures of the two bearings of a shaft from its joint reactions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel
from kernels.effects.bearings import equivalent_load, mean_pressures
from kernels.effects.friction import supports
from kernels.links import vector

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def bearing_loads(
    forces: Array,
    force: int,
    moment: int,
    axis: Array,
    bearings: Array,
    status: Status,
    radial1: Array | None,
    radial2: Array | None,
    axial: Array | None,
    equivalent1: Array | None,
    equivalent2: Array | None,
) -> None:
    """Compute loads of two bearings that carry the force and the moment on a shaft.

    Parameters
    ----------
    forces : (n, m, F) joint reactions;  force, moment : columns of the force on the shaft and of its moment
    axis : (n, m or 1, 3) axis of the shaft
    bearings : (n, 11) columns of :class:`kernels.effects.bearings.Rolling`; c is not read
    status : (n, m), in; nan where it is not OK
    radial1, radial2, axial, equivalent1, equivalent2 : (n, m) or None
    """
    for i in range(forces.shape[0]):
        for j in range(forces.shape[1]):
            k = vector(axis[i, j if axis.shape[1] > 1 else 0])
            f, m = vector(forces[i, j, force:]), vector(forces[i, j, moment:])
            first, second, along = supports(f, m, k, bearings[i, 1], bearings[i, 2])
            good = 1.0 if status[i, j] == st.OK else math.nan
            thrust = abs(along)
            if radial1 is not None:
                radial1[i, j] = good * first
            if radial2 is not None:
                radial2[i, j] = good * second
            if axial is not None:
                axial[i, j] = good * along
            if equivalent1 is not None:
                on_first = thrust if bearings[i, 10] == 1.0 else 0.0
                equivalent1[i, j] = good * equivalent_load(bearings, i, first, on_first)
            if equivalent2 is not None:
                on_second = thrust if bearings[i, 10] == 2.0 else 0.0
                equivalent2[i, j] = good * equivalent_load(bearings, i, second, on_second)


@kernel
def journal_pressures(
    first: Array,
    second: Array,
    axial: Array,
    journals: Array,
    limits: Array | None,
    status: Status,
    pressure1: Array | None,
    pressure2: Array | None,
    pressure3: Array | None,
    used: Array | None,
) -> None:
    """Compute mean pressures of two journals and a collar, and the largest one over its permissible value.

    Parameters
    ----------
    first, second, axial : (n, m) loads of the journals and of the collar
    journals : (n, 4) diameter, lengths of journal 1 and 2, diameter of the collar; 0 for a shaft without one
    limits : (n, 3) or None; permissible pressures of journal 1, journal 2, collar; read for ``used``
    status : (n, m), in; nan where it is not OK
    pressure1, pressure2, pressure3, used : (n, m) or None
    """
    for i in range(first.shape[0]):
        for j in range(first.shape[1]):
            good = 1.0 if status[i, j] == st.OK else math.nan
            collar = journals[i, 3] > 0.0
            outer = journals[i, 3] if collar else 2.0 * journals[i, 0]
            p1, p2, p3 = mean_pressures(
                first[i, j], second[i, j], axial[i, j] if collar else 0.0, journals[i, 0], journals[i, 1],
                journals[i, 2], outer,
            )  # fmt: skip
            if pressure1 is not None:
                pressure1[i, j] = good * p1
            if pressure2 is not None:
                pressure2[i, j] = good * p2
            if pressure3 is not None:
                pressure3[i, j] = good * p3
            if used is not None and limits is not None:
                share = max(p1 / limits[i, 0], p2 / limits[i, 1])
                used[i, j] = good * (max(share, p3 / limits[i, 2]) if collar else share)
