"""Every verb through click's runner: what it prints, what it writes, how it fails."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

import sweep
from sweep.cli import main
from sweep.cli.ending import Ending
from sweep.cli.families import family_names
from sweep.cli.kernels import WarmPart, rounds
from sweep.cli.main import VERBS
from sweep.cli.tables import read_table, wanted
from sweep.study import load_study

STUDY = """
[study]
name = "tiny"
title = "A tiny study"
[mechanism]
family = "geared_dwell"
[scene]
want = ["dwell_angle", "max_abs_d2psi"]
speed = "600 rpm"
[design]
k = { from = 1.1, to = 1.5, count = 9 }
a = { from = 0.5, to = 1.5, count = 5 }
[limits]
dwell_deviation = { max = 5.0, unit = "deg" }
[objective]
minimise = "max_abs_d2psi"
"""
DESIGNS = pd.DataFrame({"k": [1.2, 1.4], "a": [0.9, 1.3], "phi": [0.1, 2.0]})


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture
def study(tmp_path: Path) -> Path:
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "study.toml").write_text(STUDY)
    return folder


@pytest.fixture(params=["csv", "parquet"])
def table(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / f"designs.{request.param}"
    if request.param == "csv":
        DESIGNS.to_csv(path, index=False)
    else:
        DESIGNS.to_parquet(path)
    return path


def test_help_names_every_verb_and_the_exit_codes() -> None:
    text = " ".join(call("--help").output.split())
    for word in ("run", "check", "compare", "eval", "summarise", "families", "report", "cache", "75 folder locked"):
        assert word in text


@pytest.mark.parametrize("verb", ["eval", "summarise"])
def test_help_says_that_tables_are_in_radians(verb: str) -> None:
    assert "ANGLES IN RAD" in " ".join(call(verb, "--help").output.split())


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_eval_gives_what_evaluate_gives(table: Path, tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"out.{suffix}"
    result = call("eval", "geared_dwell", table, "--want", "psi,dpsi", "--want", "d2psi", "--out", out)
    assert (result.exit_code, result.output) == (0, "")
    found = read_table(out)
    expected = sweep.evaluate("geared_dwell", DESIGNS, ["psi", "dpsi", "d2psi"])
    assert list(found.columns) == list(expected.columns)
    np.testing.assert_array_equal(found.to_numpy(float), expected.to_numpy(float))  # every bit, through CSV too


def test_eval_over_a_turn(tmp_path: Path) -> None:
    table = tmp_path / "designs.csv"
    DESIGNS[["k", "a"]].to_csv(table, index=False)
    result = call("eval", "geared_dwell", table, "--want", "psi", "--poses", 4)
    lines = result.output.splitlines()
    assert lines[0] == "design,phi,psi,status"
    assert [line.split(",")[0] for line in lines[1:]] == list("00001111")
    assert float(lines[2].split(",")[1]) == 0.5 * np.pi


def test_summarise_gives_what_summarise_gives(table: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.parquet"
    arguments = ("summarise", "geared_dwell", table, "--want", "max_abs_d2psi,dwell_angle", "--samples", 64)
    assert call(*arguments, "--out", out).exit_code == 0
    expected = sweep.summarise("geared_dwell", DESIGNS[["k", "a"]], ["max_abs_d2psi", "dwell_angle"], samples=64)
    pd.testing.assert_frame_equal(pd.read_parquet(out), expected)
    printed = call(*arguments).output.splitlines()
    assert printed[0] == "max_abs_d2psi,dwell_angle,status"
    assert len(printed) == 3


def test_summarise_passes_accuracy_and_window(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text("a,b,c,e,xi,eta,lam,h\n10,30,30,25,30,0.5,0.1,0.2\n")
    lines = []
    for window in ((), ("--window", 0.0, 0.4)):
        result = call("summarise", "guide", path, "--want", "max_abs_dev", "--accuracy", 1e-6, *window)
        assert result.exit_code == 0
        lines.append(result.output.splitlines())
    assert lines[0][0] == "max_abs_dev,err_max_abs_dev,status"
    assert float(lines[1][1].split(",")[0]) < float(lines[0][1].split(",")[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("geared_dwel", "{table}", "--want", "psi"), "did you mean 'geared_dwell'?"),
        (("geared_dwell", "{table}", "--want", "d2psy"), "want = 'd2psy'"),
        (("geared_dwell", "{table}", "--want", " ,"), "--want is missing; needed: the name of an output"),
        (("geared_dwell", "{table}", "--want", "psi", "--out", "{tmp}/x.xlsx"), "ending in .parquet or .csv"),
        (("geared_dwell", "{table}", "--want", "psi", "--out", "{tmp}/none/x.csv"), "a file in a folder that exists"),
        (("geared_dwell", "{table}", "--want", "psi", "--out", "{tmp}/../{name}/good.csv"), "this one is TABLE"),
        (
            ("geared_dwell", "{tmp}/bad.csv", "--want", "psi"),
            ".csv (its first row is 0): column k, row 1: k = 'x'; a",
        ),
        (("geared_dwell", "{tmp}/nan.csv", "--want", "psi"), "column k, row 1: k = nan; allowed: a finite number"),
        (("geared_dwell", "{tmp}/nophi.csv", "--want", "psi"), "phi is missing; needed: a column phi [rad], or --p"),
        (("geared_dwell", "{tmp}/empty.csv", "--want", "psi"), "readable csv"),
        (("geared_dwell", "{tmp}/fake.parquet", "--want", "psi"), "readable parquet"),
        (("geared_dwell", "{tmp}/german.csv", "--want", "psi"), "values between commas, with decimal points"),
        (("geared_dwell", "{tmp}/latin.csv", "--want", "psi"), "latin.csv: column = 'note'; allowed: text in UTF-8"),
        (("geared_dwell", "{table}", "--want", "psi", "--keep", "no"), "good.csv: table: keep = 'no'; allowed: colu"),
        (("geared_dwell", "{tmp}/table.txt", "--want", "psi"), "ending in .parquet or .csv"),
    ],
)
def test_bad_input_is_one_message_and_exit_code_2(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    DESIGNS.to_csv(tmp_path / "good.csv", index=False)
    (tmp_path / "bad.csv").write_text("k,a,phi\n1.2,1,0\nx,1,0\n")
    (tmp_path / "nan.csv").write_text("k,a,phi\n1.2,1,0\n,1,0\n")
    (tmp_path / "nophi.csv").write_text("k,a\n1.2,1\n")
    (tmp_path / "german.csv").write_text("k;a;phi\n1,2;1,0;0,5\n")
    (tmp_path / "latin.csv").write_text("k,a,phi,note\n1.2,1,0,größer\n", encoding="latin-1")
    for name in ("empty.csv", "fake.parquet", "table.txt"):
        (tmp_path / name).write_text("" if name == "empty.csv" else "no table")
    before = sorted(tmp_path.rglob("*"))
    result = call("eval", *(a.format(table=tmp_path / "good.csv", tmp=tmp_path, name=tmp_path.name) for a in arguments))
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("sweep: ")
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_unexpected_error_keeps_its_traceback(table: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("sweep.cli.tables.evaluate", broken)
    result = call("eval", "geared_dwell", table, "--want", "psi")
    assert isinstance(result.exception, ZeroDivisionError)
    assert result.exit_code == 1


def test_disk_error_while_writing_leaves_the_old_file(table: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    out.write_text("old")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pd.DataFrame, "to_csv", full)
        result = call("eval", "geared_dwell", table, "--want", "psi", "--out", out)
    assert result.exit_code == 74
    assert "No space left on device" in result.stderr
    assert out.read_text() == "old"
    assert not list(tmp_path.glob("_tmp-*"))


def test_check_prints_the_plan_and_writes_nothing(study: Path) -> None:
    before = sorted(study.rglob("*"))
    result = call("check", study)
    assert result.exit_code == 0, result.stderr
    for words in (
        "tiny: A tiny study",
        "speed 600 rpm",
        "45 designs, every combination of",
        "1.1 to 1.5, 9 values",
        "dwell_deviation (at most 5°)",
        "to be made small: max_abs_d2psi",
        "will not be computed",
        "dwell_band",
        "memory",
        "allowed 20 GB",
    ):
        assert words in result.output
    assert sorted(study.rglob("*")) == before


def test_check_of_a_study_over_its_budget_ends_with_3(study: Path) -> None:
    text = STUDY.replace("count = 9", "count = 1000000").replace("count = 5", "count = 1000000")
    (study / "study.toml").write_text(text)
    result = call("check", study)
    assert result.exit_code == 3
    assert "over the budget" in result.stderr


def test_check_lists_every_fault(study: Path) -> None:
    (study / "study.toml").write_text(STUDY.replace("count = 9", "cuont = 9").replace('"dwell_angle"', '"dwel_angle"'))
    result = call("check", study)
    assert result.exit_code == 2
    assert "'count'" in result.stderr
    assert "'dwell_angle'" in result.stderr
    assert "Traceback" not in result.stderr


def test_run_report_and_resume(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "designs"
    first = call("run", study, "--out", out, "--jobs", 1)
    assert first.exit_code == 0, first.stderr
    assert sweep.is_complete(out)
    files = {f.name: f.read_bytes() for f in out.glob("part-*")}
    assert call("run", study, "--out", out).exit_code == 0
    assert {f.name: f.read_bytes() for f in out.glob("part-*")} == files
    result = call("report", out, "--out", tmp_path / "report")
    assert result.output.endswith("report.html\n")
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "A tiny study" in page
    assert len(pd.read_parquet(tmp_path / "report" / "survivors.parquet")) == (sweep.load(out).status == 0).sum()


def test_run_passes_its_options_on(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {}

    def run(*arguments: object, **options: object) -> Path:
        given.update(options, positional=arguments)
        return Path("somewhere")

    monkeypatch.setattr("sweep.engine.run.run", run)
    ended = Ending(("the answer",), 0, "next: more")
    (study / "smoke.toml").write_text("")
    monkeypatch.setattr("sweep.cli.ending.ending", lambda folder: ended)
    options = ("--jobs", 3, "--backend", "loky", "--accuracy", 1e-5, "--smoke", "--force", "--out", "x")
    assert call("run", study, *options).output == "the answer\nnext: more\ndataset: somewhere\n"
    loaded, *others = given["positional"]
    assert loaded.path == load_study(study, smoke=True).path and others == [Path("x")]
    assert (given["jobs"], given["backend"]) == (3, "loky")
    assert {given["accuracy"], given["smoke"], given["force"]} == {1e-5, True}


def test_an_accuracy_out_of_range_is_a_fault_of_the_option_not_of_the_study_file(study: Path) -> None:
    result = call("run", study, "--accuracy", 1.0)
    assert result.exit_code == 2
    assert "--accuracy" in result.output and "study.toml" not in result.output


def test_warm_compiles_levels_in_processes_and_the_rest_by_the_tiny_version(study: Path) -> None:
    first, then = rounds([str(study), "geared_dwell"])
    assert [part.of for part in first].count("geared_dwell") > 1 and WarmPart("geared_dwell") in first
    assert [part.step for part in first if part.of.startswith(str(study))]
    assert all(part.of.startswith(str(study)) and part.step is None for part in then)
    result = call("warm", study, "geared_dwell")
    assert result.exit_code == 0, result.output


def test_warm_refuses_what_is_neither_study_nor_family() -> None:
    result = call("warm", "rsrr")
    assert result.exit_code == 2 and "did you mean 'rssr'?" in result.output


def test_interrupt_ends_with_130(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object, **__: object) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr("sweep.engine.run.run", run)
    assert call("run", study).exit_code == 130


def test_families_are_listed_and_described() -> None:
    listed = call("families").output
    for name in ("rssr", "rssp", "guide", "geared_dwell"):
        assert f"  {name} " in listed
    one = call("families", "rssr+guide").output
    for words in (
        "alpha1",
        "(-1 or +1, default 1)",
        "length^4",
        "pressure_angle2",
        "max_abs_d2s",
        "max_pressure_angle1",
    ):
        assert words in one
    assert "did you mean 'rssr'?" in call("families", "rsr").stderr


def test_cache_clear_removes_the_compiled_kernels_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernels, other = tmp_path / "linksweep" / "kernels", tmp_path / "linksweep" / "other"
    for folder in (kernels / "abc", other):
        folder.mkdir(parents=True)
        (folder / "file").write_text("x")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))  # whatever is patched, the user's own stay
    monkeypatch.setattr("sweep.cli.kernels.cache_root", lambda: kernels)
    assert call("cache", "clear").output == f"removed {kernels}\n"
    assert not kernels.exists()
    assert (other / "file").exists()
    assert call("cache", "clear").output.startswith("nothing to remove")


def test_names_are_split() -> None:
    assert family_names("rssr") == "rssr"
    assert family_names("rssr+guide") == family_names("rssr, guide") == ["rssr", "guide"]
    assert wanted(("psi,dpsi", "psi", " s ,")) == ["psi", "dpsi", "s"]


VERBS_FOUND = {name: verb for name in VERBS if (verb := main.get_command(click.Context(main), name)) is not None}


def test_list_of_verbs_says_what_they_say_of_themselves() -> None:
    assert list(VERBS_FOUND) == list(VERBS) == sorted(VERBS)
    for name, (_, words) in VERBS.items():
        assert VERBS_FOUND[name].name == name
        said = " ".join((VERBS_FOUND[name].help or "").split())
        said = said.replace(" (.parquet or .csv)", "").replace(" (docs/tasks.md)", "")
        assert said.startswith(words[:-1]), name
    asks = "import sys; from sweep.cli import main; main(['--help'], standalone_mode=False)"
    imported = f"{asks}; print(len({{'numba', 'pandas'}} & {{*sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", imported], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0"


def test_page_about_the_command_line_names_every_verb_and_option() -> None:
    page = (Path(__file__).parents[2] / "docs" / "command-line.md").read_text(encoding="utf-8")
    for name, verb in VERBS_FOUND.items():
        assert f"`{name} " in page
        for parameter in verb.params:
            for option in parameter.opts if parameter.param_type_name == "option" else ():
                assert option in page, f"{name} {option}"
        row = re.search(rf"^\| `{name} ([^`]*)`", page, flags=re.MULTILINE)
        known = {option for parameter in verb.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert row is not None and set(re.findall(r"--[a-z-]+", row[1])) <= known, name
