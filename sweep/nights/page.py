"""The page of the nights: each study's headline figures as trend lines, red where something moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sweep.dataset.comparison import SLOWER
from sweep.dataset.files import write_atomically
from sweep.nights.changes import YIELD
from sweep.nights.records import WORDS, NightRecord, StudyRecord, read_history
from sweep.report.figures import rendered
from sweep.report.quantities import number, quantity

INDEX = "index.html"
SHOWN = 60  # nights on the page
WIDTH, HEIGHT, EDGE = 240.0, 36.0, 5.0  # of a trend line [px]
DIGITS = 6
SECONDS = "time of the run"


@dataclass(frozen=True)
class Point:
    """A figure in one night, by the night's place among those shown."""

    night: int
    value: float
    red: bool
    words: str


@dataclass(frozen=True)
class Dot:
    """One night on a trend line."""

    x: float
    y: float
    red: bool
    words: str


@dataclass(frozen=True)
class Trend:
    """A headline figure over the nights: its last value, the line, the nights on it."""

    name: str
    value: str
    line: str
    dots: tuple[Dot, ...]
    red: bool


@dataclass(frozen=True)
class StudyRows:
    """A study on the page: where its report lies (if it is still there), how its last night went, its trends."""

    name: str
    report: str | None
    state: str
    red: bool
    words: tuple[str, ...]
    trends: tuple[Trend, ...]


@dataclass(frozen=True)
class NightRow:
    """A night on the page; ``log`` is None where its folder has been deleted."""

    name: str
    log: str | None
    verdict: str
    red: bool
    seconds: str


def write_page(into: Path) -> Path:
    """Write ``index.html`` from the history, as a whole; it needs no network."""
    nights = read_history(into)[-SHOWN:]
    names = sorted({name for night in nights for name in night.studies})
    text = rendered(
        "nights.html",
        studies=[study_rows(name, nights, into) for name in names],
        nights=[_night_row(night, into) for night in reversed(nights)],
        width=WIDTH,
        height=HEIGHT,
    )
    path = into / INDEX
    write_atomically(path, text.encode())
    return path


def study_rows(name: str, nights: Sequence[NightRecord], into: Path) -> StudyRows:
    """Return what the page says of one study."""
    mine = [(night.name, night.studies[name]) for night in nights if name in night.studies]
    last_night, last = mine[-1]
    reports = [night for night, record in mine if record.report and (into / night / name / "report.html").is_file()]
    names = list(dict.fromkeys(figure for _, record in mine for figure in record.figures))
    order = [night.name for night in nights]
    trends = [_trend(figure, mine, order) for figure in names]
    trends += [_times(mine, order)] if any(record.seconds is not None for _, record in mine) else []
    words = last.changes or ((last.message,) if last.message else ())
    return StudyRows(
        name,
        f"{reports[-1]}/{name}/report.html" if reports else None,
        _state(last) if last_night == nights[-1].name else f"not in the last night; {_state(last)} on {last_night}",
        bool(last.changed) or last.state != "complete",
        words,
        tuple(trends),
    )


def _trend(name: str, mine: Sequence[tuple[str, StudyRecord]], order: Sequence[str]) -> Trend:
    """Return a headline figure, in the unit a designer reads."""

    def shown(record: StudyRecord) -> str:
        unit = record.units.get(name, "")
        if name == YIELD:
            return f"{number(100.0 * record.figures[name], DIGITS)}\u00a0%"
        return quantity(name, unit).show(record.figures[name], DIGITS) if unit else number(record.figures[name], DIGITS)

    points = [
        Point(order.index(night), record.figures[name], name in record.moved, f"{night}: {shown(record)}")
        for night, record in mine
        if name in record.figures
    ]
    last = next(record for _, record in reversed(mine) if name in record.figures)
    unit = last.units.get(name, "")
    return _drawn(quantity(name, unit).heading if unit else name, shown(last), points, len(order))


def _times(mine: Sequence[tuple[str, StudyRecord]], order: Sequence[str]) -> Trend:
    """Return nights in which something was computed."""
    points = [
        Point(order.index(night), record.seconds, record.changed == SLOWER, f"{night}: {record.seconds:.3g} s")
        for night, record in mine
        if record.seconds is not None
    ]
    return _drawn(SECONDS, f"{points[-1].value:.3g} s", points, len(order))


def _drawn(name: str, value: str, points: Sequence[Point], nights: int) -> Trend:
    """Place the nights on a line, the smallest value at the bottom and the largest at the top."""
    low, high = (end(point.value for point in points) for end in (min, max))
    span = high - low
    dots = []
    for point in points:
        x = EDGE + (WIDTH - 2.0 * EDGE) * (point.night / (nights - 1) if nights > 1 else 1.0)
        share = (point.value - low) / span if span > 0.0 else 0.5
        y = HEIGHT - EDGE - share * (HEIGHT - 2.0 * EDGE)
        dots.append(Dot(round(x, 1), round(y, 1), point.red, point.words))
    line = " ".join(f"{dot.x},{dot.y}" for dot in dots)
    return Trend(name, value, line, tuple(dots), points[-1].red)


def _state(record: StudyRecord) -> str:
    if record.state == "failed":
        return f"failed ({record.code})"
    if record.state != "complete":
        return "cut off" if record.state == "cut" else "not begun"
    words = {0: "no change", 10: "values changed", 11: "rows changed", 12: "slower"}
    return "first night" if record.compared_with is None else words[record.changed]


def _night_row(night: NightRecord, into: Path) -> NightRow:
    kinds = [(name, record) for name, record in night.studies.items() if record.changed or record.state != "complete"]
    first = all(record.compared_with is None for record in night.studies.values())
    quiet = "first night, nothing to compare with" if first else "no change"
    verdict = "; ".join(f"{name}: {_state(record)}" for name, record in kinds) or quiet
    log = f"{night.name}/{WORDS}" if (into / night.name / WORDS).is_file() else None
    return NightRow(night.name, log, verdict, bool(kinds), f"{night.seconds:.3g} s")
