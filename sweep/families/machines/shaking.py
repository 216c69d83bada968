"""Shaking force and moment on the frame of stages of a machine's members (machine-and-stitch, 2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.types import EPS, TWO_PI, Array, Status
from sweep.errors import InputError
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, Step, Work
from sweep.families.capabilities import GuidedPoint, JointRecords, ToolPoint, skeleton_of
from sweep.families.curve_features import Smooth, least_samples
from sweep.families.frames import CRANKS, Frame
from sweep.families.link_tree import LinkTree
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.relations import Relation, with_size
from sweep.families.machines.segments import cross
from sweep.families.sites import AXES
from sweep.numerics.even_grids import on_first_grid
from sweep.numerics.records import Indices, Mask

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

ORDERS = {1: "first", 2: "second"}  # harmonics of the main shaft's turn
SAME = 1e-12  # relative difference of speeds that is rounding of gear ratios
# Samples of a turn; the first grid that resolves the orders is used.
GRIDS: tuple[int, ...] = (64, 128, 256, 512, 1024, 4096)


@dataclass(frozen=True)
class Shaken:
    """One stage of a member.

    Parameters
    ----------
    member, stage : its names; the stage is empty if there is only one
    rod : whether a tool runs along a line beside which its point may be: the guides of the line bear the couple
    driving : the previous stage that drives it, if that is part of the machine's shaking too; "" for the shaft
    crank : its joint on the crank axis
    """

    member: str
    stage: str
    rod: bool
    driving: str = ""
    crank: str = "a"

    def named(self, output: str) -> str:
        """Return the dotted name of an output of the stage."""
        return f"{self.member}.{output}{self.stage}"

    @property
    def axis(self) -> list[str]:
        """Names of the components of the crank axis in the machine's frame."""
        return [f"{self.member}.{self.crank}{self.stage}_axis_{axis}" for axis in AXES]

    def vector(self, found: Mapping[str, Any], output: str) -> list[Any]:
        """Return a vector output in the frame of the stage."""
        return [found[self.named(f"{output}_{axis}")] for axis in AXES]


def shaken(member: str, stage: str, family: Family, listed: Sequence[tuple[str, str]]) -> Shaken:
    """Describe a stage of the given family; ``listed`` are all stages of the relation.

    Raises
    ------
    InputError
        for a family without forces.
    """
    if family.find(LinkTree) is None and family.find(JointRecords) is None:
        allowed = f"a mechanism whose forces are known; {family.name} has none"
        raise InputError("shaking", f"{member}{stage}", allowed, "machine.relations")
    tool = family.find(ToolPoint)
    rod = tool is not None and tool.direction is not None and family.find(GuidedPoint) is not None
    before = str(int(stage) - 1) if stage else ""
    crank = next((name for name in CRANKS if name in skeleton_of(family).fixed), "")
    return Shaken(member, stage, rod, before if (member, before) in listed else "", crank)


