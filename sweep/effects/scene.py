"""Scene of the effects: designs at their crank angles with joint records or links, inputs, and stages of a chain."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.effects.coupler import DRIVING
from kernels.linkage.bodies import PER_BODY, PER_LINE, Links
from kernels.linkage.joints import PER_DESIGN, PER_POSE
from kernels.types import Status
from sweep.families.base import Angles, Array, Columns, Family
from sweep.families.capabilities import JointRecords
from sweep.families.chain import drive, driving_names
from sweep.families.curve_features import Singular, measured, samples_of_peaks, samples_of_waves
from sweep.families.link_tree import LinkTree
from sweep.families.names import at_stage
from sweep.numerics.curves import Curve, with_jumps
from sweep.numerics.records import Indices, Mask
from sweep.numerics.singularities import Discriminant

# Columns of the joint records (kernels/linkage/joints.py): crank axis u, and direction s of the coupler.
_CRANK_AXIS, _ALONG_COUPLER = slice(0, 3), slice(6, 9)
_PER_LINK = (PER_BODY, 3, PER_LINE)
PART = 4096  # poses of bodies per block where their loads are computed design by design


class Driven(NamedTuple):
    """A later stage of a chain, driven by the stage before: phi = kappa psi + offset."""

    family: Family
    designs: Array
    kappa: Array
    offset: Array
    inputs: dict[str, Array]
    curves: Mapping[str, Curve] = {}

    def only(self, rows: Indices) -> Driven:
        """Select designs by index."""
        given = {name: x[rows] for name, x in self.inputs.items()}
        return Driven(self.family, self.designs[rows], self.kappa[rows], self.offset[rows], given, self.curves)


@dataclass
class Scene:
    """One block of designs at their crank angles; results that effects share are computed once.

    In a chain it is one stage: ``after`` are the later stages, ``before`` the scene that drives it.  ``curves`` are
    loads over the turn of the first crank, by the input to which they are added.  ``uneven`` are the crank's speed and
    acceleration at the poses, (n, m); None if they are the constants among the inputs.
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
        """Number of designs and number of poses of each."""
        return len(self.designs), self.angles.cos.shape[1]

    @cached_property
    def motion(self) -> Columns:
        """Pose outputs needed for the family's joint records or links, and for the next stage's crank."""
        tree = self.family.find(LinkTree)
        needs = set(self.family.derivatives(self.family.position, 2)[1:] if self.after else ())
        if tree is not None:
            needs.update(tree.needs)
        elif self._joints.moved is None:
            needs.update(self._joints.needs)
        if self.after:
            needs |= driving_names(self.family, self.after[0].family)
        return self.family.poses(self.designs, self.angles, frozenset(needs))

    @cached_property
    def records(self) -> tuple[Array, Array]:
        """Joint records per pose (n, m, PER_POSE) and per design (n, PER_DESIGN); see :mod:`kernels.linkage.joints`."""
        per_pose, per_design = np.empty((*self.shape, PER_POSE)), np.empty((len(self.designs), PER_DESIGN))
        motion, moved = self.motion, self._joints.moved
        if moved is not None:
            run = moved[self.family.poses is self.family.precise_poses]
            motion = run(self.designs, self.angles, frozenset(self._joints.needs))
        self._joints.fill(self.designs, self.angles, motion, per_pose, per_design)
        return per_pose, per_design

    @cached_property
    def links(self) -> Links:
        """Bodies of the family and their poses; see :mod:`kernels.linkage.bodies`."""
        return self._links(slice(None), self.angles, self.motion)

    @cached_property
    def still_links(self) -> Links:
        """Bodies at the first assembled pose of each design, (n, 1), for points that are fixed in a body."""
        at = np.arange(len(self.designs))[:, None], (np.asarray(self.motion["status"]) != st.OK).argmin(axis=1)[:, None]
        angles = Angles(*(np.broadcast_to(x, self.shape)[at] for x in self.angles))
        return self._links(slice(None), angles, {name: x[at] for name, x in self.motion.items()})

    def links_by_parts(self) -> Iterator[tuple[slice, Links]]:
        """Yield the bodies in blocks of designs whose poses stay in the cache."""
        n, m = self.shape
        size = max(1, PART // max(m, 1))
        for rows in (slice(start, start + size) for start in range(0, n, size)):
            motion = {name: x[rows] for name, x in self.motion.items()}
            yield rows, self._links(rows, self.angles.part(rows), motion)

    def _links(self, rows: slice, angles: Angles, motion: Columns) -> Links:
        tree = self.family.the(LinkTree)
        shape, every = motion["status"].shape, (len(tree.bodies), len(tree.freedoms), len(tree.ends))
        bodies, axes, lines = (np.empty((*shape, k, per)) for k, per in zip(every, _PER_LINK, strict=True))
        parents = np.array([body.parent for body in tree.bodies], np.int64)
        pairs = (np.array(given, np.int64).reshape(-1, 2) for given in (tree.freedoms, tree.ends))
        freedoms, ends = (np.tile(pair, (shape[0], 1, 1)) for pair in pairs)
        found = Links(parents, freedoms, ends, bodies, axes, lines)
        tree.fill(self.designs[rows], angles, motion, found)
        if tree.unit is not None:
            default = np.full(len(self.designs), tree.unit.default)  # for a family alone, which has no inputs
            unit = self.inputs.get(tree.unit.name, default)[rows, None, None, None]
            # Origins and their rates, joints, and points of lines; see PER_BODY and PER_LINE.
            for lengths in (bodies[..., :9], bodies[..., 24:], lines[..., :3]):
                lengths *= unit
        return found

    @cached_property
    def _joints(self) -> JointRecords:
        return self.family.the(JointRecords)

    @cached_property
    def driven(self) -> Scene | None:
        """Scene of the next stage at its own crank angles; None at the end of the chain."""
        if not self.after:
            return None
        following, *rest = self.after
        angles = drive(self.motion, self.family.position, following.kappa, following.offset)
        return Scene(following.family, following.designs, angles, following.inputs, tuple(rest), self, following.curves)

    def stage(self, index: int) -> Scene:
        """Scene of the stage ``index`` places after this one."""
        scene = self
        for _ in range(index):
            assert scene.driven is not None
            scene = scene.driven
        return scene

    @cached_property
    def gear(self) -> tuple[Array, Array]:
        """First and second derivative of the next stage's crank angle with respect to this stage's, (n, m)."""
        kappa = self.after[0].kappa[:, None]
        names = self.family.derivatives(self.family.position, 2)[1:]
        first, second = (kappa * np.asarray(self.motion[name], np.float64) for name in names)
        return first, second

    @cached_property
    def rates(self) -> tuple[Array, Array] | None:
        """First and second derivative of the crank angle with respect to that of stage 1; None in stage 1."""
        if self.before is None:
            return None
        first, second = self.before.gear
        if self.before.rates is not None:
            inner, bend = self.before.rates
            first, second = first * inner, second * inner * inner + first * bend
        return first, second

    def crank(self) -> tuple[Array, Array]:
        """Speed and angular acceleration of this stage's crank, (n, m), or (n, 1) where it turns evenly."""
        even = self.inputs["speed"][:, None], self.inputs["speed_change"][:, None]
        speed, change = self._first.uneven or even
        if self.rates is None:
            return speed, change
        first, second = self.rates
        return speed * first, speed * speed * second + change * first

    def status(self) -> Status:
        """Copy the motion's status, for a kernel to update; the status of earlier stages has precedence."""
        status = np.array(self.motion["status"], dtype=np.uint8)
        if self.before is not None:
            earlier = self.before.status()
            np.copyto(status, earlier, where=earlier != st.OK)
        return status

    def table(self, names: tuple[str, ...]) -> Array:
        """Stack inputs side by side, (n, len(names))."""
        return np.column_stack([self.inputs[name] for name in names])

    def load(self, name: str) -> Array:
        """Evaluate a load at the poses: (n, 1) if it is constant, (n, m) if a curve is added to it."""
        constant, curve = self.inputs[name][:, None], self.curves.get(name)
        return constant if curve is None else constant + curve(self._first.angles.phi)

    @property
    def pierces(self) -> Mask:
        """Whether a tool of this stage or a later one pierces in a design, so that a load jumps, (n,)."""
        found: Mask = np.zeros(len(self.designs), np.bool_)
        for inputs in (self.inputs, *(driven.inputs for driven in self.after)):
            found = found | (inputs["pierce_force"] != 0.0) if "pierce_force" in inputs else found
        return found

    @property
    def every_curve(self) -> tuple[Curve, ...]:
        """Loads over the turn of this stage and of later ones."""
        return (*self.curves.values(), *(curve for driven in self.after for curve in driven.curves.values()))

    @property
    def _first(self) -> Scene:
        return self if self.before is None else self.before._first

    @cached_property
    def least_samples(self) -> Array:
        """Least number of even samples that resolves loads, waves and peaks, (n,); `with_jumps` of loads at a tool."""
        of_loads = max((curve.samples for curve in self.every_curve), default=0.0)
        least = np.maximum(samples_of_waves(self.family, self.designs), of_loads)
        return with_jumps(np.maximum(least, samples_of_peaks(self._peaks(), len(self.designs))), self.pierces)

    def _peaks(self) -> list[Discriminant]:
        """Functions near whose zeros a link of this stage or of a later one turns abruptly."""

        def of_family(which: int, known: Singular, rows: Indices, phi: Array) -> Array:
            posed = self.posed(rows, phi).stage(which)
            return measured(posed.family, known, posed.designs, posed.angles)

        def of_finger(which: int, rows: Indices, phi: Array) -> Array:
            posed = self.posed(rows, phi).stage(which)
            return np.where(posed.inputs["finger"][:, None] == DRIVING, posed.finger_square, 1.0)

        found: list[Discriminant] = []
        stages = [(self.family, self.inputs), *((driven.family, driven.inputs) for driven in self.after)]
        for which, (family, inputs) in enumerate(stages):
            found += [partial(of_family, which, known) for known in family.every(Singular) if known.of is None]
            if "finger" in inputs and (inputs["finger"] == DRIVING).any():
                found.append(partial(of_finger, which))
        return found

    @property
    def finger_square(self) -> Array:
        """Squared sine of the angle between coupler and crank axis, (n, m)."""
        per_pose, per_design = self.records
        across = np.cross(per_design[:, None, _CRANK_AXIS], per_pose[:, :, _ALONG_COUPLER])
        found: Array = (across * across).sum(axis=2)
        return found

    def only(self, rows: Indices) -> Scene:
        """Select designs by index; the scene itself if these are all."""
        return self if rows.size == len(self.designs) else self._of(rows, self.angles.part(rows))

    def posed(self, rows: Indices, phi: Array) -> Scene:
        """Select designs by index, perhaps repeatedly, at their own crank angles (k, m)."""
        return self._of(rows, Angles.of(phi))

    def _of(self, rows: Indices, angles: Angles) -> Scene:
        given, after = {name: x[rows] for name, x in self.inputs.items()}, tuple(d.only(rows) for d in self.after)
        return Scene(self.family, self.designs[rows], angles, given, after, curves=self.curves)

    def even(self) -> Scene:
        """Scene with a crank of constant speed, for effects that need one; the scene itself if it is so."""
        if not self.inputs["speed_change"].any():
            return self
        still = {"speed_change": np.zeros(len(self.designs))}
        after = tuple(driven._replace(inputs=driven.inputs | still) for driven in self.after)
        return Scene(self.family, self.designs, self.angles, self.inputs | still, after, curves=self.curves)

    def precise(self) -> Scene:
        """Scene with the most accurate poses of its families."""
        after = tuple(d._replace(family=d.family.precise()) for d in self.after)
        return Scene(self.family.precise(), self.designs, self.angles, self.inputs, after, curves=self.curves)

    def on_grid(self, size: int) -> Scene:
        """Scene of the same designs at ``size`` equidistant crank angles of a turn."""
        angles = Angles.of(2.0 * np.pi * np.arange(size)[None] / size)
        return Scene(self.family, self.designs, angles, self.inputs, self.after, curves=self.curves)


def first_scene(
    family: Family,
    designs: Array,
    angles: Angles,
    given: dict[str, Array],
    curves: Mapping[str, Curve] = MappingProxyType({}),
) -> Scene:
    """Make the scene of a family, or of a chain's first stage with the later ones.

    ``given`` are the inputs by name, each (n,), ``curves`` the loads over the turn that are added to some of them.
    """
    still, first = {"speed_change": 0.0 * designs[:, 0]}, family.stages[0].tail
    crank = still | {name: given[f"{name}{first}"] for name in ("speed", "speed_change") if f"{name}{first}" in given}
    parts = []
    for stage in family.stages:
        own = {plain: x for name, x in given.items() if (plain := at_stage(name, stage.tail))}
        over = {plain: x for name, x in curves.items() if (plain := at_stage(name, stage.tail))}
        parts.append((stage.family, stage.designs(designs), own | crank, over))
    after = tuple(
        Driven(bare, matrix, designs[:, stage.kappa], designs[:, stage.offset], own, over)
        for stage, (bare, matrix, own, over) in zip(family.stages[1:], parts[1:], strict=True)
    )
    bare, matrix, own, over = parts[0]
    return Scene(bare, matrix, angles, own, after, curves=over)


def take_over(status: Status, later: NDArray[np.generic]) -> None:
    """Set the status to ``later`` where it is OK, in place."""
    np.copyto(status, later, where=status == st.OK)


def refuse(status: Status, designs: Mask) -> None:
    """Set the status of a mask of designs (n,) to INVALID_INPUT where it is OK, in place."""
    np.copyto(status, st.INVALID_INPUT, where=designs[:, None] & (status == st.OK))
