"""``from_points``: the mechanism whose joints have the given points of a drawing."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sweep.errors import InputError, MissingInput, choices
from sweep.evaluation.joints import parts
from sweep.evaluation.tables import numbers
from sweep.exchange.dxf import NAMED, UNITS, ezdxf_or_refuse
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.base import Array, Family
from sweep.families.capabilities import FittedPose, Hardpoints
from sweep.families.hardpoints import size
from sweep.families.parts import Placement, vector
from sweep.quantities.units import UnitFault, factor, heading_factor

if TYPE_CHECKING:
    import pandas as pd


TOLERANCE = 1e-4  # share of the drawing's size: coordinates given to 0.01 mm in a drawing of 100 mm


@dataclass(frozen=True)
class PlacedDesign:
    """A mechanism read from a drawing.

    Parameters
    ----------
    family : name of its family
    parameters : its design, ``branch`` included, in the unit of the points and rad
    phi : crank angle of the drawn position [rad], in (-pi, pi]
    place : position of the family's frame in the drawing, as ``member(place)`` of a machine takes it
    residual : largest distance between a given point and the mechanism's joint of that name [unit of the points]
    """

    family: str
    parameters: dict[str, float]
    phi: float
    place: Placement
    residual: float

    @property
    def branch(self) -> float:
        """Assembly mode, +1 or -1."""
        return self.parameters["branch"]


def from_points(family: str, *, tolerance: float = TOLERANCE, **points: Sequence[float] | Array) -> PlacedDesign:
    """Find the mechanism whose joints have given points of a drawing, in one position.

    Parameters
    ----------
    family : "rssr" (A, axis_A, B, C, D, axis_D), "rssp" (A, axis_A, B, C, axis_D and optionally D), "four_bar"
        (A, B, C, D; optionally axis_A, M), "guide" (A, B, C, D, point, axis_line; optionally axis_A, line),
        "slider_crank" (A, B, C, axis_D; optionally axis_A, D)
    tolerance : largest residual, as a share of the size of the drawing
    points : [x, y, z] by name.  A is the centre of the crank circle and ``axis_A`` the crank axis, about which the
        crank turns right-handed; B the crank pin; C the rocker ball or slider; D the centre of the rocker's circle and
        ``axis_D`` its axis, or a point of the slide line and its direction.  A direction may have any length.  Planar
        families take ``axis_A`` as the normal of their plane, z by default

    Returns
    -------
    PlacedDesign
        parameters, crank angle, place of the family's frame (docs/frames.md) and residual.  e is not negative; if
        the axes intersect alpha is in (-pi, 0), if they are parallel f is 0

    Raises
    ------
    InputError
        for a point that is missing, unknown or not three numbers; for points of no such mechanism, because a link
        has length zero, both axes are one line, the position is a dead point, or a point is farther from its place than
        the tolerance.

    Examples
    --------
    >>> import sweep
    >>> found = sweep.from_points("rssr", A=[0, 0, 0], axis_A=[1, 0, 0], B=[0, 0, 200], C=[-750, -850, 650],
    ...                           D=[-400, -850, 0], axis_D=[0, 1, 0])
    >>> round(found.parameters["b"], 6), found.branch
    (1219.631092, -1.0)
    """
    mechanism, reader = find_family(family), reader_of(family)
    coordinates = _checked(reader, points)
    extent = size(coordinates)
    if not extent > 0.0:
        raise InputError("points", "all one point", "points that are apart", "points")
    reading = reader.fit(coordinates)
    joints = _joints(mechanism, reading, coordinates)
    distances = {name: float(np.linalg.norm(coordinates[name] - at)) for name, at in joints.items()}
    # The first deviating point is named, since it displaces those after it as well.
    for name, distance in distances.items():
        if not distance <= tolerance * extent:
            allowed = f"a point at most {tolerance * extent:.3g} from {_words(joints[name])}"
            why = f", where the other points put it; it is {distance:.3g} off (tolerance = {tolerance:g})"
            raise InputError(name, _words(coordinates[name]), allowed + why, f"points of {mechanism.name}")
    place = Placement(_triple(reading.at), _triple(reading.z), _triple(reading.x))
    return PlacedDesign(mechanism.name, reading.parameters, reading.phi, place, max(distances.values()))


def drawn(family: str, file: Path, part: str = "", unit: str = "mm", tolerance: float = TOLERANCE) -> PlacedDesign:
    """Find the mechanism of a file of points by `from_points`, in mm; ``unit`` is that of a file without one.

    Raises
    ------
    InputError
        as `read_points` and `from_points`.
    """
    return from_points(family, tolerance=tolerance, **read_points(file, reader_of(family), part=part, unit=unit))


def reader_of(family: str) -> Hardpoints:
    """Return the reader of a family's points.

    Raises
    ------
    InputError
        for a family whose dimensions cannot be read from points.
    """
    mechanism = find_family(family)
    reader = mechanism.find(Hardpoints)
    if reader is None:
        families = [name for name in NAMES if find_family(name).find(Hardpoints) is not None]
        raise InputError("family", mechanism.name, f"one of {', '.join(families)}", "points")
    return reader


def _checked(reader: Hardpoints, points: Mapping[str, Sequence[float] | Array]) -> dict[str, Array]:
    names = (*reader.needs, *reader.may)
    for name in points:
        if name not in names:
            raise InputError("point", name, choices(name, names), "points")
    coordinates = {}
    for name in names:
        if name not in points:
            if name in reader.needs:
                kind = "a direction" if name.startswith("axis_") else "a point"
                raise MissingInput(name, f"{kind} [x, y, z], as for {', '.join(reader.needs)}", "points")
            continue
        at = np.array(vector(points[name], name))
        if name.startswith("axis_"):
            length = float(np.linalg.norm(at))
            if not length > 0.0:
                raise InputError(name, at.tolist(), "a direction, not all zeros", "points")
            at = at / length
        coordinates[name] = at
    return coordinates


def _joints(family: Family, reading: FittedPose, given: Mapping[str, Array]) -> dict[str, Array]:
    """Return the positions, in the drawing's frame, of the joints with a given point."""
    (part,) = parts(family, reading.parameters, reading.phi)
    z, x = reading.z, reading.x
    turn = np.column_stack([x, np.cross(z, x), z])
    positions = {}
    for name, point in given.items():
        joint = name if name in part.joints else name.lower()
        if joint in part.joints:
            at = turn @ part.joints[joint][0] + reading.at
            if part.kinds.get(joint) == "slide":  # any point of the line may be given
                along = turn @ part.axes[joint]
                at = at + float((point - at) @ along) * along
            positions[name] = at
    return positions


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _words(point: Array) -> str:
    return "[" + ", ".join(f"{x:.6g}" for x in point) + "]"


