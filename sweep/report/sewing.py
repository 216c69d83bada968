"""Sewing at every speed, and the thread demand over the turn, as the report shows them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kernels.types import Array
from sweep.errors import MeasuredRangeWarning
from sweep.evaluation.thread.diagram import diagram
from sweep.families.machines.machine import Machine
from sweep.families.machines.sewing import RPM, Sewing
from sweep.families.machines.thread_balance import MEASURED_SPEED, MM_PER_M, ThreadBalance
from sweep.numerics.records import Mask
from sweep.report.dataset import Dataset
from sweep.report.figures import LIMIT, WIDTH, new_figure
from sweep.report.made import design_of, sampler
from sweep.report.quantities import number

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


CURVE = 33  # number of speeds of the curve
ON_LIMIT = 1e-9  # mm: an optimum ends on its limits, and exceeds them by the rounding of its search


@dataclass(frozen=True)
class Sewn:
    """Shares of manufactured mechanisms by speed [1/min], (S,) each, and the answer in words.

    ``shares`` keep all moments, 95 % confidence from ``low`` to ``high``; ``moments`` each of them, ``ends`` the least
    or the most rise.  ``rows`` are the stated speeds: index, window of the rise, and the end that binds the optimum.
    """

    sentence: str
    rows: list[tuple[int, Array, str]]
    count: int
    speeds: Array
    shares: Array
    low: Array
    high: Array
    moments: dict[str, Array]
    ends: dict[str, Array]


def sewn(data: Dataset) -> Sewn | None:
    """Sample mechanisms of the optimum and test sewing at every speed; None without tolerances or a sewing relation."""
    study = data.study
    sewing = next((one for one in getattr(study.family, "relations", ()) if isinstance(one, Sewing)), None)
    source = sampler(data)
    if sewing is None or source is None or data.optimum is None or not isinstance(study.family, Machine):
        return None
    design = design_of(data, data.optimum)
    designs = source.designs(design)
    stated = np.array(sewing.speeds)
    speeds = np.union1d(stated, np.linspace(stated[0], stated[-1], CURVE))
    ends = sewing.ends.values()
    optimum_rooms, _, _ = sewing.rooms(study.family, design[None], stated, study.accuracy)
    nominal = {name: room[0] for name, room in optimum_rooms.items()}
    sentence = sewing_sentence({name: room for name, room in nominal.items() if name not in ends}, stated / RPM)
    sentence += f" {window_sentence(*sewing.binding(study.family, design))}"
    windows = np.stack(sewing.window(study.family, design[None], stated), axis=-1)[0]
    rooms, _, _ = sewing.rooms(study.family, designs, speeds, study.accuracy)
    meets = {name: room >= 0.0 for name, room in rooms.items()}
    meets_all = np.logical_and.reduce(list(meets.values()))
    binds = [
        _binds(sewing, {end: float(nominal[name][k]) for end, name in sewing.ends.items()}, k)
        for k in range(len(stated))
    ]
    rows = list(zip(np.searchsorted(speeds, stated).tolist(), windows, binds, strict=True))
    low, high = np.array([_interval(one) for one in meets_all.T]).T
    shares = {name: kept.mean(axis=0) for name, kept in meets.items()}
    of_moments = {name: share for name, share in shares.items() if name not in ends}
    of_ends = {end: shares[name] for end, name in sewing.ends.items()}
    return Sewn(sentence, rows, len(designs), speeds / RPM, meets_all.mean(axis=0), low, high, of_moments, of_ends)


def sewing_sentence(rooms: Mapping[str, Array], rpm: Array) -> str:
    """Describe whether a design sews, at which speeds it does not, and which moment has the smallest margin.

    Parameters
    ----------
    rooms : margin of each moment at each speed, (S,) [mm]; nan if the moment does not happen
    rpm : the speeds, (S,) [1/min]
    """
    never = [name for name, room in rooms.items() if np.isnan(room).any()]
    if never:
        return f"It does not sew: moment {' and moment '.join(name.upper() for name in never)} does not happen."
    least = np.minimum.reduce(list(rooms.values()))
    k = int(least.argmin())
    name = min(rooms, key=lambda one: float(rooms[one][k]))
    room, at = f"{number(abs(float(least[k])), 3)}\u00a0mm", f"at {rpm[k]:.6g}\u00a0rpm"
    missed = " and ".join(f"{speed:.6g}" for speed in rpm[least < -ON_LIMIT])
    if missed:
        return f"It does not sew at {missed} rpm: moment {name.upper()} misses by {room} {at}."
    spare = f"has least to spare, {room}" if least[k] > ON_LIMIT else "has nothing to spare"
    return f"It sews at {rpm[0]:.6g} to {rpm[-1]:.6g} rpm: moment {name.upper()} {spare} {at}."


def window_sentence(low: tuple[str, float], high: tuple[str, float]) -> str:
    """Name the fields of work that set the least and the most rise, or state that no rise suits all."""
    (slow, least), (fast, most) = low, high
    ends = f"at least {number(least, 3)}\u00a0mm for {slow}, at most {number(most, 3)}\u00a0mm for {fast}"
    return f"No rise suits all fields: {ends}." if least > most else f"All fields permit a rise of {ends}."


def _binds(sewing: Sewing, rooms: Mapping[str, float], k: int) -> str:
    """Name the end of the window closer to the rise of the optimum at the k-th speed, its field, and the distance."""
    end = min(rooms, key=lambda name: rooms[name])
    slow, fast = sewing.fields()
    whose = slow if k == 0 else fast if k == len(sewing.speeds) - 1 else f"{slow}, {fast}"
    words = {"above": "least", "below": "most"}
    return f"{words[end]} ({whose}), {number(rooms[end], 3)}\u00a0mm"


def _interval(kept: Mask) -> tuple[float, float]:
    """Return the 95 % confidence interval of a share, from a sample of machines (n,) that keep a limit or not."""
    from scipy.stats import binomtest

    interval = binomtest(int(kept.sum()), len(kept)).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def diagram_of_dataset(data: Dataset) -> pd.DataFrame | None:
    """Return the thread diagram of the optimum over the turn; None if the study has no threads."""
    row, family = data.result, data.study.family
    if row is None or not any(isinstance(r, ThreadBalance) for r in getattr(family, "relations", ())):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeasuredRangeWarning)  # the figure shows the measured range of the law of speed
        return diagram(family, data.design(row), angles="rad")


def threads_figure(turn: pd.DataFrame) -> Figure:
    """Draw demand, surplus and speed of every thread over one turn of the main shaft."""
    degrees = np.degrees(turn["phi"])
    names = [name.removesuffix("_demand") for name in turn.columns if name.endswith("_demand")]
    figure = new_figure(WIDTH, 7.5)
    needs, left, pace = figure.subplots(3, 1, sharex=True)
    for name in names:
        needs.plot(degrees, turn[f"{name}_demand"] - turn[f"{name}_demand"].mean(), label=name)
        left.plot(degrees, turn[f"{name}_surplus"], label=name)
        if f"{name}_velocity" in turn:
            pace.plot(degrees, turn[f"{name}_velocity"] / MM_PER_M, label=name)
    needs.plot(degrees, turn["demand"] - turn["demand"].mean(), color="#14181f", linestyle="--", label="sum")
    left.axhline(0.0, color="#14181f", linewidth=1.0)
    for way in (-1.0, 1.0):
        pace.axhline(way * MEASURED_SPEED.high, color=LIMIT, linewidth=1.0, linestyle="--")
    for axes, words in ((needs, "P, from its mean [mm]"), (left, "surplus [mm]"), (pace, "speed [m/s]")):
        axes.set_ylabel(words)
    needs.legend(ncols=len(names) + 1, loc="lower right", bbox_to_anchor=(1.0, 1.0))  # above: curves fill the axes
    pace.set_xlabel("angle of the main shaft [°]")
    pace.set_xticks(range(0, 361, 60))
    return figure
