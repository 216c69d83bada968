"""The cost of a study before it starts, against what a run leaves behind; and the refusal over the budget."""

from __future__ import annotations

import itertools
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sweep.chunks.cascade import ordered_routes
from sweep.costs import nanoseconds
from sweep.engine.estimate import check_budget, duration, estimate, other_accuracies, searches
from sweep.engine.run import run
from sweep.errors import BudgetError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.optimise.starts.dataset import random_designs
from sweep.study import Study, load_study, study_from_data
from sweep.study.study import Budget
from tests.optimise.test_robust import ROBUST

PROOF = "with the proof that no peak is missed"
TEXT = """
[study]
name = "cost"
[mechanism]
family = "rssr"
[scene]
want = ["margin", "max_pressure_angle"]
[design]
a = "10 mm"
b = { from = 30, to = 60, count = COUNT, unit = "mm" }
c = { from = 20, to = 60, count = 50, unit = "mm" }
e = "40 mm"
f = "5 mm"
g = "3 mm"
alpha = { from = 0, to = 90, count = 10, unit = "deg" }
[limits]
rotatable = true
[output]
keep = "KEEP"
"""


def study(folder: Path, count: int = 40, keep: str = "feasible") -> Study:
    (folder / "study.toml").write_text(TEXT.replace("COUNT", str(count)).replace("KEEP", keep))
    return load_study(folder)


