"""Proof that one rocker angle at most has the wanted sign of dG5/dpsi, or that none closes the loop at all; (4).

On a solution cos(delta) = (W - shift - share rho)/r, where delta is counted from the direction of the crank pin and
r = hypot(X, Y).  Bounds of rho therefore confine delta to two intervals, one on each side, and over an interval rho
changes less than over the circle: the bounds improve themselves.  Where dG5/dpsi = r sin(delta) - share rho' has the
sign of sin(delta) throughout each of them, each holds one solution at most.
"""

from __future__ import annotations

import math

from kernels._jit import inline, kernel
from kernels.families.five_link.closure import Joint

ROUNDS = 5
GUARD = 1e-9  # every bound is widened by this part of what it is made of, far above its rounding
ONE, UNKNOWN, NONE = 1, 0, -1


@inline
def _reach_between(joint: Joint, s0: float, s1: float) -> tuple[float, float, float]:
    """Return the smallest and largest rho and the largest |z| for sines between two values."""
    z0, z1 = joint.sweep * s0 + joint.axial, joint.sweep * s1 + joint.axial
    far = max(abs(z0), abs(z1)) + GUARD * joint.coupler
    near = 0.0 if z0 * z1 <= 0.0 else max(min(abs(z0), abs(z1)) - GUARD * joint.coupler, 0.0)
    low = max((joint.coupler - far) * (joint.coupler + far), 0.0)
    high = max((joint.coupler - near) * (joint.coupler + near), 0.0)
    return math.sqrt(low), math.sqrt(high), far


@kernel
def solutions(joint: Joint, x: float, y: float, w: float) -> int:
    """Return ONE for one solution at most for each sign of dG5/dpsi, NONE for no solution,
    UNKNOWN where neither was proved.
    """
    r = math.sqrt(x * x + y * y)
    if not r > 0.0:
        return UNKNOWN
    cos0, sin0 = -x / r, y / r  # direction of the crank pin
    close = w - joint.shift
    noise = GUARD * (1.0 + (abs(w) + joint.shift + abs(joint.share) * joint.coupler) / r)
    first, last, _ = _reach_between(joint, -1.0, 1.0)
    empty = 0
    for side in (1.0, -1.0):
        low, high = first, last
        proved = False
        for _ in range(ROUNDS):
            one, two = (close - joint.share * low) / r, (close - joint.share * high) / r
            cos_near, cos_far = max(one, two) + noise, min(one, two) - noise
            if cos_near < -1.0 or cos_far > 1.0 or high <= 0.0:
                empty += 1
                proved = True
                break
            cos_near, cos_far = min(cos_near, 1.0), max(cos_far, -1.0)
            sin_near = side * math.sqrt((1.0 - cos_near) * (1.0 + cos_near))
            sin_far = side * math.sqrt((1.0 - cos_far) * (1.0 + cos_far))
            s_near, c_near = sin0 * cos_near + cos0 * sin_near, cos0 * cos_near - sin0 * sin_near
            s_far, c_far = sin0 * cos_far + cos0 * sin_far, cos0 * cos_far - sin0 * sin_far
            # Over at most half a turn the sine passes 1 where the cosine changes sign downwards, -1 upwards, and the
            # cosine passes 1 or -1 where the sine changes sign.
            falls = (c_near * side >= 0.0) & (c_far * side <= 0.0)
            rises = (c_near * side <= 0.0) & (c_far * side >= 0.0)
            s_low = -1.0 if rises else min(s_near, s_far)
            s_high = 1.0 if falls else max(s_near, s_far)
            wide = 1.0 if s_near * s_far <= 0.0 else max(abs(c_near), abs(c_far))
            low, high, far = _reach_between(joint, s_low, s_high)
            if low > 0.0:
                steep = abs(joint.share) * far * abs(joint.sweep) * wide / low
                if r * min(abs(sin_near), abs(sin_far)) > steep * (1.0 + GUARD):
                    proved = True
                    break
        if not proved:
            return UNKNOWN
    return NONE if empty == 2 else ONE
