"""Thread tension and take-ups in the plainest way, 40 digits; imports nothing of the project."""

from __future__ import annotations

import math
from typing import Any

from mpmath import mp


def tension_behind(t1: float, radius: float, theta: float, alpha: float, beta: float, b: float, r: float) -> Any:
    """Tension behind a contour by integrating dT/dtheta = beta (T + B/(R + r)^2) + alpha R in small steps.

    Taylor series of the differential equation, step by step, in 40 digits.
    """
    with mp.workdps(40):
        steps, tension = 40, mp.mpf(t1)
        h, beta_, radius_ = mp.mpf(theta) / steps, mp.mpf(beta), mp.mpf(radius)
        for _ in range(steps):
            term = beta_ * (tension + mp.mpf(b) / (radius_ + mp.mpf(r)) ** 2) + mp.mpf(alpha) * radius_
            for order in range(1, 30):
                term = term * (h if order == 1 else beta_ * h / order)
                tension += term
        return tension


def length_over(e: Any, n1: Any, n2: Any) -> Any:
    """Length of the polyline N1, E, N2."""
    return sum(mp.sqrt(sum((mp.mpf(p) - mp.mpf(q)) ** 2 for p, q in zip(e, n, strict=True))) for n in (n1, n2))


def turning(e: Any, n1: Any, n2: Any) -> Any:
    """Angle by which the polyline turns at E, from the law of cosines."""
    with mp.workdps(60):
        way = mp.sqrt(sum((mp.mpf(p) - mp.mpf(q)) ** 2 for p, q in zip(n1, n2, strict=True)))
        r1, r2 = length_over(e, n1, n1) / 2, length_over(e, n2, n2) / 2
        return mp.pi - mp.acos((r1**2 + r2**2 - way**2) / (2 * r1 * r2))


def eyelet_place(a: Any, f: Any, alpha: Any, angle: Any) -> tuple[Any, Any, Any]:
    """Point on a circle of radius a about the axis through (0, f sin alpha, f cos alpha)."""
    u = (0, mp.sin(alpha), mp.cos(alpha))
    across = (0, mp.cos(alpha), -mp.sin(alpha))
    return tuple(f * u[k] + a * ((mp.cos(angle) if k == 0 else 0) + mp.sin(angle) * across[k]) for k in range(3))


def shortest_over_edge(a: float, phi: float, n1: Any, n2: Any) -> tuple[float, Any, int]:
    """y, length and number of minima over the edge, by a scan of 4000 points and golden sections; float64 first."""

    def length(y: float) -> float:
        x = a * y * y
        place = (x * math.cos(phi) - y * math.sin(phi), x * math.sin(phi) + y * math.cos(phi), 0.0)
        return math.dist(place, n1) + math.dist(place, n2)

    ys = [-10.0 + 0.005 * k for k in range(4001)]
    values = [length(y) for y in ys]
    found = []
    for k in range(1, len(ys) - 1):
        if values[k] < values[k - 1] and values[k] <= values[k + 1]:
            low, high = ys[k - 1], ys[k + 1]
            for _ in range(60):
                left, right = low + 0.382 * (high - low), low + 0.618 * (high - low)
                if length(left) < length(right):
                    high = right
                else:
                    low = left
            found.append((length(low), low))
    best = min(found)
    return best[1], best[0], len(found)


def passes_inside(a: float, phi: float, n1: Any, n2: Any) -> bool:
    """Whether the straight line between the guides passes the plane of the cam inside its material."""
    share = n1[2] / (n1[2] - n2[2])
    x, y = (n1[k] + share * (n2[k] - n1[k]) for k in (0, 1))
    along, across = x * math.cos(phi) + y * math.sin(phi), y * math.cos(phi) - x * math.sin(phi)
    return along > a * across**2


def lean_of_resultant(a: float, phi: float, n1: Any, n2: Any, ratio: float, y: float) -> float:
    """Sine of the angle by which e1 + ratio e2 leans towards growing y from the normal plane of the edge."""
    x = a * y * y
    p = (x * math.cos(phi) - y * math.sin(phi), x * math.sin(phi) + y * math.cos(phi), 0.0)
    tangent = (2 * a * y * math.cos(phi) - math.sin(phi), 2 * a * y * math.sin(phi) + math.cos(phi), 0.0)
    r1, r2 = math.dist(p, n1), math.dist(p, n2)
    pull = [(n1[k] - p[k]) / r1 + ratio * (n2[k] - p[k]) / r2 for k in range(3)]
    along = sum(q * t for q, t in zip(pull, tangent, strict=True)) / math.hypot(*tangent)
    return along / math.hypot(*pull)


def follower(thread: Any, guide_z: Any, offset: Any) -> Any:
    """Displacement of a follower that carries the thread symmetrically between two guides."""
    return mp.sqrt(thread**2 / 4 - guide_z**2 - offset**2)
