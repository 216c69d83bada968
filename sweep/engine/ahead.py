"""A second process that compiles what a study will need later, while the first one compiles what it needs now.

It is forked where the first kernel is missing in the cache, so it costs no imports and, with a full cache, nothing.  It
goes through the study on a few designs, poses and the objective first, then the search for the optimum, then
the sweep from its end, until both processes meet.  What it computes is thrown away; the kernels stay in the cache.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.jobs.progress import Progress
from sweep.jobs.signals import depend_on_parent

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from sweep.families.base import Array
    from sweep.study import Study


def compiling_ahead(study: Study, jobs: int) -> AbstractContextManager[None]:
    """Let a second process compile for a study within this context, where one may be had: ``jobs`` allows it,
    the system forks and has a processor for it.
    """
    from kernels._claims import possible

    alone = jobs == 1 or not possible() or len(os.sched_getaffinity(0)) == 1
    return nullcontext() if alone else _two(study)


@contextmanager
def _two(study: Study) -> Iterator[None]:
    from kernels._cache import locked
    from kernels._claims import on_first

    children: list[int] = []

    def begin() -> bool:
        if not _may_fork():
            return False
        parent = os.getpid()
        with warnings.catch_warnings():
            # Later Pythons warn of threads that they cannot name: those of numpy, which follow a fork.
            warnings.simplefilter("ignore", DeprecationWarning)
            try:
                child = os.fork()
            except OSError:  # there are too many processes
                return False
        if child == 0:
            _end_after(lambda: _compile(study), parent)
        children.append(child)
        return True

    try:
        with on_first(begin):
            yield
    finally:
        for child in children:
            with ExitStack() as quiet:
                with suppress(OSError):
                    quiet.enter_context(locked())  # it does not write to the cache now
                os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _may_fork() -> bool:
    """Whether no thread of this process could hold a lock that the second process would wait for."""
    others = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    return all(Progress.owns(thread) for thread in others)


def _end_after(work: Callable[[], None], parent: int) -> None:
    """Do the work in the forked process, without a word, and end it."""
    try:
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nothing, stream)
        with Path(os.devnull).open("w") as nobody:  # what these were before may be locked
            sys.stdout = sys.stderr = nobody
            depend_on_parent(parent)
            work()
    finally:
        os._exit(0)


def _compile(study: Study) -> None:
    """Do what the study does, last things first; what needs a kernel that the first process is at has to wait.

    First of all come poses: begun with the objective, whose parts the first process needs at once, that one waited for
    half a second.  Then come precise poses, and the objective: it takes long to compile, and it is the last that the
    sweep needs.
    """
    from kernels._claims import impatient
    from sweep.optimise.rehearsal import rehearsal

    search = rehearsal(study)
    with impatient():
        left = _undone(islice(search, 1))
    # By the time that precise poses are compiled the first process has compiled what both searches share.
    left += _undone(_precise(study) + _objective(study))
    with impatient():
        left += _undone(search)
    steps = _sweep(study) + left
    with impatient():
        left = _undone(steps)
    _undone(left)


def _undone(steps: Iterable[Callable[[], object]]) -> list[Callable[[], object]]:
    """Do steps; returns those that would have had to wait."""
    from kernels._claims import Busy

    left = []
    for step in steps:
        try:
            step()
        except Busy:
            left.append(step)
        except Exception:  # what is wrong with the study, or with the program, the first process will say
            continue
    return left


def _precise(study: Study) -> list[Callable[[], object]]:
    """Return the step that computes precise poses for the last limit on an extremum.

    A sweep asks for them where rounding leaves open whether a design keeps the limit.
    """
    import numpy as np

    from sweep.reductions.catalogue import quantity
    from sweep.reductions.sampling import discriminants, pose_columns

    family = study.family
    searched = [
        found for limit in study.limits if (found := quantity(family, limit.output)) and found.route == "reduction"
    ]
    if not searched or family.precise_poses is None or study.reference is None or study.accuracy.target is None:
        return []
    requests = searched[-1].requests(family, study.window is not None)
    names = [*(request.pose for request in requests), *discriminants(family)]
    design = _reference(study)
    return [lambda: pose_columns(family.precise(), design, np.zeros((1, 1)), names)]


def _reference(study: Study) -> Array:
    """Return the reference design, (1, P), which no kernel has to make."""
    from sweep.evaluation.tables import design_matrix

    return design_matrix(study.family, study.reference or {})[0]


def _objective(study: Study) -> list[Callable[[], object]]:
    """Return the step that computes the objective of the reference design.

    Where that is an extremum over the turn it is searched for as it is: the margin that an answer needs besides is what
    the first process compiles meanwhile.
    """
    from sweep.reductions.catalogue import quantity
    from sweep.reductions.extrema import true_extrema

    if study.reference is None or study.objective is None:
        return []
    family, name, target = study.family, study.objective.output, study.accuracy.target
    design = _reference(study)
    found = quantity(family, name)
    requests = () if found is None or found.route != "reduction" else found.requests(family, study.window is not None)
    if target is None or not requests or any(request.windowed for request in requests):
        return [_asked(study, design, [name])]
    return [lambda: true_extrema(family, design, requests, target)]


def _sweep(study: Study) -> list[Callable[[], object]]:
    """Return the steps of a sweep, last ones first, for a few designs."""
    from sweep.chunks.chunk import asked_outputs, few_designs

    designs = few_designs(study)
    return [_asked(study, designs, names[::-1]) for names in reversed(asked_outputs(study))]


def _asked(study: Study, designs: Array, names: Sequence[str]) -> Callable[[], object]:
    """Return the step that computes outputs of designs."""
    from sweep.evaluation.summaries import design_outputs

    return lambda: design_outputs(study.family, designs, names, study.accuracy, study.window)
