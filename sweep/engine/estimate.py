"""Estimate of a study's time, disk and memory before it starts, and the check against its budget."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import numpy as np
from numba.core.event import Event, Listener, install_listener

from sweep.chunks.cascade import CALL_SECONDS, Dropped, levels
from sweep.chunks.plan import Pilot, choose_chunk_size, describe_columns, pilot, pilot_at, row_bytes
from sweep.errors import BudgetError, grouped, how_many
from sweep.evaluation.summaries import FEWEST_SAMPLES, FINEST_TARGET, MOST_SAMPLES
from sweep.families.base import Array
from sweep.families.names import is_error, is_flag
from sweep.jobs.progress import Phases
from sweep.optimise.front import pareto
from sweep.optimise.local.start import search
from sweep.optimise.manufacture import robust
from sweep.optimise.manufacture.margins import inequalities
from sweep.optimise.manufacture.sample import Sampler
from sweep.optimise.multistart.survey import CONFIRMATIONS, GROUP_SIZE
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import SAMPLES, random_designs, sample_seconds
from sweep.optimise.starts.posing import problem_of
from sweep.optimise.starts.proportions import POPULATIONS, SWEPT
from sweep.optimise.starts.ranked import ranking
from sweep.quantities.kinds import is_windowed
from sweep.quantities.resolve import resolve
from sweep.reductions.steps import certified_names
from sweep.study.load import study_from_data, with_accuracy
from sweep.study.study import OptimiseSettings, Study

# Share of kept designs that is assumed where the pilot kept none.
LEAST_KEPT = 1e-3
COARSEST_TARGET = 0.1
# Measured: writing takes 120 ns per row and 5 ms per chunk.
WRITE_SECONDS_PER_ROW = 120e-9
WRITE_SECONDS_PER_CHUNK = 5e-3
# Measured share of bytes after zstd of a result and of its error estimate; a sampled parameter keeps seven of its
# eight bytes; lattice parameters, design number and status together take less than half a byte per row.
PACKED_RESULT, PACKED_ERROR = 0.78, 0.55  # 0.3 to 0.8 for errors
SAMPLED_VALUE_BYTES = 7.0
OTHER_BYTES_PER_ROW = 0.5
# Bytes of a column in a chunk besides its values: 350 to 450 in the footer, with name and definition, and 94 to 137 in
# pages; of a chunk besides its columns: 2000 to 5500 of metadata, once as text and once in base64.
BYTES_PER_COLUMN, BYTES_PER_CHUNK = 520.0, 2800.0

# Memory of Python, numpy, pandas, pyarrow and the compiled kernels.
BASE_MEMORY_BYTES = 350e6
# A chunk is in memory as designs, as outputs and as the table being encoded.
COPIES_OF_A_CHUNK = 3
# Threads share memory bandwidth and the interpreter: two were measured at 1.95 times the speed of one.
THREAD_EFFICIENCY = 0.97


# Evaluations of a local search, evaluations to compile and time one, and evaluations equivalent to a population of
# needle drives: 27 and 29 s at 9 ms each were measured, without and with margins for tolerances.  If a trial search
# converges within TRIED_SECONDS, its own number of evaluations is used.  The others are long: 600 is a rule of thumb,
# searches with a rest or a window took up to 3000.
TYPICAL_LOOKS, TRIED_LOOKS, POPULATION_LOOKS = 600, 40, 3000
TRIED_SECONDS = 0.5
NEAR_LOOKS = 75  # evaluations of a search of a front, which starts at its neighbour's optimum: 56 and 73 were measured
MADE_SAMPLES = 3  # samples of mechanisms of the end of a search with margins for tolerances; 1 to 5 were measured
REPORT_SECONDS = 5.0


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of a run; ``kept`` is the share of designs expected to become rows."""

    designs: int
    chunks: int
    chunk_size: int
    jobs: int
    kept: float
    memory_bytes: float
    disk_bytes: float
    seconds: float


