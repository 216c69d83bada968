"""Decomposition of design outputs into extrema of pose outputs, as the optimiser follows them.

The optimiser works with *inner* values that are smooth and sums of pose outputs at single crank angles.  Most outputs
are their own inner value; the pressure angle becomes -cos^2 of itself, the stroke ratio the angle phi0.  Both inner
values increase with the output, so minima, maxima and limits carry over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, cast

from sweep.errors import InputError
from sweep.families.base import Family, Turn
from sweep.families.capabilities import Assembly, DesignMap
from sweep.families.machines.relations import EventValue, Timing
from sweep.families.names import parts, stem, without_minus
from sweep.quantities import kinds
from sweep.quantities.dimensions import DesignFunction
from sweep.quantities.resolve import find, resolve

# Least Delta/b^2 at the worst pose of a crank that turns: cos^2 of 89.94 degrees.
ROTATABLE_MARGIN = 1e-6
# sin^2 of a pressure angle of 1.5e-8 rad: below it the slope of cos^2 is a rounding error, which must not be magnified.
SLOPELESS = 2.0**-52
SMALLEST_ANGLE = 2.0**-26  # its root

Kind: TypeAlias = Literal[
    "max_abs", "max", "min", "range", "phi_max_abs", "phi_max", "phi_min", "ext", "fold", "phi_ext", "phi_fold", "phi0",
    "phi_event", "stay", "difference", "scalar", "lengths", "least", "most", "box", "minus",
]  # fmt: skip
Inner: TypeAlias = Literal["same", "pressure", "ratio", "rotatable", "square", "transmission"]

# Measure of each quantity of the limit positions: one end, or the difference of both.
LIMIT_KINDS: dict[str, Kind] = {
    "swing": "range", "stroke": "range", "phi0": "phi0", "stroke_ratio": "phi0", "phi_ext": "phi_ext",
    "phi_fold": "phi_fold", "ext": "ext", "fold": "fold",
}  # fmt: skip


@dataclass(frozen=True)
class Series:
    """Curve over the turn whose extrema, or passages of a level, the optimiser follows.

    ``output`` is the pose output.  If it is a discriminant, the curve is divided by ``scale``, the one of its
    :class:`~sweep.families.capabilities.Assembly`: cos^2 of the pressure angle, continued below zero.
    ``window`` limits the curve to a part of the stroke.  ``wrapped`` curves are angles that jump by a full turn.
    ``passes`` is a level and a direction, +1 upwards or -1 downwards: the passages of the level are followed then.
    """

    output: str
    scale: DesignMap | None = None
    window: tuple[float, float] | None = None
    wrapped: bool = False
    passes: tuple[float, float] | None = None


@dataclass(frozen=True)
class Measure:
    """Design output as ``sign`` * (reduction ``kind`` of its series), converted by ``inner``.

    ``parts`` are the two angles of a "difference" (second minus first), the measure that "minus" negates, or the event
    at which a "scalar" takes the value of the pose output ``of``.
    ``cycles`` is that of :class:`~sweep.quantities.kinds.LimitPosition`.
    ``numbers`` are plain numbers instead of series: the output itself ("scalar"), the parameters of which the largest
    magnitude is taken ("lengths"), or the pieces of which the minimum ("least") or maximum ("most") is taken;
    ``pieces`` computes the latter.
    """

    name: str
    kind: Kind
    series: tuple[Series, ...]
    inner: Inner = "same"
    sign: float = 1.0
    numbers: tuple[str, ...] = ()
    parts: tuple[Measure, ...] = ()
    pieces: tuple[DesignFunction, ...] = ()
    of: str = ""
    cycles: int = 1

    @property
    def cycle(self) -> float:
        """Crank angle from an extended position to the next one."""
        return 2.0 * math.pi / self.cycles

    @property
    def is_angle(self) -> bool:
        """Whether the output is computed from crank angles of extrema or events."""
        if self.kind == "minus":
            return self.parts[0].is_angle
        return self.kind.startswith("phi") or self.kind in ("difference", "stay")

    @property
    def is_least(self) -> bool:
        """Whether the output is a minimum of several values, each of which bounds it from above."""
        if self.kind == "minus":
            return not self.parts[0].is_least
        return (self.kind in ("min", "least", "stay")) == (self.sign > 0.0)

    @property
    def follows_angles(self) -> bool:
        """Whether the gradient needs gradients of crank angles."""
        return self.is_angle or any(part.follows_angles for part in self.parts)

    def refused(self, minimum: float | None, maximum: float | None) -> str:
        """Say which bounds the inner value can represent, if it cannot represent the given ones; else ""."""
        if self.kind == "minus":
            return self.parts[0].refused(*(x if x is None else -x for x in (maximum, minimum)))
        low, high = (0.0 if x is None else x for x in (minimum, maximum))
        if self.inner == "ratio" and min(low, high) < 0.0:
            return "ratios of 0 or more"
        right = 0.0 <= low < 0.5 * math.pi and (maximum is None or 0.0 < high < 0.5 * math.pi)
        return "angles between 0 and 90 deg" if self.inner in ("pressure", "transmission") and not right else ""

    def nearest(self, bound: float) -> float:
        """Return the nearest bound that the inner value can represent to one that it refuses."""
        if self.kind == "minus":
            return -self.parts[0].nearest(-bound)
        return min(max(bound, SMALLEST_ANGLE), 0.5 * math.pi - SMALLEST_ANGLE)

    def to_inner(self, value: float) -> float:
        """Convert a value of the output to its inner value."""
        if self.kind == "minus":
            return -self.parts[0].to_inner(-value)
        if self.inner == "pressure":
            return -(math.cos(value) ** 2)
        if self.inner == "transmission":
            return math.sin(value) ** 2
        if self.inner == "ratio":
            return self.cycle * value / (1.0 + value)
        if self.inner == "rotatable":
            return ROTATABLE_MARGIN * value
        if self.inner == "square":
            return math.copysign(value * value, value)  # a negative limit stays one that always holds, or never
        return value

    def from_inner(self, value: float) -> float:
        """Convert an inner value to the output; nan where there is none (a mechanism that does not turn)."""
        if self.kind == "minus":
            return -self.parts[0].from_inner(-value)
        if self.inner == "pressure":
            # 1 - cos^2 may come out as -1e-16 where coupler force and velocity are in line.
            return math.atan2(math.sqrt(max(1.0 + value, 0.0)), math.sqrt(-value)) if value <= 0.0 else math.nan
        if self.inner == "transmission":
            return math.atan2(math.sqrt(value), math.sqrt(max(1.0 - value, 0.0))) if value >= 0.0 else math.nan
        if self.inner == "ratio":
            return value / (self.cycle - value)
        if self.inner == "rotatable":
            return 1.0 if value > 0.0 else 0.0
        if self.inner == "square":
            return math.copysign(math.sqrt(abs(value)), value)
        return value

    def output_slope(self, inner: float) -> float:
        """Return the derivative of the output by its inner value."""
        if self.kind == "minus":
            return self.parts[0].output_slope(-inner)
        if self.inner == "pressure":  # inner = -cos^2 of the angle
            return 1.0 / (2.0 * math.sqrt(max(-inner * (1.0 + inner), SLOPELESS)))
        if self.inner == "transmission":  # inner = sin^2 of the angle
            return 1.0 / (2.0 * math.sqrt(max(inner * (1.0 - inner), SLOPELESS)))
        if self.inner == "ratio":
            return self.cycle / (self.cycle - inner) ** 2
        if self.inner == "square":
            return 0.5 / math.sqrt(abs(inner)) if inner else math.nan
        return 1.0

    def relative_slope(self, inner: float) -> float:
        """Return the relative change of the output per relative change of its inner value; 1 for pressure angles."""
        if self.kind == "minus":
            return self.parts[0].relative_slope(-inner)
        if self.inner not in ("ratio", "square", "transmission") or not inner:
            return 1.0
        return inner * self.output_slope(inner) / self.from_inner(inner)


def curve(family: Family, output: str, window: tuple[float, float] | None = None) -> Series:
    """Series of a pose output, limited to the window if one is given."""
    return Series(output, window=window, wrapped=family.pose_output[output].wraps)


def margins(family: Family, stage: str = "") -> tuple[Series, ...]:
    """Series Delta/b^2 of one stage, or of every stage if ``stage`` is ""; empty where nothing can lock.

    In a machine "needle.2" is a stage, "needle." every stage of the member.
    """
    of_member = stage.endswith(".")
    loops = [o for o in family.every(Assembly) if o.stage == stage or (of_member and o.stage.startswith(stage))]
    selected = loops if stage else family.every(Assembly)
    return tuple(Series(o.discriminant, scale=o.scale) for o in selected)


def measure(family: Family, name: str, window: tuple[float, float] | None = None) -> Measure:
    """Measure of a design output.

    Parameters
    ----------
    family : family of the output
    name : any design output.  Means, parameters and outputs of a family's own step become numbers without inner
        structure
    window : see :class:`sweep.optimise.problem.statement.Problem`

    Raises
    ------
    InputError
        for a name that is no design output and no parameter.
    """
    if name in family.parameter_names and find(family, name) is None:
        return Measure(name, "scalar", (), numbers=(name,))
    if stem(name) == "rotatable" and not without_minus(name) and not margins(family, parts(name).stage):
        return _of_margin(name, "rotatable", ())  # a mechanism without dead points always turns
    return _measure(family, name, resolve(family, name), window)


def _measure(family: Family, name: str, quantity: kinds.Quantity, window: tuple[float, float] | None) -> Measure:
    match quantity:
        case kinds.Negative(inner=negated):
            inner = measure(family, negated.output.name, window)
            return Measure(name, "minus", inner.series, inner.inner, 1.0, inner.numbers, (inner,), inner.pieces)
        case kinds.TimingOf(timing=timing):
            return _of_timing(family, timing, window)
        case kinds.EventPlace(event=e) if isinstance(family.domain, Turn) and not family.pose_output[quantity.of].wraps:
            return Measure(name, "phi_event", (Series(e.of, passes=(e.level, 1.0 if e.rising else -1.0)),))
        case kinds.WindowAngle() if window not in (None, (0.0, 1.0)) and _is_smooth(family, quantity.of):
            return Measure(name, "stay", (curve(family, quantity.of, window),))
        case kinds.Margin(kind=kind):
            return _of_margin(name, kind, margins(family, quantity.stage))
        case kinds.LimitPosition(kind=kind):
            ratio: Inner = "ratio" if kind == "stroke_ratio" else "same"
            return Measure(name, LIMIT_KINDS[kind], (curve(family, quantity.of),), ratio, cycles=quantity.cycles)
        case kinds.Reduced(reduction=reduction, extreme=True) if isinstance(
            family.domain, Turn
        ) or not reduction.kind.startswith("phi"):
            inside = window if family.pose_output[quantity.of].windowed else None
            # A vector's length has no slope at zero: its largest value is bounded by both signs, like a magnitude.
            of_vector = {f"{quantity.of}_{axis}" for axis in "xyz"} <= family.pose_output.keys()
            kind = "max_abs" if of_vector and reduction.kind == "max" else reduction.kind
            return Measure(name, cast(Kind, kind), (curve(family, quantity.of, inside),))
        case kinds.Extent(box=box):
            numbers = tuple(f"{name}, still {k}" for k in range(len(box.still)))
            curves = tuple(curve(family, output) for output in box.curves)
            return Measure(name, "box", curves, numbers=numbers, pieces=box.still)
        case kinds.Dimension(size=size):
            numbers = tuple(f"{name}, piece {k}" for k in range(len(size.pieces)))
            side: Kind = "least" if size.least else "most"
            return Measure(name, side, (), "square" if size.squared else "same", numbers=numbers, pieces=size.pieces)
        case kinds.LargestLength(lengths=lengths):
            return Measure(name, "lengths", (), numbers=lengths)
        case kinds.OwnOutput(of_part=True):
            raise InputError("output", name, "an output that changes steadily", f"design outputs of {family.name}")
        case _:
            # Means, counts, dwells, own outputs; passages of wrapped angles, and places over an interval, are searched
            # anew for every design.
            return Measure(name, "scalar", (), numbers=(name,))


def _is_smooth(family: Family, position: str) -> bool:
    """Whether the position of a turning crank has neither kinks nor jumps."""
    pose = family.pose_output[position]
    return isinstance(family.domain, Turn) and not (pose.kinks or pose.jumps)


def _of_timing(family: Family, timing: Timing | EventValue, window: tuple[float, float] | None) -> Measure:
    places = tuple(measure(family, name, window) for name in timing.places)
    if isinstance(timing, EventValue):
        # The angle of a passage has an exact gradient; that of an extremum only finite differences.
        passages = places if places[0].kind == "phi_event" else ()
        series = places[0].series if passages else ()
        return Measure(timing.name, "scalar", series, numbers=(timing.name,), parts=passages, of=timing.of.name)
    if not all(end.is_angle for end in places):
        return Measure(timing.name, "scalar", (), numbers=(timing.name,))
    return Measure(timing.name, "difference", tuple(s for end in places for s in end.series), parts=places)


def _of_margin(name: str, kind: str, series: tuple[Series, ...]) -> Measure:
    if kind == "max_pressure_angle":
        return Measure(name, "min", series, "pressure", sign=-1.0)
    if kind == "least_transmission_angle":
        return Measure(name, "min", series, "transmission")
    return Measure(name, "min", series, "rotatable" if kind == "rotatable" else "same")