NamedPoints: TypeAlias = dict[str, list[float]]
Groups: TypeAlias = dict[str, NamedPoints]


def read_points(file: Path, reader: Hardpoints | None = None, *, part: str = "", unit: str = "mm") -> NamedPoints:
    """Return the points of one stage or member by name [mm].

    Parameters
    ----------
    file : .csv with the columns name, x, y, z, or `x [inch]` and so on (others are ignored); or .csv, .dxf, .glb
        of ``sweep export``, which contain their unit
    reader : selects the points of an exported file; None reads all.  A table written by hand is not filtered, so
        that a wrong name is found
    part : "stage 2", "needle", "needle stage 1"; optional for a file with a single part
    unit : unit of coordinates if the file has none

    Raises
    ------
    InputError
        for any other file, a missing column, a duplicate name, a missing part, or an unknown unit.
    """
    try:
        scale = factor(unit, "mm")
    except UnitFault as fault:
        raise InputError("--unit", unit, str(fault), str(file)) from None
    readers: dict[str, Callable[[Path], Groups]] = {".dxf": _of_dxf, ".glb": _of_glb}
    reads = readers.get(file.suffix.lower())
    groups, exported = _of_csv(file, scale) if reads is None else (reads(file), True)
    if not part and len(groups) > 1:
        raise MissingInput("part", f"one of {', '.join(groups)}: name it with --part", str(file))
    if part and part not in groups:
        raise InputError("part", part, f"one of {', '.join(groups)}", str(file))
    points = groups[part] if part else next(iter(groups.values()))
    if not exported or reader is None:
        return points
    return {name: at for name, at in points.items() if name in (*reader.needs, *reader.may)}


