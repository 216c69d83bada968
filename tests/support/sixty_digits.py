"""References: positions and derivatives in 60 digits, extrema over the turn from 65 536 samples and halving."""

from __future__ import annotations

from typing import Any

import numpy as np

from kernels.families import rssr
from sweep.families import family
from sweep.families.base import Array
from sweep.reductions.sampling import pose_columns

SAMPLES = 65536
DIGITS = 60
RSSR = family("rssr")
ORDERS = ("psi", "dpsi", "d2psi", "d3psi")
_BLOCK = 16
_HALVINGS = 44  # from one sample distance to the rounding of an angle
_SECANTS = 30  # at most; six are usual
_TURN = 2.0 * np.pi


def transfer_functions(design: Array, phi: float) -> tuple[Any, ...]:
    """Return psi, psi', psi'', psi''' as mpmath numbers, for exactly the given doubles."""
    import mpmath

    with mpmath.workdps(DIGITS):
        return _motion([mpmath.mpf(float(x)) for x in (*design[:7], phi)], int(design[7]))


def position(design: Array, phi: float) -> Any:
    """Return the angle psi, up to full turns, as an mpmath number."""
    import mpmath

    with mpmath.workdps(DIGITS):
        return _angle([mpmath.mpf(float(x)) for x in (*design[:7], phi)], int(design[7]))[0]


def _angle(inputs: list[Any], branch: int) -> tuple[Any, ...]:
    """Solve the implicit equation of the sources by arctangent plus arccosine, other algebra than any kernel's."""
    import mpmath

    a, b, c, e, f, g, alpha, phi = inputs
    u, v, sa, ca = mpmath.cos(phi), mpmath.sin(phi), mpmath.sin(alpha), mpmath.cos(alpha)
    x, y = e - a * u, f * sa + a * ca * v
    square = a * a - b * b + c * c + e * e + f * f + g * g - 2 * f * g * ca
    w = (square + 2 * a * (g * sa * v - e * u)) / (2 * c)
    return mpmath.atan2(y, -x) + branch * mpmath.acos(w / mpmath.sqrt(x * x + y * y)), u, v, sa, ca, x, y


def _motion(inputs: list[Any], branch: int) -> tuple[Any, ...]:
    """Return the angle, and its derivatives from the partials of ``F = |BC|^2 - b^2``."""
    import mpmath

    a, _, c, e, _, g, _, _ = inputs
    psi, u, v, sa, ca, x, y = _angle(inputs, branch)
    k, s = mpmath.cos(psi), mpmath.sin(psi)
    f_p = 2 * a * (c * v * k - c * ca * u * s + e * v + g * sa * u)
    f_pp = 2 * a * (c * u * k + c * ca * v * s + e * u - g * sa * v)
    f_s = -2 * c * (y * k + x * s)
    f_ss = 2 * c * (y * s - x * k)
    f_ps = -2 * a * c * (v * s + ca * u * k)
    f_pps = -2 * a * c * (u * s - ca * v * k)
    f_pss = -2 * a * c * (v * k - ca * u * s)
    d1 = -f_p / f_s
    d2 = -(f_pp + 2 * f_ps * d1 + f_ss * d1 * d1) / f_s
    d3 = -(-f_p + 3 * f_pps * d1 + 3 * f_pss * d1**2 - f_s * d1**3 + 3 * f_ps * d2 + 3 * f_ss * d1 * d2) / f_s
    return mpmath.atan2(s, k), d1, d2, d3


def turning_point(design: Array, phi: float) -> tuple[Any, Any]:
    """Return crank and rocker angle of the rocker's reversal next to phi, by Newton's method in 60 digits."""
    import mpmath

    with mpmath.workdps(DIGITS):
        inputs, branch, here = [mpmath.mpf(float(x)) for x in design[:7]], int(design[7]), mpmath.mpf(phi)
        for _ in range(_SECANTS):
            _, velocity, acceleration, _ = _motion([*inputs, here], branch)
            here -= velocity / acceleration
            if abs(velocity) < mpmath.mpf(10) ** -40:
                break
        return here, _motion([*inputs, here], branch)[0]


def condition(design: Array, phi: float) -> tuple[float, ...]:
    """Return the absolute condition numbers sum |x dy/dx| of psi and its derivatives, by 60-digit differences."""
    import mpmath

    with mpmath.workdps(DIGITS):
        inputs, branch = [mpmath.mpf(float(x)) for x in (*design[:7], phi)], int(design[7])
        total = [mpmath.mpf(0)] * 4
        for k, value in enumerate(inputs):
            if value == 0:
                continue
            # Small against the distance of a dead point, large against the last of 60 digits.
            step = abs(value) * mpmath.mpf(10) ** -25
            low, high = (_motion([*inputs[:k], value + s * step, *inputs[k + 1 :]], branch) for s in (-1, 1))
            slopes = [abs(value) * abs(h - w) / (2 * step) for w, h in zip(low, high, strict=True)]
            # The angle may jump by a full turn between the two.
            slopes[0] = abs(value) * abs(mpmath.sin(high[0] - low[0])) / (2 * step)
            total = [t + s for t, s in zip(total, slopes, strict=True)]
        return tuple(float(t) for t in total)


