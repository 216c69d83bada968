"""How an effect presents itself: what it gives, what it needs, what it costs, and when a scene calls for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.joints import PER_DESIGN, PER_POSE
from kernels.links import PER_BODY, PER_LINE, Links
from sweep.costs import nanoseconds
from sweep.effects.bend import Bend
from sweep.effects.places import tool_place
from sweep.families import NAMES as FAMILY_NAMES
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter
from sweep.families.capabilities import JointRecords
from sweep.families.chain import drive, driving_names
from sweep.families.link_tree import LinkTree
from sweep.numerics.curves import Curve

# Loads that a curve over the turn can add to.
CURVED = ("load_torque", "load_force", "tool_force", "tool_force_x", "tool_force_y", "tool_force_z")
# Inputs that stand in [loads] of a study; the others but the speed stand in [bodies].
LOADS = (*CURVED, "pierce_force", "pierce_at", "pierce_sense", "resisting_torque", "motor_slope", "thread_tension")

_PER_LINK = (PER_BODY, 3, PER_LINE)

Status: TypeAlias = NDArray[np.uint8]
Rows: TypeAlias = NDArray[np.intp]
Index: TypeAlias = NDArray[np.int64]


class Driven(NamedTuple):
    """A later stage of a chain, as the stage before it drives it: phi = kappa psi + offset."""

    family: Family
    designs: Array
    kappa: Array
    offset: Array
    inputs: dict[str, Array]
    curves: Mapping[str, Curve] = {}

    def only(self, rows: Rows) -> Driven:
        """Return some of the designs."""
        given = {name: x[rows] for name, x in self.inputs.items()}
        return Driven(self.family, self.designs[rows], self.kappa[rows], self.offset[rows], given, self.curves)


@dataclass
class Scene:
    """One block of designs at their crank angles, as the effects see it; what two effects share is computed once.

    In a chain it is one stage: ``after`` are the stages behind it, ``before`` the scene that drives it.  ``curves`` are
    loads over the turn of the first crank, by the input they add to.  ``uneven`` are its speed and acceleration at the
    poses, (n, m); None where they are the constants among the inputs.
    """

    family: Family
    designs: Array  # (n, P) of the bare family
    angles: Angles
    inputs: dict[str, Array]  # input name -> (n,)
    after: tuple[Driven, ...] = ()
    before: Scene | None = None
    curves: Mapping[str, Curve] = field(default_factory=dict)
    uneven: tuple[Array, Array] | None = None
    memo: dict[str, Any] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of designs and of poses of each."""
        return len(self.designs), self.angles.cos.shape[1]

    @cached_property
    def motion(self) -> Columns:
        """Pose outputs of the family that its joint records, or the poses of its links, are made of."""
        tree = self.family.find(LinkTree)
        needs = self._joints.needs if tree is None else tree.needs
        return self.family.poses(self.designs, self.angles, frozenset(needs))

    @cached_property
    def records(self) -> tuple[Array, Array]:
        """Joint records per pose (n, m, PER_POSE) and per design (n, PER_DESIGN); see :mod:`kernels.joints`."""
        per_pose, per_design = np.empty((*self.shape, PER_POSE)), np.empty((len(self.designs), PER_DESIGN))
        self._joints.fill(self.designs, self.angles, self.motion, per_pose, per_design)
        return per_pose, per_design

    @cached_property
    def links(self) -> Links:
        """Bodies of the family and their poses; see :mod:`kernels.links`."""
        tree = self.family.find(LinkTree)
        if tree is None:
            raise TypeError(f"{self.family.name} has no tree of links")
        n, every = len(self.designs), (len(tree.bodies), len(tree.freedoms), len(tree.ends))
        bodies, axes, lines = (np.empty((*self.shape, k, per)) for k, per in zip(every, _PER_LINK, strict=True))
        parents = np.array(tree.parents, np.int64)
        freedoms, ends = (np.tile(np.array(given, np.int64), (n, 1, 1)) for given in (tree.freedoms, tree.ends))
        found = Links(parents, freedoms, ends, bodies, axes, lines)
        tree.fill(self.designs, self.angles, self.motion, found)
        return found

    @cached_property
    def _joints(self) -> JointRecords:
        joints = self.family.find(JointRecords)
        if joints is None:
            raise TypeError(f"{self.family.name} has no joint records")
        return joints

    @cached_property
    def driven(self) -> Scene | None:
        """The stage that this one drives, at its own crank angles; None at the end of the chain."""
        if not self.after:
            return None
        following, *rest = self.after
        names = frozenset(driving_names(self.family, following.family))
        turn = self.family.poses(self.designs, self.angles, names)
        angles = drive(turn, self.family.position, following.kappa, following.offset)
        return Scene(following.family, following.designs, angles, following.inputs, tuple(rest), self, following.curves)

    def stage(self, index: int) -> Scene:
        """Return the scene of the stage ``index`` places behind this one."""
        scene = self
        for _ in range(index):
            assert scene.driven is not None
            scene = scene.driven
        return scene

    @cached_property
    def gear(self) -> tuple[Array, Array]:
        """First and second derivative of the next stage's crank angle with respect to this stage's, (n, m)."""
        rate = self.family.derivative_of[self.family.position]
        names = rate, self.family.derivative_of[rate]
        turn = self.family.poses(self.designs, self.angles, frozenset(names))
        kappa = self.after[0].kappa[:, None]
        first, second = (kappa * np.asarray(turn[name], np.float64) for name in names)
        return first, second

    @cached_property
    def rates(self) -> tuple[Array, Array] | None:
        """First and second derivative of the crank angle with respect to that of stage 1; None where it is that one."""
        if self.before is None:
            return None
        first, second = self.before.gear
        if self.before.rates is not None:
            inner, bend = self.before.rates
            first, second = first * inner, second * inner * inner + first * bend
        return first, second

    def crank(self) -> tuple[Array, Array]:
        """Return the speed and angular acceleration of this stage's crank, (n, m), or (n, 1) where it turns evenly."""
        even = self.inputs["speed"][:, None], self.inputs["speed_change"][:, None]
        speed, change = self._first.uneven or even
        if self.rates is None:
            return speed, change
        first, second = self.rates
        return speed * first, speed * speed * second + change * first

    def status(self) -> Status:
        """Return a fresh copy of the motion's status for a kernel to write on; stages before speak first."""
        status = np.array(self.motion["status"], dtype=np.uint8)
        if self.before is not None:
            earlier = self.before.status()
            np.copyto(status, earlier, where=earlier != st.OK)
        return status

    def table(self, names: tuple[str, ...]) -> Array:
        """Return inputs side by side, (n, len(names))."""
        return np.column_stack([self.inputs[name] for name in names])

    def load(self, name: str) -> Array:
        """Return a load at the poses: (n, 1) where it is constant, (n, m) where a curve adds to it."""
        constant, curve = self.inputs[name][:, None], self.curves.get(name)
        return constant if curve is None else constant + curve(self._first.angles.phi)

    @property
    def smooth(self) -> bool:
        """Whether no load of this stage or a later one is given over the turn, or jumps while a tool pierces."""
        piercing = "pierce_force" in self.inputs and bool(self.inputs["pierce_force"].any())
        return not self.curves and not piercing and (self.driven is None or self.driven.smooth)

    @property
    def _first(self) -> Scene:
        return self if self.before is None else self.before._first

    def only(self, rows: Rows) -> Scene:
        """Return some of the designs; the scene itself where these are all."""
        if rows.size == len(self.designs):
            return self
        angles = Angles(*(x[rows] for x in self.angles)) if self.angles.cos.shape[0] > 1 else self.angles
        given, after = {name: x[rows] for name, x in self.inputs.items()}, tuple(d.only(rows) for d in self.after)
        return Scene(self.family, self.designs[rows], angles, given, after, curves=self.curves)

    def posed(self, rows: Rows, phi: Array) -> Scene:
        """Return some of the designs, each as often as wanted, at crank angles (k, m) of their own."""
        given, after = {name: x[rows] for name, x in self.inputs.items()}, tuple(d.only(rows) for d in self.after)
        return Scene(self.family, self.designs[rows], Angles.of(phi), given, after, curves=self.curves)

    def precise(self) -> Scene:
        """Return the same scene with the most accurate poses that its families have."""
        after = tuple(d._replace(family=d.family.precise()) for d in self.after)
        return Scene(self.family.precise(), self.designs, self.angles, self.inputs, after, curves=self.curves)

    def on_grid(self, size: int) -> Scene:
        """Return the same designs at ``size`` equidistant crank angles of one turn:
        what a whole-turn effect samples.
        """
        angles = Angles.of(2.0 * np.pi * np.arange(size)[None] / size)
        return Scene(self.family, self.designs, angles, self.inputs, self.after, curves=self.curves)