@dataclass(frozen=True)
class Shaking(Relation):
    """Resultant force and moment of stages of members on the frame of the machine, about the origin of its frame."""

    stages: tuple[Shaken, ...]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Magnitude and components in the machine's frame, of the force and of the moment."""
        words = ", ".join(f"{one.member} {one.stage}".strip() for one in self.stages)
        found = []
        for name, unit, what in (
            (self.name, "force", f"the force of {words} on the frame"),
            (self._moment, "torque", f"the moment of {words} on the frame about the machine's origin"),
        ):
            found.append(Output(name, unit, f"magnitude of {what}", "(5)"))
            found += [Output(f"{name}_{x}", unit, f"{x} of {what}, machine's frame", "(5)") for x in AXES]
        return tuple(found)

    @property
    def numbers(self) -> tuple[Output, ...]:
        """Design outputs: root mean squares of the orders that counterweights can reduce."""
        found = []
        for name, unit, what in ((self.name, "force", "force"), (self._moment, "torque", "moment")):
            for order, word in ORDERS.items():
                text = f"root mean square of the {word} order of the {what} on the frame, by turns of the main shaft"
                found.append(Output(f"{name}_order{order}", unit, text, "3.1"))
        return tuple(found)

    @property
    def smooth(self) -> tuple[Smooth, ...]:
        """All outputs, which are smooth over the turn: each component, and both vectors."""
        vectors = {name: tuple(f"{name}_{x}" for x in AXES) for name in (self.name, self._moment)}
        alone = (Smooth(part, (part,)) for parts in vectors.values() for part in parts)
        return (*(Smooth(name, parts) for name, parts in vectors.items()), *alone)

    @property
    def _moment(self) -> str:
        return f"{self.name}_moment"

    def _turning(self, wanted: frozenset[str]) -> bool:
        names = (f"{self._moment}{tail}" for tail in ("", *(f"_{x}" for x in AXES), *(f"_order{n}" for n in ORDERS)))
        return not wanted.isdisjoint(names)

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the forces of the frame on every stage, and of moments if one is wanted."""
        names: set[str] = set()
        for one in self.stages:
            vectors = ["shaking_force", *(["shaking_moment"] if self._turning(wanted) else [])]
            names |= {one.named(f"{vector}_{axis}") for vector in vectors for axis in AXES}
            if self._turning(wanted) and one.rod:
                names |= {one.named("tool_load"), one.named("dev")}
            if self._turning(wanted) and one.driving:
                names |= {one.named("drive_torque"), *one.axis}
        return frozenset(names)

    def on_frame(self, found: Mapping[str, Any], frames: Mapping[str, Frame], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute force and moment on the frame, (n, m); ``frames`` of all stages have names such as "looper2"."""
        force: list[Any] = [0.0, 0.0, 0.0]
        moment: list[Any] = [0.0, 0.0, 0.0]
        for one in self.stages:
            frame = frames[f"{one.member}{one.stage}"]
            own = frame.turned(one.vector(found, "shaking_force"))
            force = [total + part for total, part in zip(force, own, strict=True)]
            if self._turning(wanted):
                about = frame.turned(self._about_own(one, found))
                arm = cross([frame.at[:, [k]] for k in range(3)], own)
                moment = [total + a + b for total, a, b in zip(moment, about, arm, strict=True)]
                if one.driving:
                    # The previous stage drives its crank, not the frame: the driving torque in its moment is internal.
                    inside = [found[name] for name in one.axis]
                    torque = found[one.named("drive_torque")]
                    moment = [total + torque * part for total, part in zip(moment, inside, strict=True)]
        moments = with_size(self._moment, moment, wanted) if self._turning(wanted) else {}
        return with_size(self.name, force, wanted) | moments

    def step(self, machine: Machine) -> Step:
        """Make the machine's step to the first orders of its self."""

        def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
            asked = [o.name for o in self.numbers if o.name in wanted]
            least, grids = least_samples(machine, designs, [name.rpartition("_order")[0] for name in asked]), GRIDS
            if accuracy.samples is not None:
                least, grids = np.zeros(len(designs)), (accuracy.samples,)

            def on_grid(rows: Indices, samples: int) -> tuple[dict[str, Array], Status]:
                codes, amplitudes = _amplitudes(machine, designs[rows], asked, samples)
                found: dict[str, Array] = {}
                for name, (value, err, size) in amplitudes.items():
                    found |= {name: value, f"err_{name}": err}
                    if accuracy.target is not None:
                        codes[(codes == st.OK) & ~(err <= accuracy.target * size)] = st.NOT_CONVERGED
                return found, codes

            found, status = on_first_grid(least, grids, on_grid)
            return found | {"status": status}

        return Step(f"orders of {self.name}", self.numbers, run, work=Work.LONG, cost=lambda accuracy: 5e4)

    def _about_own(self, one: Shaken, found: Mapping[str, Any]) -> list[Any]:
        """Moment about the origin of the stage's frame, with the couple of the tool's guides."""
        moment = one.vector(found, "shaking_moment")
        if one.rod:
            # The bar's force acts on its point, at distance dev from the line; its guides bear the couple.
            moment[2] = moment[2] - found[one.named("dev")] * found[one.named("tool_load")]
        return moment


def refused(
    machine: Machine,
    relation: Relation,
    designs: Array,
    wanted: frozenset[str],
    found: Mapping[str, Any],
    codes: Status,
) -> dict[str, Any]:
    """Return nan and a status for the wanted sums where the speeds of members contradict their ratios."""
    if not isinstance(relation, Shaking | ShaftTorque):
        return {}
    listed = {one.member for one in (relation.stages if isinstance(relation, Shaking) else relation.driven)}
    unfit: Mask = np.zeros((len(designs), 1), np.bool_)
    for key in ("speed", "speed_change"):
        ratios = {f"{m.name}.{key}{m.family.stages[0].tail}": m.ratio for m in machine.members if m.name in listed}
        shaft = [designs[:, [k]].real / ratios[p] for k, p in enumerate(machine.parameter_names) if p in ratios]
        for one in shaft[1:]:
            unfit |= np.abs(one - shaft[0]) > SAME * np.abs(shaft[0])
    np.copyto(codes, st.INVALID_INPUT, where=unfit & (codes == st.OK))
    names = [o.name for o in relation.outputs if o.name in wanted] if unfit.any() else []
    return {name: np.where(unfit, np.nan, found[name]) for name in names}


def _amplitudes(
    machine: Machine, designs: Array, asked: Sequence[str], samples: int
) -> tuple[Status, dict[str, tuple[Array, Array, Array]]]:
    """Compute the status, and for each order the root mean squares of order, error and whole curve, (n,).

    The error is estimated by the difference to every other sample, which holds the orders beyond a quarter of the
    samples.
    """
    made_of = {name: name.rpartition("_order") for name in asked}
    parts = frozenset(f"{vector}_{x}" for vector, _, _ in made_of.values() for x in AXES)
    angles = Angles.of(TWO_PI * np.arange(samples)[None] / samples)
    poses = machine.poses(designs, angles, parts)
    codes = np.asarray(poses["status"], np.uint8).max(axis=1, initial=0)
    codes[codes == st.NOT_ASSEMBLED] = st.NOT_ROTATABLE
    found = {}
    for name, (vector, _, order) in made_of.items():
        curve = np.stack([np.asarray(poses[f"{vector}_{x}"], np.float64) for x in AXES], axis=1)
        fine, coarse = (np.fft.rfft(some)[:, :, int(order)] / some.shape[2] for some in (curve, curve[:, :, ::2]))
        value, off = (np.sqrt(2.0 * np.square(np.abs(x)).sum(axis=1)) for x in (fine, fine - coarse))
        size = np.sqrt(np.square(curve).sum(axis=1).sum(axis=1) / samples)
        found[name] = value, off + 16.0 * EPS * size, size
    return codes, found
