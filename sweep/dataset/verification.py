"""``verify``: every byte against its hash, every row against the plan, some designs computed again."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.chunks import plan as plans
from sweep.chunks.chunk import compute_chunk
from sweep.dataset import store
from sweep.dataset.files import TABLES, altered
from sweep.dataset.rowcheck import row_faults, spread, unequal
from sweep.errors import InputError, LinksweepError, StoreError
from sweep.study import Study
from sweep.study.load import study_from_data

if TYPE_CHECKING:
    import pandas as pd

# What `sweep verify` ends with: chunks or the optimum are missing; something is damaged or wrong.
INCOMPLETE, DAMAGED = 11, 74
DEFAULT_DESIGNS = 32

ANEW = "the next run moves it to _bad/ and computes it anew"
UNSEEN = "a run takes it as finished; move it away, then the next run computes it anew"
SIDE_FILES = (store.OPTIMUM, store.CURVES, store.SENSITIVITY, store.TOLERANCE, store.PARETO, store.PROOF)


@dataclass(frozen=True)
class Finding:
    """Something that is not as it should be, and what ``sweep run`` will do about it.

    ``damage`` is False for what is only missing because a run has not ended.
    """

    path: Path
    words: str
    remedy: str
    damage: bool = True

    def __str__(self) -> str:
        return f"{self.path}: {self.words}; {self.remedy}"


@dataclass
class Verification:
    """What :func:`verify` found; ``exit_code`` is what ``sweep verify`` ends with."""

    folder: Path
    chunks: int = 0
    rows: int = 0
    size: int = 0
    recomputed: int = 0
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        """74 if something is damaged or wrong, else 11 if something is missing, else 0."""
        if any(finding.damage for finding in self.findings):
            return DAMAGED
        return INCOMPLETE if self.findings else 0

    def lines(self) -> list[str]:
        """Return the findings in words, one per line; the last line is the verdict."""
        words = [f"{self.chunks} whole chunks, {self.rows} rows, {self.size} bytes read"]
        words += [f"{self.recomputed} designs computed again"] if self.recomputed else []
        damaged = sum(finding.damage for finding in self.findings)
        verdict = "complete and undamaged"
        if self.findings:
            verdict = f"{damaged} damaged, {len(self.findings) - damaged} missing"
        words += [*self.notes, *map(str, self.findings), f"{self.folder}: {verdict}"]
        # The name of a file may be anything; bytes that are no letters are shown as such.
        return [line.encode("utf-8", "backslashreplace").decode() for line in words]


def verify(folder: str | Path, designs: int = DEFAULT_DESIGNS) -> Verification:
    """Check a dataset; nothing is written.

    Every chunk is read and compared with the hash in its name.  Its rows are compared with the plan: columns, numbers
    and parameters of the designs, counts by status, no missing value without a status.  Some designs, spread over the
    space, are computed again and compared to the bit, rows that were not kept included.

    Parameters
    ----------
    folder : what ``sweep run`` wrote
    designs : how many designs are computed again, 0 for none.  None are where the chunks were computed by other
        sources or libraries; a note says so

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
        if the disk refuses to read.

    Examples
    --------
    >>> import sweep
    >>> found = sweep.verify("results/press/designs", designs=4)
    >>> found.exit_code, found.lines()[1]
    (0, '4 designs computed again')
    """
    if isinstance(designs, bool) or not isinstance(designs, int) or designs < 0:
        raise InputError("designs", designs, "a whole number from 0", "verify")
    place = store.located(folder)
    plan = store.read_plan(place)
    chunks, strangers = store.listing(place)
    if plan is None and not chunks and not strangers:
        raise InputError("folder", str(folder), "a dataset that sweep run wrote", "verify")
    found = Verification(place)
    words = "no chunk, but every reader of the folder takes it for one"
    found.findings += [Finding(path, words, "the next run refuses it; move it away") for path in strangers]
    about = plan or _about_without_plan(chunks)
    study = None if plan is None else _study(found, plan, place)
    if plan is None:
        # Chunks keep the study's tables, not the order of the axes in them.
        found.notes.append("without the plan, parameters are not checked and no design is computed again")
        path = store.beside(place) / store.PLAN
        found.findings.append(Finding(path, "not there, or damaged", "the next run writes it and keeps the chunks"))
    whole = _whole_chunks(found, chunks, about, study)
    _missing(found, place, plan, about, whole)
    _totals(found, place, plan, whole)
    _side_files(found, place, plan or {})
    if study is not None and designs and whole:
        _recompute(found, study, about, whole, designs)
    return found


def _about_without_plan(chunks: Iterable[store.Part]) -> dict[str, Any]:
    """Return what the first readable chunk says of the study."""
    for part in chunks:
        try:
            about = store.about(part)
        except StoreError:
            continue
        return about
    return {}


def _study(found: Verification, plan: dict[str, Any], place: Path) -> Study | None:
    """Return the study the dataset answers; None, with a note, if this version does not understand it."""
    data = plan.get("data") or plan["chunk_data"]
    try:
        title = plan.get("about") or {"name": plan["name"]}
        return study_from_data({**data, "study": title}, store.beside(place) / store.PLAN)
    except LinksweepError as error:
        found.notes.append(f"the study cannot be read by this version, so parameters are not checked: {error}")
        return None


def _whole_chunks(
    found: Verification, chunks: list[store.Part], about: dict[str, Any], study: Study | None
) -> dict[int, store.Part]:
    """Return the chunks that are what their names say; what is wrong with the others, or with their rows, is noted."""
    whole: dict[int, store.Part] = {}
    for part in chunks:
        if part.identity != about.get("identity", part.identity):
            words = f"belongs to other data ({part.identity}, not {about['identity']})"
            found.findings.append(Finding(part.path, words, "the next run refuses; --force sets it aside"))
            continue
        try:
            data = part.read()
        except StoreError as error:
            if isinstance(error.__cause__, OSError):
                raise
            words = str(error).removeprefix(f"{part.path}: ").removesuffix(f"; {store.REMEDY}")
            found.findings.append(Finding(part.path, words, ANEW))
            continue
        if part.index in whole:
            words = f"a second chunk {part.index}, besides {whole[part.index].path.name}"
            found.findings.append(Finding(part.path, words, "the next run refuses; remove the one you do not trust"))
            continue
        whole[part.index] = part
        rows = _rows(data)
        found.chunks, found.rows, found.size = found.chunks + 1, found.rows + len(rows), found.size + len(data)
        found.findings += [
            Finding(part.path, words, UNSEEN) for words in row_faults(rows, store.about(part, data), about, study)
        ]
    return whole


def _rows(data: bytes) -> pd.DataFrame:
    import pandas as pd

    return pd.read_parquet(io.BytesIO(data))


def _missing(
    found: Verification, place: Path, plan: dict[str, Any] | None, about: dict[str, Any], whole: dict[int, store.Part]
) -> None:
    """Report chunks that are missing, and the optimum or front that the plan asks for and that is missing."""
    named = {finding.path.name for finding in found.findings}
    lost = [k for k in range(about.get("chunks", 0)) if k not in whole]
    lost = [k for k in lost if not any(name.startswith(f"part-{k:06d}-") for name in named)]
    if lost:
        words = f"{len(lost)} of {about['chunks']} chunks are missing, the first is {lost[0]}"
        complete = bool(plan and plan.get("complete"))
        words += ", although a run had finished them all" if complete else ""
        found.findings.append(Finding(place, words, "the next run computes them", damage=complete))
    if plan is None or not plan.get("optimise"):
        return
    optimum = store.beside(place) / store.OPTIMUM
    if plan.get("optimised") is None or not optimum.is_file():
        found.findings.append(Finding(optimum, "the search has not ended", "the next run searches it", damage=False))
    front = store.beside(place) / store.PARETO
    if plan.get("pareto") and not store.front_is_complete(front):
        found.findings.append(Finding(front, "the front is not complete", "the next run goes on", damage=False))


def _totals(found: Verification, place: Path, plan: dict[str, Any] | None, whole: dict[int, store.Part]) -> None:
    """Compare the designs by status that the plan notes with those of the chunks."""
    if plan is None or not plan.get("complete") or set(whole) != set(range(plan["chunks"])):
        return
    counts: Counter[str] = Counter()
    for part in whole.values():
        counts.update(store.about(part)["counts"])
    if counts != Counter(plan.get("counts") or {}):
        path = store.beside(place) / store.PLAN
        words = f"counts {plan.get('counts')}, but the chunks hold {dict(counts)}"
        found.findings.append(Finding(path, words, "the next run writes the right ones"))


def _side_files(found: Verification, place: Path, plan: dict[str, Any]) -> None:
    """Check the tables beside the chunks: the checksums of their pages, and the hashes that the plan notes."""
    for name in SIDE_FILES:
        path = store.beside(place) / name
        if not path.is_file():
            if name in (plan.get(TABLES) or {}) and path not in {finding.path for finding in found.findings}:
                found.findings.append(Finding(path, "not there any more", "the next run searches it anew"))
            continue
        try:
            store.read_table(path)
            if altered(store.beside(place), plan, [name]):
                raise StoreError(f"{path}: not as its search has written it")
        except StoreError as error:
            words = str(error).removeprefix(f"{path}: ").split("; delete it")[0]
            found.findings.append(Finding(path, words, "the next run searches it anew"))


def _recompute(
    found: Verification, study: Study, about: dict[str, Any], whole: dict[int, store.Part], number: int
) -> None:
    """Compute some designs again, each by itself: what a design gets does not depend on its company."""
    if about.get("code") != plans.code_hash():
        found.notes.append("computed by other sources or libraries than these: no design was computed again")
        return
    bounds = {index: (store.about(part)["start"], store.about(part)["stop"]) for index, part in whole.items()}
    fresh = replace(study)
    for index, chosen in spread(bounds, number).items():
        rows = whole[index].rows()
        for design in chosen:
            again = compute_chunk(fresh, design, design + 1).columns
            found.recomputed += 1
            words = unequal(rows[rows["design"] == design], again)
            if words:
                found.findings.append(Finding(whole[index].path, f"design {design}: {words}", UNSEEN))
