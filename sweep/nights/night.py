"""``nightly``: one night from its first study to its page."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sweep.dataset import chunk_files, files, store
from sweep.errors import INFEASIBLE, InputError, LinksweepError, StoreError, TimeUsedUp, WorkerDied, how_many
from sweep.nights import archive
from sweep.nights.archive import Journal, NightRecord, RunState, StudyRecord
from sweep.nights.carry import REPORT, Carried, carry
from sweep.nights.changes import Changes, changes, figures, slower
from sweep.nights.page import write_page
from sweep.nights.studies import FIGURE, RUN_LOG, Ended, StudyEntry, call, draw, in_order, notify, studies_in
from sweep.study import Study

# Exit codes that a run sets itself; any other is that of a process that died.
TOLD = (2, 3, 74, 75)
CUT = (TimeUsedUp.exit_code, 130, 143)
GRAVEST_FIRST = (11, 10, TimeUsedUp.exit_code, 12)


@dataclass(frozen=True)
class Settings:
    """Settings of a night: folder, time budget [s], number of nights kept, workers, and command for changes."""

    into: Path
    budget: float
    keep: int = 14
    jobs: int = 2
    backend: str = "threading"
    smoke: bool = False
    on_change: str | None = None


def nightly(studies: Iterable[str | Path], settings: Settings, say: Callable[[str], None]) -> NightRecord:
    """Compute all studies into a dated folder, compare them with the last good night, write the page of the nights.

    Parameters
    ----------
    studies : study files, folders with one, or folders of such folders
    settings : see :class:`Settings`
    say : called with every line of the log

    Returns
    -------
    NightRecord
        ``exit_code`` is 0 if nothing changed; that of the run if one failed, 74 before others; 11 if rows or statuses
        changed, 10 if values did; 124 if the time ran out before all studies were complete; 12 if one was slower.

    Raises
    ------
    InputError
        if there are no studies, or a setting is out of range
    LockedError
        if another night is running in the folder
    StoreError
        if the disk is full or refuses a write.
    """
    if not settings.budget > 0.0:
        raise InputError("budget", settings.budget, "a time above 0 s", "nightly")
    if settings.keep < 1:
        raise InputError("keep", settings.keep, "a number of nights from 1", "nightly")
    wanted = studies_in(map(Path, studies), settings.smoke)
    with archive.one_at_a_time(settings.into):
        earlier = archive.nights(settings.into)[::-1]
        night = _Night(settings, earlier, archive.new_night(settings.into), say)
        return night.through(in_order(wanted, earlier))


class _Night:
    """State of a running night."""

    def __init__(self, settings: Settings, earlier: list[Path], folder: Path, say: Callable[[str], None]) -> None:
        self.settings, self.earlier, self.folder = settings, earlier, folder
        self.good = archive.good_nights(settings.into)[::-1]
        self.journal = Journal(folder, say)
        self.history = archive.read_history(settings.into, lambda words: self.journal.note("history", words))
        self.begin = time.monotonic()

    @property
    def left(self) -> float:
        """Remaining time [s]."""
        return self.settings.budget - (time.monotonic() - self.begin)

    def through(self, studies: list[StudyEntry]) -> NightRecord:
        """Process all studies, then the page, old nights and the notification, and return the record."""
        names = ", ".join(one.name for one in studies)
        self.journal.note("night", f"night {self.folder.name}: {names}", studies=[one.name for one in studies])
        before = archive.read_night(self.good[0]) if self.good else None
        if absent := sorted({*(before.studies if before else ())}.difference(one.name for one in studies)):
            self.journal.note("absent", f"not among tonight's studies: {', '.join(absent)}", studies=absent)
        records: dict[str, StudyRecord] = {}
        try:
            for one in studies:
                records[one.name] = record = self.study(one)
                about: dict[str, Any] = {"state": record.state, "code": record.code, "changed": record.changed}
                about |= {"changes": record.changes, "seconds": record.seconds}
                self.journal.note("study", _words(one.name, record), study=one.name, **about)
        except KeyboardInterrupt as error:
            self.interrupted(studies, records, 128 + getattr(error, "number", signal.SIGINT))
            raise
        result = self.written(records, exit_code(records))
        if result.good:
            archive.point_latest(self.settings.into, self.folder)
        gone = archive.drop_old(self.settings.into, self.settings.keep)
        if gone:
            self.journal.note("dropped", f"old nights deleted: {', '.join(gone)}", nights=gone)
        write_page(self.settings.into)
        verdict = _verdict(result)
        self.journal.note("end", verdict, exit_code=result.exit_code, good=result.good)
        if result.exit_code and self.settings.on_change is not None:
            text = (self.folder / archive.WORDS).read_text(encoding="utf-8")
            fault = notify(self.settings.on_change, self.folder, result.exit_code, text)
            self.journal.note("told", f"--on-change {fault or 'ran'}", fault=fault)
        return result

    def written(self, records: Mapping[str, StudyRecord], code: int) -> NightRecord:
        """Write the record of this night to its folder and to the history."""
        result = NightRecord(self.folder.name, time.monotonic() - self.begin, code, records)
        archive.write_night(self.folder, result)
        archive.append_history(self.settings.into, result)
        return result

    def interrupted(self, studies: list[StudyEntry], records: Mapping[str, StudyRecord], code: int) -> None:
        """Write the record and the page of a night that a signal has interrupted."""
        left = [one.name for one in studies if one.name not in records]
        message = "the night was interrupted"
        at_work, after = StudyRecord("cut", code, message=message), StudyRecord("waiting", code, message=message)
        self.written({**records, **{name: after if k else at_work for k, name in enumerate(left)}}, code)
        kept = f"{', '.join(records)} kept" if records else "no study complete"
        where = left[0] if left else "its end"
        words = f"interrupted at {where}: {kept}; finished chunks are kept, and the next night goes on"
        self.journal.note("interrupted", words, exit_code=code)
        write_page(self.settings.into)

    def study(self, one: StudyEntry) -> StudyRecord:
        """Link, compute, report and compare one study."""
        if one.study is None:
            return StudyRecord("failed", 2, message=one.fault)
        if self.left <= 0.0:
            return StudyRecord("waiting", TimeUsedUp.exit_code)
        target = self.folder / one.name
        try:
            carried = carry(one.study, self.earlier, target) or Carried()
            ended = Ended(0, 0.0, "") if carried.whole else self.run(one, target)
            # A proof that died leaves designs and optimum complete; no feasible design is an answer, too.
            died = ended.code not in (0, INFEASIBLE, TimeUsedUp.exit_code)
            if died or not store.is_complete(target / files.DESIGNS):
                state: RunState = "cut" if ended.code in CUT else "failed"
                code = ended.code if ended.code in (*TOLD, *CUT) else WorkerDied.exit_code
                linked = (carried.night, carried.chunks)
                return StudyRecord(state, code, *linked, seconds=ended.seconds, message=ended.message)
            figure = one.path.parent / FIGURE
            if figure.is_file() and not carried.whole:
                drawn = draw(figure, target, target / RUN_LOG, self.left)
                if drawn.code:
                    self.journal.note("figure", f"{one.name}: {FIGURE} ended with {drawn.code}: {drawn.message}")
            return self.finished(one.study, target, carried, ended)
        except LinksweepError as error:
            return StudyRecord("failed", error.exit_code, message=str(error))

    def run(self, one: StudyEntry, target: Path) -> Ended:
        """Compute what is missing, within the remaining time."""
        words = ["run", str(one.path.resolve()), "--out", str(target / files.DESIGNS)]
        words += ["--jobs", str(self.settings.jobs), "--backend", self.settings.backend]
        return call([*words, *(["--smoke"] if self.settings.smoke else [])], target / RUN_LOG, self.left)

    def finished(self, study: Study, target: Path, carried: Carried, ended: Ended) -> StudyRecord:
        """Write the report of a complete dataset, compare it, and return the record."""
        message, cut = "", ended.message if ended.code == TimeUsedUp.exit_code else ""
        if not (target / REPORT).is_file():
            report_run = call(["report", str(target)], target / RUN_LOG, max(self.left, 0.0))
            message = report_run.message
            if report_run.code == StoreError.exit_code:
                raise StoreError(message.removeprefix("sweep: "))
        reported = (target / REPORT).is_file()
        designs = target / files.DESIGNS
        chunks = len(chunk_files.parts(designs))
        values, units = figures(study, designs)
        base = self.base(study.name)
        difference = Changes(0, ())
        if base is not None and not (carried.whole and carried.night == base.name):
            difference = changes(study, base / study.name / files.DESIGNS, designs)
        if not carried.chunks:
            late = slower(study.name, ended.seconds, self.history)
            difference = replace(difference, code=difference.code or late.code, lines=(*difference.lines, *late.lines))
        return StudyRecord(
            "complete",
            linked_from=carried.night,
            linked=carried.chunks,
            computed=chunks - carried.chunks,
            seconds=None if carried.whole else ended.seconds,
            figures=values,
            units=units,
            compared_with=base.name if base else None,
            changed=difference.code,
            changes=difference.lines,
            moved=difference.moved,
            edited=difference.edited,
            report=reported,
            message="; ".join(filter(None, [cut, "" if reported else f"no report: {message}"])),
        )

    def base(self, name: str) -> Path | None:
        """Return the last good night with a complete dataset of this study."""
        return next((night for night in self.good if store.is_complete(night / name / files.DESIGNS)), None)


def exit_code(studies: Mapping[str, StudyRecord]) -> int:
    """Return the exit code of a night: the most serious of its studies' codes."""
    failed = [record.code for record in studies.values() if record.state == "failed"]
    if failed:
        return StoreError.exit_code if StoreError.exit_code in failed else failed[0]
    changed = {record.changed for record in studies.values()}
    if any(record.state != "complete" for record in studies.values()):
        changed.add(TimeUsedUp.exit_code)
    return next((code for code in GRAVEST_FIRST if code in changed), 0)


