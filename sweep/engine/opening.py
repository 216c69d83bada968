"""Opening of a dataset folder: its plan if it is this study's, otherwise a new one; other data are set aside."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sweep.chunks.plan import NOT_IN_CHUNKS, Plan, make_plan
from sweep.dataset import chunk_files, files, store
from sweep.dataset.files import TABLES
from sweep.study import Study

# Files that belong to these designs only, their report included.
OWN_FILES = (files.PLAN, *files.OF_OPTIMUM, files.PARETO, "report.html")


def open_plan(study: Study, folder: Path, force: bool, chunk_size: int | None = None) -> Plan:
    """Return the plan in the folder if it is this study's, otherwise a new one; foreign data need ``force``.

    ``chunk_size`` is that of a new plan, if an estimate has chosen it already.
    """
    note = files.read_plan(folder)
    if note is not None:
        plan = make_plan(study, note["chunk_size"])
        if plan.identity == note["identity"]:
            # The chunks keep the study as the first run wrote it, even if it is now written in other units.
            plan = replace(plan, name=note["name"], chunk_data=note["chunk_data"])
            if force:
                _set_foreign_aside(folder, plan, ())
            return plan
        if _differs_in_limits_only(study, note, plan):  # the old designs are sorted by the new limits
            old_folder = _set_foreign_aside(folder, plan, OWN_FILES)
            files.write_plan(folder, plan_note(study, folder, plan) | {"known": old_folder})
            return plan
        if not force:
            raise store.foreign(folder, _conflict(study, note, plan), plan)
    plan = make_plan(study, chunk_size)
    if force:
        _set_foreign_aside(folder, plan, OWN_FILES)
    store.finished_chunks(folder, plan)  # refuses foreign chunks before the plan is written
    files.write_plan(folder, plan_note(study, folder, plan))
    return plan


def _differs_in_limits_only(study: Study, noted: dict[str, Any], plan: Plan) -> bool:
    """Whether stored designs can be sorted by new limits: all rows were kept in float64, only limits changed."""
    before, now = (_in_chunks(data, "limits") for data in (noted.get("data") or {}, study.data))
    complete = study.output.keep == "all" and study.output.dtype == "float64"
    columns = [column.name for column in plan.columns]
    same = before == now and [column["name"] for column in noted.get("columns", [])] == columns
    return complete and same and noted.get("code") == plan.code


def _in_chunks(data: Mapping[str, Any], *others: str) -> dict[str, Any]:
    """Return the tables of a study that determine values in a chunk, without some others."""
    return {key: value for key, value in data.items() if key not in (*NOT_IN_CHUNKS, *others)}


def known_folder(folder: Path) -> Path | None:
    """Folder of the chunks from which this dataset's chunks are recomputed; None if there is none."""
    where = (files.read_plan(folder) or {}).get("known")
    return files.beside(folder) / where if isinstance(where, str) else None


def is_part(folder: Path) -> bool:
    """Whether the folder is for some of the chunks only, as ``sweep split`` makes it."""
    return "part" in (files.read_plan(folder) or {})


def part_range(folder: Path, chunks: int) -> range:
    """Range of the chunk indices that belong in the folder."""
    first, stop = (files.read_plan(folder) or {}).get("part", (0, chunks))
    return range(first, stop)


def _conflict(study: Study, noted: dict[str, Any], plan: Plan) -> str:
    """Describe how the data in the folder differ from those that this run would compute."""
    before, now = (_in_chunks(data) for data in (noted.get("data") or noted["chunk_data"], study.data))
    reasons = [] if noted.get("study") == plan.study else store.differences(before, now)
    if noted.get("code") != plan.code:
        reasons.append("other sources or libraries")
    name = noted["name"] if noted["name"] == study.name else f"{noted['name']}, not {study.name}"
    return f"{name}: {'; '.join(reasons) or 'cut in another way'}"


def _set_foreign_aside(folder: Path, plan: Plan, others: tuple[str, ...]) -> str:
    """Move chunks of other plans and some side files into a folder of old data; return its name."""
    place, old_folder = files.beside(folder), f"{files.OLD}/{time.strftime('%Y%m%d-%H%M%S')}"
    old = [part.path for part in chunk_files.parts(folder) if part.identity != plan.identity]
    old += [place / name for name in others if (place / name).is_file()]
    if old:
        files.set_aside(folder, old, old_folder)
    return old_folder


def words_of(study: Study) -> dict[str, Any]:
    """Return the texts of a plan about its study, reporting sections included, so that reports need no study file."""
    return {"about": {"name": study.name, "title": study.title, "question": study.question}, "data": study.data}


def plan_note(study: Study, folder: Path, plan: Plan) -> dict[str, Any]:
    """Return the content of ``_plan.json``, with an earlier run's notes about the optimum."""
    note = files.read_plan(folder) or {}
    return plan.as_dict() | {
        **words_of(study),
        "optimise": study.optimise is not None,
        "optimised": note.get("optimised"),
        "pareto": study.pareto is not None,
        "counts": note.get("counts"),
        "missed": note.get("missed"),
        "known": note.get("known"),
        TABLES: note.get(TABLES),
        **({"part": note["part"]} if "part" in note else {}),
        "complete": False,
    }
