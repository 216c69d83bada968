"""Points by name out of a file: a table of points, or a table, drawing or model that ``sweep export`` wrote."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sweep.errors import InputError
from sweep.exchange.dxf import NAMED, ezdxf_or_refuse

if TYPE_CHECKING:
    import pandas as pd

    from sweep.families.capabilities import Hardpoints

Points: TypeAlias = dict[str, list[float]]
Groups: TypeAlias = dict[str, Points]


def read_points(file: Path, reader: Hardpoints | None = None, *, part: str = "") -> Points:
    """Return points of one stage or member by name, in the unit of the file.

    Parameters
    ----------
    file : .csv with the columns name, x, y, z (others are not looked at); or .csv, .dxf, .glb of ``sweep export``
    reader : what of an exported file is wanted; everything if left out.  A table written by hand is not filtered, so
        that a wrong name is found
    part : "stage 2", "needle", "needle stage 1"; may be left out where the file has one part only

    Raises
    ------
    InputError
        for a file that is none of these, a missing column, a name that stands twice, a part that is not there.
    """
    readers: dict[str, Callable[[Path], tuple[Groups, bool]]] = {".dxf": _of_dxf, ".glb": _of_glb}
    groups, exported = readers.get(file.suffix.lower(), _of_csv)(file)
    if not part and len(groups) > 1:
        raise InputError("part", None, f"one of {', '.join(groups)}: name it with --part", str(file))
    if part and part not in groups:
        raise InputError("part", part, f"one of {', '.join(groups)}", str(file))
    found = groups[part] if part else next(iter(groups.values()))
    if not exported or reader is None:
        return found
    return {name: at for name, at in found.items() if name in (*reader.needs, *reader.may)}


def _of_csv(file: Path) -> tuple[Groups, bool]:
    import pandas as pd

    try:
        table: pd.DataFrame = pd.read_csv(file, comment="#", skipinitialspace=True, dtype={"stage": str, "member": str})
    except (ValueError, OSError) as error:
        raise InputError("file", file.name, f"a CSV table ({error})", str(file)) from error
    table.columns = [str(name).strip() for name in table.columns]
    for column in ("name", "x", "y", "z"):
        if column not in table:
            raise InputError("column", column, "the columns name, x, y, z", str(file))
    exported = {"member", "stage", "frame"} <= set(table)
    labels = [_label(member, stage) for member, stage in _parts(table)] if exported else [""] * len(table)
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


def _parts(table: pd.DataFrame) -> list[tuple[str, str]]:
    columns = (table[name].fillna("").astype(str) for name in ("member", "stage"))
    return list(zip(*columns, strict=True))


def _label(member: str, stage: str) -> str:
    return " ".join(word for word in (member, f"stage {stage}" if stage else "") if word)


def _of_dxf(file: Path) -> tuple[Groups, bool]:
    """Return the named points and axes of the front views, whose third coordinate is kept."""
    ezdxf = ezdxf_or_refuse()
    try:
        space = ezdxf.readfile(file).modelspace()
    except (OSError, ezdxf.DXFStructureError) as error:
        raise InputError("file", file.name, f"a DXF drawing ({error})", str(file)) from error
    groups: Groups = {}
    for entity in space.query("POINT LINE"):
        if not entity.has_xdata(NAMED):
            continue
        label, name = (value for code, value in entity.get_xdata(NAMED) if code == 1000)
        line = entity.dxftype() == "LINE"
        at = entity.dxf.end - entity.dxf.start if line else entity.dxf.location
        groups.setdefault(label, {})[name] = [float(x) for x in at]
    if not groups:
        raise InputError("file", file.name, "a drawing with named points, by sweep export", str(file))
    return groups, True


def _of_glb(file: Path) -> tuple[Groups, bool]:
    """Return the joints of the first pose and the axes; coordinates are float32."""
    data = file.read_bytes()
    if len(data) < 20 or data[:4] != b"glTF":
        raise InputError("file", file.name, "a model by sweep export (glTF 2.0, binary)", str(file))
    (length,) = struct.unpack("<I", data[12:16])
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    if document.get("asset", {}).get("generator") != "linksweep":
        raise InputError("file", file.name, "a model by sweep export", str(file))
    nodes = document["nodes"]
    groups: Groups = {}
    for group in (nodes[k] for k in nodes[document["scenes"][0]["nodes"][0]]["children"]):
        points = groups.setdefault("" if group["name"] == "stage" else group["name"], {})
        for node in (nodes[k] for k in group["children"]):
            if node["name"].startswith("axis_"):
                x, y, z, w = node["rotation"]
                points[node["name"]] = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
            elif "mesh" in node:
                points[node["name"]] = np.add(node["translation"], group["translation"]).tolist()
    return groups, True
