"""Shafts of a machine, and mounts of members' cranks on them: machine-and-stitch, 1.3."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kernels.types import Array
from sweep.errors import InputError, choices, number, sign
from sweep.families.base import Parameter
from sweep.families.frames import Frame, TurningAxis, mounted, place_parameters, tilted

SHAFT_KEYS = ("at", "axis", "zero", "ratio", "phase")
MOUNT_KEYS = ("shaft", "sense", "shift", "turn", "key")
MAIN = "main"


@dataclass(frozen=True)
class Shaft:
    """An axis of the machine that turns by ``ratio`` phi + ``phase``, right-handed about its direction.

    Parameters
    ----------
    name : for messages
    at : origin of the lengths along it
    along : its direction, a unit vector
    zero : unit vector perpendicular to it, to its mark at angle 0
    ratio : whole turns per turn of the main shaft, with the sense
    phase : its angle where that of the main shaft is 0 [rad]; the default of its parameter
    """

    name: str
    at: tuple[float, float, float]
    along: tuple[float, float, float]
    zero: tuple[float, float, float]
    ratio: int = 1
    phase: float = 0.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the machine: place and tilt of the shaft, and its phase if it is geared to the main shaft."""
        own = place_parameters(f"shaft {self.name}", self.at)
        text = f"angle of shaft {self.name} where that of the main shaft is 0"
        phase = () if self.name == MAIN else (Parameter("phase", "angle", text, default=self.phase),)
        return tuple(replace(p, name=f"{self.name}_{p.name}") for p in (*own, *phase))

    def axis(self, given: Array) -> TurningAxis:
        """Return the axis of designs, from the columns of its parameters."""
        zero, along = np.array(self.zero), np.array(self.along)
        rotation = tilted(np.stack([zero, np.cross(along, zero), along], axis=1)[None], given[:, 3:6])
        return TurningAxis(given[:, :3], rotation[:, :, 2], rotation[:, :, 0])


@dataclass(frozen=True)
class Mount:
    """Seat of the first crank of a member on a shaft.

    Parameters
    ----------
    shaft : the shaft
    sense : +1 or -1, whether its crank axis runs along the shaft or against it
    shift : place of its origin along the shaft; the default of the parameter ``shift``
    turn : angle about the shaft, from its zero direction, to the direction of its crank at phi = 0
    key : angle of its crank on the shaft, from the shaft's mark
    columns : columns of the parameters of the shaft in the machine's design matrix
    """

    shaft: Shaft
    sense: int = 1
    shift: float = 0.0
    turn: float = 0.0
    key: float = 0.0
    columns: slice = field(default_factory=lambda: slice(0, 0))

    @property
    def ratio(self) -> int:
        """Turns of the crank, in its own sense, per turn of the main shaft."""
        return self.sense * self.shaft.ratio

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters that a study can vary: key, shift and turn."""
        on = f"shaft {self.shaft.name}"
        return (
            Parameter("key", "angle", f"angle of its crank on the {on}, from the mark", default=self.key),
            Parameter("shift", "length", f"place of its origin along the {on}", default=self.shift, places=True),
            Parameter(
                "turn", "angle", f"angle of its frame about the {on}, from the zero direction", default=self.turn
            ),
        )

    def phase(self, designs: Array, turn: Array, key: Array) -> Array:
        """Return the member's crank angle where that of the main shaft is 0, (4)."""
        phase = 0.0 if self.shaft.name == MAIN else designs[:, self.columns.stop - 1]
        return self.sense * (phase + key - turn)

    def frame(self, designs: Array, crank: TurningAxis, shift: Array, turn: Array) -> Frame:
        """Return the frame of the member's first stage in the machine's frame."""
        return mounted(self.shaft.axis(designs[:, self.columns]), crank, float(self.sense), shift, turn)


def read_shafts(
    given: Mapping[str, Mapping[str, Any]], placed: Callable[[str, dict[str, Any]], Any]
) -> dict[str, Shaft]:
    """Read and check the shafts of a machine; ``placed`` reads at, axis and zero.

    Raises
    ------
    InputError
        for an unknown key, a ratio that is no whole number, a main shaft with a ratio or phase, or no main shaft.
    """
    if given and MAIN not in given:
        raise InputError("shafts", list(given), "one of them named main", "machine.shafts")
    found = {}
    for name, table in given.items():
        where = f"machine.shafts.{name}"
        for key in table:
            if key not in SHAFT_KEYS or (name == MAIN and key in ("ratio", "phase")):
                known = SHAFT_KEYS[:3] if name == MAIN else SHAFT_KEYS
                raise InputError(key, table[key], choices(key, known), where)
        place = placed(f"shafts.{name}", {key: table[key] for key in SHAFT_KEYS[:3] if key in table})
        rotation = place.rotation
        along, zero = (tuple(rotation[:, k].tolist()) for k in (2, 0))
        found[name] = Shaft(name, place.at, along, zero, turns(table, where), _number("phase", table, where))
    return found


def read_mount(table: Mapping[str, Any], shafts: Mapping[str, Shaft], where: str) -> Mount:
    """Read and check the mount of a member on the shaft that its table names.

    Raises
    ------
    InputError
        for an unknown shaft, a key that the shaft already decides, a sense other than +1 and -1.
    """
    name = table["shaft"]
    if name not in shafts:
        known = f"one of {choices(str(name), shafts)}" if shafts else "the name of a shaft in [shafts]; there is none"
        raise InputError("shaft", name, known, where)
    for key in ("place", "ratio", "offset", "driver"):
        if key in table:
            allowed = "nothing beside shaft, which decides it: give sense, shift, turn and key"
            raise InputError(key, table[key], allowed, where)
    sense = sign("sense", table.get("sense", 1), where, "the crank axis along the shaft or against it")
    shift, turn, angle = (_number(each, table, where) for each in MOUNT_KEYS[2:])
    return Mount(shafts[name], sense, shift, turn, angle)


def turns(table: Mapping[str, Any], where: str) -> int:
    """Return the whole turns per turn of the main shaft, with the sense, from the key ``ratio``."""
    allowed = "a whole number but 0: the machine's turn is one of the main shaft, so choose its slowest shaft as that"
    ratio = number("ratio", table.get("ratio", 1), where, allowed)
    if ratio != int(ratio) or ratio == 0.0:
        raise InputError("ratio", table["ratio"], allowed, where)
    return int(ratio)


def _number(key: str, table: Mapping[str, Any], where: str) -> float:
    return number(key, table.get(key, 0.0), where, "a finite number, angles in rad")
