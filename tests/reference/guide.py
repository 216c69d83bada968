"""Planar four-bar with a guided coupler point by intersecting circles, 50 digits; imports nothing of the project."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def rocker_pin(b_x: Any, b_y: Any, b: Any, e: Any, c: Any, branch: Any) -> tuple[Any, Any]:
    """The common point C of the circles about B (radius b) and D = (e, 0) (radius c) on the given branch."""
    dx, dy = e - b_x, -b_y
    distance = mp.sqrt(dx**2 + dy**2)
    along = (distance**2 + b**2 - c**2) / (2 * distance)
    across = mp.sqrt(b**2 - along**2)
    for side in (1, -1):
        x = b_x + (along * dx - side * across * dy) / distance
        y = b_y + (along * dy + side * across * dx) / distance
        turning = -(x - b_x) * y + (y - b_y) * (x - e)  # (C - B) . c k'
        if mp.sign(turning) == branch:
            return x, y
    raise ValueError("both points of the circles coincide")


def coupler_point(design: tuple[Any, ...], phi: Any) -> tuple[Any, Any]:
    """Travel along the guiding line and deviation to its left."""
    a, b, c, e, xi, eta, lam, h, branch = design
    b_x, b_y = a * mp.cos(phi), a * mp.sin(phi)
    c_x, c_y = rocker_pin(b_x, b_y, b, e, c, branch)
    d_x, d_y = (c_x - b_x) / b, (c_y - b_y) / b
    x, y = b_x + xi * d_x - eta * d_y, b_y + xi * d_y + eta * d_x
    return x * mp.cos(lam) + y * mp.sin(lam), y * mp.cos(lam) - x * mp.sin(lam) - h


def outputs(design: tuple[float, ...], phi: float) -> dict[str, Any]:
    """Travel, deviation and their derivatives with respect to phi by numerical differentiation."""
    with mp.workdps(50):
        numbers = tuple(mp.mpf(x) for x in design)
        result = {}
        for index, names in ((0, ("s", "ds", "d2s", "d3s")), (1, ("dev", "ddev", "d2dev"))):
            for order, name in enumerate(names):
                result[name] = mp.diff(lambda x, k=index: coupler_point(numbers, x)[k], mp.mpf(phi), order)
        return result


def dev_slope(design: tuple[float, ...], phi: float, index: int) -> Any:
    """Partial derivative of the deviation with respect to one parameter of the design."""
    with mp.workdps(50):
        numbers = [mp.mpf(x) for x in design]

        def dev(value: Any) -> Any:
            return coupler_point((*numbers[:index], value, *numbers[index + 1 :]), mp.mpf(phi))[1]

        return mp.diff(dev, numbers[index])
