"""Views of a mechanism as a DXF drawing, by ezdxf."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sweep.errors import MissingInput, extra
from sweep.evaluation.joints import Part
from sweep.exchange.scene import extent, frames_of, shown_name
from sweep.families.base import Array

LAYERS = {"LINKS": 5, "JOINTS": 7, "PIVOTS": 1, "AXES": 8, "PATHS": 3, "TEXT": 7}
# Axes to the right and upwards: the side is seen from the left, the top from above, with z pointing down.
VIEWS = {
    "front": np.eye(3)[:2],
    "side": np.eye(3)[[2, 1]],
    "top": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
}
UNITS = {"mm": 4, "m": 6}


NAMED = "LINKSWEEP"  # application whose extended data hold the names of entities


def ezdxf_or_refuse() -> Any:
    """Return the package ezdxf.

    Raises
    ------
    InputError
        if it is not installed.
    """
    try:
        import ezdxf
        import ezdxf.bbox
    except ImportError as error:
        raise MissingInput("ezdxf", f"this package, for format dxf: {extra('cad')}", "export") from error
    return ezdxf


def write_dxf(placed: list[Part], path: Path, unit: str) -> None:
    """Write the first pose with the joints' paths.

    Planar parts are drawn from the front, spatial ones from the side and top as well.

    Layers are LINKS, JOINTS, PIVOTS, AXES, PATHS and TEXT.  Every frame has its views side by side, the front view of
    the first one at its own coordinates.  In front views points and axes keep their third coordinate and carry
    part and name as extended data of the application LINKSWEEP, which ``sweep points`` reads.

    Raises
    ------
    InputError
        if ezdxf is not installed.
    """
    document: Any = ezdxf_or_refuse().new("R2010", setup=True)
    document.appids.add(NAMED)
    document.header["$INSUNITS"] = UNITS[unit]
    for layer, colour in LAYERS.items():
        document.layers.add(layer, color=colour)
    space = document.modelspace()
    right, first = 0.0, True
    for same in frames_of(placed).values():
        size = extent(same)
        points = np.vstack([path for part in same for path in part.joints.values()])
        spatial = float(np.ptp(points[:, 2])) > 1e-9 * size
        for view, seen in VIEWS.items():
            if view != "front" and not spatial:
                continue
            flat = points @ seen.T
            shift = np.array([0.0 if first else right + 0.25 * size - float(flat[:, 0].min()), 0.0])
            first, right = False, float(flat[:, 0].max() + shift[0])
            for part in same:
                _draw(space, part, seen, shift, size)
            title = f"{', '.join(part.label for part in same)}: {view}" if spatial else same[0].label
            low = np.array([float(flat[:, 0].min()), float(flat[:, 1].min()) - 0.15 * size]) + shift
            _text(space, title, low, 0.04 * size)
    document.saveas(path)


def add_tables(path: Path, tables: Sequence[tuple[str, Sequence[str], Sequence[Sequence[str]]]]) -> None:
    """Write tables (title, heads, lines) below the views of a drawing of `write_dxf`."""
    ezdxf = ezdxf_or_refuse()
    document: Any = ezdxf.readfile(path)
    space = document.modelspace()
    box = ezdxf.bbox.extents(space)
    size = float(max(box.size.x, box.size.y))
    height, down = 0.012 * size, float(box.extmin.y) - 0.05 * size
    for title, heads, lines in tables:
        rows = [(title,), tuple(heads), *lines]
        widths = [max(len(row[k]) for row in rows[1:]) for k in range(len(heads))]
        for row in rows:
            right = float(box.extmin.x)
            for words, width in zip(row, widths, strict=False):
                if words:
                    _text(space, words, np.array([right, down]), height)
                right += (width + 2) * height
            down -= 1.6 * height
        down -= 1.6 * height
    document.saveas(path)


def _draw(space: Any, part: Part, seen: Array, shift: Array, size: float) -> None:
    front = seen is VIEWS["front"]
    at = {name: path @ seen.T + shift for name, path in part.joints.items()}
    for link in part.links:
        corners = [at[name][0] for name in link.joints]
        if len(corners) > 1:
            space.add_lwpolyline([tuple(p) for p in corners], close=len(corners) > 2, dxfattribs={"layer": "LINKS"})
    for name, path in at.items():
        layer = "PIVOTS" if name in part.kinds else "JOINTS"
        here = tuple(path[0])
        point = space.add_point(here, dxfattribs={"layer": layer})
        if front:
            point.dxf.location = (*here, float(part.joints[name][0, 2]))
            _name(point, part, shown_name(name))
        space.add_circle(here, 0.012 * size, dxfattribs={"layer": layer})
        _text(space, shown_name(name), path[0] + 0.018 * size, 0.03 * size)
        if name not in part.kinds and float(np.ptp(path, axis=0).max()) > 0.0:
            space.add_lwpolyline([tuple(p) for p in path[:-1]], close=True, dxfattribs={"layer": "PATHS"})
    for name, axis in part.axes.items():
        middle, along = at[name][0], 0.12 * size * seen @ axis
        if front:
            middle, along = np.append(middle, part.joints[name][0, 2]), 0.12 * size * axis
        if float(np.linalg.norm(along)) > 1e-6 * size:
            ends = tuple(middle - along), tuple(middle + along)
            line = space.add_line(*ends, dxfattribs={"layer": "AXES", "linetype": "CENTER"})
            if front:
                _name(line, part, f"axis_{shown_name(name)}")


def _name(entity: Any, part: Part, name: str) -> None:
    label = part.label if part.member or part.stage else ""
    entity.set_xdata(NAMED, [(1000, label), (1000, name)])


def _text(space: Any, words: str, at: Array, height: float) -> None:
    space.add_text(words, height=height, dxfattribs={"layer": "TEXT", "insert": tuple(at)})
