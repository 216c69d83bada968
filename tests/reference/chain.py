"""Mechanisms in series by nesting position functions, 50 digits, derivatives by numerical differentiation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpmath import mp


def rocker_angle(design: tuple[Any, ...], phi: Any) -> Any:
    """Spatial crank-rocker: the rocker's circle about its axis cuts the sphere of radius b about the crank pin."""
    a, b, c, e, f, g, alpha, branch = design
    x = a * mp.cos(phi)
    y = f * mp.sin(alpha) + a * mp.cos(alpha) * mp.sin(phi)
    z = f * mp.cos(alpha) - a * mp.sin(alpha) * mp.sin(phi)
    reach = mp.sqrt(b**2 - (z - g) ** 2)  # in the rocker's plane
    dx, dy = x - e, y
    distance = mp.sqrt(dx**2 + dy**2)
    opening = mp.acos((distance**2 + c**2 - reach**2) / (2 * distance * c))
    for side in (1, -1):
        psi = mp.atan2(dy, dx) + side * opening
        if mp.sign(-(c * mp.cos(psi) - dx) * mp.sin(psi) + (c * mp.sin(psi) - dy) * mp.cos(psi)) == branch:
            return psi
    raise ValueError("both points coincide")


def series(stages: list[Callable[[Any], Any]], couplings: list[tuple[float, float]]) -> Callable[[Any], Any]:
    """phi -> output of the last stage; ``couplings`` are (kappa, offset) before stages 2, 3 ..."""

    def output(phi: Any) -> Any:
        value = stages[0](phi)
        for stage, (kappa, offset) in zip(stages[1:], couplings, strict=True):
            value = stage(mp.mpf(kappa) * value + mp.mpf(offset))
        return value

    return output


def derivative(function: Callable[[Any], Any], phi: float, order: int) -> Any:
    """The derivative of that order at phi."""
    with mp.workdps(50):
        return mp.diff(function, mp.mpf(phi), order)
