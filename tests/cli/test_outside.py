"""The command line as a shell sees it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

import sweep
from sweep.families import family

HEAVY = ("numpy", "numba", "pandas", "scipy", "pyarrow", "matplotlib", "pydantic", "jinja2", "joblib")


def shell(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "sweep", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=120, check=False)


def test_help_imports_nothing_heavy(tmp_path: Path) -> None:
    """Which is what makes it answer in about 0.1 s; a time itself would fail on a busy machine."""
    program = f"""
import sys
sys.argv = ["sweep", "--help"]
from sweep.__main__ import main
try:
    main()
finally:
    print([name for name in {HEAVY!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("frobnicate",), "No such command 'frobnicate'"),
        (("optimise",), "[optimise] is a table of a study, which `sweep run STUDY` obeys"),
        (("run", "nowhere"), "'nowhere' does not exist"),
        (("run",), "Missing argument 'STUDY'"),
        (("run", ".", "--jobs", "0"), "0 is not in the range x>=1"),
        (("eval", "rssr", "nowhere.csv", "--want", "psi"), "does not exist"),
        (("report", "."), "a dataset folder, with a readable _plan.json"),
        (("report", ".", "--out", "page.html"), "allowed: a folder, into which the page is written"),
    ],
)
def test_wrong_use_ends_with_2_and_no_traceback(tmp_path: Path, arguments: tuple[str, ...], words: str) -> None:
    done = shell(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr and "of 4 steps" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_table_goes_through_a_pipe(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("k,a,phi\n1.0,-1.0,0.5\n2.0,-2.0,3.0\n")
    done = shell("eval", "geared_dwell", "d.csv", "--want", "psi", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # a = -k: the output turns with the carrier
    rows = [line.split(",") for line in done.stdout.splitlines()]
    assert rows[0] == ["psi", "status"]
    assert [float(row[0]) for row in rows[1:]] == pytest.approx([0.5, 3.0], abs=1e-15)


def test_eval_over_an_interval_takes_its_variable_beside_a_parameter_phi(tmp_path: Path) -> None:
    design = pd.DataFrame([family("backrest").example])
    assert "phi" in design
    design.to_csv(tmp_path / "design.csv", index=False)
    posed = design.assign(rho=0.3)
    posed.to_csv(tmp_path / "posed.csv", index=False)
    done = shell("eval", "backrest", "posed.csv", "--want", "theta", cwd=tmp_path)
    true = sweep.evaluate("backrest", posed, ["theta"])["theta"].item()
    assert float(done.stdout.splitlines()[1].split(",")[0]) == true
    for arguments, words in (((), "rho is missing; needed: a column rho; found"), (("--poses", "5"), "a column rho")):
        done = shell("eval", "backrest", "design.csv", "--want", "theta", *arguments, cwd=tmp_path)
        assert done.returncode == 2 and words in done.stderr
    assert "did you mean 'rssr'" in shell("eval", "rsr", "design.csv", "--want", "psi", cwd=tmp_path).stderr
