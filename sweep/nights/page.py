"""The page of the nights: each study's headline figures as trend lines, red where something changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


class ShownFigure(NamedTuple):
    """A figure of a study in one night: its heading, its value, the same in a designer's unit, whether it is red."""

    heading: str
    value: float
    words: str
    red: bool


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
    shown = {night: shown_figures(record) for night, record in mine}
    names = dict.fromkeys(figure for figures in shown.values() for figure in figures)
    trends = [
        _trend({order.index(night): figures[figure] for night, figures in shown.items() if figure in figures}, order)
        for figure in sorted(names, key=SECONDS.__eq__)
    ]
    return SimpleNamespace(
        name=name,
        report=f"{reports[-1]}/{name}/report.html" if reports else None,
        state=_state(last) if last_night == order[-1] else f"not in the last night; {_state(last)} on {last_night}",
        red=bool(last.changed) or last.state != "complete",
        words=last.changes or ((last.message,) if last.message else ()),
        trends=trends,
    )


def shown_figures(record: StudyRecord) -> dict[str, ShownFigure]:
    """Return the headline figures of a night by name, with the time of its run if something was computed."""
    figures = {}
    for name, value in record.figures.items():
        unit = record.units.get(name, "")
        shown = quantity(name, unit)
        words = shown.show(value, DIGITS) if unit else number(value, DIGITS)
        words = f"{number(100.0 * value, DIGITS)}\u00a0%" if name == SHARE else words
        figures[name] = ShownFigure(shown.heading if unit else name, value, words, name in record.moved)
    if record.seconds is not None:
        words = f"{record.seconds:.3g} s"
        figures[SECONDS] = ShownFigure(SECONDS, record.seconds, words, record.changed == SLOWER)
    return figures


def _trend(figures: Mapping[int, ShownFigure], order: Sequence[str]) -> SimpleNamespace:
    """Place the nights of a figure on a line, the smallest value at the bottom and the largest at the top."""
    values = np.array([figure.value for figure in figures.values()])
    span = float(np.ptp(values))
    x = EDGE + (WIDTH - 2.0 * EDGE) * np.array([k / (len(order) - 1) if len(order) > 1 else 1.0 for k in figures])
    share = (values - values.min()) / span if span > 0.0 else np.full(values.size, 0.5)
    y = HEIGHT - EDGE - share * (HEIGHT - 2.0 * EDGE)
    dots = [
        SimpleNamespace(x=across, y=up, red=figure.red, words=f"{order[k]}: {figure.words}")
        for across, up, (k, figure) in zip(x.round(1).tolist(), y.round(1).tolist(), figures.items(), strict=True)
    ]
    line = " ".join(f"{dot.x},{dot.y}" for dot in dots)
    last = list(figures.values())[-1]
    return SimpleNamespace(name=last.heading, value=last.words, line=line, dots=dots, red=last.red)


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
