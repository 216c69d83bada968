"""``verify``: checks every byte against its hash, every row against the plan, and recomputes some designs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.chunks import plan as plans
from sweep.chunks.chunk import compute_chunk
from sweep.chunks.parameters import parameter_matrix
from sweep.dataset import chunk_files, files, store
from sweep.dataset.files import TABLES, altered
from sweep.errors import InputError, LinksweepError, StoreError, how_many, whole
from sweep.families.base import Columns
from sweep.families.names import is_error
from sweep.study import Study
from sweep.study.load import study_of

if TYPE_CHECKING:
    import pandas as pd

# Exit codes of `sweep verify`: chunks or the optimum are missing; something is damaged or wrong.
INCOMPLETE, DAMAGED = 11, 74
# Keys that plan and chunks have in common.
SHARED = ("format", "study", "code", "designs", "chunks", "name")
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
DEFAULT_DESIGNS = 32

ANEW = "the next run moves it to _bad/ and computes it anew"
UNSEEN = "a run takes it as finished; move it away, then the next run computes it anew"


@dataclass(frozen=True)
class DatasetFault:
    """A fault of a dataset, and what ``sweep run`` will do about it.

    ``damage`` is False for parts that are only missing because a run has not ended.
    """

    path: Path
    words: str
    remedy: str
    damage: bool = True

    def __str__(self) -> str:
        return f"{self.path}: {self.words}; {self.remedy}"


@dataclass
class Verification:
    """Result of :func:`verify`; ``exit_code`` is the exit code of ``sweep verify``."""

    folder: Path
    chunks: int = 0
    rows: int = 0
    size: int = 0
    recomputed: int = 0
    findings: list[DatasetFault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, path: Path, words: str, remedy: str, damage: bool = True) -> None:
        """Add a fault to the findings."""
        self.findings.append(DatasetFault(path, words, remedy, damage))

    @property
    def exit_code(self) -> int:
        """74 if something is damaged or wrong, else 11 if something is missing, else 0."""
        if any(finding.damage for finding in self.findings):
            return DAMAGED
        return INCOMPLETE if self.findings else 0

    def lines(self) -> list[str]:
        """Describe the findings in words, one per line; the last line is the verdict."""
        words = [f"{how_many(self.chunks, 'whole chunk')}, {how_many(self.rows, 'row')}, {self.size} bytes read"]
        words += [f"{how_many(self.recomputed, 'design')} computed again"] if self.recomputed else []
        damaged, verdict = sum(finding.damage for finding in self.findings), "complete and undamaged"
        if self.findings:
            verdict = f"{damaged} damaged or lost, {len(self.findings) - damaged} not computed yet"
        words += [*self.notes, *map(str, self.findings), f"{self.folder}: {verdict}"]
        # File names may contain any bytes; undecodable ones are written as escapes.
        return [line.encode("utf-8", "backslashreplace").decode() for line in words]


def verify(folder: str | Path, designs: int = DEFAULT_DESIGNS) -> Verification:
    """Check a dataset; nothing is written.

    Every chunk is read and compared with the hash in its name.  Its rows are compared with the plan: columns, numbers
    and parameters of the designs, counts by status, no missing value without a status.  Some designs, spread over the
    space, are recomputed and compared bit by bit, designs without a row included.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    designs : number of designs that are recomputed, 0 for none.  If the chunks were computed by other sources or
        libraries, none are, and a note says so

    Returns
    -------
    Verification
        findings in words, each with what the next run will do about it; ``exit_code`` is 74 if something is damaged or
        wrong, 11 if chunks or the optimum are missing, else 0.

    Raises
    ------
    InputError
        if the folder is no dataset, or ``designs`` is negative
    StoreError
        if the disk cannot be read.

    Examples
    --------
    >>> import sweep
    >>> found = sweep.verify("results/press/designs", designs=4)
    >>> found.exit_code, found.lines()[1]
    (0, '4 designs computed again')
    """
    whole("designs", designs, "verify", 0)
    place = files.located(folder)
    plan = files.read_plan(place)
    chunks, strangers = chunk_files.listing(place)
    if plan is None and not chunks:
        raise InputError("folder", str(folder), "a dataset that sweep run wrote", "verify")
    result = Verification(place)
    for path in strangers:
        words = "no chunk, but every reader of the folder takes it for one"
        result.add(path, words, "the next run refuses it; move it away")
    about = plan or {}
    for part in chunks if plan is None else ():  # then the first readable chunk describes the study
        with suppress(StoreError):
            about = about or chunk_files.about(part)
    study = None if plan is None else _study(result, plan)
    if plan is None:
        # Chunks keep the study's tables, but not the order of the axes in them.
        result.notes.append("without the plan, parameters are not checked and no design is computed again")
        result.add(
            files.beside(place) / files.PLAN, "not there, or damaged", "the next run writes it and keeps the chunks"
        )
    sound = _sound_chunks(result, chunks, about, study)
    _missing(result, plan or {}, about.get("chunks", 0), sound)
    _side_files(result, plan or {})
    if study is not None and designs and sound:
        _recompute(result, study, about, sound, designs)
    return result


def _study(result: Verification, plan: dict[str, Any]) -> Study | None:
    """Study of the dataset; None, with a note, if this version cannot read it."""
    try:
        return study_of(plan, files.beside(result.folder) / files.PLAN)
    except LinksweepError as error:
        result.notes.append(f"the study cannot be read by this version, so parameters are not checked: {error}")
        return None


def _sound_chunks(
    result: Verification, chunks: list[chunk_files.ChunkFile], about: dict[str, Any], study: Study | None
) -> dict[int, chunk_files.ChunkFile]:
    """Return the undamaged chunks; faults of the others and of the rows are added to the findings."""
    sound: dict[int, chunk_files.ChunkFile] = {}
    for part in chunks:
        if part.identity != about.get("identity", part.identity):
            words = f"belongs to other data ({part.identity}, not {about['identity']})"
            result.add(part.path, words, "the next run refuses; --force sets it aside")
            continue
        try:
            file, metadata = part.read()
        except StoreError as error:
            if isinstance(error.__cause__, OSError):
                raise
            words = str(error).removeprefix(f"{part.path}: ").removesuffix(f"; {chunk_files.REMEDY}")
            result.add(part.path, words, ANEW)
            continue
        if part.index in sound:
            words = f"a second chunk {part.index}, besides {sound[part.index].path.name}"
            result.add(part.path, words, "the next run refuses; remove the one you do not trust")
            continue
        sound[part.index] = part
        rows = file.read().to_pandas()
        result.chunks, result.rows = result.chunks + 1, result.rows + len(rows)
        result.size += part.path.stat().st_size
        for words in row_faults(rows, metadata, about, study):
            result.add(part.path, words, UNSEEN)
    return sound


def _missing(result: Verification, plan: dict[str, Any], number: int, sound: dict[int, chunk_files.ChunkFile]) -> None:
    """Report missing chunks and searches that the plan asks for, and counts that differ from the chunks'."""
    named = {finding.path.name[: len("part-000000-")] for finding in result.findings}
    missing = [k for k in range(number) if k not in sound and f"part-{k:06d}-" not in named]
    complete = bool(plan.get("complete"))
    if missing:
        words = f"{len(missing)} of {number} chunks are missing, the first is {missing[0]}"
        words += ", although a run had finished them all" if complete else ""
        result.add(result.folder, words, "the next run computes them", damage=complete)
    place = files.beside(result.folder)
    optimum, front = place / files.OPTIMUM, place / files.PARETO
    if plan.get("optimise") and (plan.get("optimised") is None or not optimum.is_file()):
        result.add(optimum, "the search has not ended", "the next run searches it", damage=False)
    if plan.get("optimise") and plan.get("pareto") and not store.front_is_complete(front):
        result.add(front, "the front is not complete", "the next run goes on", damage=False)
    if complete and set(sound) == set(range(number)):
        counts = sum((Counter(chunk_files.about(part)["counts"]) for part in sound.values()), Counter[str]())
        if counts != Counter(plan.get("counts") or {}):
            words = f"counts {plan.get('counts')}, but the chunks hold {dict(counts)}"
            result.add(place / files.PLAN, words, "the next run writes the right ones")


