"""Presser foot on a rack that rises harmonically: closed forms of its first jump, contact and flight over the turn.

The march over events is :mod:`kernels.effects.foot`.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.curves.root_search import bisected
from kernels.jit import inline, kernel
from kernels.types import TWO_PI, Array, Status

_CELLS = 4096


@inline
def _free(d: Array, i: int, v0: float, t: float) -> float:
    """Height of the foot at the time t after it left the plate with the speed v0."""
    m, k, preload = d[i, 0], d[i, 1], d[i, 2]
    half = 0.5 * math.sqrt(k / m) * t
    sinc = math.sin(half) / half if half != 0.0 else 1.0
    height: float = v0 * t * sinc * math.cos(half) - 0.5 * (preload / m) * (t * sinc) * (t * sinc)
    return height


@inline
def _gap(d: Array, i: int, x0: float, v0: float, t: float) -> float:
    """Height of the foot above the rack, or above the plate where the rack is below the plate."""
    rack = d[i, 4] * math.sin(x0 + d[i, 3] * t) - d[i, 5]
    gap: float = _free(d, i, v0, t) - max(rack, 0.0)
    return gap


@inline
def _is_above(t: float, d: Array, i: int, x0: float, v0: float) -> bool:
    return _gap(d, i, x0, v0, t) > 0.0


@inline
def _first_contact(d: Array, i: int, x0: float, v0: float, longest: float) -> float:
    """Find the first time after the launch when the foot meets rack or plate; it meets the plate after ``longest``."""
    low = 0.0
    for j in range(1, _CELLS + 1):
        high = longest * (j / _CELLS)
        if j == _CELLS or _gap(d, i, x0, v0, high) < 0.0:
            if low == 0.0:
                # The first cell begins at the launch itself, where the gap is zero: halve towards it to find a gap.
                low = high
                for _ in range(60):
                    low *= 0.5
                    if _gap(d, i, x0, v0, low) > 0.0:
                        break
            low, high = bisected(_is_above, low, high, d, i, x0, v0)
            # Where the rack is below the plate the time to plate level is known in closed form.
            rack = d[i, 4] * math.sin(x0 + d[i, 3] * high) - d[i, 5]
            return longest if rack < 0.0 and j == _CELLS else high
        low = high
    return longest


@kernel
def closed_forms(designs: Array, status: Status, outputs: Array) -> None:
    """Compute entry, jump, limits of spring and preload, contact forces, next contact; (1)-(3), (6) of docs/foot.md.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/foot.py, without its fabric
    status : (n,) out; OK, NO_EVENT (the rack does not pass the plate) or INVALID_INPUT
    outputs : (10, n) out in the order of `CLOSED_OUTPUTS` of sweep/families/foot.py; the time of first
        contact is nan without a rebound
    """
    for i in range(designs.shape[0]):
        m, k, preload, omega = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3]
        lift, p, restitution = designs[i, 4], designs[i, 5], designs[i, 6]
        for n in range(10):
            outputs[n, i] = math.nan
        valid = m > 0.0 and k >= 0.0 and preload > 0.0 and omega > 0.0 and 0.0 <= restitution < 1.0
        status[i] = st.OK if valid and lift > 0.0 and lift < 1e150 and abs(p) < 1e150 else st.INVALID_INPUT
        if status[i] == st.OK and not -lift < p < lift:
            status[i] = st.NO_EVENT
        if status[i] != st.OK:
            continue
        across = math.sqrt((lift - p) * (lift + p))
        x0, speed = math.atan2(p, across), omega * across
        launch, natural = (1.0 + restitution) * speed, math.sqrt(k / m)
        # (-F0 + sqrt(F0^2 + k m v^2))/k without the difference; also for no spring
        jump = m * launch * launch / (preload + math.sqrt(preload * preload + k * m * launch * launch))
        ratio = launch * math.sqrt(k * m) / preload
        flight = 2.0 * math.atan(ratio) / natural if natural > 0.0 else 2.0 * m * launch / preload
        unit = m * omega * omega
        outputs[0, i], outputs[1, i], outputs[2, i] = x0, speed, natural
        outputs[3, i], outputs[4, i] = jump, flight
        outputs[5, i], outputs[6, i] = (unit * lift - preload) / (lift - p), unit * p
        outputs[7, i], outputs[8, i] = preload - unit * p, preload + k * (lift - p) - unit * lift
        if restitution > 0.0:
            outputs[9, i] = _first_contact(designs, i, x0, launch, flight)


@kernel
def rack_path(designs: Array, path: Array) -> None:
    """Compute the path of the rack at equal crank angles: height Y sin(phi) - p, along the feed -X cos(phi); (1).

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/foot.py, without its fabric
    path : (n, 6, N) out, for :func:`kernels.effects.foot_fabric.march`
    """
    step = TWO_PI / path.shape[2]
    for i in range(designs.shape[0]):
        lift, p, half = designs[i, 4], designs[i, 5], designs[i, 7]
        for j in range(path.shape[2]):
            s, c = math.sin(j * step), math.cos(j * step)
            path[i, 0, j], path[i, 1, j], path[i, 2, j] = lift * s - p, lift * c, -lift * s
            path[i, 3, j], path[i, 4, j], path[i, 5, j] = -half * c, half * s, half * c
