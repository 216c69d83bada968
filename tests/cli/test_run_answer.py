"""The end of `sweep run`: the answer in the terminal, exit codes for no feasible design and for the emergency brake."""

from __future__ import annotations

import json
import shutil
from importlib import import_module
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from sweep.cli import main
from sweep.cli.ending import ending, held_back
from sweep.quantities.limits import Limit
from sweep.report.answer import share_words
from sweep.report.page import write_report
from sweep.report.quantities import quantity
from sweep.report.tables import limit_state
from tests.optimise.test_study import STUDY
from tests.support.report_dataset import study_data, write_dataset


def run(folder: Path, text: str) -> tuple[int, str]:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(text)
    found = CliRunner().invoke(main, ["run", str(folder), "--out", str(folder / "designs"), "--jobs", "1"])
    return found.exit_code, found.output


def test_answer_names_the_optimum_what_holds_it_back_and_the_next_command(tmp_path: Path) -> None:
    code, text = run(tmp_path, STUDY.format(swing=40))
    assert code == 0
    best = pq.read_table(tmp_path / "_optimum.parquet").to_pydict()
    assert "small: 4096 designs, " in text and " within all limits, the best with largest acceleration " in text
    assert f"optimum: largest acceleration {best['max_abs_d2psi'][0]:.5g} rad/rad²" in text
    assert "held back by: " in text and "swing (at least 40°)" in text
    assert "search: 3 starts, " in text and "another start finds a new one with an estimated chance of" in text
    assert f"next: sweep report {tmp_path / 'designs'}" in text


def test_run_with_report_draws_the_figures_and_writes_the_page_as_stages_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY.format(swing=40).split("[optimise]")[0])
    (tmp_path / "figure.py").write_text(
        "import pathlib, sys\npathlib.Path(sys.argv[1], 'drawn').touch()\nsys.exit(7)\n"
    )
    found = CliRunner().invoke(
        main, ["run", str(tmp_path), "--out", str(tmp_path / "out" / "designs"), "--jobs", "1", "--report"]
    )
    assert found.exit_code == 7  # that of the program that draws; the page is there all the same
    assert (tmp_path / "out" / "drawn").exists() and (tmp_path / "out" / "report.html").exists()
    assert found.stdout.endswith(f"report: {tmp_path / 'out' / 'report.html'}\n") and "next:" not in found.stdout
    assert "4/5 figures" in found.stderr and "5/5 report: 4 of 4 steps" in found.stderr


def test_an_optimum_is_in_the_open_only_if_its_search_has_settled() -> None:
    looks = "the number of evaluations (optimise.looks), which ended its search"
    assert held_back([], "converged", settled=True) == "nothing: an optimum in the open"
    assert held_back(["swing"], "converged", settled=True) == "swing"
    assert held_back([], "looks", settled=False) == looks
    assert held_back(["swing"], "looks", settled=False) == f"swing; {looks}"
    # A feed rack stalled where its stay above the plate ends, with four parameters at their bounds.
    assert held_back([], "stalled", settled=False) == "not known, the search did not settle"


def test_a_search_that_did_not_settle_is_not_told_as_an_optimum_in_the_open(tmp_path: Path) -> None:
    inside = {"max_abs_dev": 0.01, "active": ""}
    told = "\n".join(ending(write_dataset(tmp_path / "open", optimum=inside)).lines)
    assert "held back by: nothing: an optimum in the open" in told
    stalled = {**inside, "kkt_residual": 1e-3, "ended": "stalled"}
    told = "\n".join(ending(write_dataset(tmp_path / "stalled", optimum=stalled)).lines)
    assert "held back by: not known, the search did not settle" in told


def test_output_that_stopped_at_a_bound_but_does_not_matter_holds_nothing_back() -> None:
    """A looper's acceleration was said to be held back by the stroke of the needle."""
    limit, row, shown = Limit("stroke", 22.0, 26.0), {"stroke": 22.0}, quantity("stroke", "mm")
    none: frozenset[str] = frozenset()
    assert limit_state(limit, row, None, shown, none, settled=True).state == "met"
    assert limit_state(limit, row, None, shown, frozenset(["stroke"]), settled=True).state == "active"
    assert limit_state(limit, row, None, shown, none).state == "active"  # nobody says what matters
    assert limit_state(Limit("stroke", 22.0, 22.0), row, None, shown, none, settled=True).state == "active"
    assert limit_state(limit, {"stroke": 21.0}, None, shown, none, settled=True).state == "missed"


