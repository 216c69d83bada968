"""The space of a proof, with the reason that excludes each part, from the certificate; for figures of proof studies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

import sweep
from sweep.report.figures import WIDTH, house_style, new_figure, save

Array = NDArray[np.float64]

COLOURS = {
    "not a mechanism with these limit positions": "#dddddd",
    "links outside their limits": "#d9c9e8",
    "pressure angle above its limit": "#c9d7e8",
    "rocker cannot be there in time": "#bfdcc3",
    "acceleration not below the bound": "#f2c38f",
    "open": "#d62728",
}
# Kinds of rows in a certificate, docs/proof.md.
LENGTHS, PRESSURE, ACCELERATION, ARRIVAL = range(5, 15), 15, (16, 17), range(18, 24)
WORDS = {
    "phi_ext": "crank angle of the extended position [deg]",
    "phi0": "crank angle between the limits [deg]",
    "psi_ext": "rocker angle of the extended position [deg]",
    "alpha": "angle between the axes [deg]",
    "f": "offset f of the crank [mm]",
}
INK = "#1d2127"
STRIPS = 120
QUARTER, WIDE = 90.0, 180.0  # tick distance of an axis wider than WIDE degrees


@dataclass(frozen=True)
class Space:
    """Boxes of a certificate: ends by coordinate, in the units of WORDS, and the excluding reason, of COLOURS."""

    names: tuple[str, ...]
    low: Array  # (m, n)
    high: Array
    reasons: NDArray[np.int64]
    ends: Array  # (n, 2), ends of the whole space
    optimum: Array  # (n,), of the study, nan without one

    @property
    def excluded(self) -> Array:
        """Share of the space that each reason of COLOURS excludes."""
        volumes = np.prod((self.high - self.low) / np.diff(self.ends)[:, 0], axis=1)
        return np.array([volumes[self.reasons == k].sum() for k in range(len(COLOURS))])


def _reason(outcome: str, kinds: list[int]) -> int:
    """Return the number of the reason that excludes a box."""
    rows = set(kinds)
    if outcome not in ("bound", "empty"):
        word = "open"
    elif rows & set(ACCELERATION):
        word = "acceleration not below the bound"
    elif rows & set(ARRIVAL):
        word = "rocker cannot be there in time"
    elif PRESSURE in rows:
        word = "pressure angle above its limit"
    elif rows & set(LENGTHS):
        word = "links outside their limits"
    else:
        word = "not a mechanism with these limit positions"
    return list(COLOURS).index(word)


def read(path: Path) -> Space:
    """Read the boxes of a certificate."""
    table = pq.read_table(path)
    asked = json.loads(table.schema.metadata[b"question"])
    names = tuple(asked["free"])
    units = np.array([1.0 if name in "efg" else np.degrees(1.0) for name in names])
    low, high = (
        np.column_stack([table[f"{name}_{end}"].to_numpy() for name in names]) * units for end in ("low", "high")
    )
    pairs = zip(table["outcome"].to_pylist(), table["kinds"].to_pylist(), strict=True)
    reasons = np.array([_reason(outcome, kinds) for outcome, kinds in pairs])
    ends = np.column_stack([asked["low"], asked["high"]]) * units[:, None]
    return Space(names, low, high, reasons, ends, _optimum(path.with_name("_optimum.parquet"), names) * units)


def _optimum(path: Path, names: tuple[str, ...]) -> Array:
    """Return the study's optimum in the coordinates of the space."""
    rows = pd.read_parquet(path)
    best = rows[(rows["role"] == "optimum") & (rows["status"] == 0)].reset_index(drop=True)
    if best.empty:
        return np.full(len(names), np.nan)
    design = best[["a", "b", "c", "e", "f", "g", "alpha", "branch"]]
    places = design.join(sweep.summarise("rssr", design, ["phi_ext", "phi0", "psi_ext"]))
    return places[list(names)].iloc[0].to_numpy(np.float64)


