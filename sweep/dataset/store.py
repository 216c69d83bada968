"""A dataset as a whole: its finished chunks, its completeness and its rows."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.dataset import chunk_files
from sweep.dataset.files import BAD, OPTIMUM, PARETO, beside, located, metadata, read_plan, set_aside
from sweep.errors import IncompleteWarning, InputError, StoreError

if TYPE_CHECKING:
    import pandas as pd

    from sweep.chunks.plan import Plan

MOST = 6  # differences of two studies that are reported at most
WITHOUT_UNIT = ("count", "scale")  # keys of a parameter that its unit does not belong to


def finished_chunks(
    folder: Path, plan: Plan, tell: Callable[[int, int], None] = lambda _, __: None
) -> dict[int, chunk_files.ChunkFile]:
    """List the chunks of the plan that need not be computed again; damaged ones are moved to ``_bad/``.

    ``tell`` is called with the number of chunks read and of all chunks in the folder.

    Raises
    ------
    InputError
        if a chunk belongs to another study or another version of the code.
    """
    finished: dict[int, chunk_files.ChunkFile] = {}
    present = chunk_files.parts(folder)
    for k, part in enumerate(present):
        tell(k, len(present))
        if part.identity != plan.identity or part.index >= plan.chunks:
            raise foreign(folder, f"the chunk {part.path.name}", plan)
        if not chunk_files.is_whole(part):
            set_aside(folder, [part.path], BAD)
        elif part.index in finished:
            raise _twice(folder, finished[part.index], part)
        else:
            finished[part.index] = part
    return finished


def _twice(folder: Path, one: chunk_files.ChunkFile, other: chunk_files.ChunkFile) -> StoreError:
    names = f"{one.path.name} and {other.path.name}"
    return StoreError(f"{folder}: two different chunks {one.index}, {names}; remove the one you do not trust")


def parts_of_one_table(folder: str | Path, verb: str) -> tuple[Path, list[chunk_files.ChunkFile]]:
    """Return the folder of designs of a dataset, and its chunks, of one study and each once.

    Raises
    ------
    InputError
        if the folder holds no chunks
    StoreError
        for chunks of different data, or two of one number.
    """
    place, chunks = chunk_files.required_parts(folder, verb)
    for one, other in pairwise(chunks):
        if one.identity != other.identity:
            names = f"{one.path.name} and {other.path.name}"
            raise StoreError(f"{place}: chunks of different studies or sources, {names}; they are not one table")
        if one.index == other.index:
            raise _twice(place, one, other)
    return place, chunks


def foreign(folder: Path, what: str, plan: Plan) -> InputError:
    """Make the error for data of another study or code, which are never mixed."""
    allowed = (
        f"data of this study, as its file is now, and of this version of the program (identity {plan.identity}); "
        "take another folder with --out, or set what is there aside with sweep run --force"
    )
    return InputError("dataset", what, allowed, str(folder))


def totals(folder: Path) -> tuple[dict[str, int], dict[str, int]]:
    """Count the designs by the name of their status, and by the limit they miss, from the metadata of all chunks."""
    counts: Counter[str] = Counter()
    missed: Counter[str] = Counter()
    for part in chunk_files.parts(folder):
        metadata = chunk_files.about(part)
        counts.update(metadata["counts"])
        missed.update(metadata["missed"])
    return {name: counts[name] for name in chunk_files.STATUS_NAMES.values() if name in counts}, dict(missed)


def is_complete(folder: str | Path) -> bool:
    """Whether every chunk of the dataset's plan is whole, and the optimum is there if the study asks for one.

    Parameters
    ----------
    folder : folder written by ``sweep run``

    Returns
    -------
    bool
        False also for a folder without a dataset

    Examples
    --------
    >>> import sweep
    >>> sweep.is_complete("results/press/designs"), sweep.is_complete("results/none")
    (True, False)
    """
    place = located(folder)
    plan = read_plan(place)
    if plan is None:
        return False
    parts = [part for part in chunk_files.parts(place) if part.identity == plan["identity"]]
    sound = {part.index for part in parts if chunk_files.is_whole(part)}
    optimum = plan.get("optimised") is not None and (beside(place) / OPTIMUM).is_file()
    front = not plan.get("pareto") or front_is_complete(beside(place) / PARETO)
    return sound == set(range(plan["chunks"])) and ((optimum and front) or not plan["optimise"])


def front_is_complete(path: Path) -> bool:
    """Whether the search of the front in this file has ended."""
    fields = metadata(path)
    return fields.get(b"complete") == b"true" or fields.get(b"ended") == b"time"


def front_cut_short(path: Path) -> str | None:
    """Return how much of a front was left out by its time limit, as ``5 of 28``; None if nothing was."""
    fields = metadata(path)
    return None if fields.get(b"complete") != b"false" else fields.get(b"steps", b"").decode() or None


def load(folder: str | Path, units: bool = False) -> pd.DataFrame:
    """Read the finished part of a dataset, in design order.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    units : whether column names include their units, ``alpha1 [rad]``

    Returns
    -------
    DataFrame
        ``design``, parameters [mm, rad], outputs, ``status``; ``attrs["units"]`` gives the unit of each column.  Units
        and definitions are in the Parquet field metadata and in ``_plan.json``, too.

    Raises
    ------
    InputError
        if the folder holds no chunks
    StoreError
        if a chunk is damaged, lies under another chunk's name, or exists twice.

    Warns
    -----
    IncompleteWarning
        if chunks are missing.

    Examples
    --------
    >>> import sweep
    >>> rows = sweep.load("results/press/designs")
    >>> len(rows), rows.attrs["units"]["max_pressure_angle"]
    (25, 'rad')
    >>> rows.nsmallest(1, "max_abs_d2s")[["a", "b", "max_abs_d2s"]].round(4).values.tolist()
    [[9.5, 31.5, 12.4546]]
    >>> [name for name in sweep.load("results/press/designs", units=True) if name.startswith(("a", "max_p"))]
    ['a [mm]', 'max_pressure_angle [rad]']
    """
    import pyarrow as pa

    place, chunks = parts_of_one_table(folder, "load")
    tables = [part.read()[0].read() for part in chunks]
    chunk_files.check_columns(chunks, [table.schema for table in tables])
    missing = chunk_files.missing_chunks(place, chunks)
    if missing:
        text = f"{place}: incomplete, {len(missing)} of {len(missing) + len(chunks)} chunks are missing"
        text += f" (the first is {missing[0]}); run the study again to have them computed"
        warnings.warn(text, IncompleteWarning, stacklevel=2)
    rows: pd.DataFrame = pa.concat_tables(tables).to_pandas()
    unit_of = chunk_files.noted(tables[0].schema)
    if units:
        rows = rows.rename(
            columns={name: f"{name} [{unit}]" for name, unit in unit_of.items() if unit not in ("", "1")}
        )
    rows.attrs["units"] = unit_of
    return rows


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Describe keys whose values differ, such as ``limits.swing.min 170 -> 50 deg``; at most six of them."""
    lines = list(_lines(old, new, ""))
    more = [f"and {len(lines) - MOST} more"] if len(lines) > MOST else []
    return lines[:MOST] + more