def test_a_share_that_is_less_than_what_was_asked_says_so_and_why() -> None:
    assert share_words(0.9993, None, "looks") == "99.9 % within all limits"
    assert share_words(0.9997, 0.9996, "looks", 2) == "100.0 % within all limits, 99.96 % asked, met by 2 searches"
    missed = "99.95 % within all limits, 99.96 % asked: not reached"  # cut, not rounded: 99.96 of 99.96 would be none
    assert share_words(0.99959, 0.9996, "converged") == missed
    assert share_words(0.99959, 0.9996, "looks") == f"{missed}, its search used up its evaluations before"


def test_no_feasible_design_ends_with_4_and_says_which_limit_gives_way(tmp_path: Path) -> None:
    code, text = run(tmp_path, STUDY.format(swing=150))
    assert code == 4
    assert "no design keeps all limits" in text and "must give way by" in text
    best = pq.read_table(tmp_path / "_optimum.parquet").to_pydict()
    assert best["status"][0] == 5
    page = write_report(tmp_path / "designs", tmp_path / "report").read_text(encoding="utf-8")
    assert "No design was found that keeps all limits" in page


def test_links_that_cannot_meet_are_named_by_the_design_that_comes_nearest(tmp_path: Path) -> None:
    # Crank, coupler and rocker have 280 mm together, 300 mm lie between the pivots.
    code, said = run(tmp_path, STUDY.format(swing=40).replace("e = { value = 100", "e = { value = 300"))
    assert code == 4 and "no design keeps all limits" in said
    line = next(x for x in said.splitlines() if "links that cannot meet at any crank angle" in x)
    assert "b = 150, c = 90, e = 300" in line and float(line.rpartition("the margin is ")[2].split()[0]) < 0.0


def test_an_optimum_that_nobody_builds_or_that_did_not_settle_is_warned_of(tmp_path: Path) -> None:
    told = "\n".join(ending(write_dataset(tmp_path / "built", optimum={"a1": 18.0})).lines)
    assert "shortest link" not in told and "settle" not in told
    # A crank of 0.01 mm at a coupler of 90 mm.
    told = "\n".join(ending(write_dataset(tmp_path / "tiny", optimum={"a1": 0.01, "kkt_residual": 1e-3})).lines)
    assert "warning: the optimiser did not settle" in told
    assert "warning: the shortest link of the optimum has 0.00011 of the length of its longest" in told


def test_sweep_without_optimiser_and_without_survivors_names_the_nearest_miss(tmp_path: Path) -> None:
    text = STUDY.format(swing=150).replace("[optimise]\nstarts = 3\nseed = 1\n", "")
    code, said = run(tmp_path, text)
    assert code == 4
    assert "the nearest of" in said and "swing must give way by" in said and "instead of at least 150°" in said
    assert " misses 2 limits, which must give way together:" in said and "(kept by none of these designs)" in said


CRANKS = """
[study]
name = "cranks"
[mechanism]
family = "slider_crank"
[scene]
want = ["stroke", "max_abs_d2s"]
[design]
a = { values = [8, 9, 10, 11], unit = "mm" }
b = "40 mm"
[limits]
stroke = { min = 20.5, max = 30, unit = "mm" }
max_abs_d2s = { max = 11, unit = "mm/rad^2" }
"""


def test_limits_that_contradict_each_other_are_each_kept_by_some_designs(tmp_path: Path) -> None:
    """Strokes are 2 a, accelerations a (1 + a/b); the crank of 9 mm misses a twelfth of 30 mm, the others more."""
    code, said = run(tmp_path, CRANKS)
    assert code == 4
    lines = said.splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("the nearest"))
    assert lines[k] == "the nearest of 4 designs of the space, a = 9 mm, misses 2 limits, which must give way together:"
    assert lines[k + 1 : k + 3] == [
        "  stroke must give way by 2.5 mm: 18 mm instead of 20.5 to 30 mm (kept by 1 of these designs)",
        "  largest acceleration must give way by 0.025 mm/rad²: 11.025 mm/rad² instead of at most 11 mm/rad² "
        "(kept by 1 of these designs)",
    ]


