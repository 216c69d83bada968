"""How a mechanism family presents itself to the sweep: its parameters, its outputs, its kernels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Columns: TypeAlias = dict[str, NDArray[np.generic]]
Unit = Literal[
    "length", "angle", "ratio", "sign", "count", "none", "choice",
    "mass", "inertia", "force", "torque", "pressure", "stiffness", "damping", "speed", "angular_acceleration",
    "acceleration", "time",
]  # fmt: skip


class Angles(NamedTuple):
    """Input angles with their cosines and sines; each (n, m), or (1, m) when shared by all designs."""

    phi: Array
    cos: Array
    sin: Array

    @classmethod
    def of(cls, phi: Array) -> Angles:
        """Tabulate a plain array of angles of shape (n, m) or (1, m)."""
        return cls(phi, np.cos(phi), np.sin(phi))


@dataclass(frozen=True)
class Parameter:
    """One column of the design matrix."""

    name: str
    unit: Unit
    text: str
    positive: bool = False
    default: float | None = None
    choices: tuple[float, ...] | None = None
    not_negative: bool = False

    @property
    def sign(self) -> str:
        """What its sign may be, in a word; empty if anything."""
        return "positive" if self.positive else "non-negative" if self.not_negative else ""

    @property
    def choice(self) -> str:
        """The values it may have, in words; signs are shown where they are the choice."""
        signed = any(x < 0.0 for x in self.choices or ())
        return " or ".join(f"{x:+g}" if signed else f"{x:g}" for x in self.choices or ())


@dataclass(frozen=True)
class Output:
    """One quantity that can be wanted: unit in SI words ("rad", "length", "1"), definition, equation of its page.

    ``jumps`` says that it is a whole number or otherwise constant in pieces: no slope leads an optimiser to it.
    """

    name: str
    unit: str
    text: str
    equation: str = ""
    jumps: bool = False


@dataclass(frozen=True)
class Accuracy:
    """How extrema over the turn are found: on a dense grid of ``samples``, or refined to relative error ``target``.

    With ``certify`` it is also proven that no peak of a maximum was missed (docs/extrema.md, section 5): of all wanted
    maxima, or of those that ``proven`` names.
    """

    samples: int | None = None
    target: float | None = None
    certify: bool = False
    proven: tuple[str, ...] = ()

    def of(self, name: str) -> Accuracy:
        """The accuracy of one output: without proof where only others are to be proven."""
        return replace(self, certify=False) if self.certify and self.proven and name not in self.proven else self


PoseFunction: TypeAlias = Callable[[Array, Angles, frozenset[str]], Columns]
StepFunction: TypeAlias = Callable[[Array, frozenset[str], Accuracy], Columns]
JointFunction: TypeAlias = Callable[[Array, Angles, Columns, Array, Array], None]
EllipseFunction: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class Step:
    """A family's own route to some design outputs: exact, or faster than the general reductions over sampled poses.

    ``run(designs, wanted, accuracy)`` returns the wanted ones of ``provides`` and ``status``, each of shape (n,).
    ``applies`` says for which accuracy it serves (a dense kernel does not serve ``accuracy=``).  ``certifies``: its
    maxima are proven, and serve ``Accuracy.certify`` only.
    """

    name: str
    provides: tuple[Output, ...]
    run: StepFunction
    ns_per_design: float
    applies: Callable[[Accuracy], bool] = field(default=lambda accuracy: True)
    ns_per_sample: float = 0.0
    certifies: bool = False

    def cost(self, accuracy: Accuracy) -> float:
        """Estimated time [ns per design]; a step that works through the samples says what each one costs."""
        return self.ns_per_design + self.ns_per_sample * (accuracy.samples or 0)


class Travel(NamedTuple):
    """Where the parts of a guided point's drive stand in the design matrix, for the proof of its maxima.

    ``starts`` are the columns in which the parameters of each stage begin, crank-rockers first, the guide's last;
    ``couplings`` those of kappa of each stage but the first, the offset stands behind it.
    """

    starts: tuple[int, ...]
    couplings: tuple[int, ...]


@dataclass(frozen=True)
class Family:
    """A mechanism family, or a chain of them, which looks the same from outside.

    ``poses(designs, angles, wanted)`` takes the (n, P) matrix with the columns of ``parameters`` and returns the wanted
    pose outputs and ``status``, each of shape (n, m).  ``position`` names the follower's coordinate, "psi" or "s"; its
    derivatives with respect to phi are ``d<position>``, ``d2<position>``, ``d3<position>``.  A family whose poses need
    no more than cos(phi) and sin(phi) says ``uses_phi=False``; in a chain that saves an arctangent per pose.
    ``joints(designs, angles, motion, per_pose, per_design)`` fills the records of :mod:`kernels.joints` that effects
    work from, out of the pose outputs ``joint_needs``; ``ellipse(designs)`` gives the curve that
    :mod:`kernels.effects.pressure_extrema` takes.  A family without them has no effects.  ``dear`` names, for pose
    outputs that cost far more than the motion, what they are computed by and its cost [ns per pose].  ``precise_poses``
    is a slower ``poses`` for real numbers whose errors are a few roundings of what is given, where the family has one.
    ``travel`` is given by a guide, alone or behind crank-rockers (:mod:`sweep.reductions.travel`).
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    position: str
    pose_outputs: tuple[Output, ...]
    poses: PoseFunction
    steps: tuple[Step, ...] = ()
    derivative_of: Mapping[str, str] = field(default_factory=dict)
    uses_phi: bool = True
    joints: JointFunction | None = None
    joint_needs: tuple[str, ...] = ()
    ellipse: EllipseFunction | None = None
    dear: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    precise_poses: PoseFunction | None = None
    travel: Travel | None = None

    def precise(self) -> Family:
        """Give the same family with the most accurate poses it has: for single poses, not for sweeps."""
        return self if self.precise_poses is None else replace(self, poses=self.precise_poses)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Column names of the design matrix in order."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def pose_names(self) -> tuple[str, ...]:
        """Names of the pose outputs."""
        return tuple(o.name for o in self.pose_outputs)


