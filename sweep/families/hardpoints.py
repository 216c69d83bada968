"""Fit of crank-rockers and slider-cranks to points of a drawing; frames as in docs/frames.md.

Points are in one length unit in the drawing's frame; directions have length 1.  The steps are the same for all
families: common perpendicular, frame, offsets along the axes, links, angles, sign of the assembly mode.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kernels.types import Array
from sweep.errors import InputError
from sweep.families.capabilities import FittedPose, Hardpoints

PARALLEL = 1e-9  # sine of the angle below which two directions count as parallel
NOTHING = 1e-12  # share of a drawing's size that counts as rounding of its coordinates
PLACE = "points"


def crank_rocker(points: Mapping[str, Array]) -> FittedPose:
    """Compute the dimensions of a spatial crank-rocker from A, axis_A, B, C, D, axis_D."""
    a, b, c, d, u, z = (points[name] for name in ("A", "B", "C", "D", "axis_A", "axis_D"))
    small = NOTHING * size(points)
    x, e, crossed = _common_perpendicular(d - a, u, z, small)
    y = np.cross(z, x)
    if crossed:
        sin, cos = float(np.cross(u, z) @ x), float(u @ z)
        f = -float((d - a) @ y) / sin
    else:
        sin, cos, f = 0.0, math.copysign(1.0, float(u @ z)), 0.0
    crank, rocker, coupler = b - a, c - d, c - b
    phi = math.atan2(float(crank @ np.cross(u, x)), float(crank @ x))
    psi = math.atan2(float(rocker @ y), float(rocker @ x))
    lengths = {
        "a": _length(crank - (crank @ u) * u, small, "B", "a point off the crank axis"),
        "b": _length(coupler, small, "C", "another point than B"),
        "c": _length(rocker - (rocker @ z) * z, small, "C", "a point off the rocker axis"),
    }
    branch = _sign(float(coupler @ (np.cos(psi) * y - np.sin(psi) * x)), small)
    offsets = {"e": e, "f": f, "g": float((d - a) @ z) + f * cos, "alpha": math.atan2(sin, cos), "branch": branch}
    return FittedPose(lengths | offsets, phi, a - f * u, z, x)


def slider_crank(points: Mapping[str, Array]) -> FittedPose:
    """Compute the dimensions of a spatial slider-crank from A, axis_A, B, C, axis_D and optionally D on the line."""
    a, b, c, u, y = (points[name] for name in ("A", "B", "C", "axis_A", "axis_D"))
    d = points.get("D", c)
    small = NOTHING * size(points)
    x, e, crossed = _common_perpendicular(d - a, u, y, small)
    z = np.cross(x, y)
    f = -float((d - a) @ z) / float(u @ z) if crossed else 0.0
    crank, coupler = b - a, c - b
    lengths = {
        "a": _length(crank - (crank @ u) * u, small, "B", "a point off the crank axis"),
        "b": _length(coupler, small, "C", "another point than B"),
    }
    alpha = math.atan2(float(u @ y), float(u @ z) if crossed else 0.0)
    offsets = {"e": e, "f": f, "alpha": alpha}
    phi = math.atan2(float(crank @ np.cross(u, x)), float(crank @ x))
    return FittedPose(lengths | offsets | {"branch": _sign(float(coupler @ y), small)}, phi, a - f * u, z, x)


def four_bar(points: Mapping[str, Array]) -> FittedPose:
    """Compute the dimensions of a planar four-bar from A, B, C, D, optionally axis_A (else z) and coupler point M."""
    return _planar(points, points.get("M"))


def guide(points: Mapping[str, Array]) -> FittedPose:
    """Compute the dimensions of a :func:`four_bar` with the coupler ``point``, ``axis_line`` and a point ``line``.

    Without ``line`` the guiding line runs through the coupler point, whose deviation is then 0 in this position.
    """
    found = _planar(points, points["point"])
    y = np.cross(found.z, found.x)
    along = points["axis_line"]
    lam = math.atan2(float(along @ y), float(along @ found.x))
    left = np.cos(lam) * y - np.sin(lam) * found.x
    h = float((points.get("line", points["point"]) - found.at) @ left)
    return replace(found, parameters=found.parameters | {"lam": lam, "h": h})


def planar_slider_crank(points: Mapping[str, Array]) -> FittedPose:
    """Compute the dimensions of a planar slider-crank from A, B, C, axis_D, optionally D and axis_A (else z)."""
    a, b, c = (points[name] for name in ("A", "B", "C"))
    z, small = points.get("axis_A", np.array([0.0, 0.0, 1.0])), NOTHING * size(points)
    x = points["axis_D"] - (points["axis_D"] @ z) * z
    if np.linalg.norm(x) < PARALLEL:
        raise InputError("axis_D", points["axis_D"].tolist(), "a direction that is not along axis_A", PLACE)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    crank, rod = b - a, c - b
    parameters = {
        "a": _length(crank, small, "B", "another point than A"),
        "b": _length(rod, small, "C", "another point than B"),
        "e": float((points.get("D", c) - a) @ y),
        "branch": _sign(float(rod @ x), small),
    }
    return FittedPose(parameters, math.atan2(float(crank @ y), float(crank @ x)), a, z, x)


def _planar(points: Mapping[str, Array], point: Array | None) -> FittedPose:
    """Compute a crank-rocker with parallel axes, and a point of its coupler if one is given."""
    b, c, z = points["B"], points["C"], points.get("axis_A", np.array([0.0, 0.0, 1.0]))
    found = crank_rocker({**points, "axis_A": z, "axis_D": z})
    parameters = {name: found.parameters[name] for name in ("a", "b", "c", "e", "branch")}
    if point is not None:
        along = (c - b) / parameters["b"]
        parameters |= {"xi": float((point - b) @ along), "eta": float((point - b) @ np.cross(z, along))}
    return replace(found, parameters=parameters)


def size(points: Mapping[str, Array]) -> float:
    """Largest extent of the points."""
    places = np.array([point for name, point in points.items() if not name.startswith("axis_")])
    return float(np.ptp(places, axis=0).max())


def _common_perpendicular(way: Array, first: Array, second: Array, small: float) -> tuple[Array, float, bool]:
    """Direction and length of the common perpendicular of two axes, and whether they are not parallel.

    ``way`` is a vector from a point of the first axis to one of the second.
    """
    across = np.cross(second, first)
    sine = float(np.linalg.norm(across))
    crossed = sine > PARALLEL
    x = across / sine if crossed else _square(way, second, small)
    x = -x if float(way @ x) < -small else x
    length = float(way @ x)
    return x, 0.0 if abs(length) <= small else length, crossed


def _square(vector: Array, axis: Array, small: float) -> Array:
    """Direction of the component of a vector perpendicular to an axis."""
    rest = vector - (vector @ axis) * axis
    length = float(np.linalg.norm(rest))
    if length <= small:
        raise InputError("D", "on the axis through A", "an axis beside it: axes on one line make no linkage", PLACE)
    return rest / length


def _length(vector: Array, small: float, name: str, allowed: str) -> float:
    length = float(np.linalg.norm(vector))
    if length <= small:
        raise InputError(name, f"a link of length {length:.3g}", allowed, PLACE)
    return length


def _sign(value: float, small: float) -> float:
    """Return the assembly mode by the sign of the coupler along the follower's way, unless that is small."""
    if abs(value) <= small:
        allowed = "points of another position: in this one, a dead point, both assembly modes meet"
        raise InputError("C", "coupler and follower are square", allowed, PLACE)
    return math.copysign(1.0, value)


_SPATIAL = ("A", "axis_A", "B", "C")
CRANK_ROCKER_POINTS = Hardpoints((*_SPATIAL, "D", "axis_D"), (), crank_rocker)
SLIDER_CRANK_POINTS = Hardpoints((*_SPATIAL, "axis_D"), ("D",), slider_crank)
FOUR_BAR_POINTS = Hardpoints(("A", "B", "C", "D"), ("axis_A", "M"), four_bar)
GUIDE_POINTS = Hardpoints(("A", "B", "C", "D", "point", "axis_line"), ("axis_A", "line"), guide)
PLANAR_SLIDER_POINTS = Hardpoints(("A", "B", "C", "axis_D"), ("axis_A", "D"), planar_slider_crank)
