"""``from_points``: the mechanism that stands on given points of a drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.errors import InputError, nearest
from sweep.evaluation.joints import parts
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.base import Array, Family
from sweep.families.capabilities import Hardpoints, Reading
from sweep.families.hardpoints import size
from sweep.families.placing import Place, vector

TOLERANCE = 1e-4  # part of the drawing's size: coordinates given to 0.01 mm in a drawing of 100 mm


@dataclass(frozen=True)
class PlacedDesign:
    """A mechanism read off a drawing.

    Parameters
    ----------
    family : its name
    parameters : its design, ``branch`` included, in the unit of the points and rad
    phi : crank angle of the drawn position [rad], in (-pi, pi]
    place : where the family's frame stands in the drawing; ``member(place)`` of a machine takes it as it is
    residual : largest distance between a given point and the mechanism's joint of that name [unit of the points]
    """

    family: str
    parameters: dict[str, float]
    phi: float
    place: Place
    residual: float

    @property
    def branch(self) -> float:
        """The assembly mode, +1 or -1."""
        return self.parameters["branch"]


def from_points(family: str, *, tolerance: float = TOLERANCE, **points: Sequence[float] | Array) -> PlacedDesign:
    """Return the mechanism whose joints stand on given points of a drawing, in one position.

    Parameters
    ----------
    family : "rssr" (A, axis_A, B, C, D, axis_D), "rssp" (A, axis_A, B, C, axis_D and, if wanted, D), "four_bar"
        (A, B, C, D; if wanted axis_A, M), "guide" (A, B, C, D, point, axis_line; if wanted axis_A, line),
        "slider_crank" (A, B, C, axis_D; if wanted axis_A, D)
    tolerance : largest residual, as a part of the size of the drawing
    points : [x, y, z] by name.  A is the centre of the crank circle and ``axis_A`` the crank axis, about which the
        crank turns right-handed; B the crank pin; C the rocker ball or slider; D the centre of the rocker's circle and
        ``axis_D`` its axis, or a point of the slide line and its direction.  A direction may have any length.  Planar
        families take ``axis_A`` as the normal of their plane, z where it is left out

    Returns
    -------
    PlacedDesign
        parameters, crank angle, place of the family's frame (docs/frames.md) and residual.  e is not negative; where
        the axes intersect alpha is in (-pi, 0), where they are parallel f is 0

    Raises
    ------
    InputError
        for a point that is missing, unknown or no three numbers; for points that make no such mechanism, because a link
        has no length, both axes are one line, the position is a dead point, or a point lies off its place by more than
        the tolerance.

    Examples
    --------
    >>> found = from_points("rssr", A=[0, 0, 0], axis_A=[1, 0, 0], B=[0, 0, 200], C=[-750, -850, 650],
    ...                     D=[-400, -850, 0], axis_D=[0, 1, 0])
    >>> round(found.parameters["b"], 6), found.branch
    (1219.631092, -1.0)
    """
    found, reader = find_family(family), reader_of(family)
    given = _checked(reader, points)
    extent = size(given)
    if not extent > 0.0:
        raise InputError("points", "all one point", "points that are apart", "points")
    reading = reader.fit(given)
    joints = _joints(found, reading, given)
    off = {name: float(np.linalg.norm(given[name] - at)) for name, at in joints.items()}
    for name, distance in off.items():  # the first one off is named: it puts those behind it off as well
        if not distance <= tolerance * extent:
            allowed = f"within {tolerance * extent:.3g} of the joint, which would stand at {_words(joints[name])}"
            raise InputError(name, _words(given[name]), allowed, f"points of a {found.title}, {distance:.3g} off")
    x, y, z = reading.at.tolist()
    place = Place((x, y, z), _triple(reading.z), _triple(reading.x))
    return PlacedDesign(found.name, reading.parameters, reading.phi, place, max(off.values()))


def reader_of(family: str) -> Hardpoints:
    """Return what reads the points of a family.

    Raises
    ------
    InputError
        for a family whose dimensions are not read off points.
    """
    found = find_family(family)
    reader = found.find(Hardpoints)
    if reader is None:
        known = [name for name in NAMES if find_family(name).find(Hardpoints) is not None]
        raise InputError("family", found.name, f"one of {', '.join(known)}", "points")
    return reader


def _checked(reader: Hardpoints, points: Mapping[str, Sequence[float] | Array]) -> dict[str, Array]:
    known = (*reader.needs, *reader.may)
    for name in points:
        if name not in known:
            raise InputError("point", name, f"{', '.join(known)}{nearest(name, known)}", "points")
    given = {}
    for name in known:
        if name not in points:
            if name in reader.needs:
                raise InputError(name, "missing", f"[x, y, z]; needed are {', '.join(reader.needs)}", "points")
            continue
        at = np.array(vector(points[name], name))
        if name.startswith("axis_"):
            length = float(np.linalg.norm(at))
            if not length > 0.0:
                raise InputError(name, at.tolist(), "a direction, not all zeros", "points")
            at = at / length
        given[name] = at
    return given


def _joints(family: Family, reading: Reading, given: Mapping[str, Array]) -> dict[str, Array]:
    """Return the places, in the drawing's frame, of the joints that have a given point."""
    (part,) = parts(family, reading.parameters, reading.phi)
    z, x = reading.z, reading.x
    turn = np.column_stack([x, np.cross(z, x), z])
    found = {}
    for name, point in given.items():
        joint = name if name in part.joints else name.lower()
        if joint in part.joints:
            at = turn @ part.joints[joint][0] + reading.at
            if part.kinds.get(joint) == "slide":  # any point of the line gives it
                along = turn @ part.axes[joint]
                at = at + float((point - at) @ along) * along
            found[name] = at
    return found


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _words(point: Array) -> str:
    return "[" + ", ".join(f"{x:.6g}" for x in point) + "]"
