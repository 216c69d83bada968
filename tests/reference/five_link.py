"""Five-link by its joints: a scan of the rocker angle, then 50 digits; imports nothing of the project."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp

CELLS = 4000


def pin_and_axes(design: tuple[Any, ...], phi: Any, lib: Any) -> tuple[Any, Any]:
    """Crank pin B and direction u of the crank axis."""
    a, f, alpha = design[0], design[4], design[6]
    u = (0, lib.sin(alpha), lib.cos(alpha))
    across = (0, lib.cos(alpha), -lib.sin(alpha))
    b = [f * u[k] + a * (lib.cos(phi) * (k == 0) + lib.sin(phi) * across[k]) for k in range(3)]
    return b, u


def gap(design: tuple[Any, ...], phi: Any, psi: Any, lib: Any) -> Any:
    """Squared length from axis 1 to the ball as the rocker has it, less what the joint makes it.

    The ball is at z along the crank axis from the pin; the coupler then has rho = sqrt(b^2 - z^2) across it, and
    h + rho and s2 are at right angles.
    """
    b, c, e, g, h, s2 = (design[k] for k in (1, 2, 3, 5, 7, 8))
    pin, u = pin_and_axes(design, phi, lib)
    d = [e + c * lib.cos(psi) - pin[0], c * lib.sin(psi) - pin[1], g - pin[2]]
    z = sum(d[k] * u[k] for k in range(3))
    square = sum((d[k] - z * u[k]) ** 2 for k in range(3))
    return square - (h + lib.sqrt(b**2 - z**2)) ** 2 - s2**2


def roots(design: tuple[float, ...], phi: float) -> list[float]:
    """Rocker angles that close the loop, by signs on a fine grid; two nearer than a cell, or to an end, are missed."""
    psi = np.linspace(-np.pi, np.pi, CELLS + 1)
    with np.errstate(invalid="ignore"):
        values = gap(design, phi, psi, np)
    cells = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    with mp.workdps(30):
        return [
            float(mp.findroot(lambda x: gap(design, phi, x, mp), (psi[k], psi[k + 1]), solver="illinois", tol=1e-45))
            for k in cells
        ]


def modes(design: tuple[float, ...], phi: float) -> dict[tuple[float, float], float]:
    """Rocker angle of each (branch, mode): of equal slope of the gap the largest branch (C - B) . k' comes first."""
    found: dict[float, list[tuple[float, float]]] = {1.0: [], -1.0: []}
    pin, _ = pin_and_axes(design, phi, np)
    for psi in roots(design, phi):
        step = 1e-6
        slope = gap(design, phi, psi + step, np) - gap(design, phi, psi - step, np)
        branch = 1.0 if slope > 0.0 else -1.0
        x, y = design[3] + design[2] * np.cos(psi) - pin[0], design[2] * np.sin(psi) - pin[1]
        found[branch].append((float(-branch * (y * np.cos(psi) - x * np.sin(psi))), psi))
    return {(b, float(k)): psi for b, some in found.items() for k, (_, psi) in enumerate(sorted(some), start=1)}


def outputs(design: tuple[float, ...], phi: float, near: float) -> dict[str, Any]:
    """Rocker angle next to ``near`` and its derivatives with respect to phi by numerical differentiation."""
    with mp.workdps(60):
        numbers = tuple(mp.mpf(x) for x in design)

        def psi(angle: Any) -> Any:
            return mp.findroot(lambda x: gap(numbers, angle, x, mp), mp.mpf(near), tol=1e-100)

        names = ("psi", "dpsi", "d2psi", "d3psi")
        return {name: mp.diff(psi, mp.mpf(phi), k, h=mp.mpf(10) ** -12) for k, name in enumerate(names)}


def pressure_angle(design: tuple[float, ...], phi: float, psi: float) -> float:
    """Angle between the rocker ball's velocity and the force that both revolutes let through.

    A force through C has no moment about an axis if it meets it: it lies in the plane of C and axis 1, and in that of C
    and axis 2, so along the line the two planes share.
    """
    b, c, e, g, h, s2 = (design[k] for k in (1, 2, 3, 5, 7, 8))
    pin, u = (np.array(x) for x in pin_and_axes(design, phi, np))
    d = np.array([e + c * np.cos(psi), c * np.sin(psi), g]) - pin
    z = d @ u
    radial, rho = d - z * u, np.sqrt(b**2 - z**2)
    # radial = (h + rho) m + s2 t with t = u x m
    m = ((h + rho) * radial - s2 * np.cross(u, radial)) / ((h + rho) ** 2 + s2**2)
    t = np.cross(u, m)
    on_axis_2 = h * m + s2 * t
    force = np.cross(np.cross(d, u), np.cross(d - on_axis_2, t))
    force /= np.linalg.norm(force)
    moving = np.array([-np.sin(psi), np.cos(psi), 0.0])
    return float(np.arctan2(np.linalg.norm(np.cross(force, moving)), abs(force @ moving)))
