"""Signals to the command line: whatever it is doing, it leaves within two seconds, and nobody stays behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from sweep.dataset.files import MADE, OPTIMUM, SEARCH
from tests.support.engine_study import ROOT, write_study
from tests.support.selection import mostly_long

SIGNALS = (signal.SIGINT, signal.SIGTERM)
SIGNALLED = 128  # and the number of the signal: exit codes 130 and 143
SECONDS = 2.0
# A machine that has other things to do, too, needs longer for the same: so much is allowed beyond.
SLACK = 1.0
OPTIMISE = '\n[objective]\nminimise = "max_abs_d2psi"\n[optimise]\nstarts = 300\nseed = 1\nunseen = "0.001 %"\n'
# The back-rest of the study, held at a tension: the bracket angle is sought at every radius of the beam.
BACKREST = {
    'family = "backrest"': 'family = "backrest_tension"', "n = 65536": "n = 64", 'turn = "-0.15 rad"\n': "",
    "max_abs_drift": "max_phi", "max_K_couple": "max_K", "min_K_couple": "min_K",
    'phi = "0.4 rad"': 'phi_lo = "-0.1 rad"\nphi_hi = "1.2 rad"\nroot = 1\ncouple = 1',
}  # fmt: skip
SLOW = """
[limits]
min_N1 = { min = 100, unit = "N" }
[objective]
minimise = "max_phi"
[accuracy]
target = 1e-6
[optimise]
starts = 1
looks = 100
[tolerance]
lengths = "0.5 mm"
"""


def begun(study: Path, out: Path, cache: Path | None = None, *options: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "sweep", "run", str(study), "--out", str(out), *options]
    environment = os.environ | ({} if cache is None else {"XDG_CACHE_HOME": str(cache)})
    return subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip


def others_of(session: int) -> list[int]:
    """Processes of a session that still run."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(entry.name))
    return found


