"""The page of the nights: each study's headline figures as trend lines, red where something changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from sweep.dataset.comparison import SLOWER
from sweep.dataset.files import write_atomically
from sweep.nights.archive import WORDS, NightRecord, StudyRecord, read_history
from sweep.nights.changes import SHARE
from sweep.pages import rendered
from sweep.report.quantities import number, quantity

INDEX = "index.html"
SHOWN = 60  # number of nights on the page
WIDTH, HEIGHT, EDGE = 240.0, 36.0, 5.0  # size and margin of a trend line [px]
DIGITS = 6
SECONDS = "time of the run"


class DatedFigure(NamedTuple):
    """A figure in one night; ``night`` is the index of the night among those shown."""

    night: int
    value: float
    red: bool
    words: str


def write_page(into: Path) -> Path:
    """Write ``index.html`` from the history, atomically; it needs no network."""
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


def study_rows(name: str, nights: Sequence[NightRecord], into: Path) -> SimpleNamespace:
    """Return the page's data of one study: its report (if it still exists), its last night, its trends."""
    mine = [(night.name, night.studies[name]) for night in nights if name in night.studies]
    last_night, last = mine[-1]
    reports = [night for night, record in mine if record.report and (into / night / name / "report.html").is_file()]
    order = [night.name for night in nights]
    trends = [_trend(figure, mine, order) for figure in dict.fromkeys(x for _, record in mine for x in record.figures)]
    trends += [_times(mine, order)] if any(record.seconds is not None for _, record in mine) else []
    return SimpleNamespace(
        name=name,
        report=f"{reports[-1]}/{name}/report.html" if reports else None,
        state=_state(last) if last_night == order[-1] else f"not in the last night; {_state(last)} on {last_night}",
        red=bool(last.changed) or last.state != "complete",
        words=last.changes or ((last.message,) if last.message else ()),
        trends=trends,
    )


def _trend(name: str, mine: Sequence[tuple[str, StudyRecord]], order: Sequence[str]) -> SimpleNamespace:
    """Return the trend of a headline figure, in a designer's unit."""

    def shown(record: StudyRecord) -> str:
        value, unit = record.figures[name], record.units.get(name, "")
        if name == SHARE:
            return f"{number(100.0 * value, DIGITS)}\u00a0%"
        return quantity(name, unit).show(value, DIGITS) if unit else number(value, DIGITS)

    with_it = [(night, record) for night, record in mine if name in record.figures]
    points = [
        DatedFigure(order.index(night), record.figures[name], name in record.moved, f"{night}: {shown(record)}")
        for night, record in with_it
    ]
    last = with_it[-1][1]
    unit = last.units.get(name, "")
    return _drawn(quantity(name, unit).heading if unit else name, shown(last), points, len(order))


def _times(mine: Sequence[tuple[str, StudyRecord]], order: Sequence[str]) -> SimpleNamespace:
    """Return the trend of the run's time, over nights in which something was computed."""
    points = [
        DatedFigure(order.index(night), record.seconds, record.changed == SLOWER, f"{night}: {record.seconds:.3g} s")
        for night, record in mine
        if record.seconds is not None
    ]
    return _drawn(SECONDS, f"{points[-1].value:.3g} s", points, len(order))


def _drawn(name: str, value: str, points: Sequence[DatedFigure], nights: int) -> SimpleNamespace:
    """Place the nights on a line, the smallest value at the bottom and the largest at the top."""
    values = np.array([point.value for point in points])
    span = float(np.ptp(values))
    x = EDGE + (WIDTH - 2.0 * EDGE) * np.array([p.night / (nights - 1) if nights > 1 else 1.0 for p in points])
    share = (values - values.min()) / span if span > 0.0 else np.full(values.size, 0.5)
    y = HEIGHT - EDGE - share * (HEIGHT - 2.0 * EDGE)
    places = zip(x.round(1).tolist(), y.round(1).tolist(), points, strict=True)
    dots = [SimpleNamespace(x=across, y=up, red=point.red, words=point.words) for across, up, point in places]
    line = " ".join(f"{dot.x},{dot.y}" for dot in dots)
    return SimpleNamespace(name=name, value=value, line=line, dots=dots, red=points[-1].red)


def _state(record: StudyRecord) -> str:
    if record.state == "failed":
        return f"failed ({record.code})"
    if record.state != "complete":
        return "cut off" if record.state == "cut" else "not begun"
    if record.edited:
        return "study file edited"
    words = {0: "no change", 10: "values changed", 11: "rows changed", 12: "slower"}
    return "first night" if record.compared_with is None else words[record.changed]


def _night_row(night: NightRecord, into: Path) -> SimpleNamespace:
    """Return the page's data of a night; without a log if its folder has been deleted."""
    kinds = [(name, record) for name, record in night.studies.items() if record.changed or record.state != "complete"]
    return SimpleNamespace(
        name=night.name,
        log=f"{night.name}/{WORDS}" if (into / night.name / WORDS).is_file() else None,
        verdict="; ".join(f"{name}: {_state(record)}" for name, record in kinds) or night.quiet,
        red=bool(kinds),
        seconds=f"{night.seconds:.3g} s",
    )
