"""The verbs about compiled kernels: warm compiles them in advance, cache clear removes them."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

from kernels.cache_folder import cache_root
from sweep.cli.families import main_outputs
from sweep.engine.run import KernelStep, run
from sweep.evaluation.summaries import design_outputs, routes
from sweep.families import family as find_family
from sweep.families.base import DEFAULT_TARGET, Accuracy, Angles, Family, March
from sweep.families.poses import equal_steps
from sweep.jobs.executors import executor, for_tasks
from sweep.jobs.progress import Progress
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.nights.studies import files_of
from sweep.study import Study
from sweep.study.load import load_study

TINY = "smoke.toml"
POSES = 8
WHOLE_STROKE = (0.0, 1.0)


class WarmPart(NamedTuple):
    """Unit of work that one process compiles.

    For a study it is the step of a number, or without one everything after the steps; for a family some outputs, or
    without any its poses.
    """

    of: str
    outputs: tuple[str, ...] = ()
    step: int | None = None


@dataclass(frozen=True)
class Compile:
    """Compile a part by its number, in a worker."""

    parts: tuple[WarmPart, ...]

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> str:
        """Compile or load the kernels of the part, on a few designs; return the name of its study or family."""
        part = self.parts[number]
        if not Path(part.of).exists():
            _compile_family(find_family(part.of), part.outputs)
        elif part.step is not None:
            KernelStep(_study(part.of))(part.step)
        else:
            with tempfile.TemporaryDirectory(prefix="linksweep-") as folder:
                run(part.of, Path(folder, "designs"), 1, smoke=True, force=True)
        return part.of


@lru_cache(maxsize=1)
def _study(file: str) -> Study:
    return load_study(file)


def _compile_family(family: Family, outputs: Sequence[str]) -> None:
    """Compile a family's design outputs, or its poses if none are named."""
    designs = np.array([[family.example.get(p.name, p.default) for p in family.parameters]], np.float64)
    if outputs:
        design_outputs(family, designs, outputs, _accuracy(family), WHOLE_STROKE)
        return
    angles = Angles.of(equal_steps(family.domain, designs, POSES)[None])
    for one in (family, family.precise()):
        one.poses(designs, angles, frozenset(family.pose_names))


def _accuracy(family: Family) -> Accuracy:
    return Accuracy(samples=POSES) if isinstance(family.domain, March) else Accuracy(target=DEFAULT_TARGET)


def rounds(what: Sequence[str]) -> tuple[list[WarmPart], list[WarmPart]]:
    """Return the parts of studies and families: those that processes share first, then the rest of each study.

    The rest are the optimiser, the front and the proof, compiled by running the tiny version.

    Raises
    ------
    InputError
        for a name that is neither a study nor a family.
    """
    first: list[WarmPart] = []
    then: list[WarmPart] = []
    for name in what:
        if not Path(name).exists():
            family = find_family(name)
            selected = routes(family, main_outputs(family), _accuracy(family))
            first += [WarmPart(name), *(WarmPart(name, route.outputs) for route in selected)]
            continue
        for file in files_of(Path(name)):
            study = load_study(file)
            first += [WarmPart(str(file), step=number) for number in reversed(range(KernelStep(study).count))]
            if study.optimise is not None and (file.parent / TINY).exists():
                then.append(WarmPart(str(file)))
    return list(dict.fromkeys(first)), list(dict.fromkeys(then))


def compile_parts(parts: Sequence[WarmPart], jobs: int, stop: Stop, advance: Callable[[int], None]) -> None:
    """Compile parts in ``jobs`` processes; ``advance`` is called with 1 after each part.

    Raises
    ------
    Interrupted
        if a signal came; compiled kernels are kept.
    """
    place = for_tasks(executor("loky", jobs), len(parts))
    for _ in place.outcomes(Compile(tuple(parts)), iter(range(len(parts))), jobs, stop):
        advance(1)
    stop.raise_if_signalled("compiling", "what is compiled is")


@click.command()
@click.argument("what", metavar="[STUDY|FAMILY]...", nargs=-1)
@click.option("--jobs", type=click.IntRange(min=1), help="Processes. Default: as many as there are cores.")
def warm(what: tuple[str, ...], jobs: int | None) -> None:
    """Compile what studies or families need, before they are run: for images, clusters and nights.

    STUDY is a study file, a folder with one, or a folder of such folders; without any it is the folder studies.
    FAMILY is a name from `sweep families`, or a chain such as rssr+guide.  A run compiles what it finds missing by
    itself; afterwards it has nothing to wait for.
    """
    first, then = rounds(what or ("studies",))
    workers = jobs or os.cpu_count() or 1
    with stop_on_signal() as stop, Progress("compiling", len(first) + len(then), 0, True, unit="parts") as bar:
        compile_parts(first, workers, stop, bar.advance)
        compile_parts(then, workers, stop, bar.advance)


@click.group()
def cache() -> None:
    """Manage the compiled kernels that are kept on disk."""


@cache.command()
def clear() -> None:
    """Remove the compiled kernels of every version; they are compiled again when needed.

    Files cut short are noticed and made anew; this is the cure for any other damage, and makes room.
    """
    root = cache_root()
    if not root.exists():
        click.echo(f"nothing to remove: {root} does not exist")
        return
    shutil.rmtree(root)
    click.echo(f"removed {root}")
