"""Thread of a machine: how much the stitch needs, how much the take-ups give, what is left over, and how it pulls.

The thread runs over points of the machine in order, from the tensioner to the stitch.  Between two points it is
straight.  A take-up among them (an eyelet, a cam) takes up P more thread than at its zero.  With the length needed by
all straight pieces and the stock, the thread between tensioner and stitch that nothing has taken up,

    given = stock - sum of P,     surplus = given - needed                                              (10), (11)

A negative surplus means that the thread has to come through the tensioner, or stretches.  The tension at the tensioner,

    T1 = tension - stiffness surplus, not below 0                                                        (12)

grows over every bend by the law of contours, docs/thread.md (3).  All outputs are analytic but for these kinks, so
optimisers get exact gradients.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from sweep.errors import InputError, choices
from sweep.families.base import Output, Parameter
from sweep.families.capabilities import ThreadPath
from sweep.families.frames import Frame
from sweep.families.parts import AXES, Member, vector
from sweep.numerics.curves import TableCurve, table_curve

KEYS = ("thread", "stock", "tension", "stiffness", "radius", "allowed")
GF = 9.80665e-3  # N
EQUATION = "docs/thread.md (9)-(13)"
PHI = "phi"

Vector: TypeAlias = tuple[Any, Any, Any]


class Range(NamedTuple):
    """The values of a quantity between which the reported constants were measured."""

    name: str
    unit: str
    low: float
    high: float


# Polukhin 1971, chapter VI; what is assumed is said so (docs/thread.md, section 3).
ALPHA = Parameter("alpha", "none", "adhesion, gf/(mm deg); reported 6.17e-3", not_negative=True, default=6.17e-3)
BETA = Parameter("beta", "none", "friction, 1/deg; reported 1.12e-2", not_negative=True, default=1.12e-2)
BENDING = Parameter("B", "none", "bending, gf mm^2; reported 0.714", not_negative=True, default=0.714)
COUNT = Parameter("N", "none", "metric count of the thread, m/g; reported No. 98/3", positive=True, default=98.0 / 3.0)
DENSITY = Parameter("gamma", "none", "density of the thread, g/cm^3; assumed", positive=True, default=0.8)
RADIUS = Parameter("R", "none", "radius of the contour, mm", not_negative=True)
CONTOUR_CONSTANTS = (ALPHA, BETA, BENDING, COUNT, DENSITY)
MEASURED_RADIUS = Range("R", "mm", 0.125, 7.5)

# Through all three reported points: x 1.19 from 0.08 to 1.23 m/s, x 1.16 from there to 7.4 m/s.
REFERENCE_SPEED = Parameter("v_ref", "none", "speed at which the tension is known, m/s", positive=True, default=1.23)
SHARE = Parameter("K", "none", "share of the tension that grows with the speed", default=0.39494858849527207)
EXPONENT = Parameter("n", "none", "exponent of the speed", positive=True, default=0.189538228897548)
SPEED_CONSTANTS = (REFERENCE_SPEED, SHARE, EXPONENT)
MEASURED_SPEED = Range("v", "m/s", 0.08, 7.4)


@dataclass(frozen=True)
class TakeUp:
    """A take-up in the path: the dotted pose outputs of the thread it takes up and of its wrap angle."""

    member: str
    taken: str
    wrap: str


Waypoint: TypeAlias = tuple[float, float, float] | str | TakeUp


@dataclass(frozen=True)
class ThreadBalance:
    """Thread needed, given, left over; its tension at the stitch.

    Parameters
    ----------
    name : stands before the names of the outputs
    path : from tensioner to stitch: fixed points in the machine's frame, dotted names of moving points, take-ups
    stock : thread between tensioner and stitch when nothing is taken up; the default of the parameter ``NAME_stock``
    tension : at the tensioner, while the thread is just tight [force]
    stiffness : force per length by which the thread is slack or stretched
    radii : of the contour at each bend, in the order of the path [mm]
    allowed : most surplus over the turn, None for none
    """

    name: str
    path: tuple[Waypoint, ...]
    stock: float = 0.0
    tension: float = 0.0
    stiffness: float = 0.0
    radii: tuple[float, ...] = ()
    allowed: TableCurve | None = None

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The balance, and the tension."""
        who = self.name
        over = Output(f"{who}_excess", "length", f"surplus of thread {who} beyond what is allowed", EQUATION)
        return (
            Output(f"{who}_needed", "length", f"thread {who} along the straight pieces of its path", EQUATION),
            Output(f"{who}_given", "length", f"thread {who} that the take-ups leave: stock - sum of P", EQUATION),
            Output(f"{who}_surplus", "length", f"thread {who} given minus needed; negative: it is pulled", EQUATION),
            *((over,) if self.allowed is not None else ()),
            Output(f"{who}_wrap", "rad", f"sum of the angles by which thread {who} is bent", EQUATION),
            Output(f"{who}_tension", "force", f"tension of thread {who} at the stitch", EQUATION),
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stock, which a study can vary."""
        text = f"thread {self.name} between tensioner and stitch when nothing is taken up"
        return (Parameter(f"{self.name}_stock", "length", text, default=self.stock),)

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Name coordinates of the moving points, what the take-ups give, and their bends if wanted."""
        names = [f"{place}_{axis}" for place in self.path if isinstance(place, str) for axis in AXES]
        taken = [place.taken for place in self.path if isinstance(place, TakeUp)]
        wraps = [place.wrap for place in self.path if isinstance(place, TakeUp) and self._bent(wanted)]
        return frozenset((*names, *taken, *wraps))

    def _bent(self, wanted: frozenset[str]) -> bool:
        return not wanted.isdisjoint((f"{self.name}_wrap", f"{self.name}_tension"))

    def compute(self, found: Mapping[str, Any], frames: Mapping[str, Frame], wanted: frozenset[str]) -> dict[str, Any]:
        """Return the outputs, (n, m); ``found`` has the main shaft's angle as "phi", and the stock."""
        needed: Any = 0.0 * found[PHI]
        taken: Any = 0.0 * found[PHI]
        wraps: list[Any] = []
        before: Any = None  # point before, direction of the piece before
        along: Any = None
        for place in self.path:
            if isinstance(place, TakeUp):
                taken, before, along = taken + found[place.taken], None, None
                wraps += [found[place.wrap]] if self._bent(wanted) else []
                continue
            point = _point(place, found)
            if before is not None:
                length, direction = _piece(before, point)
                needed = needed + length
                if along is not None and self._bent(wanted):
                    wraps.append(bend(along, direction))
                along = direction
            before = point
        given = found[f"{self.name}_stock"] - taken
        surplus = given - needed
        columns = {"needed": needed, "given": given, "surplus": surplus}
        columns["wrap"] = sum(wraps, 0.0 * needed)
        if self.allowed is not None:
            columns["excess"] = surplus - _over(self.allowed, found[PHI])
        if f"{self.name}_tension" in wanted:
            columns["tension"] = self._tension(surplus, wraps)
        return {f"{self.name}_{key}": values for key, values in columns.items()}

    def _tension(self, surplus: Any, wraps: Sequence[Any]) -> Any:
        """Tension behind the last bend by the law of contours, with the reported constants of the thread."""
        pull = (self.tension - self.stiffness * surplus) / GF
        pull = np.where(np.real(pull) > 0.0, pull, 0.0)
        alpha, beta, bending, count, density = (float(p.default or 0.0) for p in (ALPHA, BETA, BENDING, COUNT, DENSITY))
        own = 1.0 / np.sqrt(np.pi * density * count)
        for radius, wrap in zip(self.radii, wraps, strict=True):
            theta = np.degrees(np.real(wrap)) + (1j * np.degrees(np.imag(wrap)) if np.iscomplexobj(wrap) else 0.0)
            grown = np.expm1(beta * theta)
            pull = pull * (1.0 + grown) + (bending / (radius + own) ** 2 + alpha * radius / beta) * grown
        return GF * pull


def bend(before: Vector, after: Vector) -> Any:
    """Measure the angle between unit vectors of a thread, (13): 2 arctan(|e1 - e2|/|e1 + e2|), exact near 0, pi."""
    off, both = (_size([a + sign * b for a, b in zip(before, after, strict=True)]) for sign in (-1.0, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # folded back upon itself: arctan of infinity, half a turn
        folded = np.real(both) == 0.0
        return np.where(folded, np.pi, 2.0 * np.arctan(off / np.where(folded, 1.0, both)))


def _size(parts: Sequence[Any]) -> Any:
    return np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)


def _piece(start: Vector, end: Vector) -> tuple[Any, Vector]:
    """Length and direction of a straight piece; a piece of no length has no direction (nan)."""
    parts = [b - a for a, b in zip(start, end, strict=True)]
    length = _size(parts)
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y, z = (part / length for part in parts)
    return length, (x, y, z)


def _point(place: Any, found: Mapping[str, Any]) -> Vector:
    if isinstance(place, str):
        x, y, z = (found[f"{place}_{axis}"] for axis in AXES)
        return x, y, z
    return tuple(np.float64(x) for x in place)  # type: ignore[return-value]


def _over(curve: TableCurve, phi: Any) -> Any:
    """Curve at real or complex angles (derivative by the complex step)."""
    if not np.iscomplexobj(phi):
        return curve(phi)
    return curve(phi.real) + 1j * phi.imag * curve.slope(phi.real)


def thread_balance(name: str, table: Mapping[str, Any], members: Mapping[str, Member]) -> ThreadBalance:
    """Relation of a user's table, checked.

    Raises
    ------
    InputError
        for an unknown key, point or member, fewer than two places, a number that is none, radii that are not as many as
        bends.
    """
    where = f"machine.relations.{name}"
    for key in table:
        if key not in KEYS:
            raise InputError(key, table[key], choices(key, KEYS), where)
    path = tuple(_place(given, members, where) for given in table["thread"])
    bends = _bends(path)
    if bends is None:
        raise InputError("thread", table["thread"], "points and take-ups in order, two points at least in a row", where)
    stock, tension, stiffness = (_number(key, table.get(key, 0.0), where, key == "stock") for key in KEYS[1:4])
    given = table.get("radius", 1.0)
    radii = tuple(_number("radius", x, where) for x in (given if isinstance(given, tuple) else (given,) * bends))
    if len(radii) != bends:
        raise InputError("radius", given, f"one number, or one for each of the {bends} bends", where)
    return ThreadBalance(name, path, stock, tension, stiffness, radii, _allowed(table.get("allowed"), where))


def _bends(path: Sequence[Waypoint]) -> int | None:
    """Count the bends along a path, take-ups and points between two others; None if no piece is straight."""
    bends, row, pieces = 0, 0, 0
    for place in path:
        row = 0 if isinstance(place, TakeUp) else row + 1
        bends += isinstance(place, TakeUp) or row > 2
        pieces += row > 1
    return bends if pieces else None


def _place(given: Any, members: Mapping[str, Member], where: str) -> Waypoint:
    if not isinstance(given, str):
        return vector(given, f"{where}.thread")
    if given in members:
        path = members[given].family.find(ThreadPath)
        if path is not None:
            return TakeUp(given, f"{given}.{path.taken}", f"{given}.{path.wrap}")
    points = [f"{m.name}.{point}" for m in members.values() for point in m.points]
    if given not in points:
        known = [*points, *(m.name for m in members.values() if m.family.find(ThreadPath) is not None)]
        raise InputError("thread", given, f"points, take-ups: {choices(given, known)}", where)
    return given


def _number(key: str, given: Any, where: str, signed: bool = False) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not np.isfinite(given):
        raise InputError(key, given, "a finite number", where)
    if given < 0.0 and not signed:
        raise InputError(key, given, "a number that is not negative", where)
    return float(given)


def _allowed(given: Any, where: str) -> TableCurve | None:
    if given is None:
        return None
    table = dict(given) if isinstance(given, tuple) else {}
    if set(table) != {"phi", "values"}:
        raise InputError("allowed", given, "phi [rad] and values: the most surplus over the turn", where)
    try:
        return table_curve(np.array(table["phi"], np.float64), np.array(table["values"], np.float64))
    except (TypeError, ValueError) as error:
        raise InputError("allowed", given, str(error), where) from None