def _of_csv(file: Path, scale: float) -> tuple[Groups, bool]:
    import pandas as pd

    try:
        table: pd.DataFrame = pd.read_csv(file, comment="#", skipinitialspace=True, dtype={"stage": str, "member": str})
    except (ValueError, OSError) as error:
        raise InputError("file", file.name, f"a CSV table ({error})", str(file)) from error
    table = _in_mm(table.rename(columns=str.strip), file, scale)
    for column in ("name", "x", "y", "z"):
        if column not in table:
            found = f"found {', '.join(map(str, table))}"
            raise MissingInput(column, f"the columns name, x, y, z between commas; {found}", str(file))
    exported = {"member", "stage", "frame"} <= set(table)
    labels = [""] * len(table)
    if exported:
        columns = (table[name].fillna("").astype(str) for name in ("member", "stage"))
        labels = [_label(member, stage) for member, stage in zip(*columns, strict=True)]
    groups: Groups = {}
    for label, name, *at in zip(labels, table["name"], *(table[axis] for axis in "xyz"), strict=True):
        points = groups.setdefault(label, {})
        name = str(name).strip()
        if name in points:
            raise InputError("name", name, "each name once", str(file))
        points[name] = [float(x) for x in at]
    if not groups:
        raise InputError("rows", 0, "a row for each point", str(file))
    return groups, exported


_HEADED = re.compile(r"([xyz])\s*\[(.+)\]")


def _in_mm(table: pd.DataFrame, file: Path, scale: float) -> pd.DataFrame:
    """Convert coordinates to mm, by the unit of their heading, as `x [inch]`, of an export's column, or by scale."""
    exported = {"member", "stage", "frame", "unit"} <= set(table)
    for axis in {"x", "y", "z"} & set(table):
        factors = table["unit"].map({"m": 1e3}).fillna(1.0) if exported else scale
        table[axis] = factors * numbers(table[axis], axis, f"{file}, row")
    for heading in list(table.columns):
        match = _HEADED.fullmatch(heading)
        if match is not None:
            in_mm = heading_factor(match[1], match[2].strip(), "mm")
            table[match[1]] = in_mm * numbers(table.pop(heading), heading, f"{file}, row")
    return table


def _label(member: str, stage: str) -> str:
    return " ".join(word for word in (member, f"stage {stage}" if stage else "") if word)


def _of_dxf(file: Path) -> Groups:
    """Return named points and axes of the front views, which keep the third coordinate."""
    ezdxf = ezdxf_or_refuse()
    try:
        document = ezdxf.readfile(file)
    except (OSError, ezdxf.DXFStructureError) as error:
        raise InputError("file", file.name, f"a DXF drawing ({error})", str(file)) from error
    scale = 1e3 if document.header["$INSUNITS"] == UNITS["m"] else 1.0
    groups: Groups = {}
    for entity in document.modelspace().query("POINT LINE"):
        if not entity.has_xdata(NAMED):
            continue
        label, name = (value for code, value in entity.get_xdata(NAMED) if code == 1000)
        line = entity.dxftype() == "LINE"
        at = entity.dxf.end - entity.dxf.start if line else entity.dxf.location
        groups.setdefault(label, {})[name] = [scale * float(x) for x in at]
    if not groups:
        raise InputError("file", file.name, "a drawing with named points, by sweep export", str(file))
    return groups


def _of_glb(file: Path) -> Groups:
    """Return joints of the first pose and axes; coordinates are float32."""
    data = file.read_bytes()
    if len(data) < 20 or data[:4] != b"glTF":
        raise InputError("file", file.name, "a model by sweep export (glTF 2.0, binary)", str(file))
    (length,) = struct.unpack("<I", data[12:16])
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    if document.get("asset", {}).get("generator") != "linksweep":
        raise InputError("file", file.name, "a model by sweep export", str(file))
    nodes = document["nodes"]
    root = nodes[document["scenes"][0]["nodes"][0]]
    millimetres = 1e3 * root["scale"][0]
    groups: Groups = {}
    for group in (nodes[k] for k in root["children"]):
        points = groups.setdefault("" if group["name"] == "stage" else group["name"], {})
        for node in (nodes[k] for k in group["children"]):
            if node["name"].startswith("axis_"):
                x, y, z, w = node["rotation"]
                points[node["name"]] = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
            elif "mesh" in node:
                points[node["name"]] = (millimetres * np.add(node["translation"], group["translation"])).tolist()
    return groups
