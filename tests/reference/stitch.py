"""Needle, loopers and a seam by circles and spheres on a dense turn; 64-bit mantissas, nothing of the project.

Points come from rotations of frames and intersections of circles; moments from signs of sampled geometry, closed by
bisection; conditions from differences in every input.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

REAL = np.longdouble
TURN = REAL(2) * np.arccos(REAL(-1))
SAMPLES = 1024
GUIDE = ("a", "b", "c", "e", "xi", "eta", "lam", "h", "branch")
Inputs = dict[str, Any]


def flat(given: dict[str, Any], prefix: str = "") -> Inputs:
    """Every number of nested inputs under a dotted name."""
    found: Inputs = {}
    for key, value in given.items() if isinstance(given, dict) else enumerate(given):
        if isinstance(value, dict | list):
            found |= flat(value, f"{prefix}{key}.")
        elif isinstance(value, int | float):
            found[f"{prefix}{key}"] = REAL(value)
    return found


def cross(a: Any, b: Any) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a: Any, b: Any) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def minus(a: Any, b: Any) -> list[Any]:
    return [x - y for x, y in zip(a, b, strict=True)]


def unit(a: Any) -> list[Any]:
    size = np.sqrt(dot(a, a))
    return [x / size for x in a]


def frame(p: Inputs, at: str) -> tuple[Any, Any, Any, Any]:
    """Origin, x, y, z of a place."""
    z = unit([p[f"{at}axis.{k}"] for k in range(3)])
    zero = [p[f"{at}zero.{k}"] for k in range(3)]
    x = unit(minus(zero, [dot(zero, z) * c for c in z]))
    return [p[f"{at}at.{k}"] for k in range(3)], x, cross(z, x), z


def meeting(centre: Any, reach: Any, e: Any, c: Any, branch: Any) -> tuple[Any, Any]:
    """Where circles about ``centre`` and (e, 0) meet: cosine and sine of the direction from (e, 0)."""
    dx, dy = centre[0] - e, centre[1]
    square = dx**2 + dy**2
    along = (square + c**2 - reach) / 2
    across = np.sqrt(square * c**2 - along**2)
    ends = [((along * dx - k * across * dy) / square / c, (along * dy + k * across * dx) / square / c) for k in (1, -1)]
    turning = [-(c * x - dx) * y + (c * y - dy) * x for x, y in ends]
    first = np.sign(turning[0]) == branch
    return np.where(first, ends[0][0], ends[1][0]), np.where(first, ends[0][1], ends[1][1])


def rocker(p: Inputs, at: str, phi: Any) -> tuple[Any, Any]:
    """Cosine and sine of a crank-rocker's output angle."""
    a, b, c, e, f, g, alpha, branch = (p[f"{at}{name}"] for name in ("a", "b", "c", "e", "f", "g", "alpha", "branch"))
    x = a * np.cos(phi)
    y = f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    z = f * np.cos(alpha) - a * np.sin(alpha) * np.sin(phi)
    return meeting((x, y), b**2 - (z - g) ** 2, e, c, branch)


def guided(p: Inputs, phi: Any) -> tuple[list[Any], list[Any]]:
    """The needle's guided point, and the direction to its point."""
    origin, x, y, z = frame(p, "needle.")
    cos, sin = rocker(p, "needle.stages.0.p.", phi)
    one, two = "needle.stages.0.p.", "needle.stages.1."
    kappa, turn = p[f"{two}kappa"], p[f"{two}turn"]
    phi2 = kappa * np.arctan2(sin, cos) + p[f"{two}offset"]
    origin = [o + p[f"{one}e"] * i + p[f"{two}shift"] * k for o, i, k in zip(origin, x, z, strict=True)]
    x2 = [np.cos(turn) * i + np.sin(turn) * j for i, j in zip(x, y, strict=True)]
    y2 = cross([kappa * k for k in z], x2)
    a, b, c, e, xi, eta, lam, _, branch = (p[f"{two}p.{name}"] for name in GUIDE)
    pin = (a * np.cos(phi2), a * np.sin(phi2))
    end = meeting(pin, b**2, e, c, branch)
    along = ((e + c * end[0] - pin[0]) / b, (c * end[1] - pin[1]) / b)
    u, v = pin[0] + xi * along[0] - eta * along[1], pin[1] + xi * along[1] + eta * along[0]
    point = [o + u * i + v * j for o, i, j in zip(origin, x2, y2, strict=True)]
    sense = p["needle.sense"]
    return point, [sense * (np.cos(lam) * i + np.sin(lam) * j) for i, j in zip(x2, y2, strict=True)]


def carried(p: Inputs, looper: str, name: str, phi: Any) -> list[Any]:
    """A point of a looper's rocker."""
    origin, *axes = frame(p, f"{looper}.")
    cos, sin = rocker(p, f"{looper}.p.", p[f"{looper}.ratio"] * phi + p[f"{looper}.offset"])
    x, y, z = (p[f"{looper}.{name}.{k}"] for k in range(3))
    local = [p[f"{looper}.p.e"] + x * cos - y * sin, x * sin + y * cos, z]
    return [origin[k] + sum(part * axis[k] for part, axis in zip(local, axes, strict=True)) for k in range(3)]