def filled(
    kernel: Callable[..., object],
    arguments: Sequence[object],
    names: tuple[str, ...],
    wanted: frozenset[str],
    status: NDArray[np.uint8],
    dtype: DTypeLike = np.float64,
) -> Columns:
    """Call ``kernel(*arguments, status, *outputs)``; the wanted outputs, shaped like ``status``, and ``status``."""
    outputs = optional_outputs(names, wanted, status.shape, dtype)
    kernel(*arguments, status, *outputs)
    columns: Columns = {name: out for name, out in zip(names, outputs, strict=True) if out is not None}
    return columns | {"status": status}


def filled_with_places(
    kernel: Callable[..., object],
    designs: Array,
    angles: Angles,
    names: tuple[str, ...],
    places: tuple[str, ...],
    wanted: frozenset[str],
) -> Columns:
    """Call a kernel of poses whose last output is one array (k, n, m) of all joint coordinates ``places`` or None."""
    shape, dtype = (len(designs), angles.cos.shape[1]), np.result_type(designs, angles.cos)
    room = None if wanted.isdisjoint(places) else np.empty((len(places), *shape), dtype)

    def with_places(*given: object) -> None:
        kernel(*given, room)

    columns = filled(with_places, (designs, angles.cos, angles.sin), names, wanted, np.empty(shape, np.uint8), dtype)
    if room is not None:
        columns |= {name: x for name, x in zip(places, room, strict=True) if name in wanted}
    return columns


def optional_outputs(
    names: tuple[str, ...], wanted: frozenset[str], shape: tuple[int, ...], dtype: DTypeLike = np.float64
) -> list[Array | None]:
    """An empty array for each wanted name and None for the others, in the order of a kernel's out arguments.

    ``dtype`` is complex128 where the designs or angles are (exact gradients by the complex step).
    """
    return [np.empty(shape, dtype) if name in wanted else None for name in names]
