"""A checked study, the input of engine, optimiser and report; in mm, rad and s."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sweep.effects import extended
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Family
from sweep.families.machines.specification import Specification
from sweep.families.names import without_minus
from sweep.numerics.curves import Curve
from sweep.quantities.limits import Limit as Limit
from sweep.study.space import DesignSpace

if TYPE_CHECKING:
    from sweep.synthesis.fit import LineFit
    from sweep.synthesis.locus import OnLocus
    from sweep.synthesis.tasks.problem import SynthesisTask


@dataclass(frozen=True)
class Objective:
    """Design output to be minimised; for maximisation the negative of the named output."""

    output: str

    @property
    def aim(self) -> str:
        """Direction of the objective as a word, for the output that the study names."""
        return "maximised" if without_minus(self.output) else "minimised"


@dataclass(frozen=True)
class ProveSettings:
    """Wanted gap between optimum and proven bound, and the largest number of boxes of designs to evaluate for it.

    A box is not halved once all its sides are below the share ``smallest`` of their ranges; it stays open, and the
    answer lists it as an exception.  ``seconds`` is an emergency brake: no round of boxes begins after it, and the
    answer says so.
    """

    gap: float
    boxes: int = 1_000_000
    smallest: float = 1e-7
    seconds: float | None = None


@dataclass(frozen=True)
class OptimiseSettings:
    """Settings of the local search: largest number of starts, seed, stopping rules and variables.

    ``variables`` is "locus" for the outputs that [locus] prescribes, "parameters" for the links, None for the default
    of the study.  ``unseen`` is the estimated share of unseen basins below which no more starts are made once the best
    basin was met often enough; None asks for 2 % of starts, and of populations for the best basin alone.  ``looks`` is
    the number of designs that each start may evaluate; with ``globally`` = "proportions" starts are ends of populations
    of descents over the nonlinear variables, from at most ``populations`` independent populations.  ``time_budget`` [s]
    is an emergency brake: a stopped result says so, and no other result depends on it.  ``prove`` asks for a proof that
    no design of the space is better.
    """

    starts: int = 20
    seed: int = 0
    time_budget: float | None = None
    variables: Literal["parameters", "locus"] | None = None
    unseen: float | None = None
    looks: int = 20_000
    globally: Literal["none", "proportions"] = "none"
    populations: int = 40
    prove: ProveSettings | None = None

    @property
    def by_populations(self) -> bool:
        """Whether the starts are ends of populations of descents."""
        return self.globally == "proportions"


@dataclass(frozen=True)
class ParetoSettings:
    """Bounds on a second output, for each of which the objective is minimised.

    ``bounds`` are upper ones, or with ``at_least`` lower ones; ``starts`` designs of the sweep within each bound are
    searched besides the optimum and the result of the next looser bound; ``time_budget`` [s] for the whole front is an
    emergency brake.  With ``points`` further bounds are placed where the front bends, until the front has that many.
    ``looks`` is the number of designs that each start may evaluate, as for the optimum.
    """

    output: str
    bounds: tuple[float, ...]
    at_least: bool = False
    starts: int = 2
    time_budget: float | None = None
    points: int | None = None
    looks: int = 20_000


@dataclass(frozen=True)
class Tolerance:
    """Manufacturing tolerances, +- of every length [mm] and of every angle [rad]; zero is exact.

    ``robust`` is the share of manufactured mechanisms that must keep the limits; None tests the nominal design alone.
    ``own`` are tolerances of single parameters, by name; ``samples`` is the number of mechanisms that estimate the
    share.
    """

    lengths: float = 0.0
    angles: float = 0.0
    robust: float | None = None
    own: tuple[tuple[str, float], ...] = ()
    samples: int = 1 << 16  # a share of 95 % is accurate to 0.05 %; with 8192 it was 0.2 % off


@dataclass(frozen=True)
class OutputSettings:
    """Designs that become rows, float type of the results, and designs whose curves over the turn are written."""

    keep: Literal["feasible", "all"] = "feasible"
    dtype: Literal["float32", "float64"] = "float64"
    curves: Literal["optimum", "none"] = "optimum"


@dataclass(frozen=True)
class Budget:
    """Costs above which a run must be forced."""

    disk_bytes: float
    seconds: float


@dataclass(frozen=True)
class Study:
    """A question about one mechanism, made by :func:`sweep.study.load_study`.

    ``want`` holds every computed design output: the wanted ones, those of the limits, the objective and the second
    output of the front.  ``curves`` are the loads over the turn, by the input to which each adds.  ``data`` is the
    file's content with defaults filled in and tables of other files inserted, ready for JSON; ``study_from_data``
    rebuilds the study.
    """

    name: str
    title: str
    question: str
    path: Path
    mechanism: tuple[str, ...] | Specification
    speed: float | None
    curves: dict[str, Curve]
    want: tuple[str, ...]
    space: DesignSpace
    locus: OnLocus | None
    fit: LineFit | None
    limits: tuple[Limit, ...]
    objective: Objective | None
    accuracy: Accuracy
    window: tuple[float, float] | None
    optimise: OptimiseSettings | None
    pareto: ParetoSettings | None
    tolerance: Tolerance | None
    reference: dict[str, float] | None
    task: SynthesisTask | None
    output: OutputSettings
    budget: Budget
    data: dict[str, Any]

    def __getstate__(self) -> dict[str, Any]:
        # What it remembers is made of functions: whoever unpickles a study makes its own family.
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def written(self) -> dict[str, Any]:
        """Entries of parameters and of inputs of effects as written in the file, by name."""
        return {name: x for table in ("loads", "bodies", "design") for name, x in self.data.get(table, {}).items()}

    @property
    def parameter_limits(self) -> tuple[Limit, ...]:
        """Limits that bound a parameter."""
        return tuple(limit for limit in self.limits if limit.output in self.family.parameter_names)

    @property
    def output_limits(self) -> tuple[Limit, ...]:
        """Limits that bound a design output."""
        return tuple(limit for limit in self.limits if limit.output not in self.family.parameter_names)

    @property
    def prescribed(self) -> tuple[str, ...]:
        """Design outputs that [locus] prescribes."""
        return () if self.locus is None else tuple(p.name for p in self.locus.prescribed)

    @property
    def tested_limits(self) -> tuple[Limit, ...]:
        """Limits that a design of the sweep may violate; those of prescribed outputs hold by construction."""
        return tuple(limit for limit in self.output_limits if limit.output not in self.prescribed)

    @property
    def bands(self) -> tuple[Limit, ...]:
        """Tolerance bands around prescribed outputs: designs hold the value, manufactured mechanisms scatter."""
        held = [limit for limit in self.output_limits if limit.output in self.prescribed]
        return tuple(x for k, x in enumerate(held) if x.output in [other.output for other in held[:k]])

    @property
    def wanted_yield(self) -> float | None:
        """Share of manufactured mechanisms that must keep the limits; None if that of the nominal design does."""
        return None if self.tolerance is None else self.tolerance.robust

    @property
    def made(self) -> tuple[str, ...]:
        """Parameters that [locus] or [fit] determines."""
        links = () if self.locus is None else self.locus.made
        return links if self.fit is None else (*links, *self.fit.parameters(self.family))

    @property
    def rescaled(self) -> tuple[str, ...]:
        """Parameters of which the study gives proportions only, since [fit] scales them."""
        return () if self.fit is None else self.fit.rescaled(self.family)

    @cached_property
    def family(self) -> Family:
        """The mechanism: a family, a chain or a machine, with the effects that the wanted outputs need."""
        return extended(self.bare, self.want, self.curves)

    @cached_property
    def bare(self) -> Family:
        """The mechanism without effects."""
        return find_family(self.mechanism)

    @cached_property
    def fingerprint(self) -> str:
        """Hash of everything that determines values, without name, title, question, budget and report.

        The same values written in other units or in another order give the same fingerprint.
        """
        content = {
            "families": asdict(self.mechanism) if isinstance(self.mechanism, Specification) else self.mechanism,
            "speed": self.speed,
            "want": self.want,
            "space": _space_content(self.space),
            "locus": self.prescribed,
            "fit": self.fit and asdict(self.fit),
            "limits": sorted((limit.output, limit.minimum, limit.maximum) for limit in self.limits),
            "objective": self.objective and self.objective.output,
            "accuracy": {"samples": self.accuracy.samples, "target": self.accuracy.target},
            "window": self.window,
            "optimise": self.optimise and _without_none(_counted(self.optimise), "variables"),
            "reference": self.reference,
            "output": asdict(self.output),
        }
        if self.pareto is not None:
            content["pareto"] = _counted(self.pareto)
        if self.curves:
            content["curves"] = {name: asdict(curve) for name, curve in self.curves.items()}
        if self.accuracy.certify:
            content["certify"] = self.accuracy.proven or True
        if self.task is not None:
            content["task"] = repr(self.task)
        if self.tolerance is not None:
            content["tolerance"] = _without_none(asdict(self.tolerance), "robust")
        return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _counted(settings: OptimiseSettings | ParetoSettings) -> dict[str, Any]:
    """Return the settings without the emergency brake, which determines no value."""
    return {key: value for key, value in asdict(settings).items() if key != "time_budget"}


def _without_none(content: dict[str, Any], name: str) -> dict[str, Any]:
    """Remove a later key that has no value, so that fingerprints of older datasets stay the same."""
    return {key: value for key, value in content.items() if key != name or value is not None}


def _space_content(space: DesignSpace) -> Mapping[str, Any]:
    axes = [
        (axis.name, axis.low, axis.high, axis.scale, None if axis.values is None else axis.values.tolist())
        for axis in space.axes
    ]
    return {
        "kind": space.kind,
        "samples": space.samples,
        "seed": space.seed,
        "axes": axes,
        "fixed": dict(space.fixed),
    }
