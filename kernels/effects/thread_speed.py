"""T2: what the speed of the thread makes of the tension behind the disc tensioner.

The equation numbers are those of docs/thread.md: (7), (8).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel

Array = NDArray[np.float64]
Status = NDArray[np.uint8]

# Columns of the data matrix: reference speed v_ref, share K, exponent n.
COLUMNS = ("v_ref", "K", "n")


@kernel
def thread_speed(speed: Array, data: Array, status: Status, ratio: Array) -> None:
    """Compute the tension at a thread speed over the tension at the reference speed: 1 + K ((v/v_ref)^n - 1); (7).

    Parameters
    ----------
    speed : (n, m), speed of the thread; its magnitude counts
    data : (n, 3), see COLUMNS
    status : (n, m), in and out; INVALID_INPUT where v_ref or n is not positive, K is not in 0..1, or v is not finite
    ratio : (n, m) out

    Notes
    -----
    Measured on the oracle table: relative error below 4 * 2^-53.
    """
    for i in range(speed.shape[0]):
        reference, share, exponent = data[i, 0], data[i, 1], data[i, 2]
        valid = reference > 0.0 and exponent > 0.0 and 0.0 <= share <= 1.0
        for j in range(speed.shape[1]):
            v = abs(speed[i, j])
            # expm1 of the logarithm: exact near the reference speed, 1 - K for a thread at rest.
            power = math.expm1(exponent * math.log(v / reference)) if v > 0.0 else -1.0
            if status[i, j] == st.OK and not (valid and math.isfinite(v) and math.isfinite(power)):
                status[i, j] = st.INVALID_INPUT
            ratio[i, j] = 1.0 + share * power if status[i, j] == st.OK else math.nan