def _side_files(result: Verification, plan: dict[str, Any]) -> None:
    """Check the tables beside the chunks: page checksums, and the hashes in the plan."""
    place, reported = files.beside(result.folder), {finding.path for finding in result.findings}
    for path in [place / name for name in files.SIDE_FILES]:
        if not path.is_file():
            if path.name in (plan.get(TABLES) or {}) and path not in reported:
                result.add(path, "not there any more", "the next run searches it anew")
            continue
        try:
            files.read_table(path)
            if altered(place, plan, [path.name]):
                raise StoreError(f"{path}: not as its search has written it")
        except StoreError as error:
            words = str(error).removeprefix(f"{path}: ").split("; delete it")[0]
            result.add(path, words, "the next run searches it anew")


def _recompute(
    result: Verification, study: Study, about: dict[str, Any], sound: dict[int, chunk_files.ChunkFile], number: int
) -> None:
    """Recompute some designs, each by itself, since a design's row does not depend on other designs."""
    if about.get("code") != plans.code_hash():
        result.notes.append("computed by other sources or libraries than these: no design was computed again")
        return
    abouts = ((index, chunk_files.about(part)) for index, part in sound.items())
    bounds = {index: (metadata["start"], metadata["stop"]) for index, metadata in abouts}
    fresh = replace(study)
    for index, chosen in spread(bounds, number).items():
        rows = sound[index].rows()
        for design in chosen:
            recomputed = compute_chunk(fresh, design, design + 1).columns
            result.recomputed += 1
            if words := unequal(rows[rows["design"] == design], recomputed):
                result.add(sound[index].path, f"design {design}: {words}", UNSEEN)