def angle_error(got: float, exact: Any) -> float:
    """Return the distance of an angle from the exact one, modulo full turns."""
    import mpmath

    with mpmath.workdps(DIGITS):
        return abs(float(mpmath.sin(mpmath.mpf(float(got)) - exact)))


def extremum(designs: Array, pose: str, sign: int = 0) -> Array:
    """Return the maximum (sign 1), minimum (-1) or largest magnitude (0) over the turn of a pose output.

    Every local extremum within a tenth of the best sample is refined by halving on the sign of the derivative.  Of the
    samples 49 152 are evenly spaced; the others are dense near the least discriminant, down to 1e-9 rad, since near a
    change point the even ones miss the peak.  A follower that turns fully has no extremum of its angle: nan.
    """
    return _extremum(designs, pose, sign)[0]


def largest_acceleration(designs: Array) -> Array:
    """Return the largest |psi''| over the turn, at the place of :func:`extremum`, with the height in 60 digits."""
    _, places = _extremum(designs, "d2psi", 0)
    return np.array([peak_acceleration(*pair) for pair in zip(designs, places, strict=True)])


def peak_acceleration(design: Array, phi: float) -> float:
    """Return the peak acceleration closest to phi, in 60 digits, by secant steps to the zero of the jerk."""
    import mpmath

    with mpmath.workdps(DIGITS):
        inputs, branch = [mpmath.mpf(float(x)) for x in design[:7]], int(design[7])
        here, before = mpmath.mpf(float(phi)), mpmath.mpf(float(phi)) + mpmath.mpf(10) ** -12
        slope = _motion([*inputs, before], branch)[3]
        height = mpmath.mpf(0)
        for _ in range(_SECANTS):
            _, _, acceleration, jerk = _motion([*inputs, here], branch)
            height = abs(acceleration)
            if jerk == slope or abs(here - before) < mpmath.mpf(10) ** -30:
                break
            here, before, slope = here - jerk * (here - before) / (jerk - slope), here, jerk
        return float(height)


def _extremum(designs: Array, pose: str, sign: int) -> tuple[Array, Array]:
    best, place = np.full(len(designs), np.nan), np.full(len(designs), np.nan)
    near = np.geomspace(1e-9, np.pi, SAMPLES // 8)
    steps = np.sort(np.concatenate([np.linspace(-np.pi, np.pi, SAMPLES * 3 // 4 + 1)[1:], near[:-1], -near[:-1]]))
    for start in range(0, len(designs), _BLOCK):
        rows = np.arange(start, min(start + _BLOCK, len(designs)))
        phi = hardest_angle(designs[rows])[:, None] + steps
        columns, _ = pose_columns(RSSR, designs[rows], phi, (pose,))
        y, winds = columns[pose], np.zeros(rows.size, np.bool_)
        if pose == "psi":
            closed = np.unwrap(np.column_stack([y, y[:, 0]]), axis=1)
            y, winds = closed[:, :-1], np.abs(closed[:, -1] - closed[:, 0]) > 1.0
        y = np.abs(y) if sign == 0 else sign * y
        top, low = y.max(axis=1, keepdims=True), y.min(axis=1, keepdims=True)
        peak = (y >= np.roll(y, 1, axis=1)) & (y >= np.roll(y, -1, axis=1)) & (y >= top - 0.1 * (top - low))
        row, column = np.nonzero(peak & ~winds[:, None])
        gaps = np.diff(steps, append=steps[0] + _TURN)
        heights, places = refined(designs[rows[row]], pose, sign, phi[row, column], gaps[column - 1], gaps[column])
        if pose == "psi":
            heights += _TURN * np.rint((y[row, column] - heights) / _TURN)
        found = np.full(rows.size, -np.inf)
        np.maximum.at(found, row, heights)
        best[rows] = np.where(winds, np.nan, found * (-1.0 if sign < 0 else 1.0))
        winner = heights == found[row]
        place[rows[row[winner]]] = places[winner]
    return best, place


def hardest_angle(designs: Array) -> Array:
    """Return the crank angle of the least discriminant, next to which a motion is sharpest."""
    status, place = np.empty(len(designs), np.uint8), np.empty(len(designs))
    rssr.margin(designs, status, None, None, None, place, None)
    return place


def swing(designs: Array) -> Array:
    """Return the magnitude of the swing from the two extrema of the angle, nan for a follower that turns fully."""
    return extremum(designs, "psi", 1) - extremum(designs, "psi", -1)


def refined(designs: Array, pose: str, sign: int, centre: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Return height, times the sign that makes it a maximum, and place of the extremum around each centre."""
    slope = RSSR.derivative_of[pose]
    low, high = centre - before, centre + after
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        columns, _ = pose_columns(RSSR, designs, middle[:, None], (pose, slope))
        rising = columns[slope][:, 0] * (np.sign(columns[pose][:, 0]) if sign == 0 else sign) > 0.0
        low, high = np.where(rising, middle, low), np.where(rising, high, middle)
    place: Array = 0.5 * (low + high)
    columns, _ = pose_columns(RSSR, designs, place[:, None], (pose,))
    y: Array = columns[pose][:, 0]
    return (np.abs(y) if sign == 0 else sign * y), place
