"""Designs side by side under one study: motion, outputs and limits of each, as a page shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from kernels import status as codes
from sweep.dataset.files import write_atomically
from sweep.errors import InputError, StoreError
from sweep.evaluation.statuses import meaning
from sweep.pages import rendered
from sweep.report.dataset import Dataset, Row, chosen, read_dataset, row_of
from sweep.report.live import embedded, moving, scripts_of
from sweep.report.optima import Shown
from sweep.report.tables import ParameterRow, limit_states, output_rows, parameter_rows


def judged(data: Dataset, rows: Sequence[Row], names: Sequence[str]) -> dict[str, Any]:
    """Return what a page shows of designs under their names; the first one is in hand, the others beside it."""
    seen = [as_result(data, row) for row in rows]
    roles = ["result", *(f"pin pin-{k}" for k in range(1, len(rows)))]
    shown = [Shown(name, role, status_words(row), row) for name, role, row in zip(names, roles, rows, strict=True)]
    outputs, limits = [output_rows(one) for one in seen], [limit_states(one) for one in seen]
    motion = moving(data, shown)
    return {
        "status": [status_words(row) for row in rows],
        "motion": motion and motion | {"ghosts": list(range(1, len(rows)))},
        "outputs": [
            {"name": same[0].name, "symbol": same[0].symbol, "text": same[0].text,
             "values": [one.value for one in same], "fast": [one.fast for one in same]}
            for same in zip(*outputs, strict=True)
        ],
        "limits": [
            {"name": same[0].shown.name, "symbol": same[0].shown.symbol, "bound": same[0].bound,
             "values": [one.value for one in same], "states": [one.state for one in same],
             "slack": [one.slack for one in same]}
            for same in zip(*limits, strict=True)
        ],
    }  # fmt: skip


def as_result(data: Dataset, row: Row) -> Dataset:
    """Return a study with a design in the place of its result."""
    return replace(data, best=row, optima=None, computed_reference=None)


def status_words(row: Row) -> str:
    """Say why a design has no values; empty where it has."""
    code = int(row.get("status", codes.OK))
    return "" if code == codes.OK else meaning(code)


PAGE = "comparison.html"


def write_comparison(folders: Sequence[Path], out: Path) -> Path:
    """Write a page with the results of several datasets side by side, all judged by the study of the first.

    Raises
    ------
    InputError
        for datasets of other mechanisms, or without a result.
    StoreError
        if the page cannot be written.
    """
    data = read_dataset(folders[0])
    names = _names([read_dataset(folder).study.name for folder in folders], folders)
    found = [chosen(folder) for folder in folders]
    own = data.study.bare.parameter_names
    for folder, one in zip(folders, found, strict=True):
        if not set(own) <= set(one.design):
            allowed = f"a dataset of the mechanism of {folders[0]}: {', '.join(own)}"
            raise InputError("folder", str(folder), allowed, "report")
    first = found[0].design
    rows = [row_of(data.study, first | {name: one.design[name] for name in own}) for one in found]
    compared = judged(data, rows, names)
    lines = [parameter_rows(as_result(data, row)) for row in rows]
    text = rendered(
        PAGE,
        names=names,
        folders=[str(folder) for folder in folders],
        study=data.study,
        dimensions=sorted(map(_values, zip(*lines, strict=True)), key=lambda line: len(set(line[2])) == 1),
        motion_data=embedded(compared["motion"]) if compared["motion"] else "",
        axis=compared["motion"]["axis"] if compared["motion"] else "",
        scripts=scripts_of(compared["motion"]),
        **{key: compared[key] for key in ("outputs", "limits", "status")},
    )
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"report {out}: cannot be written: {error}") from error
    write_atomically(out / PAGE, text.encode())
    return out / PAGE


def _names(studies: Sequence[str], folders: Sequence[Path]) -> list[str]:
    """Call results by their studies; by their folders where these are the same."""
    if len({*studies}) == len(studies):
        return list(studies)
    return [str(folder.parent.name if folder.name == "designs" else folder.name) for folder in folders]


def _values(same: Sequence[ParameterRow]) -> tuple[str, str, list[str]]:
    return same[0].name, same[0].text, [row.value for row in same]
