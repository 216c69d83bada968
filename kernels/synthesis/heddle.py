"""Synthesis of a heddle drive: extreme positions from the stroke, rod from the lever swing, arms of the shafts.

Equations (1), (2), (10) and (11) of docs/heddle.md.  O1, O2, O3 lie on one line; the arm O3D stands square to it at
mid-stroke, and the rigid angle C-O3-D puts C above the line.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.curves.root_search import bisected
from kernels.families.heddle import driven, four_bar
from kernels.jit import inline, kernel
from kernels.types import EPS, TWO_PI, Array, Status

_MOST_STEPS = 200


@inline
def half_angle(stroke: float, arm: float, exact: bool) -> float:
    """Half of the swing of the shaft lever: by the chord of its end (exact), or by the source's arc tangent; (1)."""
    if exact:
        return math.atan2(stroke, math.sqrt((2.0 * arm - stroke) * (2.0 * arm + stroke)))
    return math.atan2(stroke, 2.0 * arm)


@inline
def distance_to_c(frame: float, arm: float, xi: float) -> float:
    """Return O2C from the sides O2O3, O3C and the angle between them; (2)."""
    half = math.sin(0.5 * xi)
    return math.sqrt((frame - arm) * (frame - arm) + 4.0 * frame * arm * (half * half))


@kernel
def heddle_extremes(requirements: Array, extremes: Array, status: Status) -> None:
    """Compute both extreme positions of the bell crank for a wanted stroke of the shaft; (1), (2) of docs/heddle.md.

    Parameters
    ----------
    requirements : (n, 6); stroke, O4E, O1O2, O1O3, O3C [length], kappa = angle C-O3-D [rad]
    extremes : (n, 12) out; mu, xi_1, xi_2 [rad], O2C_1, O2C_2, vertical travel of E [length], first by the chord
        (columns 0-5), then by the arc tangent that the source prints (columns 6-11)
    status : (n,) out; OK, NOT_ASSEMBLED (the stroke is longer than the lever can make it) or INVALID_INPUT
    """
    for i in range(requirements.shape[0]):
        stroke, lever, kappa = requirements[i, 0], requirements[i, 1], requirements[i, 5]
        frame, arm = requirements[i, 3] - requirements[i, 2], requirements[i, 4]
        valid = stroke > 0.0 and lever > 0.0 and arm > 0.0 and frame > 0.0 and abs(kappa) < 1e5
        valid = valid and stroke < 1e140 and lever < 1e140 and arm < 1e140 and frame < 1e140
        code = st.OK if valid else st.INVALID_INPUT
        if valid and stroke > 2.0 * lever:
            code = st.NOT_ASSEMBLED
        status[i] = code
        for way in range(2):
            out = extremes[i, 6 * way : 6 * way + 6]
            if code == st.INVALID_INPUT or (code != st.OK and way == 0):
                out[:] = math.nan
                continue
            mu = half_angle(stroke, lever, way == 0)
            middle = 1.5 * math.pi - kappa
            out[0], out[1], out[2] = mu, middle + mu, middle - mu
            out[3] = distance_to_c(frame, arm, middle + mu)
            out[4] = distance_to_c(frame, arm, middle - mu)
            out[5] = 2.0 * lever * math.sin(mu) if way == 1 else stroke


@inline
def lever_angle(frame: float, arm: float, lever: float, rod: float, side: float, xi: float) -> tuple[float, float]:
    """Angle of the cam lever, continuous in xi where C passes behind O2, too; below 0 where the rod does not reach."""
    reach = distance_to_c(frame, arm, xi)
    near = (rod - (lever - reach)) * (rod + (lever - reach))
    far = ((lever + reach) - rod) * ((lever + reach) + rod)
    towards = math.atan2(arm * math.sin(xi), frame - arm * math.cos(xi))
    if arm > frame:
        towards = math.pi - xi - math.atan2(frame * math.sin(xi), arm - frame * math.cos(xi))
    return towards + side * 2.0 * math.atan2(math.sqrt(max(near, 0.0)), math.sqrt(max(far, 0.0))), min(near, far)