def test_bounds_that_follow_from_the_designs_of_the_sweep_are_told_with_their_values(tmp_path: Path) -> None:
    fitted = study_data(fit={"stroke": "24.5 mm"})
    for name in ("xi2", "eta2", "h2"):
        del fitted["design"][name]
    optimum = {"c2": 91.5, "active": "a1 at its lower bound; c2 at its upper bound"}
    told = "\n".join(ending(write_dataset(tmp_path / "given", optimum=optimum)).lines)
    assert "c2 at its upper bound" in told and "follow from" not in told
    told = "\n".join(ending(write_dataset(tmp_path / "fitted", fitted, optimum=optimum)).lines)
    assert "bounds that follow from the designs of the sweep: c2 = 91.5 mm; for others sweep wider" in told


def test_brake_is_told_everywhere_and_the_next_run_searches_again(tmp_path: Path) -> None:
    braked = STUDY.format(swing=40).replace("starts = 3\n", 'starts = 30\ntime_budget = "0.001 s"\n')
    code, text = run(tmp_path, braked)
    assert code == 124
    words = "time ran out: 0 of 30 starts"
    assert f"warning: {words}" in text
    about = pq.read_schema(tmp_path / "_optimum.parquet").metadata
    assert words in about[b"summary"].decode() and json.loads(about[b"search"])["ended"] == "time"
    page = write_report(tmp_path / "designs", tmp_path / "report").read_text(encoding="utf-8")
    assert words in page.replace("T", "t")
    code, text = run(tmp_path, STUDY.format(swing=40).replace("starts = 3\n", "starts = 30\n"))
    assert code == 0 and "time ran out" not in text


def test_front_cut_short_ends_with_124_and_goes_on(tmp_path: Path) -> None:
    table = '[pareto]\noutput = "max_pressure_angle"\nat_most = { from = 30, to = 50, count = 3, unit = "deg" }\n'
    code, text = run(tmp_path, STUDY.format(swing=40) + table + 'time_budget = "0.001 s"\n')
    assert code == 124 and "steps of the front" in text
    page = write_report(tmp_path / "designs", tmp_path / "report").read_text(encoding="utf-8")
    assert "Time ran out: " in page
    code, text = run(tmp_path, STUDY.format(swing=40) + table)
    assert code == 0
    assert pq.read_schema(tmp_path / "_pareto.parquet").metadata[b"complete"] == b"true"


@pytest.mark.parametrize("unseen", ["0 %", "100 %", "2", "2 mm"])
def test_unseen_share_that_cannot_be_is_refused(tmp_path: Path, unseen: str) -> None:
    code, text = run(tmp_path, STUDY.format(swing=40).replace("seed = 1\n", f'seed = 1\nunseen = "{unseen}"\n'))
    assert code == 2 and "optimise.unseen" in text


@pytest.mark.parametrize("moment", ["sweep.engine.run.search", "sweep.cli.ending.ending"])
@pytest.mark.parametrize("gone", ["out", "out/designs", "out/_plan.json"])
def test_what_is_removed_behind_the_sweep_is_a_fault_of_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str, gone: str
) -> None:
    (tmp_path / "study.toml").write_text(STUDY.format(swing=40))
    module, name = moment.rsplit(".", 1)
    work = getattr(import_module(module), name)

    def removed(*given: Any) -> Any:
        place = tmp_path / gone
        if place.is_dir():
            shutil.rmtree(place)
        else:
            place.unlink()
        return work(*given)

    monkeypatch.setattr(moment, removed)
    found = CliRunner().invoke(main, ["run", str(tmp_path), "--out", str(tmp_path / "out" / "designs"), "--jobs", "1"])
    assert found.exit_code == 74 and isinstance(found.exception, SystemExit), found.exception
    assert "since this run wrote it; run again" in found.stderr