def row_faults(
    rows: pd.DataFrame, chunk: Mapping[str, Any], about: Mapping[str, Any], study: Study | None
) -> list[str]:
    """Describe the faults in the rows of one chunk.

    Parameters
    ----------
    rows : all rows and columns of the chunk
    chunk : metadata of the chunk
    about : the plan, or the metadata of a chunk where there is no plan
    study : gives the parameters of the design space; None if it is not known
    """
    faults = []
    if "chunk_size" in about:
        start = chunk["chunk"] * about["chunk_size"]
        stop = min(start + about["chunk_size"], about["designs"])
        if (chunk["start"], chunk["stop"]) != (start, stop):
            faults.append(f"designs {chunk['start']}:{chunk['stop']}, the plan says {start}:{stop}")
    expected = [(column["name"], column["dtype"]) for column in about.get("columns", [])]
    actual = [(str(name), str(dtype)) for name, dtype in rows.dtypes.items()]
    if expected and expected != actual:
        return [*faults, f"columns {actual}, the plan says {expected}"]
    if lacking := [name for name in ("design", "status") if name not in rows.columns]:
        return [*faults, f"no column {', '.join(lacking)}"]
    differing = [key for key in SHARED if key in about and chunk.get(key) != about[key]]
    differing += ["data"] if chunk.get("data") != about.get("chunk_data", chunk.get("data")) else []
    faults += [f"its metadata say another {', '.join(differing)} than the plan"] if differing else []
    designs, status = rows["design"].to_numpy(), rows["status"].to_numpy()
    if np.any(np.diff(designs) <= 0) or np.any((designs < chunk["start"]) | (designs >= chunk["stop"])):
        return [*faults, f"design numbers not growing inside {chunk['start']}:{chunk['stop']}"]
    faults += _count_faults(status, chunk)
    total = chunk["stop"] - chunk["start"]
    if study is not None and study.output.keep == "all" and len(rows) != total:
        faults.append(f"{how_many(len(rows), 'row')}, although every one of {total} designs is kept")
    outputs = [column["name"] for column in about.get("columns", []) if column["role"] == "output"]
    missing = rows.loc[status == 0, [name for name in outputs if not is_error(name)]].isna().any()
    faults += [f"{name}: missing values in rows whose status is ok" for name in missing.index[missing]]
    if study is not None and len(rows):
        faults += _parameter_faults(rows, chunk, study)
    return faults


def _count_faults(status: np.ndarray[Any, Any], chunk: Mapping[str, Any]) -> list[str]:
    faults = []
    counts, total = chunk["counts"], chunk["stop"] - chunk["start"]
    if sum(counts.values()) != total:
        faults.append(f"{how_many(sum(counts.values()), 'design')} counted, {total} in the chunk")
    codes, sizes = np.unique(status, return_counts=True)
    rows = {chunk_files.STATUS_NAMES.get(int(code), str(code)): int(n) for code, n in zip(codes, sizes, strict=True)}
    # Rows that were not kept are counted too; of a status either all rows are kept or none.
    if any(counts.get(name, 0) != count for name, count in rows.items()) or (counts.get("OK", 0) and "OK" not in rows):
        faults.append(f"rows by status {rows}, counted {counts}")
    return faults


def _parameter_faults(rows: pd.DataFrame, chunk: Mapping[str, Any], study: Study) -> list[str]:
    """Parameters that differ from the design space; those that [fit] sets or scales are not compared."""
    matrix, _ = parameter_matrix(study, chunk["start"], chunk["stop"])
    index = rows["design"].to_numpy() - chunk["start"]
    fitted = () if study.fit is None else (*study.fit.parameters(study.family), *study.rescaled)
    faults = []
    for k, name in enumerate(study.family.parameter_names):
        if name in fitted or name not in rows.columns:
            continue
        wrong = ~np.isclose(rows[name].to_numpy(), matrix[index, k], rtol=0.0, atol=0.0, equal_nan=True)
        if wrong.any():
            first = int(rows["design"].to_numpy()[wrong][0])
            faults.append(f"{name}: {int(wrong.sum())} values are not those of the design space (design {first})")
    return faults


def spread(bounds: Mapping[int, tuple[int, int]], number: int) -> dict[int, list[int]]:
    """Choose about ``number`` designs evenly spread over chunks of these bounds, by chunk; the same at every call."""
    indices = sorted(bounds)
    ends = np.cumsum([bounds[index][1] - bounds[index][0] for index in indices])
    places = np.unique((np.arange(1, number + 1) * GOLDEN % 1.0 * ends[-1]).astype(np.int64))
    chosen: dict[int, list[int]] = {}
    for k, place in zip(np.searchsorted(ends, places, side="right").tolist(), places.tolist(), strict=True):
        chosen.setdefault(indices[k], []).append(bounds[indices[k]][1] - int(ends[k]) + place)
    return chosen


def unequal(row: pd.DataFrame, again: Columns) -> str:
    """Describe how a stored row (one or none) differs from the recomputed design; empty if no bit differs."""
    if len(row) != len(again["design"]):
        return "has a row, computed again it has none" if len(row) else "has no row, computed again it has one"
    for name, values in again.items() if len(row) else ():
        if name not in row.columns:
            return f"no column {name}"
        stored = row[name].to_numpy()
        if not np.array_equal(stored, values, equal_nan=stored.dtype.kind == "f"):
            return f"{name} = {stored[0]!r}, computed again {values[0]!r}"
    return ""