@kernel
def heddle_lever_angles(positions: Array, angles: Array, status: Status) -> None:
    """Compute angles of the cam lever O2B in both extreme positions for a given rod BC; (10) of docs/heddle.md.

    Parameters
    ----------
    positions : (n, 7); O2O3, O3C [length], xi_1, xi_2 [rad], O2B, BC [length], side_B (+1: B left of the ray O2-C)
    angles : (n, 3) out; lever_angle_1, lever_angle_2, their difference [rad from the line O1O3]; nan if not assembled
    status : (n,) out; OK, NOT_ASSEMBLED or INVALID_INPUT
    """
    for i in range(positions.shape[0]):
        frame, arm, lever, rod = positions[i, 0], positions[i, 1], positions[i, 4], positions[i, 5]
        xi1, xi2, side = positions[i, 2], positions[i, 3], positions[i, 6]
        angles[i, :] = math.nan
        status[i] = st.INVALID_INPUT
        if not (lever > 0.0 and rod > 0.0 and side * side == 1.0 and xi1 == xi1):
            continue
        one, reached = lever_angle(frame, arm, lever, rod, side, xi1)
        two, reached2 = lever_angle(frame, arm, lever, rod, side, xi2)
        status[i] = st.OK if reached >= 0.0 and reached2 >= 0.0 else st.NOT_ASSEMBLED
        if status[i] == st.OK:
            turns = TWO_PI * math.floor(0.5 + 0.5 * (one + two) / TWO_PI)
            angles[i, 0], angles[i, 1], angles[i, 2] = one - turns, two - turns, one - two


@inline
def _kept_rod(x: float, y: float, one: tuple[float, float], two: tuple[float, float], side: float) -> float:
    """Length of the rod from B = (x, y) to the first C; nan if B is on the wrong side of a ray from O2 to C."""
    if side * (one[0] * y - one[1] * x) > 0.0 and side * (two[0] * y - two[1] * x) > 0.0:
        return math.hypot(x - one[0], y - one[1])
    return math.nan


@kernel
def heddle_rods(positions: Array, rods: Array, count: Status, status: Status) -> None:
    """Find the rods BC that give the cam lever a wanted swing between the extreme positions; (11) of docs/heddle.md.

    Turn the second position about O2 by the swing: B coincides in both, so it stands on the circle of radius O2B and on
    the perpendicular bisector of the two places of C.  That gives two points for each sense of the swing; those on the
    wrong side of a ray O2-C are dropped.

    Parameters
    ----------
    positions : (n, 7); O2O3, O3C [length], xi_1, xi_2 [rad], O2B [length], magnitude of the swing [rad], side_B
    rods : (n, 4) out; ascending, nan last [length]
    count : (n,) out; number of rods
    status : (n,) out; OK, NOT_ADMISSIBLE (no rod), SINGULAR (C does not move: every rod will do) or INVALID_INPUT
    """
    for i in range(positions.shape[0]):
        frame, arm, lever, side = positions[i, 0], positions[i, 1], positions[i, 4], positions[i, 6]
        xi1, xi2, swing = positions[i, 2], positions[i, 3], positions[i, 5]
        rods[i, :] = math.nan
        count[i] = 0
        if not (frame > 0.0 and arm > 0.0 and lever > 0.0 and 0.0 < swing < math.pi and side * side == 1.0):
            status[i] = st.INVALID_INPUT
            continue
        # (O2C_2)^2 - (O2C_1)^2 without the squares
        excess = -4.0 * frame * arm * math.sin(0.5 * (xi1 + xi2)) * math.sin(0.5 * (xi1 - xi2))
        one = (frame - arm * math.cos(xi1), arm * math.sin(xi1))
        x2, y2 = frame - arm * math.cos(xi2), arm * math.sin(xi2)
        singular = False
        for sense in (1.0, -1.0):
            cos, sin = math.cos(swing), sense * math.sin(swing)
            two = (x2 * cos - y2 * sin, x2 * sin + y2 * cos)
            nx, ny = two[0] - one[0], two[1] - one[1]
            size = math.hypot(nx, ny)
            if size <= 8.0 * EPS * (frame + arm):
                singular = True
                continue
            along = 0.5 * excess / size
            square = (lever - along) * (lever + along)
            if not square > 0.0:
                continue
            across = math.sqrt(square)
            nx, ny = nx / size, ny / size
            for turn in (1.0, -1.0):
                x, y = along * nx - turn * across * ny, along * ny + turn * across * nx
                rod = _kept_rod(x, y, one, two, side)
                if rod == rod:
                    start, _ = lever_angle(frame, arm, lever, rod, side, xi1)
                    end, _ = lever_angle(frame, arm, lever, rod, side, xi2)
                    if abs(start - end) > math.pi:  # the lever goes the other way round
                        continue
                    rods[i, count[i]] = rod
                    count[i] += 1
        rods[i, : count[i]].sort()
        status[i] = st.SINGULAR if singular else (st.OK if count[i] > 0 else st.NOT_ADMISSIBLE)


