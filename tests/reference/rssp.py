"""Spatial slider-crank from joint positions, 50 digits: slow, obvious, imports nothing from kernels or sweep."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def joints(a: Any, b: Any, e: Any, f: Any, alpha: Any, branch: Any, phi: Any) -> tuple[list[Any], list[Any]]:
    """Crank pin B and slider ball C; C lies on the line x = e, z = 0 at the distance b from B."""
    u = [mp.mpf(0), mp.sin(alpha), mp.cos(alpha)]  # crank axis
    across = [mp.mpf(0), mp.cos(alpha), -mp.sin(alpha)]
    along_x = [mp.mpf(1), mp.mpf(0), mp.mpf(0)]
    crank_pin = [f * u[k] + a * (mp.cos(phi) * along_x[k] + mp.sin(phi) * across[k]) for k in range(3)]
    half_chord = mp.sqrt(b**2 - (e - crank_pin[0]) ** 2 - crank_pin[2] ** 2)
    return crank_pin, [mp.mpf(e), crank_pin[1] + branch * half_chord, mp.mpf(0)]


def outputs(design: tuple[float, ...], phi: float) -> dict[str, Any]:
    """Displacement, its derivatives by numerical differentiation, and the angle between coupler and slide line."""
    with mp.workdps(50):
        numbers = [mp.mpf(x) for x in design]
        b_pin, c_ball = joints(*numbers, mp.mpf(phi))
        result = {"s": c_ball[1]}
        for order, name in ((1, "ds"), (2, "d2s"), (3, "d3s")):
            result[name] = mp.diff(lambda x: joints(*numbers, x)[1][1], mp.mpf(phi), order)
        result["pressure_angle"] = mp.acos(abs(c_ball[1] - b_pin[1]) / numbers[1])
        return result
