"""Room of the moments A, B and C of a machine at several speeds, while the window of the loop moves.

Each field of work permits a rise of the needle at A (machine-and-stitch, 5.4).  The first field is the one of the least
speed, the last one that of the greatest; between them the window varies linearly with the speed, which is ours.  With
an uneven shaft the needle passes faster or slower than the mean: the rise has to suit both.  If a member with the
looper's blade has an elastic lag, its tip is late by the lag, which grows with the square of the speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from kernels.types import Array, Status
from sweep.families.base import Accuracy, Angles, Columns, Output, Step, Work
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.moments import Taking
from sweep.families.machines.relations import Relation
from sweep.families.machines.triangles import Entering

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

RPM = 2.0 * np.pi / 60.0
ENDS = {
    "above": "how far the rise at A stands above the least one permitted",
    "below": "how far the rise at A stands below the most permitted",
}


@dataclass(frozen=True)
class Sewing(Relation):
    """Moments that a machine has to keep at several speeds.

    Parameters
    ----------
    name : of the relation
    taking : moment A, with at least one field of work
    entering : moments B and C, or one of them
    speeds : of the main shaft, increasing [rad/s]; the fields of A belong to the first and to the last
    clearance : least and largest distance of tip and needle at A at which the loop is taken
    shaft : torque of the main shaft whose unevenness counts; None for an even one
    """

    taking: Taking
    entering: tuple[Entering, ...]
    speeds: tuple[float, ...]
    clearance: tuple[float, float]
    shaft: ShaftTorque | None = None

    @property
    def numbers(self) -> tuple[Output, ...]:
        """Design outputs: room at each speed."""
        moments = ", ".join((self.taking.name, *(one.name for one in self.entering)))
        texts = ENDS | {"": f"least room of moments {moments}"}
        return tuple(
            Output(name, "length", f"{texts[part]} at {self.speeds[k] / RPM:.6g} rpm; negative: it does not sew", "5.4")
            for name, (part, k) in self.readings.items()
        )

    @property
    def readings(self) -> Mapping[str, tuple[str, int]]:
        """Kind of room ("" for the least of all moments) and index of the speed, by design output."""
        return {
            f"{self.name}_{part}{'_' if part else ''}at_{speed / RPM:.6g}": (part, k)
            for part in ("", *ENDS)
            for k, speed in enumerate(self.speeds)
        }

    @property
    def ends(self) -> dict[str, str]:
        """Keys of the room that the rise leaves to both ends of its window; they differ from all names of relations."""
        return {end: f"{self.taking.name} {end}" for end in ENDS}

    def fields(self) -> tuple[str, str]:
        """Return the fields of work of the least and of the greatest speed."""
        assert self.taking.window is not None
        first, *_, last = (*self.taking.window.fields, self.taking.window.fields[-1])
        return first[0], last[0]

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the outputs for the speeds of an uneven shaft; no pose outputs are computed from them."""
        shaft = self.shaft
        return frozenset() if shaft is None else shaft.needs(frozenset(o.name for o in shaft.numbers))

    def binding(self, machine: Machine, design: Array) -> tuple[tuple[str, float], tuple[str, float]]:
        """Name the fields that set the least and the greatest rise of a design (P,), each with that rise."""
        assert self.taking.window is not None
        return self.taking.window.binding(design, machine.parameter_names)

    def window(self, machine: Machine, designs: Array, speeds: Array) -> tuple[Array, Array]:
        """Compute the least and the greatest permitted rise, each (n, S), of designs at speeds (S,) or (n, S)."""
        assert self.taking.window is not None
        first, last = self.speeds[0], self.speeds[-1]
        part = np.atleast_2d((speeds - first) / (last - first))
        ends = self.taking.window.ends(designs, machine.parameter_names)
        low, high = (own[:, [0]] + part * (own[:, [-1]] - own[:, [0]]) for own in ends)
        return low, high

    def rooms(
        self, machine: Machine, designs: Array, speeds: Array, accuracy: Accuracy
    ) -> tuple[dict[str, Array], Array, Status]:
        """Compute the room of each moment at each speed, (n, S) by its relation's name, their error and status (n,).

        The room of A is the smallest of the rooms of rise, clearance, scarf and eye; the room of B and C is the margin
        of the triangle; nan without such a moment, negative if the stitch is missed.  ``ends`` are the distances of A's
        rise from the least and the greatest permitted rise.
        """
        lag = self._lag(machine)
        slow, fast, status = self._unevenness(machine, designs, accuracy)
        if lag is None:
            found = self._moments(machine, designs, accuracy, status)
            parts = {name: [values] * len(speeds) for name, values in found.items()}
        else:
            moved = [self._moved(machine, lag, designs, float(speed), accuracy) for speed in speeds]
            each = [self._moments(machine, one, accuracy, status) for one in moved]
            parts = {name: [one[name] for one in each] for name in each[0]}
        rooms = {name: np.stack(values, axis=1) for name, values in parts.items()}
        rise, err = rooms.pop("rise"), rooms.pop("err").max(axis=1)
        windows = [self.window(machine, designs, speeds[None, :] * share[:, None]) for share in (slow, fast)]
        rooms[self.ends["above"]] = np.minimum.reduce([rise - low for low, _ in windows])
        rooms[self.ends["below"]] = np.minimum.reduce([high - rise for _, high in windows])
        rooms[self.taking.name] = np.minimum.reduce([rooms[name] for name in (self.taking.name, *self.ends.values())])
        return rooms, err, status

    def step(self, machine: Machine) -> Step:
        """Make the machine's step to the least room of all moments at each speed."""

        def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
            rooms, known, status = self.rooms(machine, designs, np.array(self.speeds), accuracy)
            least = np.minimum.reduce(list(rooms.values()))
            rooms[""] = least
            status = np.where((status == st.OK) & np.isnan(least).any(axis=1), st.NEVER, status).astype(np.uint8)
            # size of the lengths whose differences are the rooms
            most = self.window(machine, designs, np.array(self.speeds))[1].max(axis=1)
            columns: Columns = {}
            for name, (part, k) in self.readings.items():
                room = rooms[self.ends.get(part, "")][:, k]
                err = (np.abs(room) + most) * (accuracy.target or 0.0)
                columns |= {name: room, f"err_{name}": np.maximum(err, known)}
            return columns | {"status": status}

        return Step(f"sewing {self.name}", self.numbers, run, work=Work.LONG, cost=lambda accuracy: 3e6)

    def _moments(self, machine: Machine, designs: Array, accuracy: Accuracy, status: Status) -> dict[str, Array]:
        """Compute rise and room of A without its window, margins of B and C, and their error, (n,); update status."""
        name, (least, most) = self.taking.name, self.clearance
        names = [f"{name}_{key}" for key in ("rise", "clearance", "above_eye", "below_scarf_end")]
        a = self.taking.step(machine).run(designs, frozenset(names), accuracy)
        rise, clearance, above, below = (np.asarray(a[key], np.float64) for key in names)
        found = {"rise": rise, name: np.minimum.reduce([clearance - least, most - clearance, above, below])}
        parts = {name: a}
        for one in self.entering:
            margin = f"{one.name}_margin"
            parts[one.name] = one.step(machine).run(designs, frozenset({margin}), accuracy)
            found[one.name] = np.asarray(parts[one.name][margin], np.float64)
        for key, part in parts.items():
            lost = (status == st.OK) & np.isnan(found[key])
            status[lost] = part["status"][lost]
        errors = (np.asarray(x, np.float64) for part in parts.values() for k, x in part.items() if k.startswith("err_"))
        return found | {"err": np.maximum.reduce([0.0 * rise, *errors])}

    def _unevenness(self, machine: Machine, designs: Array, accuracy: Accuracy) -> tuple[Array, Array, Status]:
        """Slowest and fastest speed as shares of the mean, (n,), at the speed of the scene, and the status."""
        if self.shaft is None:
            return np.ones(len(designs)), np.ones(len(designs)), np.zeros(len(designs), np.uint8)
        names = [f"{self.shaft.name}_{key}" for key in ("slowest", "fastest")]
        found = self.shaft.step(machine).run(designs, frozenset(names), accuracy)
        column = machine.parameter_names.index(self.shaft.driven[0].named("speed"))
        mean = np.abs(designs[:, column]) / abs(self.shaft.driven[0].ratio)
        slow, fast = (np.asarray(found[key], np.float64) / mean for key in names)
        return slow, fast, np.array(found["status"], np.uint8)

    def _lag(self, machine: Machine) -> tuple[str, str, int, int] | None:
        """Names of lag and rate of A's looper, and the columns of its phase and speed; None without a lag."""
        member = machine.member(self.taking.blade.tip.partition(".")[0])
        lag, names = f"{member.name}.lag", machine.parameter_names
        rate = member.family.derivative_of.get(member.family.position, "")
        if lag not in machine.pose_output or member.driver is not None or not rate:
            return None
        phase = names.index(f"{member.name}.{'key' if member.mount else 'offset'}")
        return lag, f"{member.name}.{rate}", phase, names.index(f"{member.name}.speed")

    def _moved(
        self, machine: Machine, lag: tuple[str, str, int, int], designs: Array, speed: float, accuracy: Accuracy
    ) -> Array:
        """Shift the crank of the looper so that the looper is where its lag at A puts it at a speed."""
        bent, rate, phase, own = lag
        member = machine.member(bent.partition(".")[0])
        moved = designs.copy()
        moved[:, own] = speed * member.ratio
        phi = f"phi_{self.taking.name}"
        at = np.asarray(self.taking.step(machine).run(designs, frozenset({phi}), accuracy)[phi], np.float64)
        poses = machine.poses(moved, Angles.of(at[:, None]), frozenset((bent, rate)))
        # an angle of the main shaft: sense and ratio of the crank convert it to one of the key or offset
        ahead = np.asarray(poses[bent], np.float64)[:, 0] / np.asarray(poses[rate], np.float64)[:, 0]
        sign = member.ratio if member.mount is None else member.ratio * member.mount.sense
        moved = designs.copy()
        moved[:, phase] += ahead * sign
        return moved
