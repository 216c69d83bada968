"""The main shaft of a machine: torque, inertia, friction and speed over the turn of all members with one flywheel.

Machine-and-stitch, 2: power is the same on both sides of every gear, so on the main shaft a member of ratio r has r
times its torque, r^2 times its inertia and r^3 times the derivative of its inertia.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.effects.speed_fluctuation import RESOLVED
from kernels.types import Array, Status
from sweep.families.base import Accuracy, Angles, Columns, Output, Parameter, Step, Work, floats
from sweep.families.curve_features import Smooth, least_samples
from sweep.families.machines.relations import Relation
from sweep.families.poses import chosen
from sweep.numerics.even_grids import FINER, GRIDS, LEFT, on_first_grid, steady
from sweep.numerics.records import Indices

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

NUMBERS = {
    "unevenness": ("1", "(largest - smallest speed)/mean of the main shaft in the steady state"),
    "fastest": ("rad/s", "largest magnitude of its speed"),
    "slowest": ("rad/s", "smallest magnitude of its speed"),
}
_RATE = {"reduced_inertia": 2, "dreduced_inertia": 3, "drive_torque": 1, "drive_torque_friction": 1}


@dataclass(frozen=True)
class DrivenMember:
    """A member, the number of its first stage if it has several, and its turns per turn of the main shaft."""

    member: str
    stage: str
    ratio: int

    def named(self, name: str) -> str:
        """Return the dotted name of an output or input of the stage."""
        return f"{self.member}.{name}{self.stage}"


@dataclass(frozen=True)
class ShaftTorque(Relation):
    """Torque on the main shaft of the members that it drives, with inertia, friction and speed.

    ``rubs``: friction of all members is known.
    """

    driven: tuple[DrivenMember, ...]
    rubs: bool

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Torque, inertia with its derivative, and friction loss."""
        words = ", ".join(one.member for one in self.driven)
        found = (
            Output(self.name, "torque", f"torque on the main shaft that drives {words} and the flywheel", "2"),
            Output(f"{self.name}_inertia", "inertia", f"inertia of {words} and the flywheel on the main shaft", "2"),
            Output(f"{self.name}_dinertia", "inertia", "its derivative by the angle of the main shaft", "2"),
        )
        lost = Output(f"{self.name}_friction", "torque", f"torque on it that friction of {words} takes", "2")
        return (*found, lost) if self.rubs else found

    @property
    def smooth(self) -> tuple[Smooth, ...]:
        """Torque and inertia, which are smooth over the turn; friction is not."""
        return tuple(Smooth(name, (name,)) for name in (self.name, f"{self.name}_inertia", f"{self.name}_dinertia"))

    @property
    def numbers(self) -> tuple[Output, ...]:
        """Design outputs: the speed over the turn."""
        return tuple(Output(f"{self.name}_{key}", unit, text, "D4") for key, (unit, text) in NUMBERS.items())

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Flywheel and motor of the main shaft."""
        on = "on the main shaft, besides all members"
        slope = "torque that the motor gains per speed of the main shaft it loses; 0: constant torque"
        return (
            Parameter(f"{self.name}_flywheel", "inertia", f"inertia {on}", default=0.0, not_negative=True),
            Parameter(f"{self.name}_motor_slope", "rotary_damping", slope, default=0.0, not_negative=True),
        )

    def _made_of(self, wanted: frozenset[str]) -> set[str]:
        of = {
            self.name: {"drive_torque", "speed_change"},
            f"{self.name}_inertia": {"reduced_inertia"},
            f"{self.name}_dinertia": {"dreduced_inertia"},
            f"{self.name}_friction": {"drive_torque", "drive_torque_friction"},
        }
        speed = {o.name: {"drive_torque", "reduced_inertia", "dreduced_inertia"} for o in self.numbers}
        return set().union(*(made for name, made in (of | speed).items() if name in wanted))

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the members' outputs that the wanted sums need, with the acceleration for the flywheel."""
        return frozenset(one.named(name) for one in self.driven for name in self._made_of(wanted))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the wanted sums, (n, m)."""
        flywheel, first = found[f"{self.name}_flywheel"], self.driven[0]
        columns = {}
        if self.name in wanted:
            change = found[first.named("speed_change")] / first.ratio
            columns[self.name] = self._sum(found, "drive_torque") + flywheel * change
        if f"{self.name}_inertia" in wanted:
            columns[f"{self.name}_inertia"] = self._sum(found, "reduced_inertia") + flywheel
        if f"{self.name}_dinertia" in wanted:
            columns[f"{self.name}_dinertia"] = self._sum(found, "dreduced_inertia")
        if f"{self.name}_friction" in wanted:
            lost = self._sum(found, "drive_torque_friction") - self._sum(found, "drive_torque")
            columns[f"{self.name}_friction"] = lost
        return columns

    def step(self, machine: Machine) -> Step:
        """Make the machine's step to the speed of its main shaft over the turn."""

        def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
            found = _numbers(self, machine, designs)
            known = found.pop("energy_error")
            # The missed energy is a share of the largest energy: of a slow speed it is a larger share.
            mean, steep = found.pop("mean"), found["fastest"] / found["slowest"]
            size = {"unevenness": steep / mean, "fastest": np.ones(len(designs)), "slowest": steep}
            status = found.pop("status")
            columns: Columns = {f"{self.name}_{key}": values for key, values in found.items()}
            columns |= {f"err_{self.name}_{key}": known * found["fastest"] * size[key] for key in found}
            return chosen(columns, wanted, status)

        return Step(f"speed of {self.name}", self.numbers, run, work=Work.LONG, cost=lambda accuracy: 5e5)

    def _sum(self, found: Mapping[str, Any], name: str) -> Any:
        return sum(float(one.ratio) ** _RATE[name] * found[one.named(name)] for one in self.driven)