def _words(name: str, record: StudyRecord) -> str:
    """Describe the result of one study."""
    if record.state == "waiting":
        return f"{name}: not begun, the time was over"
    linked = f", {how_many(record.linked, 'chunk')} linked from {record.linked_from}" if record.linked else ""
    if record.state == "cut":
        return f"{name}: cut off, the time was over{linked}; the next night begins with it"
    if record.state == "failed":
        return f"{name}: failed with {record.code}: {record.message}"
    took = (
        "nothing to compute"
        if record.seconds is None
        else f"{how_many(record.computed, 'chunk')} in {record.seconds:.3g} s"
    )
    lines = [f"{name}: {took}{linked}", *record.changes, *([record.message] if record.message else [])]
    if record.compared_with is None:
        lines.append("the first good night with it, nothing to compare with")
    elif not record.changed:
        lines.append(f"no change since {record.compared_with}")
    return "\n          ".join(lines)


def _verdict(record: NightRecord) -> str:
    """Return the last line of a night's log."""
    changed = [f"{name} ({entry.changed})" for name, entry in record.studies.items() if entry.changed]
    unfinished = [name for name, entry in record.studies.items() if entry.state in ("cut", "waiting")]
    failed = [name for name, entry in record.studies.items() if entry.state == "failed"]
    parts = [("changed", changed), ("not ready", unfinished), ("failed", failed)]
    words = "; ".join(f"{word}: {', '.join(names)}" for word, names in parts if names)
    return f"{words or record.quiet} (exit code {record.exit_code}, {record.seconds:.3g} s)"
