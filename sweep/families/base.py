"""The type of a mechanism family: its domain, parameters, outputs and kernels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property, wraps
from typing import Any, ClassVar, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from kernels.types import Array as Array
from sweep.families.parameter import PER_RADIAN as PER_RADIAN
from sweep.families.parameter import Event as Event
from sweep.families.parameter import Output as Output
from sweep.families.parameter import Parameter as Parameter
from sweep.families.parameter import Unit as Unit
from sweep.families.register import about as about
from sweep.families.register import parameters_of as parameters_of


@dataclass(frozen=True)
class Turn:
    """A closed turn: every pose output is a function of the crank angle phi with period 2 pi."""

    kind: ClassVar[str] = "turn"
    name: str = "phi"
    unit: str = "rad"
    text: str = "crank angle"


@dataclass(frozen=True)
class Interval:
    """An interval of an input variable; its ends are candidates for extrema.

    ``ends(designs)``, of (n, P), returns both ends, (n,) each.  ``poses`` gets the variable as ``angles.phi``; cosine
    and sine have no meaning.
    """

    kind: ClassVar[str] = "interval"
    name: str
    unit: str
    text: str
    ends: Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class March:
    """A motion with history: a pose depends on the poses before it, in the order of the crank angle.

    The family marches over ``turns`` turns in equal steps and keeps the last one, so its values exist only on the grid
    of the march: ``poses`` takes one row of equally spaced crank angles of one turn, from 0.
    """

    kind: ClassVar[str] = "march"
    name: str = "phi"
    unit: str = "rad"
    text: str = "crank angle"
    turns: int = 2


Domain: TypeAlias = Turn | Interval | March
Columns: TypeAlias = dict[str, NDArray[np.generic]]


def floats(columns: Mapping[str, NDArray[np.generic]], *names: str) -> list[Array]:
    """Return some columns as float64 arrays."""
    return [np.asarray(columns[name], np.float64) for name in names]


class Angles(NamedTuple):
    """Input angles with their cosines and sines; each (n, m), or (1, m) when shared by all designs."""

    phi: Array
    cos: Array
    sin: Array

    @classmethod
    def of(cls, phi: Array) -> Angles:
        """Tabulate a plain array of angles of shape (n, m) or (1, m)."""
        return cls(phi, np.cos(phi), np.sin(phi))

    def part(self, rows: Any, poses: slice = slice(None)) -> Angles:
        """Select designs, unless all share the angles, and poses."""
        return Angles(*(np.ascontiguousarray(x[rows if len(x) > 1 else slice(None), poses]) for x in self))


@dataclass(frozen=True)
class Accuracy:
    """Accuracy of extrema over the turn: a dense grid of ``samples``, or refinement to relative error ``target``.

    With ``certify`` all wanted maxima, or those that ``proven`` names, are proven too (docs/extrema.md, section 5).
    """

    samples: int | None = None
    target: float | None = None
    certify: bool = False
    proven: tuple[str, ...] = ()

    def of(self, name: str) -> Accuracy:
        """Accuracy of one output: without proof if it is not among the outputs to be proven."""
        return replace(self, certify=False) if self.certify and self.proven and name not in self.proven else self


DEFAULT_TARGET = 1e-8  # relative error where no accuracy is given
PoseFunction: TypeAlias = Callable[[Array, Angles, frozenset[str]], Columns]
Capability = TypeVar("Capability")


class Work(IntEnum):
    """Kind of work of a route; routes are run in this order.

    It decides which limit a design meets first and which outputs are then not computed, so no measured time changes it.
    """

    PARAMETERS = 0  # reads parameters only
    QUICK = 1  # a family's own step of a few microseconds at most: closed forms, a few roots
    SEARCH = 2  # extrema, means and events over poses
    EFFECT = 3  # the same with an effect at every pose
    LONG = 4  # a family's own step of tens of microseconds or more: curves, motion in time
    PROOF = 5


@dataclass(frozen=True)
class Step:
    """A family's own route to some design outputs: exact, or faster than the general reductions over sampled poses.

    ``run(designs, wanted, accuracy)`` returns the wanted ones of ``provides`` and ``status``, each of shape (n,).
    ``applies`` tells the accuracies it serves (a dense kernel does not serve ``accuracy=``).  ``certifies``: its maxima
    are proven, and serve ``Accuracy.certify`` only.  Steps of the same kind of work are run in the order in which the
    family lists them.  ``cost`` estimates its time [ns per design]; by default it is the row "family: step" of
    sweep/costs.toml; ``jump_ns`` is what designs take longer whose loads jump.  ``analytic``: it takes complex designs,
    for exact gradients by the complex step.
    """

    name: str
    provides: tuple[Output, ...]
    run: Callable[[Array, frozenset[str], Accuracy], Columns]
    applies: Callable[[Accuracy], bool] = field(default=lambda accuracy: True)
    work: Work = Work.QUICK
    certifies: bool = False
    cost: Callable[[Accuracy], float] | None = None
    jump_ns: float = 0.0
    analytic: bool = False


Coordinates: TypeAlias = tuple[str | None, str | None, str | None]
"""Pose outputs that are x, y, z of a point in the family's frame; None is a coordinate 0."""


