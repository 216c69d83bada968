"""A study in parts for batch systems: ``split`` fixes the cut, each part is its own run, ``merge`` joins them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sweep.chunks.plan import make_plan
from sweep.dataset import chunk_files, files, store
from sweep.dataset.files import link_or_copy
from sweep.dataset.lock import locked
from sweep.engine.opening import open_plan, plan_note
from sweep.errors import InputError, whole
from sweep.study import load_study

PARTS = "parts"
MOST_PARTS = 10_000


def split(study: str | Path, out: str | Path, parts: int, *, smoke: bool = False) -> list[Path]:
    """Cut a study into chunks once, and make a folder for each of several runs that may go on at the same time.

    Each part is a run of consecutive chunks of one and the same cut.  ``sweep run STUDY --out PART`` computes only that
    part, on any machine; :func:`merge` brings the chunks together.  Optimum and front are searched afterwards by a run
    of the whole dataset.

    Parameters
    ----------
    study : study file or its folder
    out : folder of the chunks of the whole dataset
    parts : number of parts; at most as many as there are chunks are made
    smoke : take the study's tiny version

    Returns
    -------
    folders of the chunks of the parts, ``parts/0000/designs`` and so on beside ``out``.

    Raises
    ------
    InputError
        if the number is out of range, or ``out`` or a part holds data of another study
    LockedError, StoreError
        if a run is at work in ``out``, or the disk refuses.
    """
    whole("parts", parts, "split", 1, MOST_PARTS)
    model, folder = load_study(study, smoke=smoke), files.located(out)
    with locked(folder):
        plan = open_plan(model, folder, force=False)
        note = plan_note(model, folder, plan)
    count = min(parts, plan.chunks)
    folders = [files.beside(folder) / PARTS / f"{k:04d}" / files.DESIGNS for k in range(count)]
    for k, place in enumerate(folders):
        chunk_range = [plan.chunks * k // count, plan.chunks * (k + 1) // count]
        existing = files.read_plan(place)
        if existing is not None and (existing["identity"], existing.get("part")) != (plan.identity, chunk_range):
            allowed = "parts of this study cut in this way; remove the old ones first"
            raise InputError("part", str(place), allowed, "split")
        with files.store_errors(place):
            place.mkdir(parents=True, exist_ok=True)
        if existing is None:
            files.write_plan(place, note | {"part": chunk_range, "optimised": None, "complete": False})
    return folders


@dataclass(frozen=True)
class Merged:
    """Result of :func:`merge`: chunks taken in, chunks still missing, damaged chunks left where they are."""

    folder: Path
    taken: int
    missing: tuple[int, ...]
    damaged: tuple[Path, ...]


def merge(study: str | Path, out: str | Path, *, smoke: bool = False) -> Merged:
    """Link the finished chunks of all parts into the dataset; it may be called repeatedly.

    Parameters
    ----------
    study : study file or its folder
    out : folder of the chunks of the whole dataset, as given to :func:`split`
    smoke : take the study's tiny version

    Returns
    -------
    Merged
        ``sweep run STUDY --out OUT`` computes the chunks that are missing, then optimum and front.

    Raises
    ------
    InputError
        if there are no parts, or ``out`` or a part holds data of another study or other sources
    LockedError, StoreError
        if a run is at work in ``out``, or the disk refuses.
    """
    model, folder = load_study(study, smoke=smoke), files.located(out)
    places = sorted((files.beside(folder) / PARTS).glob(f"*/{files.DESIGNS}"))
    note = files.read_plan(folder)
    if note is None or not places:
        raise InputError("folder", str(out), "a folder that sweep split has prepared", "merge")
    plan = make_plan(model, note["chunk_size"])
    taken, damaged = 0, []
    with locked(folder):
        present = store.finished_chunks(folder, plan)
        for part in [part for place in places for part in chunk_files.parts(place)]:
            if part.identity != plan.identity:
                raise store.foreign(part.path.parent, f"the chunk {part.path.name}", plan)
            if part.index in present:
                continue
            if not chunk_files.is_whole(part):
                damaged.append(part.path)
                continue
            with files.store_errors(folder):
                link_or_copy(part.path, folder / part.path.name)
            present[part.index] = part
            taken += 1
    missing = tuple(index for index in range(plan.chunks) if index not in present)
    return Merged(folder, taken, missing, tuple(damaged))
