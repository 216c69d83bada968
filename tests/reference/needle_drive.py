"""Many crank-rockers driving guided four-bars, by intersecting circles on a grid; imports nothing of the project."""

from __future__ import annotations

import numpy as np

ANGLES = 360


def motion(design: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Swing, stroke, largest deviation and pressure angles, box of the coupler point, of designs (n,), each (n,).

    nan where the links do not reach somewhere in the turn.
    """
    p = {name: np.asarray(value, np.float64)[:, None] for name, value in design.items()}
    phi = np.arange(ANGLES) * (2.0 * np.pi / ANGLES)
    with np.errstate(invalid="ignore"):
        psi, first = _rocker(p, phi)
        turned = p["kappa2"] * psi + p["offset2"]
        s, dev, x, y, second = _guided(p, turned)
        return {
            "swing1": np.ptp(np.unwrap(psi, axis=1), axis=1),
            "stroke": np.ptp(s, axis=1),
            "max_abs_dev": np.abs(dev).max(axis=1),
            "max_pressure_angle1": np.arccos(np.abs(first).min(axis=1)),
            "max_pressure_angle2": np.arccos(np.abs(second).min(axis=1)),
            "max_x_m2": x.max(axis=1), "min_x_m2": x.min(axis=1), "max_y_m2": y.max(axis=1), "min_y_m2": y.min(axis=1),
        }  # fmt: skip


def _rocker(p: dict[str, np.ndarray], phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle of the rocker and cosine of the pressure angle; its circle cuts the sphere about the crank pin."""
    x = p["a1"] * np.cos(phi)
    y = p["f1"] * np.sin(p["alpha1"]) + p["a1"] * np.cos(p["alpha1"]) * np.sin(phi)
    z = p["f1"] * np.cos(p["alpha1"]) - p["a1"] * np.sin(p["alpha1"]) * np.sin(phi)
    reach = p["b1"] ** 2 - (z - p["g1"]) ** 2
    dx, dy = x - p["e1"], y
    distance = np.hypot(dx, dy)
    opening = np.arccos((distance**2 + p["c1"] ** 2 - reach) / (2.0 * distance * p["c1"]))
    ends = []
    for side in (1.0, -1.0):
        psi = np.arctan2(dy, dx) + side * opening
        tangent = -(p["c1"] * np.cos(psi) - dx) * np.sin(psi) + (p["c1"] * np.sin(psi) - dy) * np.cos(psi)
        ends.append((psi, tangent))
    own = np.sign(ends[0][1]) == p["branch1"]
    psi, tangent = (np.where(own, one, other) for one, other in zip(*ends, strict=True))
    return psi, tangent / p["b1"]


def _guided(p: dict[str, np.ndarray], phi: np.ndarray) -> tuple[np.ndarray, ...]:
    """Coupler point along and across the line, its coordinates, and cosine of the pressure angle."""
    pin = p["a2"] * np.exp(1j * phi)
    to = p["e2"] - pin
    distance = np.abs(to)
    along = (distance**2 + p["b2"] ** 2 - p["c2"] ** 2) / (2.0 * distance)
    across = np.sqrt(p["b2"] ** 2 - along**2)
    ends = []
    for side in (1.0, -1.0):
        joint = pin + (along + 1j * side * across) * to / distance
        arm, rocker = joint - pin, joint - p["e2"]
        ends.append((joint, (arm * np.conj(1j * rocker)).real / (p["b2"] * p["c2"])))
    own = np.sign(ends[0][1]) == p["branch2"]
    joint, cosine = (np.where(own, one, other) for one, other in zip(*ends, strict=True))
    point = pin + (p["xi2"] + 1j * p["eta2"]) * (joint - pin) / p["b2"]
    line = point * np.exp(-1j * p["lam2"])
    return line.real, line.imag - p["h2"], point.real, point.imag, cosine


def share_within(
    design: dict[str, float],
    limits: dict[str, tuple[float, float]],
    lengths: float,
    angles: float,
    count: int,
    seed: int,
) -> float:
    """Share of mechanisms that keep all limits; every dimension normal, the tolerance three standard deviations."""
    rng = np.random.default_rng(seed)
    spread = dict.fromkeys(("alpha1", "lam2", "offset2"), angles)
    spread |= {name: 0.0 for name in design if name.startswith(("branch", "kappa"))}
    good = 0
    for first in range(0, count, 1000):
        n = min(1000, count - first)
        made = {name: x + rng.normal(0.0, 1.0, n) * spread.get(name, lengths) / 3.0 for name, x in design.items()}
        found = motion(made)
        keeps = np.ones(n, dtype=np.bool_)
        for name, (low, high) in limits.items():
            keeps &= (found[name] >= low) & (found[name] <= high)
        good += int(keeps.sum())
    return good / count
