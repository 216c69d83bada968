"""A second process that compiles ahead: each kernel once, no process more than needed, the same bytes."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from kernels import _claims
from sweep.engine import ahead
from sweep.evaluation import summaries
from sweep.families.base import Accuracy
from sweep.optimise import rehearsal as rehearsals
from sweep.optimise.rehearsal import rehearsal
from sweep.reductions import extrema, sampling
from sweep.study.load import load_study
from tests.engine_study import ROOT, chunk_bytes, write_study
from tests.test_kernel_cache import report, tree  # noqa: F401

# The second process claims "f" at once, and does something with it; the first one asks for it half a second later.
CLAIMS = """
import os, time
from kernels._claims import Busy, claimed, impatient, on_first

def begin():
    pid = os.fork()
    if pid == 0:
        with claimed("f", ()):
            {second}
            os._exit(0)
    time.sleep(0.5)
    return True

with on_first(begin):
    with claimed("g", ()) as shared:
        print("g", shared)
    since = time.monotonic()
    {first}
    print(round(time.monotonic() - since, 1))
os.wait()
"""
ASK = 'with claimed("f", ()) as shared: print("f", shared)'
IMPATIENT = """
    try:
        with impatient(), claimed("f", ()): print("never")
    except Busy: print("busy")
"""


def said(second: str, first: str = ASK) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", CLAIMS.format(second=second, first=first)], cwd=ROOT, capture_output=True, text=True,
        timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_claim_is_waited_for_until_it_is_given_up() -> None:
    *words, waited = said("time.sleep(1.5)")
    assert words == ["g", "True", "f", "True"]
    assert 0.7 <= float(waited) < 10.0


def test_a_claim_ends_with_its_process_however_it_ends() -> None:
    assert said("os.kill(os.getpid(), 9)")[-1] == "0.0"


def test_who_has_other_things_to_do_is_told_instead_of_waiting() -> None:
    assert said("time.sleep(1.5)", IMPATIENT) == ["g", "True", "busy", "0.0"]


def test_a_process_that_was_halted_is_waited_for_no_longer_than_patience_lasts() -> None:
    halted = "import kernels._claims as c; c.PATIENCE = 0.3; " + ASK.replace("with", "\n    with", 1)
    assert said("time.sleep(3.0)", halted) == ["g", "True", "f", "False", "0.3"]


def test_without_a_second_process_nothing_is_claimed() -> None:
    with _claims.claimed("f", ()) as shared:
        assert not shared
    with _claims.on_first(lambda: False), _claims.claimed("f", ()) as shared:
        assert not shared


# Both processes call the same kernel; the second one gets it first and takes its time.
TWICE = """
    import os, time
    from kernels._claims import on_first
    from kernels.loop import run

    def begin():
        if os.fork() == 0:
            compile = run._compiler.compile
            run._compiler.compile = lambda *given: (time.sleep(1.5), compile(*given))[1]
            run(1.0)
            os._exit(0)
        time.sleep(0.7)
        return True

    with on_first(begin):
        print(run(1.0), sum(run.stats.cache_misses.values()), sum(run.stats.cache_hits.values()))
    os.wait()
"""


def test_a_kernel_that_the_other_process_compiles_is_loaded(tree: Path) -> None:  # noqa: F811
    assert report(tree, TWICE) == ["2.0", "0", "1"]


RUN = """
import os, sys
forks, fork = [], os.fork
os.fork = lambda: forks.append(fork()) or forks[-1]
import sweep
folder = sweep.run(sys.argv[1], sys.argv[2], jobs=int(sys.argv[3]))
print(len(forks))
"""


def test_two_processes_begin_where_a_kernel_is_missing_and_write_the_same_bytes(tmp_path: Path) -> None:
    study = write_study(tmp_path / "study", count=10)
    bytes_of, forks = [], []
    for out, jobs, cache in (("two", 2, "a"), ("full", 2, "a"), ("one", 1, "b")):
        environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / cache)}
        done = subprocess.run(
            [sys.executable, "-c", RUN, str(study), str(tmp_path / out / "designs"), str(jobs)],
            cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
        assert done.returncode == 0 and done.stderr == "", done.stderr
        forks.append(int(done.stdout))
        bytes_of.append(chunk_bytes(tmp_path / out / "designs"))
    several = len(os.sched_getaffinity(0)) > 1
    assert forks == [int(several), 0, 0]
    assert bytes_of[0] == bytes_of[1] == bytes_of[2] and bytes_of[0]


THREADS = """
import io, threading
from sweep.engine import ahead
from sweep.jobs.progress import Phases

over = threading.Event()
other = threading.Thread(target=over.wait)
other.start()
print(ahead._may_fork())
over.set()
other.join()
with Phases(True, io.StringIO()) as phases:
    phases.say("compiling")
    print(ahead._may_fork())
"""


def test_no_process_is_forked_beside_threads_that_may_hold_locks() -> None:
    """In a process of its own, which has no threads of other tests."""
    done = subprocess.run([sys.executable, "-c", THREADS], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_what_the_second_process_does_covers_a_search_for_what_is_made() -> None:
    """Its steps are those of the search: none fails on the study that has all of them."""
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    steps = list(rehearsal(study))
    assert len(steps) == 5
    for step in steps:
        step()


def test_the_second_process_begins_with_poses_and_the_objective(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    done: list[str] = []
    monkeypatch.setattr(rehearsals, "rehearsal", lambda _: iter([partial(done.append, x) for x in ("poses", "search")]))
    monkeypatch.setattr(ahead, "_objective", lambda _: [partial(done.append, "objective")])
    monkeypatch.setattr(ahead, "_sweep", lambda _: [partial(done.append, "sweep")])
    ahead._compile(study)
    assert done == ["poses", "objective", "search", "sweep"]


def test_precise_poses_are_those_of_the_last_limit_on_an_extremum(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    asked: list[object] = []
    real = sampling.pose_columns
    monkeypatch.setattr(sampling, "pose_columns", lambda *given: asked.append(given[3]) or real(*given))
    for step in ahead._precise(study):
        step()
    assert asked == [["dev", "discriminant1", "discriminant2"]]
    assert ahead._precise(replace(study, reference=None)) == []
    assert ahead._precise(replace(study, accuracy=Accuracy())) == []
    assert ahead._precise(replace(study, limits=())) == []


def test_the_objective_is_that_of_the_reference_design(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    asked: list[object] = []
    monkeypatch.setattr(extrema, "true_extrema", lambda family, designs, requests, _: asked.append(requests))
    monkeypatch.setattr(summaries, "design_outputs", lambda family, designs, names, *_: asked.append(names))
    for other in (None, "stroke"):  # an extremum is searched for as it is, anything else as an output
        goal = replace(study.objective, output=other) if other and study.objective else study.objective
        for step in ahead._objective(replace(study, objective=goal)):
            step()
    assert asked == [(extrema.Request("d2s", 0),), ["stroke"]]
    assert ahead._objective(replace(study, reference=None)) == []
    assert ahead._objective(replace(study, objective=None)) == []