ComputeFunction: TypeAlias = Callable[[Scene, frozenset[str]], Columns]
DesignFunction: TypeAlias = Callable[[Scene, frozenset[str], Accuracy], Columns]


@dataclass(frozen=True)
class DesignResult:
    """Outputs an effect gives per design instead of per pose: a whole-turn effect's, or a closed form.

    ``run(scene, wanted, accuracy)`` gets a scene of a single crank angle, whose ``on_grid`` makes whole turns; it
    returns the wanted outputs, perhaps their ``err_``, and ``status``.  ``block`` is how many designs it gets at once:
    few where it needs hundreds of poses of each, more where it asks for a few poses many times.
    """

    outputs: tuple[Output, ...]
    run: DesignFunction
    block: int = 32


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
    ``even_crank`` effects presume a crank that turns evenly, so they are no effects of a chain's later stages.
    ``takes_load`` is the key of the effect that hands back the load of a chain's later stages; without it their load
    does not enter. ``may_drive_nothing`` says that those stages are massless unless their bodies are given, so that
    none of their inputs is required, and stages without known loads may follow. ``requires`` is the capability that
    a family must have, ``followers`` are the kinds of follower that the effect is made for, ``tool_inputs`` are
    further inputs where a tool can hang on the coupler and moves along a line, where it moves freely, and where it
    hangs on the tip of a rocker. ``least`` are pose outputs of which the least value over the turn counts, as a
    life, not the largest (:func:`sweep.effects.wanted.expanded`). ``tree`` is the tree of links of the one family
    that it is for, if any; ``carried_at`` the place of a tool that a family must have, if any. ``only_for`` are the
    outputs that need an input, by the input, where not all do: it is no input where none of these is wanted.
    ``bends`` are where curves of outputs have kinks. ``advise(scene)`` applies the rule of negligibility to some
    designs over a turn; None where none turns.
    """

    key: str
    name: str
    title: str
    equation: str
    formulas: tuple[str, ...]
    needs: tuple[str, ...]
    inputs: tuple[Parameter, ...]
    outputs: tuple[Output, ...]
    compute: ComputeFunction
    called_for: str
    negligible: str
    whole_turn: bool = False
    even_crank: bool = False
    takes_load: str = ""
    may_drive_nothing: bool = False
    design_result: DesignResult | None = None
    advise: AdviceFunction | None = None
    requires: type = JointRecords
    tool_inputs: tuple[tuple[Parameter, ...], ...] = ((), (), ())
    least: tuple[str, ...] = ()
    followers: tuple[str, ...] = ("rocker", "slider")
    tree: LinkTree | None = None
    carried_at: int | None = None
    only_for: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    bends: tuple[Bend, ...] = ()

    def inputs_of(self, family: Family) -> tuple[Parameter, ...]:
        """Return the inputs, with those of a tool where the family has a place that one can hang on."""
        place = tool_place(family)
        return self.inputs if place is None else (*self.inputs, *self.tool_inputs[place])

    def serves(self, family: Family) -> bool:
        """Return whether the family has what the effect requires, with a kind of follower that it is made for."""
        joints = family.find(JointRecords)
        follows = joints is None or joints.follower in self.followers
        own = self.tree is None or family.find(LinkTree) is self.tree
        own = own and self.carried_at in (None, tool_place(family))
        return family.find(self.requires) is not None and follows and own

    @cached_property
    def families(self) -> tuple[str, ...]:
        """Names of the register's families that it serves."""
        return tuple(name for name in FAMILY_NAMES if self.serves(find_family(name)))

    @property
    def ns_per_pose(self) -> float:
        """Measured time of all pose outputs together, without the motion; 0 where there are none."""
        return nanoseconds("effects", self.name) if self.outputs else 0.0

    @property
    def ns_per_design(self) -> float:
        """Measured time of all design outputs together; 0 where there are none."""
        return nanoseconds("effects_design", self.name) if self.design_result is not None else 0.0


def take_over(status: Status, later: NDArray[np.generic]) -> None:
    """Make ``later`` the status of what is OK so far, in place."""
    np.copyto(status, later, where=status == st.OK)


def refuse(status: Status, designs: NDArray[np.bool_]) -> None:
    """Make INVALID_INPUT the status of these designs, (n,), where it is OK so far, in place."""
    np.copyto(status, st.INVALID_INPUT, where=designs[:, None] & (status == st.OK))


def no_poses(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return what an effect computes per pose that has no outputs per pose: the motion's status."""
    return {"status": scene.status()}


def largest(scene: Scene, compute: ComputeFunction, name: str, quantity: str, threshold: float) -> Advice | None:
    """Return the advice from the largest magnitude of one output, of the designs where it is known all the way."""
    found = np.abs(np.asarray(compute(scene, frozenset({name}))[name], np.float64))
    turning = np.isfinite(found).all(axis=1)
    return Advice(quantity, found[turning].max(axis=1), threshold) if turning.any() else None
