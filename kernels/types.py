"""Array types and constants that kernels, sweep and studies share."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Status: TypeAlias = NDArray[np.uint8]  # the numbers of kernels.status
CosSin: TypeAlias = tuple[Array, Array]  # cosines and sines of a table of angles
Numbers: TypeAlias = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step

EPS = 2.0**-53  # half the distance from 1 to the next float64: the largest relative error of one rounding
TWO_PI = 2.0 * math.pi