def passing(p: Inputs, phi: Any) -> dict[str, Any]:
    """The tip in the needle's frame."""
    g, n = guided(p, phi)
    scarf = [p[f"needle.scarf.{k}"] for k in range(3)]
    w = unit(minus(scarf, [dot(scarf, n) * x for x in n]))
    r = minus(carried(p, "looper", "tip", phi), g)
    return {"across": dot(r, cross(n, w)), "side": dot(r, w), "height": dot(r, n), "depth": dot(g, n)}


def entering(p: Inputs, phi: Any, by: str) -> dict[str, Any]:
    """The needle's point, or another looper's tip, against the triangle of eye, hold and seam."""
    if by == "needle":
        g, n = guided(p, phi)
        tip = [x + p["needle.point"] * y for x, y in zip(g, n, strict=True)]
    else:
        tip = carried(p, by, "tip", phi)
    corners = [carried(p, "looper", "eye", phi), carried(p, "looper", "hold", phi), [p[f"seam.{k}"] for k in range(3)]]
    normal = unit(cross(minus(corners[1], corners[0]), minus(corners[2], corners[0])))
    found = {"across": dot(minus(tip, corners[0]), normal)}
    for name, j, k in (("blade", 0, 1), ("seam", 1, 2), ("thread", 2, 0)):
        along = unit(minus(corners[k], corners[j]))
        found[name] = dot(normal, cross(along, minus(tip, corners[j])))
    return found


def gap(p: Inputs, phi: Any) -> Any:
    """Least distance of needle and blade: places along the needle, ever closer, against the nearest of the blade."""
    g, n = guided(p, phi)
    tip, back = (carried(p, "looper", name, phi) for name in ("tip", "back"))
    d = minus(back, tip)
    middle, width = 0.5 + 0.0 * phi, 0.5
    for _ in range(6):
        s = np.clip(middle[:, None] + width * np.linspace(-1.0, 1.0, 41), 0.0, 1.0)
        away = [x[..., None] + s * p["needle.point"] * y - z[..., None] for x, y, z in zip(g, n, tip, strict=True)]
        t = np.clip(sum(a * b[..., None] for a, b in zip(away, d, strict=True)) / dot(d, d)[..., None], 0.0, 1.0)
        far = np.sqrt(sum((a - t * b[..., None]) ** 2 for a, b in zip(away, d, strict=True)))
        best = far.argmin(axis=1)
        middle, width = s[np.arange(len(best)), best], width / 15.0
    return far.min(axis=1) - p["needle.diameter"] / 2


def extremes(curve: Callable[[Any], Any]) -> Any:
    """Crank angles of all extremes of a curve: those of a dense turn, looked at ever closer."""
    step = TURN / SAMPLES
    x = curve(step * np.arange(SAMPLES))
    turns = (x - np.roll(x, 1)) * (x - np.roll(x, -1)) > 0
    phi = step * np.flatnonzero(turns)
    sign = np.where(x > np.roll(x, 1), 1.0, -1.0)[turns]
    for _ in range(16):
        grid = phi[:, None] + step * np.linspace(-1.0, 1.0, 17).astype(REAL)
        values = curve(grid.ravel()).reshape(grid.shape) * sign[:, None]
        phi, step = grid[np.arange(phi.size), values.argmax(axis=1)], step / 6
    return phi


def roots(curve: Callable[[Any], Any]) -> Any:
    """Crank angles of all zeros: changes of sign among dense samples and extremes, halved until they stand."""
    phi = np.sort(np.concatenate([TURN * np.arange(SAMPLES) / SAMPLES, np.mod(extremes(curve), TURN)]))
    x = curve(phi)
    k = np.flatnonzero(x * np.roll(x, -1) < 0)
    left, right = phi[k], np.append(phi, phi[0] + TURN)[k + 1]
    low = np.sign(x[k])
    for _ in range(70):
        middle = (left + right) / 2
        same = np.sign(curve(middle)) == low
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return np.mod(left, TURN)


def slope(curve: Callable[[Any], Any], phi: Any) -> Any:
    """Derivative by the crank angle."""
    h = REAL(1e-5)
    return (8 * (curve(phi + h) - curve(phi - h)) - curve(phi + 2 * h) + curve(phi - 2 * h)) / (12 * h)


def conditions(read: Callable[[Inputs, Any], dict[str, Any]], p: Inputs, phi: Any) -> dict[str, Any]:
    """Of the root of ``across`` near one angle, and of what is read there, the sum of |x dy/dx| over all inputs."""
    at = np.array([phi], dtype=REAL)
    names = list(read(p, at))
    rates = {name: slope(lambda x, n=name: read(p, x)[n], at)[0] for name in names}
    sums = dict.fromkeys(["phi", *names], REAL(0))
    for key, value in p.items():
        if value == 0 or "branch" in key or "kappa" in key or "sense" in key or "ratio" in key:
            continue
        h = REAL(1e-6) * value
        up, down = (read(p | {key: value + k * h}, at) for k in (1, -1))
        by = {name: (up[name][0] - down[name][0]) / (2 * h) * value for name in names}
        move = -by["across"] / rates["across"]
        sums["phi"] += abs(move)
        for name in names:
            sums[name] += abs(by[name] + rates[name] * move)
    return sums