def test_estimate_grows_with_the_designs(tmp_path: Path) -> None:
    small, large = estimate(study(tmp_path, 4000), 2), estimate(study(tmp_path, 40_000), 2)
    assert large.designs == 10 * small.designs == 20_000_000
    assert large.chunks == -(-large.designs // large.chunk_size)
    assert large.seconds == pytest.approx(10 * small.seconds, rel=0.2)
    assert large.disk_bytes == pytest.approx(10 * small.disk_bytes, rel=0.2)
    assert large.memory_bytes < 2 * 2**30


def test_a_small_study_costs_more_per_design(tmp_path: Path) -> None:
    """Every route is called at least once a chunk, however few designs it gets."""
    small, large = estimate(study(tmp_path), 2), estimate(study(tmp_path, 40_000), 2)
    assert small.seconds / small.designs > 1.5 * large.seconds / large.designs


def test_two_workers_take_half_the_time_and_more_memory(tmp_path: Path) -> None:
    one, two = estimate(study(tmp_path), 1), estimate(study(tmp_path), 2)
    assert one.seconds == pytest.approx(1.94 * two.seconds)
    assert one.memory_bytes < two.memory_bytes


def test_dropping_infeasible_designs_saves_disk(tmp_path: Path) -> None:
    some, everything = estimate(study(tmp_path), 2), estimate(study(tmp_path, keep="all"), 2)
    assert everything.kept == 1.0
    assert some.disk_bytes == pytest.approx(some.kept * everything.disk_bytes, rel=0.2)


@pytest.mark.parametrize("count", [400, 2])  # of a small study most lies in the footer, per column
def test_disk_estimate_is_close_to_that_of_a_run(tmp_path: Path, count: int) -> None:
    question = study(tmp_path, count)
    expected = estimate(question, 2)
    folder = run(question, tmp_path / "designs")
    size = sum(part.stat().st_size for part in folder.glob("part-*"))
    assert expected.disk_bytes / 1.5 < size < expected.disk_bytes * 1.5
    assert len(list(folder.glob("part-*"))) == expected.chunks


def test_within_the_budget_nothing_is_raised(tmp_path: Path) -> None:
    question = study(tmp_path)
    check_budget(question, estimate(question, 2))


def test_over_the_budget_is_refused_with_both_reasons_and_exit_code_3(tmp_path: Path) -> None:
    question = replace(study(tmp_path), budget=Budget(disk_bytes=1.0, seconds=1e-6))
    with pytest.raises(BudgetError, match=r"time about .* \(budget.time\); disk about .* \(budget.disk\)") as caught:
        check_budget(question, estimate(question, 2))
    assert caught.value.exit_code == 3


def test_the_default_budget_refuses_10_to_the_12_designs(tmp_path: Path) -> None:
    text = TEXT.replace("count = 50", "count = 100000").replace("COUNT", "1000000").replace("KEEP", "feasible")
    (tmp_path / "study.toml").write_text(text)
    question = load_study(tmp_path)
    with pytest.raises(BudgetError, match=r"1 000 000 000 000 designs on.*disk about \d\d \d00 GB; allowed: 20 GB"):
        check_budget(question, estimate(question, 2))


def with_accuracy(folder: Path, accuracy: str) -> Study:
    text = (
        TEXT.replace("COUNT", "40").replace("KEEP", "feasible").replace('"margin",', '"max_abs_d2psi", "max_abs_psi",')
    )
    (folder / "study.toml").write_text(f"{text}[accuracy]\n{accuracy}\n")
    return load_study(folder)


def test_one_digit_more_costs_more_and_one_less_costs_less(tmp_path: Path) -> None:
    model = with_accuracy(tmp_path, "target = 1e-8")
    found = dict(other_accuracies(model, 2))
    assert list(found) == ["one digit less", "one digit more", PROOF]
    assert found["one digit less"] < estimate(model, 2).seconds < found["one digit more"] < found[PROOF]


def test_twice_the_samples_cost_nearly_twice(tmp_path: Path) -> None:
    model = with_accuracy(tmp_path, "samples = 1440")
    found, now = dict(other_accuracies(model, 2)), estimate(model, 2).seconds
    assert list(found) == ["half the samples", "twice the samples"]
    # Twice the samples halve the designs of a chunk, so the fixed time of each chunk comes twice as often.
    assert 1.6 < found["twice the samples"] / now < 2.05
    assert 0.5 < found["half the samples"] / now < 0.65


@pytest.mark.parametrize(
    ("accuracy", "left"), [("target = 1e-14", ["one digit less", PROOF]), ("samples = 8", ["twice the samples"])]
)
def test_no_price_is_named_for_what_cannot_be_asked(tmp_path: Path, accuracy: str, left: list[str]) -> None:
    assert [words for words, _ in other_accuracies(with_accuracy(tmp_path, accuracy), 1)] == left


WINDOWED = """
[study]
name = "window"
[mechanism]
family = "guide"
[scene]
want = [WANTED]
window = { from = 0.1, to = 0.7 }
[design]
a = "10 mm"
b = { from = 24, to = 26, count = 3, unit = "mm" }
c = "25 mm"
e = "20 mm"
xi = "50 mm"
eta = "0 mm"
lam = "90 deg"
h = "0 mm"
"""


@pytest.mark.parametrize(("wanted", "proven"), [('"max_abs_dev", "max_abs_d2s"', [PROOF]), ('"max_abs_dev"', [])])
def test_no_proof_is_priced_of_what_counts_in_a_window_alone(tmp_path: Path, wanted: str, proven: list[str]) -> None:
    (tmp_path / "study.toml").write_text(WINDOWED.replace("WANTED", wanted))
    found = [words for words, _ in other_accuracies(load_study(tmp_path), 1)]
    assert found == ["one digit less", "one digit more", *proven]


@pytest.mark.parametrize(("wanted", "windows"), [("max_abs_dev", 1), ("range_dev", 2), ("window_angle", 1)])
def test_ends_of_a_window_have_the_price_of_events(tmp_path: Path, wanted: str, windows: int) -> None:
    # Without them a sweep was said to take a hundredth of its time; a window's search costs more than its ends alone.
    (tmp_path / "study.toml").write_text(WINDOWED.replace("WANTED", f'"{wanted}"'))
    (route,) = ordered_routes(load_study(tmp_path))
    assert windows * nanoseconds("work", "event") < route.ns_per_design < 4 * windows * nanoseconds("work", "event")


@pytest.mark.parametrize("jobs", [1, 2])
def test_price_of_what_follows_counts_every_search(monkeypatch, jobs):
    """A look takes 10 ms: 27 s of a population and 36 s of a robust end were measured at 9."""
    monkeypatch.setattr("sweep.engine.estimate.search", lambda *_: SimpleNamespace(looks=10, ended="looks"))
    ticks = itertools.count(step=0.1)
    monkeypatch.setattr("sweep.engine.estimate.time.process_time", lambda: next(ticks))
    monkeypatch.setattr("sweep.engine.estimate._made_seconds", lambda *_: (7.0, 0.5))
    study = load_study(Path(__file__).parents[2] / "studies" / "needle208")
    designs, _ = design_matrix(study.family, study.reference)
    found = {name: (typical, most) for name, typical, most in searches(study, jobs, SimpleNamespace(kept=designs))}
    assert list(found) == ["search", "tolerances", "what is made", "tables and report"]
    assert found["what is made"] == (7.0 / jobs, 7.0)
    # A population and the searches from two of its ends; those from two designs of the sweep where they are needed.
    assert found["search"] == pytest.approx((3 * (30.0 + 12.0) / jobs, (40 * (30.0 + 80.0) + 80.0) / jobs))
    whole = (4 * 16.0 + 3 * 40.0 + 3 * 30.0) / jobs
    # Three samples of what is made of each of three ends, and eleven at most.
    few, many = 3 * 3 * 0.5 / jobs, 11 * 3 * 0.5 / jobs
    assert found["tolerances"] == pytest.approx((whole + few, 2.0 * whole + many))


def test_price_of_what_is_made_counts_every_mechanism(monkeypatch):
    """Nine minutes of mechanisms of a back-rest were said to be five seconds of tables and report."""
    clock = [0.0]

    def taking_a_millisecond(family, designs, *given):
        clock[0] += 1e-3 * len(designs)
        return design_outputs(family, designs, *given)

    monkeypatch.setattr("sweep.optimise.manufacture.sample.design_outputs", taking_a_millisecond)
    monkeypatch.setattr("sweep.optimise.manufacture.sample.batch_size", lambda _: 100)
    monkeypatch.setattr("sweep.engine.estimate.time.process_time", lambda: clock[0])
    monkeypatch.setattr("sweep.engine.estimate.search", lambda *_: SimpleNamespace(looks=25, ended="converged"))
    monkeypatch.setattr("sweep.engine.estimate.sample_seconds", lambda *_: 0.0)
    study = study_from_data(tomllib.loads(ROBUST), "study.toml")
    design = design_matrix(study.family, study.reference)[0]
    found = {name: most for name, _, most in searches(study, 1, SimpleNamespace(kept=design))}
    # Yields of optimum, drawing and reference, outputs of the first and the last, costs of seven dimensions.
    assert found["what is made"] == pytest.approx(1e-3 * (3 * 65536 + 2 * 2048 + 7 * 512))
    assert clock[0] == pytest.approx(0.6, abs=0.11)  # no more than has to be tried


def test_price_of_searches_that_converge_is_that_of_the_looks_they_take(monkeypatch):
    """The tolerances of a crank-rocker of seven dimensions were said to take 66 s, and took 1.6."""
    monkeypatch.setattr("sweep.engine.estimate.search", lambda *_: SimpleNamespace(looks=25, ended="converged"))
    ticks = itertools.count(step=0.025)
    monkeypatch.setattr("sweep.engine.estimate.time.process_time", lambda: next(ticks))
    monkeypatch.setattr("sweep.engine.estimate.sample_seconds", lambda *_: 0.0)
    monkeypatch.setattr("sweep.engine.estimate._made_seconds", lambda *_: (0.0, 0.0))
    study = study_from_data(tomllib.loads(ROBUST), "study.toml")
    design = design_matrix(study.family, study.reference)[0]
    found = {name: (typical, most) for name, typical, most in searches(study, 1, SimpleNamespace(kept=design))}
    looks = study.optimise.looks
    assert found["search"] == pytest.approx((3 * 0.025, 3 * looks * 1e-3))
    # Four rounds from each of three starts, and forty from each end at most, of 25 looks of 1 ms.
    assert found["tolerances"] == pytest.approx(((3 * 4 + 3 * 40) * 0.025, 2 * (3 * 4 * 400 + 3 * looks) * 1e-3))


def test_a_look_is_timed_where_a_search_would_start(monkeypatch):
    """A six-bar's search was said to take 14 s and took minutes: the design of the trial did not turn."""
    tried = []

    def noting(number, problem, start, *given):
        tried.append(start)
        return SimpleNamespace(looks=10, ended="looks")

    monkeypatch.setattr("sweep.engine.estimate.search", noting)
    data = tomllib.loads(TEXT.replace("COUNT", "40").replace("KEEP", "feasible").replace('"10 mm"', '"38 mm"'))
    data |= {"objective": {"minimise": "max_abs_d2psi"}, "optimise": {"starts": 2, "seed": 1}}
    question = study_from_data(data, "study.toml")
    searches(question, 1, SimpleNamespace(kept=np.empty((0, len(question.family.parameters)))))
    designs = np.stack([random_designs(question, 1, 1)[0], *tried])
    turning = design_outputs(question.family, designs, ("rotatable",), question.accuracy)["rotatable"]
    assert turning.tolist() == [0.0, 1.0, 1.0]  # the first that is drawn would not do


def test_a_time_is_written_out() -> None:
    assert [duration(x) for x in (99.7, 104.0, 119.0, 9.96, 150.0)] == ["100 s", "100 s", "120 s", "10 s", "2.5 min"]


def test_disk_of_a_small_study_is_that_of_a_run(tmp_path: Path) -> None:
    """It was said to be 1.33 times too small: three runs of neighbours told the share kept, no metadata were priced."""
    question = study(tmp_path, 2)
    expected = estimate(question, 1)
    folder = run(question, tmp_path / "designs", jobs=1)
    size = sum(part.stat().st_size for part in folder.glob("part-*"))
    assert expected.disk_bytes / 1.1 < size < expected.disk_bytes * 1.1
