"""How an effect presents itself: what it gives, what it needs, what it costs, and when a scene calls for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.joints import PER_DESIGN, PER_POSE
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter

Status: TypeAlias = NDArray[np.uint8]
Rows: TypeAlias = NDArray[np.intp]


@dataclass
class Scene:
    """One block of designs at their crank angles, as the effects see it; what two effects share is computed once."""

    family: Family
    designs: Array  # (n, P) of the bare family
    angles: Angles
    inputs: dict[str, Array]  # input name -> (n,)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of designs and of poses of each."""
        return len(self.designs), self.angles.cos.shape[1]

    @cached_property
    def motion(self) -> Columns:
        """Pose outputs of the family that the joint records are made of."""
        return self.family.poses(self.designs, self.angles, frozenset(self.family.joint_needs))

    @cached_property
    def records(self) -> tuple[Array, Array]:
        """Joint records per pose (n, m, PER_POSE) and per design (n, PER_DESIGN); see :mod:`kernels.joints`."""
        if self.family.joints is None:
            raise TypeError(f"{self.family.name} has no joint records")
        per_pose, per_design = np.empty((*self.shape, PER_POSE)), np.empty((len(self.designs), PER_DESIGN))
        self.family.joints(self.designs, self.angles, self.motion, per_pose, per_design)
        return per_pose, per_design

    def status(self) -> Status:
        """Return a fresh copy of the motion's status for a kernel to write on."""
        return np.array(self.motion["status"], dtype=np.uint8)

    def table(self, names: tuple[str, ...]) -> Array:
        """Inputs side by side, (n, len(names))."""
        return np.column_stack([self.inputs[name] for name in names])

    def only(self, rows: Rows) -> Scene:
        """Some of the designs; the scene itself where these are all."""
        if rows.size == len(self.designs):
            return self
        angles = Angles(*(x[rows] for x in self.angles)) if self.angles.cos.shape[0] > 1 else self.angles
        return Scene(self.family, self.designs[rows], angles, {name: x[rows] for name, x in self.inputs.items()})

    def on_grid(self, size: int) -> Scene:
        """The same designs at ``size`` equidistant crank angles of one turn: what a whole-turn effect samples."""
        return Scene(self.family, self.designs, Angles.of(2.0 * np.pi * np.arange(size)[None] / size), self.inputs)


ComputeFunction: TypeAlias = Callable[[Scene, frozenset[str]], Columns]
DesignFunction: TypeAlias = Callable[[Family, Array, dict[str, Array], frozenset[str], Accuracy], Columns]


@dataclass(frozen=True)
class DesignResult:
    """Outputs an effect gives per design instead of per pose: a whole-turn effect's, or a closed form.

    ``run(family, designs, inputs, wanted, accuracy)`` returns the wanted ones, perhaps their ``err_``, and ``status``.
    """

    outputs: tuple[Output, ...]
    run: DesignFunction
    ns_per_design: float


@dataclass(frozen=True)
class Advice:
    """Whether an effect matters, estimated from a few designs: the quantity that tells, and where it starts to."""

    quantity: str
    values: Array  # (n,) of the designs that could be estimated
    threshold: float

    @property
    def worst(self) -> float:
        """The value of the design where the effect matters most."""
        return float(self.values.max())

    @property
    def negligible(self) -> bool:
        """Whether it matters for none of the designs."""
        return self.worst < self.threshold


AdviceFunction: TypeAlias = Callable[[Scene], Advice | None]


@dataclass(frozen=True)
class Effect:
    """One row of the register; ``compute(scene, wanted)`` returns the wanted outputs (n, m) and ``status`` (n, m).

    ``whole_turn`` effects couple different crank angles: they sample the turn themselves, whatever is asked for.
    ``advise(scene)`` applies the effect's rule of negligibility to some designs over a turn; None where none turns.
    """

    key: str
    name: str
    title: str
    equation: str
    formulas: tuple[str, ...]
    families: tuple[str, ...]
    needs: tuple[str, ...]
    inputs: tuple[Parameter, ...]
    outputs: tuple[Output, ...]
    compute: ComputeFunction
    ns_per_pose: float
    called_for: str
    negligible: str
    whole_turn: bool = False
    design_result: DesignResult | None = None
    advise: AdviceFunction | None = None
