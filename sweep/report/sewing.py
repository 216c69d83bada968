"""Will it sew at every speed: the share of what is made that keeps the moments of the stitch, by speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sweep.families.machines import Machine
from sweep.families.sewing import RPM, Sewing
from sweep.optimise.manufacture.tolerance import deviating
from sweep.report.dataset import Dataset
from sweep.report.quantities import number

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from kernels.types import Array

    Mask = NDArray[np.bool_]

CURVE = 33  # speeds of the curve


@dataclass(frozen=True)
class Row:
    """One speed: the window of the rise, shares that keep each moment and all of them, with the interval of 95 %."""

    speed: str
    window: str
    shares: tuple[str, ...]
    every: str
    interval: str


@dataclass(frozen=True)
class Sewn:
    """What is made by speed: rows of the stated speeds, and a curve of shares between them."""

    moments: tuple[str, ...]
    rows: tuple[Row, ...]
    count: int
    speeds: Array
    shares: Array


def sewn(data: Dataset) -> Sewn | None:
    """Make the optimum many times and sew at every speed; None without tolerances or a relation that sews."""
    study, row = data.study, data.optimum
    if study.tolerance is None or study.optimise is None or row is None or not isinstance(study.family, Machine):
        return None
    sewing = next((one for one in study.family.relations if isinstance(one, Sewing)), None)
    if sewing is None:
        return None
    design = np.array([float(row[name]) for name in study.family.parameter_names])
    designs = deviating(study.family, design, study.tolerance, study.optimise.seed, study.tolerance.samples)
    stated = np.array(sewing.speeds)
    speeds = np.union1d(stated, np.linspace(stated[0], stated[-1], CURVE))
    rooms, _ = sewing.rooms(study.family, designs, speeds, study.accuracy)
    kept = {name: room >= 0.0 for name, room in rooms.items()}
    every = np.logical_and.reduce(list(kept.values()))
    rows = tuple(_row(sewing, kept, every, k, speeds[k]) for k in np.searchsorted(speeds, stated).tolist())
    return Sewn(tuple(kept), rows, len(designs), speeds / RPM, every.mean(axis=0))


def _row(sewing: Sewing, kept: dict[str, Mask], every: Mask, k: int, speed: float) -> Row:
    from scipy.stats import binomtest

    low, high = sewing.window(np.array([speed]))
    known = binomtest(int(every[:, k].sum()), len(every)).proportion_ci(method="wilson")
    return Row(
        f"{speed / RPM:.6g}",
        f"{number(float(low[0]))} to {number(float(high[0]))}",
        tuple(_percent(float(one[:, k].mean())) for one in kept.values()),
        _percent(float(every[:, k].mean())),
        f"{_percent(known.low)} to {_percent(known.high)}",
    )


def _percent(share: float) -> str:
    return f"{number(100.0 * share, 3)}\u00a0%"