def _lines(old: Mapping[str, Any], new: Mapping[str, Any], place: str) -> list[str]:
    lines: list[str] = []
    units = old.get("unit"), new.get("unit")
    for key in [*new, *(key for key in old if key not in new)]:
        before, now = old.get(key), new.get(key)
        name = f"{place}{key}"
        if before == now or (key == "unit" and len(old) > 1):
            continue
        if isinstance(before, Mapping) and isinstance(now, Mapping):
            lines += _lines(before, now, f"{name}.")
        else:
            if isinstance(before, list) and isinstance(now, list) and len(before) == len(now) > MOST:
                pairs = [pair for pair in zip(before, now, strict=True) if pair[0] != pair[1]]
                before, now = [x for x, _ in pairs], [x for _, x in pairs]
            unit_before, unit = (None, None) if key in WITHOUT_UNIT else units
            unit_before = unit_before if unit_before != unit else None
            lines.append(f"{name} {_written(before, unit_before)} -> {_written(now, unit)}")
    if not lines and units[0] != units[1]:
        lines.append(f"{place}unit {_written(units[0])} -> {_written(units[1])}")
    return lines


def _written(value: Any, unit: Any = None) -> str:
    if value is None:
        return "none"
    if isinstance(value, Mapping):
        own, unit = value.get("unit"), None
        value = ", ".join(
            f"{key} = {_written(v, None if key in WITHOUT_UNIT else own)}" for key, v in value.items() if key != "unit"
        )
    if isinstance(value, list):
        value = f"{len(value)} values" if len(value) > MOST else ", ".join(map(str, value))
    text = str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}" if unit and unit != "1" else text
