"""The proof that a study asks for, as a part of its run."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.dataset import store
from sweep.errors import Interrupted
from sweep.jobs.executors import Here, executor
from sweep.jobs.flow import Executor
from sweep.jobs.signals import stop_on_signal

if TYPE_CHECKING:
    from sweep.study import Study


def prove(study: Study, folder: Path, jobs: int, backend: str, progress: bool) -> None:
    """Prove what ``optimise.prove`` asks for, going on where an earlier run stopped; nothing where it asks for nothing.

    Raises
    ------
    InputError
        if the study asks for what cannot be proven
    Interrupted
        by a signal; finished work is kept.
    """
    from sweep.jobs.progress import Progress
    from sweep.proof import prove_study
    from sweep.proof.certificate import PROOF
    from sweep.proof.rounds import Cores

    if study.optimise is None or study.optimise.prove is None:
        (store.beside(folder) / PROOF).unlink(missing_ok=True)
        return
    boxes = study.optimise.prove.boxes
    with stop_on_signal() as stop, Progress("proof", boxes, 0, progress, unit="boxes") as shown:

        def tell(judged: int, expected: int) -> None:
            shown.expect(expected)
            shown.advance(judged - shown.done)

        place: Executor = Here() if jobs == 1 else executor(backend, jobs)
        try:
            prove_study(study, folder, Cores(place, jobs, stop), tell)
        except KeyboardInterrupt:
            number = stop.signal_number or signal.SIGINT
            text = f"{folder}: stopped by signal {number} while proving; run again to continue"
            raise Interrupted(number, text) from None
