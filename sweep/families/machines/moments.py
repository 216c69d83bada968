"""Moment A, where a looper's tip passes the needle and takes its loop: machine-and-stitch, 5.1 and 5.2.

In the needle's frame, n along the needle to its point, w out of the scarf and perpendicular to n, u = n x w, the tip is
at X = (T - G).u across, Y = (T - G).w aside, Z = (T - G).n along the needle from the guided point G.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels.types import Array
from sweep.families.base import PER_RADIAN, Output, Parameter
from sweep.families.machines.relations import Relation
from sweep.families.machines.segments import Gap, cross, dot, minus
from sweep.families.machines.tools import Blade, Needle, rate_of
from sweep.families.sites import AXES

PARALLEL = 1e-6  # share of the scarf vector below which its part normal to the needle gives no direction


@dataclass(frozen=True)
class RiseWindow:
    """Window of the needle's rise at A: the range that two or more fields of work permit in common, 5.4.

    ``fields`` are their names with the least and the greatest rise that each permits.  With ``vary`` these are defaults
    of parameters of the machine; ``of`` is the name of the moment.
    """

    of: str
    fields: tuple[tuple[str, float, float], ...]
    vary: bool = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Both ends of every field, if they vary."""
        texts = {"least": "least rise that {} permits", "most": "largest rise that {} permits"}
        return tuple(
            Parameter(f"{self.of}_{end}_{_word(field)}", "length", text.format(field), default=value, not_negative=True)
            for field, *values in (self.fields if self.vary else ())
            for (end, text), value in zip(texts.items(), values, strict=True)
        )

    def ends(self, designs: Any, names: Sequence[str]) -> tuple[Any, Any]:
        """Least and greatest rise that every field permits, each (n, F), of designs with these columns."""
        if self.vary:
            found = designs[:, [names.index(p.name) for p in self.parameters]]
            return found[:, 0::2], found[:, 1::2]
        given = np.broadcast_to([ends for _, *ends in self.fields], (len(designs), len(self.fields), 2))
        return given[:, :, 0], given[:, :, 1]

    def binding(self, design: Array, names: Sequence[str]) -> tuple[tuple[str, float], tuple[str, float]]:
        """Name the fields that set the least and the greatest rise of a design (P,), each with that rise."""
        low, high = (one[0] for one in self.ends(design[None, :], names))
        first, last = int(low.argmax()), int(high.argmin())
        return (self.fields[first][0], float(low[first])), (self.fields[last][0], float(high[last]))

    @property
    def words(self) -> str:
        """Description of the window, with the fields that bind."""
        text = "how far the rise lies inside its window"
        if self.vary:
            return f"{text}, which {' and '.join(field for field, *_ in self.fields)} leave"
        (slow, least), (fast, most) = self.binding(np.empty(0), ())
        none = ": none is left" if least > most else ""
        return f"{text}: at least {least:g} for {slow}, at most {most:g} for {fast}{none}"


def _word(field: str) -> str:
    return re.sub(r"\W+", "_", field)


@dataclass(frozen=True)
class Taking(Relation):
    """A blade's tip in the frame of a needle, pose by pose; its passage: :mod:`sweep.families.machines.passages`.

    ``sense`` is +1 or -1: the tip passes towards u or against it; ``window`` is that of the rise.
    """

    needle: Needle
    blade: Blade
    sense: int
    window: RiseWindow | None = None

    @property
    def gap(self) -> Gap:
        """Gap of needle and blade as capsules."""
        return Gap(f"{self.name}_gap", (self.needle.body, self.blade.body))

    def beside(self, height: Any) -> Any:
        """Whether a height lies between the needle's top and point."""
        return (height > self.needle.top) & (height < self.needle.point)

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative by the angle of the main shaft of each pose output."""
        return {f"{self.name}_{what}": f"{self.name}_d{what}" for what in ("across", "side", "height", "depth")}

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Coordinates of the tip in the needle's frame, depth of the needle, and their derivatives."""
        texts = {
            "across": "the tip across the needle, along n x w",
            "side": "the tip beside the needle's axis, out of the scarf",
            "height": "the tip along the needle, from the guided point",
            "depth": "the guided point along the needle's direction",
        }
        found = [Output(f"{self.name}_{what}", "length", text, "(12)") for what, text in texts.items()]
        found += [
            Output(
                f"{self.name}_d{what}", PER_RADIAN, f"derivative of {self.name}_{what} by phi of the main shaft", "(12)"
            )
            for what in texts
        ]
        speed = "speed of the tip relative to the needle, per radian of the main shaft"
        gap = Output(self.gap.name, "length", "gap between needle and blade, less their radii", "(9)", kinks=True)
        return (*found, Output(f"{self.name}_speed", PER_RADIAN, speed, "(12)"), gap)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the rise window."""
        return self.window.parameters if self.window else ()

    @property
    def _moving(self) -> frozenset[str]:
        """Names of the outputs that need velocities."""
        return frozenset((*self.rates.values(), f"{self.name}_speed"))

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of coordinates of both points and the line, and of velocities if they are wanted."""
        names = [self.needle.on, self.blade.tip, self.needle.line]
        if not wanted.isdisjoint(self._moving):
            names += [rate_of(self.needle.on), rate_of(self.blade.tip)]
        if self.gap.name in wanted:
            names.append(self.blade.back)
        return frozenset(f"{name}_{axis}" for name in names for axis in AXES)

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the wanted outputs, (n, m); nan where the scarf is along the needle."""
        point, tip, line = (_vector(found, name) for name in (self.needle.on, self.blade.tip, self.needle.line))
        n = [self.needle.sense * x for x in line]
        scarf = self.needle.scarf
        along = dot(scarf, n)
        w = [x - along * part for x, part in zip(scarf, n, strict=True)]
        size = np.sqrt(dot(w, w))
        size = np.where(np.real(size) > PARALLEL * np.linalg.norm(scarf), size, np.nan)
        w = [x / size for x in w]
        u = cross(n, w)
        columns = self.gap.compute(found, frozenset()) if self.gap.name in wanted else {}
        orders = [("", point, tip)]
        if not wanted.isdisjoint(self._moving):
            orders.append(("d", _vector(found, rate_of(self.needle.on)), _vector(found, rate_of(self.blade.tip))))
        for d, point, tip in orders:
            r = minus(tip, point)
            parts = {"across": dot(r, u), "side": dot(r, w), "height": dot(r, n), "depth": dot(point, n)}
            columns |= {f"{self.name}_{d}{what}": part for what, part in parts.items()}
            columns |= {f"{self.name}_speed": np.sqrt(dot(r, r))} if d else {}
        return columns


def _vector(found: Mapping[str, Any], name: str) -> list[Any]:
    return [found[f"{name}_{axis}"] for axis in AXES]
