"""``compare``: differences between two datasets of one study: values, rows, missing values and time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.dataset import chunk_files, files
from sweep.dataset.files import check_tables
from sweep.dataset.store import differences
from sweep.errors import InputError, StoreError, how_many
from sweep.evaluation.statuses import meaning
from sweep.families.names import is_error

if TYPE_CHECKING:
    import pandas as pd

VALUES_CHANGED, ROWS_CHANGED, SLOWER = 10, 11, 12
DEFAULT_SLOWER = 1.5
# Runs shorter than this are not compared in speed [s].
LEAST_SECONDS = 5.0
ROLES = ("optimum", "reference")
# Number of changed rows that are named.
INCOMPARABLE = "no row is comparable"
NAMED = 5


@dataclass
class Moved:
    """Changes in one column: number of changed values, largest change, number of values that appeared or vanished."""

    name: str
    changed: int = 0
    missing: int = 0
    absolute: float = 0.0
    relative: float = 0.0
    where: str = ""
    kind: str = "design"
    places: list[str] = field(default_factory=list)

    def look(self, old: NDArray[Any], new: NDArray[Any], places: NDArray[Any], rtol: float) -> None:
        """Compare some rows of both datasets; ``places`` (n,) are the names of the rows."""
        a, b = np.asarray(old, np.float64), np.asarray(new, np.float64)
        self.missing += int((np.isnan(a) != np.isnan(b)).sum())
        size = np.maximum(np.abs(a), np.abs(b))
        with np.errstate(invalid="ignore"):
            absolute = np.where(a == b, 0.0, np.abs(a - b))
            # nan against a number is counted as missing above; an infinite difference always counts as a change
            exceeds = (absolute > rtol * size) | np.isinf(absolute)
        self.changed += int(exceeds.sum())
        self.places += [str(place) for place in places[exceeds][: NAMED - len(self.places)]]
        if exceeds.any():
            relative = np.where(exceeds, absolute / np.where((size > 0.0) & np.isfinite(size), size, 1.0), 0.0)
            worst = int(relative.argmax())
            if relative[worst] >= self.relative:
                self.relative, self.where = float(relative[worst]), f"{self.kind} {places[worst]}".strip()
            self.absolute = max(self.absolute, float(absolute[exceeds].max()))


@dataclass
class Comparison:
    """Result of :func:`compare`; ``exit_code`` is the exit code of ``sweep compare``."""

    rows: int = 0
    only_old: int = 0
    only_new: int = 0
    status_changed: int = 0
    designs: list[int] = field(default_factory=list)
    columns_only_old: tuple[str, ...] = ()
    columns_only_new: tuple[str, ...] = ()
    moved: dict[str, Moved] = field(default_factory=dict)
    seconds: tuple[float, float] | None = None
    slower: float = DEFAULT_SLOWER
    notes: tuple[str, ...] = ()

    @property
    def values_changed(self) -> bool:
        """Whether a value changed by more than the allowed relative change."""
        return any(column.changed for column in self.moved.values())

    @property
    def rows_changed(self) -> bool:
        """Whether rows, columns, a status or the pattern of missing values changed."""
        lost = any(column.missing for column in self.moved.values())
        return lost or bool(self.only_old or self.only_new or self.status_changed or self.columns_only_old)

    @property
    def is_slower(self) -> bool:
        """Whether the new run took more than ``slower`` times as long as the old one."""
        if self.seconds is None or max(self.seconds) < LEAST_SECONDS:
            return False
        return self.seconds[1] > self.slower * self.seconds[0]

    @property
    def exit_code(self) -> int:
        """11 if rows or missing values changed, else 10 if values did, else 12 if it was slower, else 0."""
        if self.rows_changed:
            return ROWS_CHANGED
        return VALUES_CHANGED if self.values_changed else SLOWER if self.is_slower else 0

    def lines(self) -> list[str]:
        """Describe the differences in words; of two mechanisms there is no more to say than that."""
        if any(note.endswith(INCOMPARABLE) for note in self.notes):
            return list(self.notes)
        lines = [*self.notes, f"{how_many(self.rows, 'row')} in both"]
        old, new = ", ".join(self.columns_only_old), ", ".join(self.columns_only_new)
        differences = {
            f"{how_many(self.only_old, 'row')} only in the old dataset": self.only_old,
            f"{how_many(self.only_new, 'row')} only in the new dataset": self.only_new,
            f"columns only in the old dataset: {old}": old,
            f"columns only in the new dataset: {new}": new,
            f"{how_many(self.status_changed, 'row')} with another status": self.status_changed,
            f"the first of these rows: designs {', '.join(map(str, self.designs))}": self.designs,
        }
        lines += [words for words, present in differences.items() if present]
        for column in self.moved.values():
            if column.changed:
                lines.append(
                    f"{column.name}: {how_many(column.changed, 'value')} changed, at most by {column.absolute:.3g}, "
                    f"relative {column.relative:.3g} (worst: {column.where}{_first(column)})"
                )
            if column.missing:
                lines.append(f"{column.name}: {how_many(column.missing, 'value')} appeared or went missing")
        if not (self.values_changed or self.rows_changed):
            lines.append("no value changed")
        if self.seconds is not None:
            before, now = self.seconds
            verdict = f", more than {self.slower:g} times as long" if self.is_slower else ""
            lines.append(f"time {before:.3g} s before, {now:.3g} s now{verdict}")
        return lines


def _first(column: Moved) -> str:
    """Name the first changed rows, if there is more than one."""
    if column.changed < 2:
        return ""
    return f"; the first: {', '.join(column.places)}{', ...' if column.changed > len(column.places) else ''}"


def compare(old: str | Path, new: str | Path, rtol: float = 0.0, slower: float = DEFAULT_SLOWER) -> Comparison:
    """Compare two datasets of one study, design by design, in bounded memory.

    Parameters
    ----------
    old, new : dataset folders written by ``sweep run``
    rtol : relative change of a value that is allowed; with 0 values have to be equal (0 and -0 are)
    slower : allowed ratio of the new run's time to the old one's

    Returns
    -------
    Comparison
        Differences of parameters, outputs and status of every design, and of optimum and reference if both studies
        optimise.  Error estimates are not compared.  Times are those of all runs into a folder together; they are
        compared only if both ended complete and one took 5 s or more.

    Raises
    ------
    InputError
        if a folder holds no dataset, or ``rtol`` or ``slower`` is out of range
    StoreError
        if a chunk is damaged, or lies under another chunk's name.

    Examples
    --------
    >>> import sweep
    >>> found = sweep.compare("results/press/designs", "results/press/designs")
    >>> found.exit_code, found.lines()[1]
    (0, 'no value changed')
    """
    if not rtol >= 0.0:
        raise InputError("rtol", rtol, "a relative change from 0", "compare")
    if not slower >= 1.0:
        raise InputError("slower", slower, "a factor from 1", "compare")
    datasets = [chunk_files.required_parts(folder, "compare") for folder in (old, new)]
    folders, chunks = (datasets[0][0], datasets[1][0]), [parts for _, parts in datasets]
    names = [_columns(parts) for parts in chunks]
    plans = [files.trusted_plan(folder) or {} for folder in folders]
    result = Comparison(slower=slower, notes=_notes(folders, plans), seconds=_seconds(*folders))
    result.columns_only_old = tuple(name for name in names[0] if name not in names[1])
    result.columns_only_new = tuple(name for name in names[1] if name not in names[0])
    shared = [name for name in names[0] if name in names[1] and name not in ("design", "status")]
    result.moved = {name: Moved(name) for name in shared}
    stops = [*(chunk_files.about(part)["stop"] for part in chunks[0]), math.inf]
    streams = [_rows(parts, columns, stops) for parts, columns in zip(chunks, names, strict=True)]
    for before, after in zip(*streams, strict=True):
        _look(result, before, after, rtol)
    result.notes += _other_designs(result, plans)
    _compare_optima(result, *folders, rtol)
    return result


def _columns(chunks: Sequence[chunk_files.ChunkFile]) -> list[str]:
    chunk_files.check_columns(chunks)
    return [name for name in chunks[0].read()[0].schema_arrow.names if not is_error(name)]


def _rows(
    chunks: Iterable[chunk_files.ChunkFile], columns: list[str], stops: Iterable[float]
) -> Iterator[pd.DataFrame]:
    """Yield the rows of a dataset in design order, split at the stops; one chunk at a time is in memory."""
    import pandas as pd

    rows, reached, remaining = pd.DataFrame({name: [] for name in columns}), 0, iter(chunks)
    for stop in stops:
        while reached < stop and (part := next(remaining, None)) is not None:
            file, metadata = part.read()
            reached, read = metadata["stop"], file.read(columns).to_pandas()
            rows = pd.concat([rows, read], ignore_index=True) if len(rows) else read
        if np.any(np.diff(rows["design"].to_numpy()) <= 0):
            where = next(iter(chunks)).path.parent
            raise StoreError(f"{where}: designs are not in their order, or there twice; see sweep verify")
        now = rows["design"] < stop
        yield rows[now]
        rows = rows[~now]


def _look(result: Comparison, old: pd.DataFrame, new: pd.DataFrame, rtol: float) -> None:
    designs, in_old, in_new = np.intersect1d(old["design"], new["design"], assume_unique=True, return_indices=True)
    result.rows += designs.size
    result.only_old += len(old) - designs.size
    result.only_new += len(new) - designs.size
    before, after = old["status"].to_numpy()[in_old], new["status"].to_numpy()[in_new]
    result.status_changed += int((before != after).sum())
    if len(result.designs) < NAMED:
        unmatched = np.setxor1d(old["design"], new["design"], assume_unique=True)
        named = np.union1d(unmatched, designs[before != after]).astype(np.int64)
        result.designs += named[: NAMED - len(result.designs)].tolist()
    for name, moved in result.moved.items():
        moved.look(old[name].to_numpy()[in_old], new[name].to_numpy()[in_new], designs, rtol)


def _compare_optima(result: Comparison, old: Path, new: Path, rtol: float) -> None:
    paths = [files.beside(folder) / files.OPTIMUM for folder in (old, new)]
    if not all(path.is_file() for path in paths):
        return
    for folder in (old, new):
        check_tables(folder, [files.OPTIMUM])
    tables = [files.read_table(path).drop_duplicates("role").set_index("role") for path in paths]
    for role in ROLES:
        if not all(role in table.index for table in tables):
            continue
        before, after = (table.to_dict("index")[role].get("status") for table in tables)
        if before != after:
            result.status_changed += 1
            result.notes += (f"status of the {role}: {_in_words(before)} before, {_in_words(after)} now",)
        for name in [name for name in result.moved if all(name in table.columns for table in tables)]:
            before, after = (np.array([table.loc[role, name]], np.float64) for table in tables)
            moved = Moved(f"{name} of the {role}", kind="")
            result.moved[moved.name] = moved
            moved.look(before, after, np.array([role]), rtol)


def _in_words(status: Any) -> str:
    return f"{status} ({meaning(status)})"


def _mechanism(plan: Mapping[str, Any]) -> str:
    """Name the mechanism of a dataset: its family, its chain, or the members of its machine."""
    data = plan.get("data") or plan.get("chunk_data") or {}
    members = data.get("machine") or {"": data.get("mechanism") or {}}
    stages = {name: "+".join(of.get("chain") or [of.get("family", "")]) for name, of in members.items()}
    return ", ".join(f"{name}={chain}" if name else chain for name, chain in sorted(stages.items()))


def _other_designs(result: Comparison, plans: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Say of two studies whose rows of one number are different designs what that means for the changes."""
    parameters = {c["name"] for plan in plans for c in plan.get("columns", ()) if c["role"] == "parameter"}
    other = [name for name, moved in result.moved.items() if name in parameters and moved.changed]
    if not other or plans[0].get("study") == plans[1].get("study") or len({_mechanism(plan) for plan in plans}) > 1:
        return ()
    words = "rows are compared by their numbers, and with these the two studies number different designs"
    return (f"the designs differ in {', '.join(other)}: {words}, so changed values do not concern one mechanism",)


