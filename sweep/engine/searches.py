"""Stages of a run after its sweep: the optimum, the proof and the front, as far as the study asks for them."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from sweep import optimise
from sweep.chunks import plan as plans
from sweep.dataset import files
from sweep.dataset.files import TABLES, altered, digests, metadata
from sweep.errors import Interrupted, SearchCutShort, StoreError
from sweep.jobs.executors import Executor, Here, executor
from sweep.jobs.progress import Phases, Progress
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.proof import Proof, known_proof, prove_study
from sweep.proof.question import question_of
from sweep.proof.rounds import Cores
from sweep.study import Study


def search(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> None:
    """Compute optimum, proof and front, as far as the study asks for them."""
    if study.optimise is not None:
        _optimise(replace(study, pareto=None), folder, jobs, progress)
    proof_cut_short = prove(study, folder, jobs, backend, progress)
    _front(study, folder, jobs, progress)
    _raise_if_cut_short(folder)
    if proof_cut_short:
        raise SearchCutShort(folder, f"{folder}: optimise.prove.time ran out; run again, and the proof goes on")


def stages_of(study: Study) -> tuple[str, ...]:
    """List the stages of a run in order, by the labels of its progress."""
    labels, settings = ["compiling", "planning", study.name], study.optimise
    if settings is not None:
        robust = study.wanted_yield is not None
        optional = {"search": True, "tolerances": settings.by_populations and robust, "robust design": robust}
        optional |= {
            "tables": True,
            "what is made": study.tolerance is not None,
            "proof": settings.prove is not None,
            "front": study.pareto is not None,
        }
        labels += [name for name, wanted in optional.items() if wanted]
    return tuple(labels)


def optimum_key(study: Study, note: Mapping[str, Any]) -> str:
    """Key of all that an optimum or a front depends on: identity of the chunks, study, optimiser's sources."""
    return f"{note['identity']}-{study.fingerprint[:12]}-{plans.optimiser_hash()}"


@contextmanager
def _stoppable(folder: Path, words: str) -> Iterator[Stop]:
    """Let a signal set the flag within this context; an interruption is raised with the words of what it stopped."""
    with stop_on_signal() as stop:
        try:
            yield stop
        except KeyboardInterrupt:
            number = stop.signal_number or signal.SIGINT
            raise Interrupted(number, f"{folder}: stopped by signal {number} while {words}") from None


def _own_plan(folder: Path) -> dict[str, Any]:
    """Return the plan that this run has written."""
    note = files.trusted_plan(folder)
    if note is None:
        raise StoreError(f"{folder}: removed since this run wrote it; run again")
    return note


def _optimise(study: Study, folder: Path, jobs: int, progress: bool) -> None:
    """Run the optimiser unless an intact result for this key is there already."""
    note = _own_plan(folder)
    key = optimum_key(study, note)
    place = files.beside(folder)
    survey = optimise.read_survey(place / files.OPTIMUM)
    recorded = [name for name in files.OF_OPTIMUM if name in (note.get(TABLES) or {})]
    intact = not altered(place, note, {files.OPTIMUM, *recorded})
    if note.get("optimised") == key and intact and (survey is None or survey.ended != "time"):
        return
    assert study.optimise is not None
    files.write_plan(folder, note | {"optimised": None})
    with _stoppable(folder, "optimising; run again for the whole search") as stop, Phases(progress) as phases:
        optimise.optimise_study(study, folder, lambda: bool(stop), jobs, phases.say, key)
    files.write_plan(folder, note | {"optimised": key, TABLES: digests(place, files.OF_OPTIMUM)})


def _raise_if_cut_short(folder: Path) -> None:
    """Raise if the optimum is written but its time limit left some starts unsearched."""
    survey = optimise.read_survey(files.beside(folder) / files.OPTIMUM)
    if survey is not None and survey.ended == "time":
        text = f"{folder}: {survey.warnings[0]} searched; run again with a greater optimise.time_budget for all of them"
        raise SearchCutShort(folder, text)


def _front(study: Study, folder: Path, jobs: int, progress: bool) -> None:
    """Search the study's front, continuing an earlier run with the same key."""
    if study.pareto is None:
        (files.beside(folder) / files.PARETO).unlink(missing_ok=True)
        return

    note = _own_plan(folder)
    key = optimum_key(study, note)
    place, recorded = files.beside(folder), dict(note.get(TABLES) or {})
    damaged = altered(place, note, [files.PARETO])
    if damaged:
        (place / files.PARETO).unlink(missing_ok=True)
    if files.PARETO in recorded and (damaged or metadata(place / files.PARETO).get(b"key") != key.encode()):
        del recorded[files.PARETO]  # the hash of an earlier front: the new one grows step by step
        files.write_plan(folder, note | {TABLES: recorded})
    with _stoppable(folder, "searching the front; run again to continue") as stop, Phases(progress) as phases:
        optimise.front_study(study, folder, key, lambda: bool(stop), jobs, phases.say)
    if digests(place, [files.PARETO]).items() - recorded.items():
        files.write_plan(folder, note | {TABLES: recorded | digests(place, [files.PARETO])})


def refuse_unprovable(study: Study) -> None:
    """Raise before anything is computed if the study asks for a proof that is not possible.

    Raises
    ------
    InputError
        with the allowed values.
    """
    if study.optimise is not None and study.optimise.prove is not None:
        question_of(study)


def prove(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> bool:
    """Compute the proof that ``optimise.prove`` asks for, continuing an earlier run; returns False without it.

    Returns
    -------
    bool
        whether its time limit, ``optimise.prove.time``, has ended it.

    Raises
    ------
    InputError
        if the study asks for a proof that is not possible
    Interrupted
        by a signal; finished work is kept.
    """
    place = files.beside(folder)
    if study.optimise is None or study.optimise.prove is None:
        (place / files.PROOF).unlink(missing_ok=True)
        return False
    note = _own_plan(folder)
    if altered(place, note, [files.PROOF]):
        (place / files.PROOF).unlink(missing_ok=True)
    proof = known_proof(study, folder) or _proven(study, folder, jobs, backend, progress)
    recorded, current = dict(note.get(TABLES) or {}), digests(place, [files.PROOF])
    if current.items() - recorded.items():
        files.write_plan(folder, note | {TABLES: recorded | current})
    return proof.cut_short


def _proven(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> Proof:
    """Run the proof over the boxes, on as many cores as there are workers."""
    assert study.optimise is not None and study.optimise.prove is not None
    boxes = study.optimise.prove.boxes
    words, unit = "proving; run again to continue", "boxes, a first proof compiles before them"
    with _stoppable(folder, words) as stop, Progress("proof", boxes, 0, progress, unit=unit) as bar:

        def tell(judged: int, expected: int) -> None:
            bar.expect(expected, "boxes" if judged else unit)
            bar.advance(judged - bar.done)

        where: Executor = Here() if jobs == 1 else executor(backend, jobs)
        return prove_study(study, folder, Cores(where, jobs, stop), tell)