def _numbers(shaft: ShaftTorque, machine: Machine, designs: Array) -> dict[str, Any]:
    """Compute unevenness, extreme speeds, error of the energy and status, (n,), on the first resolving grid."""
    names, first = list(machine.parameter_names), shaft.driven[0]
    designs = np.array(designs, np.float64)
    for one in shaft.driven:
        designs[:, names.index(one.named("speed_change"))] = 0.0
    speed = designs[:, names.index(first.named("speed"))] / first.ratio
    slope = designs[:, names.index(f"{shaft.name}_motor_slope")]

    def on_grid(rows: Indices, size: int) -> tuple[dict[str, Array], Status]:
        inertia, excess, poses = _samples(shaft, machine, designs[rows], speed[rows], size)
        motor = slope[rows] if slope[rows].any() else None
        coarsest = LEFT if size == FINER[-1] else RESOLVED
        part, codes = steady(inertia, excess, speed[rows], motor, np.zeros((1, 1)), coarsest)
        np.copyto(codes, poses, where=poses != st.OK)
        return {key: part[key] for key in (*NUMBERS, "energy_error")}, codes

    found, status = on_first_grid(least_samples(machine, designs, (shaft.name,)), (*GRIDS, *FINER), on_grid)
    found = {key: np.where(status == st.OK, values, np.nan) for key, values in found.items()}
    return found | {"status": status, "mean": np.abs(speed)}


def _samples(
    shaft: ShaftTorque, machine: Machine, designs: Array, speed: Array, size: int
) -> tuple[Array, Array, Status]:
    """Sample inertia and torque excess J' w^2/2 - M(w, 0) on the main shaft, (n, N), and the worst status, (n,)."""
    angles = Angles.of(2.0 * np.pi * np.arange(size)[None] / size)
    names = [shaft.name, f"{shaft.name}_inertia", f"{shaft.name}_dinertia"]
    poses = machine.poses(designs, angles, frozenset(names))
    torque, inertia, bend = floats(poses, *names)
    status = np.asarray(poses["status"], np.uint8).max(axis=1, initial=0)
    return np.ascontiguousarray(inertia), 0.5 * bend * speed[:, None] ** 2 - torque, status
