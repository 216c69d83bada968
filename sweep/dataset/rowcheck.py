"""Whether the rows of a chunk are those that its plan asks for, and whether a design computed again is the same."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.chunks.parameters import parameter_matrix
from sweep.dataset.parts import STATUS_NAMES
from sweep.families.base import Columns
from sweep.families.names import is_error
from sweep.study import Study

if TYPE_CHECKING:
    import pandas as pd

# What plan and chunks both say.
SHARED = ("format", "study", "code", "designs", "chunks", "name")

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def row_faults(rows: pd.DataFrame, own: Mapping[str, Any], about: Mapping[str, Any], study: Study | None) -> list[str]:
    """Return what is wrong with the rows of one chunk, in words.

    Parameters
    ----------
    rows : all of them, all columns
    own : metadata of the chunk
    about : the plan, or the metadata of a chunk where there is no plan
    study : whose design space gives the parameters; None if it is not known
    """
    faults = []
    if "chunk_size" in about:
        start = own["chunk"] * about["chunk_size"]
        stop = min(start + about["chunk_size"], about["designs"])
        if (own["start"], own["stop"]) != (start, stop):
            faults.append(f"designs {own['start']}:{own['stop']}, the plan says {start}:{stop}")
    wanted = [(column["name"], column["dtype"]) for column in about.get("columns", [])]
    there = [(str(name), str(dtype)) for name, dtype in rows.dtypes.items()]
    if wanted and wanted != there:
        return [*faults, f"columns {there}, the plan says {wanted}"]
    lacking = [name for name in ("design", "status") if name not in rows.columns]
    if lacking:
        return [*faults, f"no column {', '.join(lacking)}"]
    apart = [key for key in SHARED if key in about and own.get(key) != about[key]]
    apart += ["data"] if own.get("data") != about.get("chunk_data", own.get("data")) else []
    if apart:
        faults.append(f"its metadata say another {', '.join(apart)} than the plan")
    designs, status = rows["design"].to_numpy(), rows["status"].to_numpy()
    if np.any(np.diff(designs) <= 0) or np.any((designs < own["start"]) | (designs >= own["stop"])):
        return [*faults, f"design numbers not growing inside {own['start']}:{own['stop']}"]
    faults += _count_faults(status, own)
    if study is not None and study.output.keep == "all" and len(rows) != own["stop"] - own["start"]:
        faults.append(f"{len(rows)} rows, although every one of {own['stop'] - own['start']} designs is kept")
    good = status == 0
    for column in about.get("columns", []):
        name = column["name"]
        if column["role"] == "output" and not is_error(name) and np.isnan(rows[name].to_numpy()[good]).any():
            faults.append(f"{name}: missing values in rows whose status is ok")
    if study is not None and len(rows):
        faults += _parameter_faults(rows, own, study)
    return faults


def _count_faults(status: np.ndarray[Any, Any], own: Mapping[str, Any]) -> list[str]:
    faults = []
    noted, number = own["counts"], own["stop"] - own["start"]
    if sum(noted.values()) != number:
        faults.append(f"{sum(noted.values())} designs counted, {number} in the chunk")
    codes, found = np.unique(status, return_counts=True)
    rows = {STATUS_NAMES.get(int(code), str(code)): int(count) for code, count in zip(codes, found, strict=True)}
    # Rows that were not kept are counted; what is kept is kept of its status entirely.
    if any(noted.get(name, 0) != count for name, count in rows.items()) or (noted.get("OK", 0) and "OK" not in rows):
        faults.append(f"rows by status {rows}, counted {noted}")
    return faults


def _parameter_faults(rows: pd.DataFrame, own: Mapping[str, Any], study: Study) -> list[str]:
    """Parameters that are not those of the design space; what [fit] sets or scales is left to the recomputing."""
    matrix, _ = parameter_matrix(study, own["start"], own["stop"])
    at = rows["design"].to_numpy() - own["start"]
    fitted = () if study.fit is None else (*study.fit.parameters(study.family), *study.rescaled)
    faults = []
    for k, name in enumerate(study.family.parameter_names):
        if name in fitted or name not in rows.columns:
            continue
        wrong = ~_same(rows[name].to_numpy(), matrix[at, k])
        if wrong.any():
            first = int(rows["design"].to_numpy()[wrong][0])
            faults.append(f"{name}: {int(wrong.sum())} values are not those of the design space (design {first})")
    return faults


def _same(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    return np.asarray((one == other) | ((one != one) & (other != other)))


def spread(bounds: Mapping[int, tuple[int, int]], number: int) -> dict[int, list[int]]:
    """Choose about ``number`` designs spread evenly over chunks of these bounds, by chunk; the same at every call."""
    indices = sorted(bounds)
    ends = np.cumsum([bounds[index][1] - bounds[index][0] for index in indices])
    chosen: dict[int, list[int]] = {}
    for place in sorted({int((k + 1) * GOLDEN % 1.0 * ends[-1]) for k in range(number)}):
        k = int(np.searchsorted(ends, place, side="right"))
        index = indices[k]
        chosen.setdefault(index, []).append(bounds[index][1] - int(ends[k]) + place)
    return chosen


def unequal(row: pd.DataFrame, again: Columns) -> str:
    """Return how a stored row (one or none) differs from the design computed again; empty if no bit does."""
    if len(row) != len(again["design"]):
        kept = "has a row" if len(row) else "has no row"
        return f"{kept}, computed again it {'has none' if len(row) else 'has one'}"
    if not len(row):
        return ""
    for name, values in again.items():
        if name not in row.columns:
            return f"no column {name}"
        stored = row[name].to_numpy()
        if not bool(_same(stored, values)[0]):
            return f"{name} = {stored[0]!r}, computed again {values[0]!r}"
    return ""
