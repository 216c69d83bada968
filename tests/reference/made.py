"""What manufacture makes of a needle drive, in plain numpy: positions over a dense grid, normal tolerances, no search.

Crank-rockers by the circle of the rocker ball and the sphere of the coupler, the coupler point by complex numbers.
Largest and smallest values are those of the grid: with 720 poses, off by (pi/720)^2/2 of a curve's second derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

POSES = 720
BLOCK = 2000
Columns = Mapping[str, Any]


def normal(design: Mapping[str, float], lengths: set[str], angles: set[str], off: tuple[float, float], n: int) -> Any:
    """``n`` designs about one, by column; +-``off`` of lengths and angles are three standard deviations."""
    rng = np.random.default_rng(20260)
    width = dict.fromkeys(lengths, off[0]) | dict.fromkeys(angles, off[1])
    return {name: x + rng.normal(0.0, width.get(name, 0.0) / 3.0, n) for name, x in design.items()}


def outputs(made: Columns) -> dict[str, Any]:
    """Swing, stroke, pressure angles, deviation and places of the coupler point of every mechanism, (n,) each.

    nan where it does not turn fully.
    """
    n = len(made["a1"])
    parts = [_block({k: x[i : i + BLOCK, None] for k, x in made.items()}) for i in range(0, n, BLOCK)]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def rocker(a: Any, b: Any, c: Any, e: Any, f: Any, g: Any, alpha: Any, branch: Any, phi: Any) -> tuple[Any, Any]:
    """Rocker angle and pressure angle; nan where the links do not reach."""
    x = a * np.cos(phi)
    y = f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    z = f * np.cos(alpha) - a * np.sin(alpha) * np.sin(phi)
    dx, dy = x - e, y
    far = np.hypot(dx, dy)
    opening = np.arccos((far**2 + c**2 - (b**2 - (z - g) ** 2)) / (2.0 * far * c))
    found, pressure = np.full(far.shape, np.nan), np.full(far.shape, np.nan)
    for side in (1.0, -1.0):
        psi = np.arctan2(dy, dx) + side * opening
        along = -(c * np.cos(psi) - dx) * np.sin(psi) + (c * np.sin(psi) - dy) * np.cos(psi)
        mine = np.sign(along) == branch
        found, pressure = np.where(mine, psi, found), np.where(mine, np.arccos(np.abs(along) / b), pressure)
    return found, pressure


def _block(made: Columns) -> dict[str, Any]:
    phi = 2.0 * np.pi * np.arange(POSES)[None, :] / POSES
    with np.errstate(invalid="ignore"):
        first = (made[f"{k}1"] for k in ("a", "b", "c", "e", "f", "g", "alpha", "branch"))
        psi, pressure1 = rocker(*first, phi)
        psi = np.unwrap(psi, axis=1)
        turned = made["kappa2"] * psi + made["offset2"]
        a, b, c, e, branch = (made[f"{k}2"] for k in ("a", "b", "c", "e", "branch"))
        psi2, pressure2 = rocker(a, b, c, e, 0.0 * a, 0.0 * a, 0.0 * a, branch, turned)
        pin, end = a * np.exp(1j * turned), e + c * np.exp(1j * psi2)
        point = pin + (made["xi2"] + 1j * made["eta2"]) / b * (end - pin)
        line = point * np.exp(-1j * made["lam2"])
        dev = line.imag - made["h2"]
    ends = {"x_m2": point.real, "y_m2": point.imag}
    return {
        "swing1": np.ptp(psi, axis=1),
        "stroke": np.ptp(line.real, axis=1),
        "max_pressure_angle1": pressure1.max(axis=1),
        "max_pressure_angle2": pressure2.max(axis=1),
        "max_abs_dev": np.abs(dev).max(axis=1),
        "least_link2": np.min([made[f"{k}2"][:, 0] for k in "abc"], axis=0),
        "arm_ratio2": np.maximum(
            np.hypot(made["xi2"], made["eta2"]), np.hypot(made["xi2"] - b, made["eta2"])
        )[:, 0] / b[:, 0],
        **{f"max_{name}": x.max(axis=1) for name, x in ends.items()},
        **{f"min_{name}": x.min(axis=1) for name, x in ends.items()},
    }  # fmt: skip