def estimate(
    study: Study,
    jobs: int,
    tell: Callable[[int, int], None] = lambda _, __: None,
    known: Pilot | None = None,
) -> Estimate:
    """Estimate a run from the routes' costs and a pilot of about a thousand designs spread over the space.

    Parameters
    ----------
    study : the study
    jobs : number of workers
    tell : called with the number of finished parts of the pilot and of all parts
    known : the pilot, if it has been run already

    Returns
    -------
    Estimate
        ``seconds`` of the sweep alone, without the first compilation of the kernels.  If the pilot keeps no design, one
        in a thousand is assumed.  ``disk_bytes`` assumes that every result of a row is computed and does not repeat,
        which is too much where rows of infeasible designs are kept or symmetries make values repeat.
    """
    sample = pilot(study, tell) if known is None else known
    chunk_size = choose_chunk_size(study, sample)
    designs = study.space.count
    share = 1.0 if study.output.keep == "all" else max(sample.feasible, LEAST_KEPT)
    columns = describe_columns(study)
    results = sum(
        np.dtype(column.dtype).itemsize * (PACKED_ERROR if is_error(column.name) else PACKED_RESULT)
        for column in columns
        if column.role == "output" and not is_flag(column.name)
    )
    sampled = len(study.space.axes) * SAMPLED_VALUE_BYTES if study.space.kind == "sobol" else 0.0
    chunks = -(-designs // chunk_size)
    work = designs * (sample.seconds_per_design + share * WRITE_SECONDS_PER_ROW)
    # At the end of a chunk every level computes the designs that still wait there, even a few.
    work += chunks * (WRITE_SECONDS_PER_CHUNK + CALL_SECONDS * len(levels(study)))
    return Estimate(
        designs=designs,
        chunks=chunks,
        chunk_size=chunk_size,
        jobs=jobs,
        kept=share,
        memory_bytes=BASE_MEMORY_BYTES + jobs * COPIES_OF_A_CHUNK * min(chunk_size, designs) * row_bytes(study),
        disk_bytes=designs * share * (OTHER_BYTES_PER_ROW + sampled + results)
        + chunks * (len(columns) * BYTES_PER_COLUMN + BYTES_PER_CHUNK),
        seconds=work / (1.0 if jobs == 1 else jobs * THREAD_EFFICIENCY),
    )


def searches(study: Study, jobs: int, known: Pilot) -> tuple[tuple[str, float, float], ...]:
    """List the searches after the sweep with their typical and longest time [s], from timed evaluations of a design.

    A short trial search starts at a design that the pilot kept, or at the best of random ones, as searches do: an
    evaluation of a design that does not turn costs a quarter of one that does.  Compilation is not counted.
    """
    settings = study.optimise
    if settings is None or study.objective is None:
        return ()
    designs = known.kept if len(known.kept) else random_designs(study, 1, settings.seed)
    if not len(designs):
        return ()
    problem = problem_of(study, designs)
    start = designs[0 if len(known.kept) else int(np.argmin(ranking(problem, designs)))]
    search(0, problem, start, lambda: False, TRIED_LOOKS)  # compiles
    begin = time.process_time()
    trial = search(0, problem, start, lambda: time.process_time() - begin > TRIED_SECONDS, TYPICAL_LOOKS)
    seconds = (time.process_time() - begin) / max(trial.looks, 1) / jobs
    settled = trial.looks if trial.ended == "converged" else None
    typical, most = min(settings.looks, settled or TYPICAL_LOOKS) * seconds, settings.looks * seconds
    population = POPULATION_LOOKS * seconds if settings.by_populations else 0.0
    if settings.by_populations:
        longest = settings.populations * (population + 2.0 * most) + settings.starts // SWEPT * most
        rows = [("search", CONFIRMATIONS * (population + 2.0 * typical), longest)]
    else:
        sampled = study.fit is None and settings.starts > 1
        sample = sample_seconds(problem, start, settings.starts) if sampled else 0.0
        expected = 0.0 if len(known.kept) else sample
        all_samples = -(-SAMPLES * settings.starts // GROUP_SIZE) * sample
        rows = [("search", expected + settings.starts * typical, all_samples + settings.starts * most)]
    whole, sample = _made_seconds(study, problem, start)
    if study.wanted_yield is not None:
        expected, longest = (n * seconds + POPULATIONS * population for n in _robust_looks(settings, settled))
        ends = min(robust.CONTINUED, settings.starts)
        few, many = (n * ends * sample / jobs for n in (MADE_SAMPLES, robust.CORRECTIONS + 1))
        rows.append(("tolerances", expected + few, 2.0 * longest + many))
    if study.pareto is not None:
        count = pareto.searches(study.pareto)
        limit = min(study.pareto.looks, settings.looks) * seconds
        rows.append(("front", count * min(NEAR_LOOKS * seconds, limit), count * limit))
    if study.tolerance is not None:
        rows.append(("what is made", whole / jobs, whole))
    return (*rows, ("tables and report", REPORT_SECONDS, 4.0 * REPORT_SECONDS))


def _made_seconds(study: Study, problem: Problem, design: Array) -> tuple[float, float]:
    """Time what is made of a design (P,): seconds of one worker for all tables about it, and for one sample."""
    if study.tolerance is None:
        return 0.0, 0.0
    shown = 1 + (study.reference is not None)
    limits, told = inequalities(problem), [0]
    names = [limit.output for limit in limits] or list(study.want)
    Sampler(problem, study.tolerance, 0).outputs(design, names, count=1)  # compiles
    begin = time.process_time()
    sampler = Sampler(
        problem, study.tolerance, 0, lambda: time.process_time() - begin > TRIED_SECONDS, tell=told.append
    )
    with suppress(Dropped):
        sampler.outputs(design, names)
    seconds = (time.process_time() - begin) / sum(told)
    shares = shown + (study.wanted_yield is not None) if limits else 0
    return sampler.planned(design, shares, shown) * seconds, study.tolerance.samples * seconds


def _robust_looks(settings: OptimiseSettings, settled: int | None) -> tuple[int, int]:
    """Estimate the evaluations of the searches with margins for tolerances: typical, and if none converges.

    Searches of needle drives use all evaluations they are allowed: 9 to 14 s per start and 33 to 41 s per end were
    measured, samples included, where 1600 and 4000 evaluations take 14 and 36 s.  Where a trial search has ``settled``
    after some number of evaluations, each round takes at most that many.  Without populations no more searches are
    begun than there are starts.
    """
    starts = robust.MOST_BASINS if settings.by_populations else min(robust.MOST_BASINS, settings.starts)
    rounds, first_budget = starts * robust.ROUNDS, min(robust.FIRST_BUDGET, settings.looks)
    continued, corrections = min(robust.CONTINUED, starts), robust.CORRECTIONS * robust.ROUNDS
    most = rounds * first_budget + continued * settings.looks
    if settled is None:
        return most, most
    return rounds * min(first_budget, settled) + continued * min(settings.looks, corrections * settled), most


def other_accuracies(
    study: Study, jobs: int, tell: Callable[[int, int], None] = lambda _, __: None, known: Pilot | None = None
) -> tuple[tuple[str, float], ...]:
    """Estimate the time [s] of the same sweep at other accuracies, each described in words.

    ``tell`` is called with the number of finished estimates and of all estimates.  ``known`` is the pilot of the study.
    """
    sample = pilot(study) if known is None else known
    estimates, others = [], neighbours(study)
    for k, (words, other) in enumerate(others):
        tell(k, len(others))
        estimates.append((words, estimate(other, jobs, known=pilot_at(other, sample)).seconds))
    return tuple(estimates)


def neighbours(study: Study) -> tuple[tuple[str, Study], ...]:
    """List the same study with one digit less and one more, or half and twice the samples, each with a description.

    With a target also without the proof of its maxima, or with it where its maxima can be proven.  An accuracy outside
    the range of `sweep.summarise` is left out.
    """
    target, samples = study.accuracy.target, study.accuracy.samples
    if target is not None:
        digits = (("one digit less", 10.0 * target), ("one digit more", 0.1 * target))
        variants = [(words, with_accuracy(study, t)) for words, t in digits if FINEST_TARGET <= t <= COARSEST_TARGET]
        wanted = [name for name in certified_names(study.family) if name in study.want]
        provable = [
            name for name in wanted if not (study.window and is_windowed(study.family, resolve(study.family, name)))
        ]
        if study.accuracy.certify:
            variants.append(("without the proof", with_accuracy(study, certify=False)))
        elif provable:
            variants.append(("with the proof that no peak is missed", with_accuracy(study, certify=provable)))
        return tuple(variants)
    assert samples is not None
    counts = (("half the samples", samples // 2), ("twice the samples", 2 * samples))
    return tuple(
        (words, study_from_data(study.data | {"accuracy": {"samples": n}}, study.path))
        for words, n in counts
        if FEWEST_SAMPLES <= n <= MOST_SAMPLES
    )


def check_budget(study: Study, cost: Estimate) -> None:
    """Raise if a study's estimate exceeds its budget ([budget] in the file; 20 GB and 1 h by default).

    Raises
    ------
    BudgetError
        with the estimate, the budget and the way out.
    """
    over = []
    if cost.seconds > study.budget.seconds:
        over.append(f"time about {duration(cost.seconds)}; allowed: {duration(study.budget.seconds)} (budget.time)")
    if cost.disk_bytes > study.budget.disk_bytes:
        over.append(f"disk about {size(cost.disk_bytes)}; allowed: {size(study.budget.disk_bytes)} (budget.disk)")
    if over:
        way_out = "take fewer values, raise the budget in the study file, or force it"
        what = f"{how_many(cost.designs, 'design')} on {how_many(cost.jobs, 'worker')}"
        raise BudgetError(f"{study.path}: over the budget with {what}: {'; '.join(over)}; {way_out}")


def duration(seconds: float) -> str:
    """Write a time in words."""
    for below, unit in ((1e-6, "ns"), (1e-3, "us"), (1.0, "ms")):
        if 0.0 < seconds < below:
            return f"{float(f'{seconds / below * 1e3:.3g}'):g} {unit}"
    if seconds < 120.0:
        return f"{float(f'{seconds:.2g}'):g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.3g} h"


def size(count: float) -> str:
    """Write a number of bytes in words; budgets are written in GB, so that is the largest unit."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= scale:
            return f"{grouped(float(f'{count / scale:.3g}'))} {unit}"
    return f"{count:.0f} bytes"


class Compiled(Listener):
    """Counts the functions that numba has compiled, and reports each new count."""

    def __init__(self, tell: Callable[[int], None]) -> None:
        self.functions, self.tell = 0, tell
        tell(0)

    def on_start(self, event: Event) -> None:
        """Ignore the start of a compilation."""

    def on_end(self, event: Event) -> None:
        """Count a finished compilation, and report the count."""
        self.functions += 1
        self.tell(self.functions)


@contextmanager
def compiling(phases: Phases) -> Iterator[None]:
    """Report the functions that are compiled within this context, between the phases of the caller."""

    def tell(functions: int) -> None:
        if functions:
            phases.say("compiling", functions, unit="functions")

    with install_listener("numba:compile", Compiled(tell)):
        yield
