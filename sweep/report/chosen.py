"""A design out of a dataset folder: the optimum, the reference, the best of the sweep, or a row."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.report.dataset import Dataset, read_dataset
from sweep.report.page import gather

ROLES = ("optimum", "reference", "best")


@dataclass(frozen=True)
class Chosen:
    """A design with the mechanism it is of; ``speed`` is that of the study's scene [rad/s]."""

    family: Family
    design: dict[str, float]
    speed: float | None


def chosen(folder: str | Path, design: str | int | None = None) -> Chosen:
    """Return a design of a dataset.

    Parameters
    ----------
    folder : what `sweep run` left behind
    design : "optimum", "reference", "best" (of the sweep) or the number of a row as :func:`sweep.load` counts them; if
        left out the optimum, or where nothing was optimised the best

    Raises
    ------
    InputError
        for a folder that is no complete dataset, or one that has no such design.
    """
    path = Path(folder)
    if isinstance(design, int) or (isinstance(design, str) and design.lstrip("-").isdigit()):
        return _row(path, int(design))
    if design is not None and design not in ROLES:
        raise InputError("design", design, f"{', '.join(ROLES)}, or the number of a row", str(folder))
    data = read_dataset(path)
    if design == "best" or (design == "reference" and data.optima is None) or (design is None and data.optimum is None):
        data, _, _ = gather(path)  # goes through all rows
    row = {"optimum": data.optimum, "reference": data.reference, "best": data.best, None: data.result}[design]
    if row is None:
        raise InputError(
            "design", design or "result", f"one this dataset has, of {', '.join(ROLES)}, or a row", str(folder)
        )
    return _chosen(data, {name: float(row[name]) for name in data.study.family.parameter_names})


def _row(folder: Path, number: int) -> Chosen:
    from sweep.dataset.store import load

    data = read_dataset(folder)
    rows = load(folder)
    if not 0 <= number < len(rows):
        raise InputError("design", number, f"a row from 0 to {len(rows) - 1}", str(folder))
    row = rows.iloc[number]
    return _chosen(data, {name: float(row[name]) for name in data.study.family.parameter_names})


def _chosen(data: Dataset, design: dict[str, float]) -> Chosen:
    return Chosen(data.study.family, design, data.study.speed)