def _map(axes: Axes, space: Space, reach: float) -> None:
    """Draw the boxes of two free coordinates in the colours of their reasons, for crank angles up to ``reach``."""
    x = space.names.index("phi_ext")
    y = 1 - x
    (x0, y0), (x1, y1) = space.low[:, [x, y]].T, space.high[:, [x, y]].T
    corners = np.stack([np.stack(corner, axis=1) for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))], axis=1)
    colours = [list(COLOURS.values())[k] for k in space.reasons]
    axes.add_collection(PolyCollection(list(corners), facecolors=colours, edgecolors="white", linewidths=0.3))
    axes.set_xlim(space.ends[x, 0], min(space.ends[x, 1], reach))
    axes.set_ylim(*space.ends[y])
    axes.set_xlabel(WORDS[space.names[x]])
    axes.set_ylabel(WORDS[space.names[y]])
    axes.plot(*space.optimum[[x, y]], marker="o", markersize=5, color=INK, clip_on=False)


def shares(space: Space, k: int) -> tuple[Array, Array]:
    """Return the edges of strips across coordinate k, and the share of each strip by reason, (STRIPS, reasons)."""
    edges = np.linspace(space.ends[k, 0], space.ends[k, 1], STRIPS + 1)
    width = space.high - space.low
    others = np.prod(np.delete(width / np.diff(space.ends)[:, 0], k, axis=1), axis=1)
    found = np.zeros((STRIPS, len(COLOURS)))
    for i in range(STRIPS):
        shared = np.minimum(space.high[:, k], edges[i + 1]) - np.maximum(space.low[:, k], edges[i])
        within = np.maximum(shared, 0.0) / (edges[i + 1] - edges[i]) * others
        found[i] = np.bincount(space.reasons, within, len(COLOURS))
    return edges, found


def _strips(axes: Axes, space: Space, k: int) -> None:
    """Draw the excluded shares of the space by reason, over one coordinate."""
    edges, found = shares(space, k)
    base = np.zeros(STRIPS)
    for number, colour in enumerate(COLOURS.values()):
        top = base + 100.0 * found[:, number]
        axes.stairs(top, edges, baseline=base, fill=True, color=colour, linewidth=0.0)
        base = top
    axes.set_xlim(*space.ends[k])
    axes.axvline(space.optimum[k], color=INK, linewidth=1.2, linestyle=":", clip_on=False)
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel(WORDS[space.names[k]].replace(" of the ", " of the\n", 1))
    if np.diff(space.ends[k])[0] > WIDE and space.names[k] != "f":
        axes.xaxis.set_major_locator(MultipleLocator(QUARTER))


def draw(space: Space, reach: float) -> Figure:
    """Return the figure of a space: a map of two free coordinates, or for more a panel for each."""
    with house_style():
        n = len(space.names)
        columns = 3 if n == 3 else 2
        figure = new_figure(WIDTH, (0.4 if n == 3 else 0.62) * WIDTH)
        if n == 2:
            _map(figure.add_subplot(), space, reach)
        else:
            for k in range(n):
                axes = figure.add_subplot((n + columns - 1) // columns, columns, k + 1)
                _strips(axes, space, k)
                if k % columns == 0:
                    axes.set_ylabel("share of the space [%]")
        handles: list[Artist] = [
            Patch(color=colour, label=f"{word}: {100.0 * share:.2g} %")
            for (word, colour), share in zip(COLOURS.items(), space.excluded, strict=True)
            if share > 0.0
        ]
        if np.isfinite(space.optimum).all():
            dot = Line2D([], [], color=INK, marker="o", linestyle="", label="the optimum")
            handles.append(dot if n == 2 else Line2D([], [], color=INK, linestyle=":", label="the optimum"))
        figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
    return figure


def main(folder: Path, reach: float = 360.0) -> None:
    """Draw the certificate in ``folder`` into its report; a map only up to the crank angle ``reach``, in degrees."""
    with house_style():
        save(draw(read(folder / "_proof.parquet"), reach), folder / "figures" / "space.svg")