def _notes(folders: Sequence[Path], plans: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    notes = [
        f"{folder}: not complete"
        for folder, plan in zip(folders, plans, strict=True)
        if not plan.get("complete") or chunk_files.missing_chunks(folder, chunk_files.parts(folder))
    ]
    mechanisms = [_mechanism(plan) for plan in plans]
    if all(mechanisms) and mechanisms[0] != mechanisms[1]:
        notes.insert(0, f"two studies of different mechanisms, {mechanisms[0]} and {mechanisms[1]}: {INCOMPARABLE}")
    elif plans[0].get("study") != plans[1].get("study"):
        words = differences(*(plan.get("chunk_data") or {} for plan in plans))
        notes.append(f"the studies differ in what determines the values: {'; '.join(words) or 'fixed tables'}")
    if plans[0].get("code") != plans[1].get("code"):
        notes.append("computed by different versions of the code or its libraries")
    return tuple(notes)


def _seconds(old: Path, new: Path) -> tuple[float, float] | None:
    """Time of all runs into each folder [s]; None unless the last run into both was complete."""
    times = []
    for folder in (old, new):
        ends = [line for line in files.read_runs(folder) if line.get("event") == "end"]
        if not ends or ends[-1].get("outcome") != "complete":
            return None
        seconds = [line.get("seconds", 0.0) for line in ends]
        if not all(isinstance(value, (int, float)) for value in seconds):
            return None
        times.append(float(sum(seconds)))
    return times[0], times[1]