def told(process: subprocess.Popen[str], number: int, group: bool) -> tuple[float, str]:
    """Send a signal; how long it takes to leave, and what it says."""
    (os.killpg if group else os.kill)(process.pid, number)
    begin = time.monotonic()
    _, errors = process.communicate(timeout=60)
    left = time.monotonic() - begin
    deadline = time.monotonic() + 5.0
    while others_of(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not others_of(process.pid), "somebody stays behind"
    return left, errors


@pytest.mark.parametrize("number", mostly_long(SIGNALS, [signal.SIGTERM]))
def test_it_leaves_while_it_compiles(tmp_path: Path, number: int) -> None:
    """An empty cache: the first seconds are imports and compiling."""
    study = write_study(tmp_path / "study")
    process = begun(study, tmp_path / "out", tmp_path / "cache")
    while not list((tmp_path).glob("cache/**/*.nbi")):
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(random.Random(number).uniform(0.0, 2.0))
    left, errors = told(process, number, group=False)
    assert process.returncode == SIGNALLED + number, errors
    assert left < SECONDS + SLACK and "Traceback" not in errors


@pytest.mark.parametrize("number", mostly_long(SIGNALS, [signal.SIGINT]))
@pytest.mark.parametrize("group", mostly_long([True, False], [True]))
def test_it_leaves_while_it_optimises_with_the_best_so_far(tmp_path: Path, number: int, group: bool) -> None:
    study = write_study(tmp_path / "study", keep="feasible", count=20)
    study.write_text(study.read_text() + OPTIMISE)
    process = begun(study, tmp_path / "designs", None, "--jobs", "2")
    while not list((tmp_path / "designs").glob("part-*")) or len(others_of(process.pid)) < 3:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    time.sleep(1.0)
    left, errors = told(process, number, group)
    assert process.returncode == SIGNALLED + number, errors
    assert left < SECONDS + SLACK and "Traceback" not in errors
    best = pd.read_parquet(tmp_path / OPTIMUM)
    assert best["role"].iloc[0] == "optimum" and best["max_abs_d2psi"].iloc[0] > 0.0


@pytest.mark.long  # its search takes half a minute
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_it_leaves_in_the_middle_of_what_is_made_with_the_optimum(tmp_path: Path, jobs: str) -> None:
    """A mechanism of this back-rest takes 8 ms, and 65 536 of them nine minutes of one core."""
    backrest = (ROOT / "studies" / "backrest" / "study.toml").read_text().partition("[limits]")[0]
    for old, new in BACKREST.items():
        assert old in backrest, old
        backrest = backrest.replace(old, new)
    (tmp_path / "study.toml").write_text(backrest + SLOW)
    process = begun(tmp_path, tmp_path / "designs", None, "--jobs", jobs)
    assert process.stderr is not None
    for line in process.stderr:
        if "what is made: " in line:
            break
    else:
        pytest.fail("it ended before")
    left, errors = told(process, signal.SIGINT, group=True)
    assert process.returncode == SIGNALLED + signal.SIGINT, errors
    assert left < SECONDS + SLACK and "Traceback" not in errors
    # It was forced to leave before, and had written no optimum.
    best = pd.read_parquet(tmp_path / OPTIMUM)
    assert best["role"].iloc[0] == "optimum" and best["yield"].isna().all()
    assert not (tmp_path / MADE).exists() and (tmp_path / SEARCH).exists() and not list(tmp_path.glob("**/_tmp-*"))


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_behind_the_work_is_told_as_one(number: int) -> None:
    """What a process does at its very end, such as closing pools, is interrupted at once, with the code of a signal."""
    program = """
import atexit, time
import sweep.__main__ as program
def ending():
    print("over", flush=True)
    time.sleep(30.0)
program.command_line = lambda: atexit.register(ending)
program.main()
"""
    process = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "over\n"
    process.send_signal(number)
    process.communicate(timeout=20)
    assert process.returncode == SIGNALLED + number


def test_a_folder_that_is_not_there_any_more_is_said(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    program = "import os; os.rmdir(os.getcwd()); from sweep.__main__ import main; main()"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program, "run", str(ROOT / "studies" / "geared-dwell"), "--smoke"],
        cwd=tmp_path / "gone", env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 74 and "Traceback" not in done.stderr, done.stderr
    assert "not there any more" in done.stderr or "No such file" in done.stderr


def test_so_many_workers_are_refused(tmp_path: Path) -> None:
    study = write_study(tmp_path / "study")
    for jobs in ("100000000", "1025"):
        process = begun(study, tmp_path / "out", None, "--jobs", jobs)
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 2 and "a whole number from 1 to 1024" in errors and "Traceback" not in errors


def test_a_signal_after_the_answer_keeps_the_answers_exit_code() -> None:
    # A thread that Python waits for at its end.
    waiting = "import sys, threading, time; threading.Thread(target=time.sleep, args=(30,)).start()"
    program = f"{waiting}; from sweep.__main__ import main; sys.argv = ['sweep', 'families', 'rssr']; main()"
    process = subprocess.Popen(
        [sys.executable, "-u", "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    said = process.stdout.readline()
    time.sleep(1.0)  # the rest of the answer, and the way out of the verb
    process.send_signal(signal.SIGTERM)
    rest, _ = process.communicate(timeout=20)
    assert process.returncode == 0 and "rssr" in said + rest


def test_the_end_skips_what_libraries_do_after_python() -> None:
    """Threads of a library that outlive the work abort a program in its destructors; here an exit handler of C does."""
    program = """
import atexit, ctypes, sys
import sweep.__main__ as program
abort = ctypes.CFUNCTYPE(None)(lambda: ctypes.CDLL(None).abort())
ctypes.CDLL(None).__cxa_atexit(abort, None, None)
work = program.command_line
def then():
    atexit.register(lambda: print("python's own"))
    work()
program.command_line = then
sys.argv = ["sweep", *sys.argv[1:]]
program.main()
"""
    for words, code in ((["families", "rssr"], 0), (["family"], 2)):
        done = subprocess.run(
            [sys.executable, "-c", program, *words], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == code and done.stdout.endswith("python's own\n"), done.stderr


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_stream_that_the_caller_has_closed_is_no_fault(closed: str) -> None:
    """There is nothing to flush at the end: with a closed standard output it was told as an AttributeError."""
    for verb, code in (("families rssr", 0), ("family", 2)):
        done = subprocess.run(
            ["sh", "-c", f'"$0" -m sweep {verb} {closed}', sys.executable],
            cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == code and "AttributeError" not in done.stderr, done.stderr
