"""The proof that a study asks for, as a part of its run."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.dataset import store
from sweep.dataset.tables import TABLES, altered, digests
from sweep.errors import Interrupted
from sweep.jobs.executors import Here, executor
from sweep.jobs.flow import Executor
from sweep.jobs.signals import stop_on_signal

if TYPE_CHECKING:
    from sweep.proof import Proof
    from sweep.study import Study


def refuse_unprovable(study: Study) -> None:
    """Refuse a study that asks for a proof of what cannot be proven, before it has computed anything.

    Raises
    ------
    InputError
        with what is allowed.
    """
    from sweep.proof.question import question_of

    if study.optimise is not None and study.optimise.prove is not None:
        question_of(study)


def prove(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> bool:
    """Prove what ``optimise.prove`` asks for, going on where an earlier run stopped; nothing where it asks for nothing.

    Returns
    -------
    bool
        whether its emergency brake, ``optimise.prove.time``, has pulled.

    Raises
    ------
    InputError
        if the study asks for what cannot be proven
    Interrupted
        by a signal; finished work is kept.
    """
    from sweep.proof import known_proof

    place = store.beside(folder)
    if study.optimise is None or study.optimise.prove is None:
        (place / store.PROOF).unlink(missing_ok=True)
        return False
    note = store.read_plan(folder) or {}
    if altered(place, note, [store.PROOF]):
        (place / store.PROOF).unlink(missing_ok=True)
    found = known_proof(study, folder) or _proven(study, folder, jobs, backend, progress)
    known, now = dict(note.get(TABLES) or {}), digests(place, [store.PROOF])
    if now.items() - known.items():
        store.write_plan(folder, note | {TABLES: known | now})
    return found.cut_short


def _proven(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> Proof:
    """Judge the boxes, on as many cores as there are workers."""
    from sweep.jobs.progress import Progress
    from sweep.proof import prove_study
    from sweep.proof.rounds import Cores

    assert study.optimise is not None and study.optimise.prove is not None
    boxes = study.optimise.prove.boxes
    with stop_on_signal() as stop, Progress("proof", boxes, 0, progress, unit="boxes") as shown:

        def tell(judged: int, expected: int) -> None:
            shown.expect(expected)
            shown.advance(judged - shown.done)

        where: Executor = Here() if jobs == 1 else executor(backend, jobs)
        try:
            return prove_study(study, folder, Cores(where, jobs, stop), tell)
        except KeyboardInterrupt:
            number = stop.signal_number or signal.SIGINT
            text = f"{folder}: stopped by signal {number} while proving; run again to continue"
            raise Interrupted(number, text) from None