@inline
def _travel(arm: float, lever: float, frame: float, end: float, half: float) -> tuple[float, float, int]:
    """Height of E above mid-stroke with the bell crank at +half and at -half, and the status; (12)."""
    bar = four_bar(arm, math.hypot(frame, arm - lever), lever, frame, 1.0)
    cos, _, _, _, up = driven(bar, -math.sin(half), math.cos(half))
    other, _, _, _, down = driven(bar, math.sin(half), math.cos(half))
    code = up if up != st.OK else down
    return -end * cos, -end * other, code


@inline
def _too_short(arm: float, lever: float, frame: float, end: float, half: float, stroke: float, beyond: bool) -> bool:
    """Whether an arm gives less than the stroke and passes no dead point; ``beyond``: one at -half does not count."""
    up, down, code = _travel(arm, lever, frame, end, half)
    return not (up - down >= stroke or (code != st.OK and not (beyond and up == up)))


@kernel
def heddle_shaft_arms(shafts: Array, arms: Array, status: Status) -> None:
    """Find the arm O3D that gives a shaft its stroke; the other lengths are common to all shafts; (12), (13).

    Parameters
    ----------
    shafts : (n, 5); stroke, O4E, O4F, O3O4 [length], mu_3 = half swing of the bell crank [rad]
    arms : (n, 4) out; O3D, DF [length], highest and lowest place of E against mid-stroke [length]
    status : (n,) out; OK, NOT_ADMISSIBLE (no arm gives the stroke) or INVALID_INPUT

    Notes
    -----
    DF lets both arms stand square to O3O4 at mid-stroke.  The stroke grows with the arm until the link reaches a dead
    point at one end of the swing, and beyond that until it reaches one at the other end; the arm is bisected to the
    last bit, first on this side of the first dead point.
    """
    for i in range(shafts.shape[0]):
        stroke, end, lever, frame, half = shafts[i, 0], shafts[i, 1], shafts[i, 2], shafts[i, 3], shafts[i, 4]
        arms[i, :] = math.nan
        if not (stroke > 0.0 and end > 0.0 and lever > 0.0 and frame > 0.0 and 0.0 < half < 0.5 * math.pi):
            status[i] = st.INVALID_INPUT
            continue
        status[i] = st.NOT_ADMISSIBLE
        for beyond in (False, True):
            # Upwards from the first-order arm, until an arm has the stroke or passes a dead point: either is too long.
            low, high = 0.0, lever * (0.5 * stroke / end) / math.sin(half)
            for _ in range(_MOST_STEPS):
                if not _too_short(high, lever, frame, end, half, stroke, beyond):
                    break
                low, high = high, 1.03125 * high
            _, high = bisected(_too_short, low, high, lever, frame, end, half, stroke, beyond)
            up, down, code = _travel(high, lever, frame, end, half)
            if code == st.OK and up - down >= stroke:
                status[i] = st.OK
                arms[i, 0], arms[i, 1] = high, math.hypot(frame, high - lever)
                arms[i, 2], arms[i, 3] = up, down
                break
