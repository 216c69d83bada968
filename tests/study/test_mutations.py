"""Whatever stands in a study file: an answer, or an error raised on purpose; never a traceback, a hang, a wrong OK."""

from __future__ import annotations

import signal
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

import sweep
from sweep.engine.estimate import check_budget, estimate
from sweep.engine.run import run
from sweep.errors import LinksweepError
from sweep.report.dataset import gather
from sweep.report.page import write_report
from sweep.study import load_study
from tests.support.mutated_studies import DWELL, EDGES, LOCUS, NAMES_OF_FAMILIES, NEEDLE, ROCKER, mutated, plain

SECONDS = 20
COMPILING = 200
MOST_DESIGNS = 3000


class Hangs(Exception):
    """The time was up."""


@contextmanager
def no_longer_than(seconds: int) -> Iterator[None]:
    def ring(number: int, frame: FrameType | None) -> None:
        raise Hangs(f"more than {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def outcome(text: str, folder: Path, *, searched: int = 1, drawn: int = 4) -> str:
    """What becomes of a study file: "answered", "refused", or what is wrong with the answer.

    A second time nothing has to be compiled.  Optimum and front are searched for one in ``searched`` of the studies,
    figures are drawn for one in ``drawn``; the rest is computed and gathered.
    """
    begin = time.process_time()
    try:
        return _outcome(text, folder, COMPILING, searched, drawn)
    finally:
        if time.process_time() - begin > SECONDS:
            _outcome(text, folder.with_name(f"{folder.name}-again"), SECONDS, searched, drawn)


def _outcome(text: str, folder: Path, seconds: int, searched: int, drawn: int) -> str:
    folder.mkdir()
    (folder / "study.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        with no_longer_than(seconds):
            study = load_study(folder)
            check_budget(study, estimate(study, 1))
            if study.space.count > MOST_DESIGNS:
                return "large"
            lot = zlib.crc32(text.encode("utf-8", "surrogatepass"))
            if lot % searched:
                study = replace(study, optimise=None, pareto=None)
            rows = sweep.load(run(study, folder / "designs", jobs=1))
            if lot % drawn:
                gather(folder / "designs")
            else:  # figures take most of the time
                write_report(folder / "designs")
    except LinksweepError as error:
        assert str(error)
        return "refused"
    results = rows.loc[rows["status"] == 0].drop(columns=["design", "status"])
    if not np.isfinite(results.to_numpy()).all():
        return "status 0 beside a number that is not finite"
    return "answered"


def wrong(seeds: range, folder: Path) -> tuple[list[str], Counter[str]]:
    """The seeds whose files end in anything but an answer or a refusal, and how often each end was met."""
    found, ends = [], Counter[str]()
    for seed in seeds:
        text = mutated(seed)
        try:
            end = outcome(text, folder / str(seed))
        except Exception as error:  # this is what is looked for
            end = f"{type(error).__name__}: {str(error)[:200]}"
            end += f" at {traceback.extract_tb(error.__traceback__)[-1]}"
        ends[end if end in ("answered", "refused", "large") else "wrong"] += 1
        if end not in ("answered", "refused", "large"):
            found.append(f"seed {seed}: {end}")
    return found, ends


def test_the_files_that_are_mutated_are_sound(tmp_path: Path) -> None:
    for name, text in (("rocker", ROCKER), ("dwell", DWELL), ("locus", LOCUS), ("needle", NEEDLE)):
        assert outcome(text, tmp_path / name) == "answered"


@pytest.mark.parametrize(("text", "old", "new"), EDGES, ids=range(len(EDGES)))
def test_numbers_at_the_ends_of_what_a_number_can_be(text: str, old: str, new: str, tmp_path: Path) -> None:
    assert text.count(old) == 1
    assert outcome(text.replace(old, new), tmp_path / "study") in ("answered", "refused")


@pytest.mark.long
def test_many_mutated_study_files_are_answered_or_refused(tmp_path: Path) -> None:
    found, ends = wrong(range(1000, 3500), tmp_path)
    assert not found, "\n".join(found)
    assert ends["answered"] > 100 and ends["refused"] > 1000, ends


def test_studies_of_every_family_are_mutated_and_sound(tmp_path: Path) -> None:
    for name in NAMES_OF_FAMILIES:
        (tmp_path / f"{name}.toml").write_text(plain(name))
        assert load_study(tmp_path / f"{name}.toml").family.name == name
    found = "".join(mutated(seed) for seed in range(0, 25 * len(NAMES_OF_FAMILIES), 5))
    assert [name for name in NAMES_OF_FAMILIES if f'family = "{name}"' not in found] == []
