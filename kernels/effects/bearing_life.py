"""B2: loads of the rocker's two rolling bearings from the joint reactions, and the life they allow over the cycle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel
from kernels.effects.bearings import equivalent_load
from kernels.effects.friction import supports

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def bearing_loads(
    forces: Array,
    axis: Array,
    bearings: Array,
    status: Status,
    radial1: Array | None,
    radial2: Array | None,
    axial: Array | None,
    equivalent1: Array | None,
    equivalent2: Array | None,
) -> None:
    """Compute loads of two bearings that carry a force and a moment of the frame on the rocker.

    Parameters
    ----------
    forces : (n, m, 18) as of :func:`kernels.effects.kinetostatics`;  axis : (n, 3) axis of the rocker
    bearings : (n, 11) columns of :class:`kernels.effects.bearings.Rolling`; c is not read
    status : (n, m), in; nan where it is not OK
    radial1, radial2, axial, equivalent1, equivalent2 : (n, m) or None
    """
    for i in range(forces.shape[0]):
        k = (axis[i, 0], axis[i, 1], axis[i, 2])
        for j in range(forces.shape[1]):
            f = (forces[i, j, 9], forces[i, j, 10], forces[i, j, 11])
            m = (forces[i, j, 15], forces[i, j, 16], forces[i, j, 17])
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
