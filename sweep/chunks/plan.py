"""The plan of a sweep: its cut into chunks, its columns, and the identity in every chunk's name."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, get_args

import numpy as np

from kernels.cache_folder import source_hash
from kernels.status import OK
from sweep.chunks.cascade import BLOCK, CALL_SECONDS, Cascade, levels
from sweep.chunks.chunk import output_columns
from sweep.chunks.parameters import parameter_ns, runs_matrix
from sweep.families.base import Array, Unit, Work
from sweep.families.names import is_error, without_error
from sweep.quantities.kinds import is_windowed
from sweep.quantities.resolve import resolve
from sweep.quantities.units import internal_unit
from sweep.reductions.steps import is_proven
from sweep.sources import DIGESTS
from sweep.study import Study

FORMAT = 2

# A chunk should take a few seconds on one core by the routes' own costs, so that every machine cuts alike; it should
# have at most CHUNK_BYTES before it is encoded; and there should be enough chunks to keep all workers busy to the end.
CHUNK_SECONDS = 2.0
CHUNK_BYTES = 32 * 2**20
CHUNKS_AT_LEAST = 16
SECONDS_AT_LEAST = 0.1
CHUNK_STEP = 512

# Neighbouring designs are alike: with 4 and with 32 runs of them the share kept was off by 0.2 and 0.6.
PILOT_MOST, PILOT_LEAST, PILOT_RUNS, PILOT_PARTS = 1024, 16, 128, 4
PILOT_SHARE = 8  # a pilot has at most 1/8 of the designs: for a small sweep it would otherwise double the time

PARAMETER_UNITS = {word: internal_unit(word) for word in get_args(Unit)}

# Folders of the package whose sources determine values in a chunk.
VALUES = frozenset(
    ["numerics", "families", "quantities", "effects", "reductions", "evaluation", "synthesis", "study", "chunks"]
)

# Sections of the study file that determine no value in a chunk.
NOT_IN_CHUNKS = ("study", "optimise", "pareto", "tolerance", "reference", "budget", "report")


@dataclass(frozen=True)
class Column:
    """One column of a chunk: its numpy type, unit and definition (both stored as Parquet field metadata)."""

    name: str
    dtype: str
    unit: str
    text: str
    role: str


class Pilot(NamedTuple):
    """Estimates from a pilot: time per design on one core [s], and share of designs within every limit.

    ``reached`` lists the outputs of every level of the cascade and the share of designs that reach it; ``kept`` are the
    designs (n, P) among the ``tried`` that are within every limit.
    """

    seconds_per_design: float
    feasible: float
    reached: tuple[tuple[tuple[str, ...], float], ...]
    kept: Array
    tried: int


@dataclass(frozen=True)
class Plan:
    """The cut of a sweep into chunks and all that determines their content: equal plans give equal bytes."""

    name: str
    study: str
    code: str
    designs: int
    chunk_size: int
    columns: tuple[Column, ...]
    repetitive: tuple[str, ...]
    chunk_data: dict[str, Any]

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.designs // self.chunk_size)

    @property
    def format(self) -> int:
        """Version of the chunk layout, which a chunk's metadata name."""
        return FORMAT

    @property
    def identity(self) -> str:
        """Short hash of study, code, cut and columns; part of every chunk's file name."""
        columns = [[c.name, c.dtype, c.unit] for c in self.columns]
        text = json.dumps([FORMAT, self.study, self.code, self.designs, self.chunk_size, columns, self.repetitive])
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def bounds(self, index: int) -> tuple[int, int]:
        """Return the first design of a chunk, and the one after its last."""
        start = index * self.chunk_size
        return start, min(start + self.chunk_size, self.designs)

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as it is written to ``_plan.json``."""
        return {"format": FORMAT, "identity": self.identity, "chunks": self.chunks} | asdict(self)


def make_plan(study: Study, chunk_size: int | None = None) -> Plan:
    """Make the plan of a study; its chunk size is estimated from a pilot of about a thousand designs.

    Parameters
    ----------
    study : the study
    chunk_size : designs per chunk if it is known already (a resumed run)
    """
    return Plan(
        name=study.name,
        study=designs_fingerprint(study),
        code=code_hash(),
        designs=study.space.count,
        chunk_size=choose_chunk_size(study) if chunk_size is None else chunk_size,
        columns=describe_columns(study),
        repetitive=_repetitive(study),
        chunk_data={key: value for key, value in study.data.items() if key not in NOT_IN_CHUNKS},
    )


def _repetitive(study: Study) -> tuple[str, ...]:
    """List the parameters whose values repeat among the designs; they are written dictionary-encoded."""
    names = study.space.fixed if study.space.kind == "sobol" else study.space.names
    parameters = study.family.parameter_names
    return tuple(name for name in names if name in parameters and name not in (*study.made, *study.rescaled))


def designs_fingerprint(study: Study) -> str:
    """Hash the study without the parts that concern only the optimum: changing these leaves the designs valid."""
    output = replace(study.output, curves="none")
    return replace(study, optimise=None, pareto=None, tolerance=None, reference=None, output=output).fingerprint


def choose_chunk_size(study: Study, known: Pilot | None = None) -> int:
    """Choose the designs per chunk: a multiple of 512 from the routes' cost, the memory and the number of designs.

    Neither the number of workers nor the clock of the machine enters.  ``known`` is a pilot that has been run already.
    """
    seconds = max((pilot(study) if known is None else known).seconds_per_design, 1e-10)
    by_time = CHUNK_SECONDS / seconds
    by_memory = CHUNK_BYTES / row_bytes(study)
    by_count = max(study.space.count / CHUNKS_AT_LEAST, SECONDS_AT_LEAST / seconds)
    return CHUNK_STEP * max(1, math.floor(min(by_time, by_memory, by_count) / CHUNK_STEP))


TRIED = (512, 4096)  # designs that are tested in search of feasible ones
RUN = 8  # consecutive designs among them, which share the cost of a call


def pilot(study: Study, tell: Callable[[int, int], None] = lambda _, __: None) -> Pilot:
    """Run the cascade on about a thousand designs spread over the space, or on an eighth of a smaller space.

    ``tell`` is called with the number of finished parts and of all parts.

    Effects without a limit at the end of the cascade are priced, not computed.  The time counts parameters, and each
    route as often as designs reached it, by their own costs, so it is the same on every machine.
    """
    count = study.space.count
    number = min(PILOT_MOST, max(count // PILOT_SHARE, min(PILOT_LEAST, count)))
    length = -(-number // PILOT_RUNS)
    starts = _spread(number // length, count - length + 1)
    runs_per_part = -(-len(starts) // PILOT_PARTS)
    parts = [starts[k : k + runs_per_part] for k in range(0, len(starts), runs_per_part)]
    computed = _pilot_levels(study)
    reached, feasible, total, kept = np.zeros(len(levels(study))), 0, 0, []
    for k, part in enumerate(parts):
        tell(k, len(parts))
        designs, status = runs_matrix(study, [(start, start + length) for start in part])
        cascade = Cascade(study, keep=False)
        cascade.levels = cascade.levels[:computed]
        cascade.feed(np.arange(len(designs)), designs, status)
        kept.append(cascade.end(()).designs)
        passed = int(cascade.counts[OK])
        reached += [*cascade.reached[:computed], *[passed] * (len(reached) - computed)]
        feasible += passed
        total += len(designs)
    shares = [float(share) for share in reached / total]
    outputs = tuple(level.outputs for level in levels(study))
    seconds, sent = _seconds(study, shares), tuple(zip(outputs, shares, strict=True))
    return Pilot(seconds, feasible / total, sent, np.concatenate(kept), total)


def _pilot_levels(study: Study) -> int:
    """Return the number of levels that a pilot computes; effects without a limit at the end are skipped."""
    limited = {limit.output for limit in study.tested_limits}
    count = len(levels(study))
    if study.bare is study.family:
        return count
    for level in reversed(levels(study)):
        if level.route is None or level.route.order[0] < Work.EFFECT or limited.intersection(level.outputs):
            break
        count -= 1
    return count


def pilot_at(study: Study, known: Pilot) -> Pilot:
    """Price a study by the pilot of the same study at another accuracy.

    The accuracy affects only designs close to a limit.  A level that a proof moves is reached by as many designs as
    before, and by no fewer than the levels after it.
    """
    share_of = {name: share for names, share in known.reached for name in names or ("",)}
    shares = [max(share_of[name] for name in level.outputs or ("",)) for level in levels(study)]
    return known._replace(seconds_per_design=_seconds(study, [max(shares[k:]) for k in range(len(shares))]))


def _seconds(study: Study, shares: Sequence[float]) -> float:
    """Estimate the time of one design [s], given the share of designs that reach each level."""
    seconds, calls = 1e-9 * parameter_ns(study), 1.0 / BLOCK
    for share, level in zip(shares, levels(study), strict=True):
        seconds += 1e-9 * share * level.ns_per_design
        calls += share / level.batch
    return seconds + CALL_SECONDS * calls


def _spread(number: int, count: int) -> list[int]:
    """Choose about ``number`` integers below ``count``, evenly spread; the same at every call."""
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    return sorted({int((k * golden) % 1.0 * count) for k in range(number)})


def spread_designs(study: Study, number: int) -> Array:
    """Choose about ``number`` designs (n, P) spread over the space; fewer where [locus] finds no mechanism."""
    starts = _spread(number, study.space.count)
    matrix, status = runs_matrix(study, [(start, start + 1) for start in starts])
    designs: Array = matrix[status == OK]
    return designs


def feasible_designs(study: Study, number: int) -> tuple[Array, int]:
    """Find about ``number`` designs that keep all limits, spread over the feasible ones, and the number tried.

    512 designs spread over the space go through the limits, then 4096 if none of these keeps all; they are fitted and
    on their locus like the designs of the sweep.
    """
    count, tried = study.space.count, 0
    feasible = np.empty((0, len(study.family.parameters)))
    for most in TRIED:
        runs = -(-count // RUN)
        chosen = range(runs) if count <= most else _spread(most // RUN, runs)
        designs, status = runs_matrix(study, [(k * RUN, min((k + 1) * RUN, count)) for k in chosen])
        cascade = Cascade(study, keep=False)
        cascade.feed(np.arange(len(designs)), designs, status)
        feasible, tried = cascade.end(()).designs, len(designs)
        if len(feasible) or tried == count:
            break
    return spread_rows(feasible, number), tried


def spread_rows(designs: Array, number: int) -> Array:
    """Select ``number`` of the designs, evenly spread, or all if they are fewer."""
    rows = np.unique(np.linspace(0, len(designs) - 1, min(number, len(designs))).astype(int))
    chosen: Array = designs[rows]
    return chosen


def row_bytes(study: Study) -> int:
    """Return the number of bytes of a row before it is encoded."""
    return sum(np.dtype(column.dtype).itemsize for column in describe_columns(study))


def describe_columns(study: Study) -> tuple[Column, ...]:
    """List the columns of a chunk in order: design, parameters, outputs, status."""
    columns = [Column("design", "int64", "1", "index of the design in the study's design space", "index")]
    columns += [
        Column(p.name, "float64", PARAMETER_UNITS[p.unit], p.text, "parameter") for p in study.family.parameters
    ]
    columns += [_output_column(study, name, dtype) for name, dtype in output_columns(study).items()]
    columns.append(Column("status", "uint8", "1", "0 = ok, others say why a value is missing", "status"))
    return tuple(columns)


def error_words(study: Study, name: str) -> str:
    """Definition of an output's error column: proven bound or estimate."""
    proven = is_proven(study.family, name, study.accuracy)
    return "proven bound of the absolute error" if proven else "absolute error estimate"


def _output_column(study: Study, name: str, dtype: str) -> Column:
    plain = without_error(name)
    want = resolve(study.family, plain)
    definition = want.output
    text = f"{error_words(study, plain)} of {definition.name}" if is_error(name) else definition.text
    if study.window is not None and not is_error(name) and is_windowed(study.family, want):
        text += ", in the window from {:g} to {:g} of the stroke".format(*study.window)
    return Column(name, dtype, internal_unit(definition.unit), text, "output")


@lru_cache
def code_hash() -> str:
    """Hash the sources and libraries that determine the values in a chunk."""
    import scipy

    values = [path for path in DIGESTS if path.split("/")[0].removesuffix(".toml") in VALUES]
    return _hash_sources(values, f"{source_hash()} {np.__version__} {scipy.__version__}")


@lru_cache
def optimiser_hash() -> str:
    """Hash the sources that determine the optimum, beyond those of the chunks."""
    return _hash_sources([path for path in DIGESTS if path.startswith("optimise/")], code_hash())


def _hash_sources(paths: list[str], first: str) -> str:
    return hashlib.sha256(f"{first} {[(path, DIGESTS[path]) for path in paths]}".encode()).hexdigest()[:16]
