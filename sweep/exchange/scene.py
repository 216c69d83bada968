"""Scene of every export: joints over one whole turn, with different frames side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.joints import Part, parts
from sweep.evaluation.statuses import meaning
from sweep.evaluation.tables import Table, design_matrix
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Array, Interval, March
from sweep.families.poses import equal_steps
from sweep.numerics.records import Mask

STEPS = 720  # steps of a march from which one pose is taken
GAP = 0.25  # gap between two frames side by side, relative to the larger one


def turn(mechanism: Mechanism, design: Table, phi: float, poses: int) -> list[Part]:
    """Return all parts over one turn as in :func:`over`, each with its place in the scene.

    Raises
    ------
    InputError
        if a pose does not exist.
    """
    stages = over(mechanism, design, phi, poses)
    domain = find_family(mechanism).domain
    for part in stages:
        if not part.links:
            allowed = "a mechanism whose links are known: see docs/frames.md"
            raise InputError("mechanism", part.family.name, allowed, "export")
        bad = np.flatnonzero([not np.isfinite(path).all(axis=1).all() for path in part.joints.values()])
        if bad.size:
            pose = int(np.argmax(part.status != 0))
            value = f"{meaning(int(part.status[pose]))} at {domain.name} = {part.phi[pose]:.6g}"
            kind = "that exists over the whole interval" if isinstance(domain, Interval) else "whose crank turns fully"
            raise InputError(part.label, value, f"a design {kind}", "export")
    return side_by_side(stages)


def over(mechanism: Mechanism, design: Table, phi: float, poses: int) -> list[Part]:
    """Return all parts over one turn from ``phi`` on, the last pose equal to the first.

    An interval is traversed to its end, back to its beginning and to ``phi`` again, which is replaced by its beginning
    if it lies outside.  A march begins at 0.
    """
    family = find_family(mechanism)
    if isinstance(family.domain, March):
        steps = equal_steps(family.domain, np.empty((0, 0)), poses)
        closed, angles = [*range(poses), 0], np.append(steps, 2.0 * math.pi)
        return [_taken(part, closed, angles) for part in parts(mechanism, design, steps)]
    if isinstance(family.domain, Interval):
        matrix, _ = design_matrix(family, design)
        return parts(mechanism, design, _there_and_back(equal_steps(family.domain, matrix, 2), phi, poses))
    return parts(mechanism, design, phi + np.linspace(0.0, 2.0 * math.pi, poses + 1))


def _there_and_back(ends: Array, start: float, poses: int) -> Array:
    low, high = ends
    span = high - low
    run = (start - low if low < start < high else 0.0) + np.linspace(0.0, 2.0 * span, poses + 1)
    angles: Array = high - np.abs(np.mod(run, 2.0 * span) - span)
    return angles


def _taken(part: Part, rows: list[int], phi: Array) -> Part:
    """Return a part in some of its poses, at the angles ``phi``."""
    joints = {name: path[rows] for name, path in part.joints.items()}
    crank, position, status = part.crank[rows], part.position[rows], part.status[rows]
    return replace(part, phi=phi, joints=joints, crank=crank, position=position, status=status)


def finite(phi: float) -> float:
    """Return the angle of a drawn position.

    Raises
    ------
    InputError
        if it is not finite.
    """
    if not math.isfinite(phi):
        raise InputError("phi", phi, "a finite angle [rad]", "export")
    return phi


def pose(mechanism: Mechanism, design: Table, phi: float) -> list[Part]:
    """Return all parts in one position.

    Raises
    ------
    InputError
        for a march, whose poses depend on those before, if ``phi`` is not a multiple of half a degree.
    """
    domain = find_family(mechanism).domain
    if not isinstance(domain, March):
        return parts(mechanism, design, phi)
    steps = equal_steps(domain, np.empty((0, 0)), STEPS)
    k = round(phi / (2.0 * math.pi) * STEPS)
    if not (0 <= k < STEPS and abs(steps[k] - phi) < 1e-9):
        raise InputError("phi", phi, "a multiple of half a degree below a turn: a march has poses in steps", "export")
    return [_taken(part, [k], steps[[k]]) for part in parts(mechanism, design, steps)]


def side_by_side(stages: Sequence[Part]) -> list[Part]:
    """Place the parts of one frame together, and each further frame beside those before it, along x; same order."""
    shifts, right = {}, math.nan
    for frame, same in frames_of(stages).items():
        points = np.vstack([path for part in same for path in part.joints.values()])
        low, high = float(np.nanmin(points[:, 0])), float(np.nanmax(points[:, 0]))
        along = 0.0 if math.isnan(right) else right + GAP * extent(same) - low
        shifts[frame] = np.array([along, 0.0, 0.0])
        right = high + along
    return [replace(part, shift=shifts[part.frame]) for part in stages]


def extent(stages: Sequence[Part]) -> float:
    """Return the largest extent of all joints over the turn."""
    points = np.vstack([path for part in stages for path in part.joints.values()])
    return float(np.nanmax(np.nanmax(points, axis=0) - np.nanmin(points, axis=0)))


def shown_name(joint: str) -> str:
    """Return a joint's name as the docs write it: A, B, C1, but point and line."""
    return joint.upper() if len(joint) < 3 else joint


VIEWS = {"xy": (0, 1), "zy": (2, 1), "xz": (0, 2)}
ELEVATION, AZIMUTH = math.radians(24.0), math.radians(-55.0)


def first_pose(parts: Sequence[Part]) -> int:
    """Return the first pose in which every joint exists; 0 if there is none."""
    return int(np.argmax(_assembled(parts)))


def exists(parts: Sequence[Part]) -> bool:
    """Tell whether there are joints, and a pose in which all of them exist."""
    return any(part.joints for part in parts) and bool(_assembled(parts).any())


def _assembled(parts: Sequence[Part]) -> Mask:
    """Return the mask of poses in which every joint exists."""
    exists = [np.isfinite(path).all(axis=1) for part in parts for path in part.joints.values()]
    return np.asarray(np.logical_and.reduce(exists))


def projection(view: str) -> Array:
    """Return the (2, 3) matrix of a view: "xy", "zy", "xz" along an axis, "space" from a corner with z upwards."""
    if view in VIEWS:
        return np.eye(3)[list(VIEWS[view])]
    (se, ce), (sa, ca) = ((math.sin(x), math.cos(x)) for x in (ELEVATION, AZIMUTH))
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce]])


def is_spatial(parts: Sequence[Part]) -> bool:
    """Tell whether joints leave the plane z = 0, or an axis is not perpendicular to it."""
    points = np.vstack([path for part in parts for path in part.joints.values()])
    turned = [axis for part in parts for name, axis in part.axes.items() if part.kinds[name] == "axis"]
    lean = any(abs(axis[0]) + abs(axis[1]) > 1e-9 for axis in turned)
    return lean or float(np.nanmax(np.abs(points[:, 2]))) > 1e-9 * float(np.nanmax(np.abs(points)))


def frames_of(parts: Sequence[Part]) -> dict[str, list[Part]]:
    """Return the parts by their frame, in order."""
    return {frame: [part for part in parts if part.frame == frame] for frame in dict.fromkeys(p.frame for p in parts)}