@dataclass(frozen=True)
class Family:
    """A mechanism family, or a chain of them, which has the same interface.

    Parameters
    ----------
    name, title : name in the register, and title for people
    parameters : the columns of the (n, P) design matrix
    position : the pose output that is the follower's coordinate; limit positions, swing or stroke refer to it
    pose_outputs : all outputs of a single pose
    poses : ``poses(designs, angles, wanted)`` returns the wanted pose outputs and ``status``, each (n, m)
    domain : domain of evaluation
    steps : its own routes to design outputs, exact or faster than the general reductions over poses
    derivative_of : for a pose output its derivative with respect to the domain's variable
    events : events at roots of pose outputs
    outward : the sign parameter whose +1 makes the extended limit position the one with the largest position; without
        one the extended position always is
    uses_phi : whether poses need more than cos(phi) and sin(phi); in a chain that costs an arctangent per pose
    analytic : whether poses take complex designs and angles, for exact gradients by the complex step
    points : named moving points
    capabilities : typed objects for effects, proofs, drawings and fits (:mod:`sweep.families.capabilities`)
    example : an ordinary design, by parameter, whose poses all exist; hard inputs are derived from it
    dear : for pose outputs far more costly than the motion, their effect and its cost [ns per pose], in running order
    precise_poses : slower poses whose errors are a few roundings of the inputs, if the family has them
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    position: str
    pose_outputs: tuple[Output, ...]
    poses: PoseFunction
    domain: Domain = field(default_factory=Turn)
    steps: tuple[Step, ...] = ()
    derivative_of: Mapping[str, str] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    outward: str = ""
    uses_phi: bool = False
    analytic: bool = True
    points: Mapping[str, Coordinates] = field(default_factory=dict)
    capabilities: tuple[object, ...] = ()
    example: Mapping[str, float] = field(default_factory=dict)
    dear: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    precise_poses: PoseFunction | None = None

    def __repr__(self) -> str:
        """Name it: all its parts would fill pages."""
        return f"{type(self).__name__}({self.name!r})"

    def precise(self) -> Family:
        """Family with the most accurate poses it has: for single poses, not for sweeps."""
        return self._precise

    def values(self, designs: Array, angles: Angles, *names: str) -> list[Array]:
        """Compute some pose outputs, (n, m) each, without their status."""
        return floats(self.poses(designs, angles, frozenset(names)), *names)

    @cached_property
    def _precise(self) -> Family:
        """The same, made once, so that results cached with it are reused."""
        return self if self.precise_poses is None else replace(self, poses=self.precise_poses)

    def find(self, kind: type[Capability]) -> Capability | None:
        """First capability of a type, None if the family has none."""
        return next(iter(self.every(kind)), None)

    def the(self, kind: type[Capability]) -> Capability:
        """First capability of a type that the family has to have."""
        if not (found := self.every(kind)):
            raise TypeError(f"{self.name} has no {kind.__name__}")
        return found[0]

    def every(self, kind: type[Capability]) -> tuple[Capability, ...]:
        """All capabilities of a type: a chain has one per stage."""
        return tuple(found for found in self.capabilities if isinstance(found, kind))

    @cached_property
    def derived(self) -> dict[object, Any]:
        """Cache of results that depend on this family only, by the function: see :func:`of_family`."""
        return {}

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Column names of the design matrix in order."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def pose_names(self) -> tuple[str, ...]:
        """Names of the pose outputs."""
        return tuple(o.name for o in self.pose_outputs)

    @cached_property
    def pose_output(self) -> Mapping[str, Output]:
        """Pose outputs by name."""
        return {o.name: o for o in self.pose_outputs}

    def orders(self, name: str) -> list[str]:
        """List the derivatives 1..k up to ``name`` of the output that it derives from; empty if it is no derivative."""
        lower = {derivative: of for of, derivative in self.derivative_of.items()}
        names: list[str] = []
        while name in lower:
            names.insert(0, name)
            name = lower[name]
        return names

    def derivatives(self, name: str, most: int | None = None) -> list[str]:
        """List an output and its successive derivatives: all of them, or at most the given number."""
        names = [name]
        while names[-1] in self.derivative_of and (most is None or len(names) <= most):
            names.append(self.derivative_of[names[-1]])
        return names

    @cached_property
    def positions(self) -> Mapping[str, str]:
        """Pose outputs that are the position of a follower, with the number of its stage in a chain."""
        return {self.position: ""}

    def follower(self, pose: str) -> str:
        """Name of the follower's position that a pose output belongs to."""
        return self.position

    @cached_property
    def whole(self) -> Stage:
        """The whole mechanism as the stage of a chain."""
        return Stage(0, self, slice(0, len(self.parameters)))

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Stages of a chain; a family alone is its own only stage."""
        return (self.whole,)

    def outward_sign(self, position: str) -> str:
        """Name of the sign parameter that distinguishes a position's extended and folded limits; "" without one."""
        return self.outward


@dataclass(frozen=True)
class Stage:
    """One mechanism of a chain: its number from 1, and the columns of its parameters in the chain's design matrix.

    A family alone is a stage of number 0.
    """

    number: int
    family: Family
    columns: slice
    kappa: int | None = None  # columns of the coupling to the stage before; none for stage 1
    offset: int | None = None
    shift: int | None = None  # columns of its place on the shaft between; None if the families define no such axis
    turn: int | None = None

    @property
    def tail(self) -> str:
        """Suffix of the stage's names: its number in a chain, "" for a family alone."""
        return str(self.number) if self.number else ""

    @property
    def is_placed(self) -> bool:
        """Whether the place of its frame in that of the previous stage is known."""
        return self.shift is not None

    def designs(self, designs: Array) -> Array:
        """Design matrix of this stage alone."""
        return np.ascontiguousarray(designs[:, self.columns])


Found = TypeVar("Found")


def of_family(function: Callable[[Family], Found]) -> Callable[[Family], Found]:
    """Cache the result of a function of a family, which never changes.

    The result is shared by all callers, so it must not be changed.
    """

    @wraps(function)
    def found(family: Family) -> Found:
        if function not in family.derived:
            family.derived[function] = function(family)
        result: Found = family.derived[function]
        return result

    return found
