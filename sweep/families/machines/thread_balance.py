"""Thread of a machine: length that the stitch needs, length that the take-ups give, surplus and tension.

The thread runs over places of the machine in order, from the tensioner to the stitch, straight from one to the next.
Over some of them it runs between two events only: from the moment a blade takes its loop to the moment it casts it off.
A take-up among them (an eyelet, a cam) takes up P more thread than at its zero.  With the length needed by all straight
pieces, and the lengths sewn in and drawn from the bobbin since these began, between 0 and 2 pi of the main shaft, and
the stock, the thread between tensioner and stitch that no take-up holds,

    demand = needed + sewn - drawn,     given = stock - sum of P,     surplus = given - demand          (10), (11)

A negative surplus means that thread comes through the tensioner, or stretches.  The tension at the tensioner,

    T1 = tension - stiffness surplus, not below 0, times a factor of the thread's speed                  (12)

grows over every bend at which the thread slides by the law of contours, docs/thread.md (3).  All outputs are analytic
except at these kinks and where the path changes, so optimisers get exact gradients.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import PER_RADIAN, Output, Parameter
from sweep.families.machines import thread_way
from sweep.families.machines.relations import Relation
from sweep.numerics.curves import TableCurve

GF = 9.80665e-3  # N
MM_PER_M = 1e3
EQUATION = "docs/thread.md (9)-(15)"


class Range(NamedTuple):
    """Interval of a quantity in which the reported constants were measured."""

    name: str
    unit: str
    low: float
    high: float


# Polukhin 1971, chapter VI; texts name assumed values as such (docs/thread.md, section 3).
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
class ThreadBalance(Relation):
    """Thread needed, given and left over, and its tension at the stitch.

    Parameters
    ----------
    name : prefix of the names of the outputs
    path : from tensioner to stitch
    stock : thread between tensioner and stitch with all take-ups at zero; the default of the parameter ``NAME_stock``
    tension : at the tensioner, while the thread is just tight [force]
    stiffness : force per length by which the thread is slack or stretched
    radii : of the contour at each bend, in the order of the path [mm]
    allowed : largest permitted surplus over the turn, None without a limit
    sewn : thread in one stitch; the default of the parameter ``NAME_sewn``
    feeding, drawing : two events each, between which thread is sewn in, and drawn from the bobbin
    moves : whether the velocities of all its points are known
    """

    path: thread_way.Run
    stock: float = 0.0
    tension: float = 0.0
    stiffness: float = 0.0
    radii: tuple[float, ...] = ()
    allowed: TableCurve | None = None
    sewn: float = 0.0
    feeding: tuple[str, ...] = ()
    drawing: tuple[str, ...] = ()
    moves: bool = False

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Outputs of the balance, the bends and the tension."""
        who, speed = self.name, "its speed, the length that it gains per time"
        found = [
            ("needed", "length", f"thread {who} along the straight pieces of its path"),
            ("demand", "length", f"thread {who} needed and sewn in, less what is drawn: what the take-ups follow"),
            ("given", "length", f"thread {who} that the take-ups leave: stock - sum of P"),
            ("surplus", "length", f"thread {who} given minus demanded; negative: it is pulled"),
            ("wrap", "rad", f"sum of the angles by which thread {who} is bent"),
            ("tension", "force", f"tension of thread {who} at the stitch"),
        ]
        if self.moves:
            found += [
                ("rate", PER_RADIAN, f"derivative of the demand of thread {who} between events"),
                ("velocity", "length/s", f"of thread {who}: {speed}"),
            ]
        if self.allowed is not None:
            found.append(("excess", "length", f"surplus of thread {who} beyond what is allowed"))
        kinks = set(self.bent)
        if any(isinstance(place.on, thread_way.TakeUp) and place.on.kinks for place in self.path):
            kinks |= {"given", "surplus", "excess", "wrap", "tension"}
        if self.happens:
            kinks = {key for key, *_ in found}
        return tuple(Output(f"{who}_{key}", unit, text, EQUATION, kinks=key in kinks) for key, unit, text in found)

    @property
    def bent(self) -> frozenset[str]:
        """Outputs with a kink where one of the curves of :meth:`ThreadBalance.bending` passes zero."""
        if any(isinstance(place.on, thread_way.Edge) for place in self.path):  # its ends bound the range of sliding
            return frozenset(("wrap", "tension", "rate", "velocity"))
        return frozenset(("tension",) if self.moves or self.stiffness else ())

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Stock, length of a stitch and speed: parameters that a study can vary."""
        text = f"thread {self.name} between tensioner and stitch when nothing is taken up"
        found = [Parameter(f"{self.name}_stock", "length", text, default=self.stock)]
        if self.feeding:
            text = f"thread {self.name} that a stitch takes"
            found.append(Parameter(f"{self.name}_sewn", "length", text, default=self.sewn, not_negative=True))
        if self.moves:
            text = f"of the main shaft, for what it makes of the tension of thread {self.name}; 0: nothing"
            found.append(Parameter(f"{self.name}_speed", "speed", text, default=0.0))
        return tuple(found)

    @property
    def happens(self) -> tuple[str, ...]:
        """Events at which the path or the sliding changes, or sewing in or drawing begins or ends."""
        ends = [end for place in self.path for end in (*place.held, *place.fixed)]
        return tuple(dict.fromkeys((*ends, *self.feeding, *self.drawing)))

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative of the demand, where all velocities are known and no event changes the path."""
        return {f"{self.name}_demand": f"{self.name}_rate"} if self.moves and not self.happens else {}

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Return names of the coordinates of points and take-up curves, with bends and velocities if wanted."""
        moving, bent = self._asked(wanted)
        names = {name for place in self.path for spot in thread_way.spots(place) for name in spot.needs(moving)}
        ups = [place.on for place in self.path if isinstance(place.on, thread_way.TakeUp)]
        names.update(f"phi_{event}" for event in self.happens)
        return frozenset(names.union((up.taken for up in ups), (up.wrap for up in ups if bent)))

    def _asked(self, wanted: frozenset[str]) -> tuple[bool, bool]:
        """Tell whether the wanted outputs need velocities, and whether they need bends."""
        own = {name.removeprefix(f"{self.name}_") for name in wanted}
        pulls = "tension" in own
        return self.moves and (pulls or not own.isdisjoint(("rate", "velocity"))), pulls or "wrap" in own

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Return the outputs, (n, m); ``found`` holds "phi" of the main shaft, events as "phi_...", parameters."""
        phi, (moving, bent) = found[thread_way.PHI], self._asked(wanted)
        needed, rate, taken = 0.0 * phi, 0.0 * phi, 0.0 * phi
        wraps: list[tuple[thread_way.Waypoint, Any, thread_way.PlacedPoint]] = []
        for up, places in groupby(self.path, _is_take_up):
            run = list(places)
            if not up:
                pieces = thread_way.placed_points(run, found, moving)
                length, change, bends = thread_way.length_and_bends(pieces, moving, bent)
                needed, rate = needed + length, rate + change
                wraps += zip(run[1:-1], bends, pieces[1:-1], strict=True) if bent else ()
                continue
            for place in run:
                assert isinstance(place.on, thread_way.TakeUp)
                taken = taken + found[place.on.taken]
                wraps += [(place, found[place.on.wrap], thread_way.PlacedPoint((), (), None))] if bent else []
        sewn, sewing = self._passed("feeding", found)
        drawn, drawing = self._passed("drawing", found)
        given, demand = found[f"{self.name}_stock"] - taken, needed + sewn - drawn
        rate = rate + sewing - drawing
        columns = {"needed": needed, "demand": demand, "given": given, "surplus": given - demand}
        if self.allowed is not None:
            columns["excess"] = columns["surplus"] - _over(self.allowed, phi)
        if moving:
            columns |= {"rate": rate, "velocity": rate * found[f"{self.name}_speed"]}
        if bent:
            angles = [(p, thread_way.masked(piece.on, angle + p.wrap)) for p, angle, piece in wraps]
            columns["wrap"] = sum((angle for _, angle in angles), 0.0 * needed)
            sliding = [thread_way.masked(thread_way.outside(p.fixed, found), angle) for p, angle in angles]
            pull = self.tension - self.stiffness * columns["surplus"]
            columns["tension"] = self._tension(pull * self._hurried(columns, found), sliding)
        return {f"{self.name}_{key}": values for key, values in columns.items()}

    def bending(self, found: Mapping[str, Any]) -> Any:
        """Return the curves whose zeros are kinks of tension or rate, (n, m, q).

        ``found`` is that of :meth:`ThreadBalance.compute`.  At these zeros the thread becomes slack, its
        speed leaves the measured range, or it comes to the end of a blade.
        """
        curves: list[Any] = []
        if self.stiffness:
            curves.append(self.tension - self.stiffness * found[f"{self.name}_surplus"])
        if self.moves:
            speed = found[f"{self.name}_velocity"] / MM_PER_M
            curves += [speed - way * limit for limit in MEASURED_SPEED[2:] for way in (-1.0, 1.0)]
        for up, run in groupby(self.path, _is_take_up):
            curves += [] if up else _past_ends(tuple(run), found)
        return np.stack(np.broadcast_arrays(*curves), axis=2)

    def _passed(self, when: str, found: Mapping[str, Any]) -> tuple[Any, Any]:
        """Return the thread sewn in or drawn in this turn, at most ``NAME_sewn``, and its derivative."""
        ends: tuple[str, ...] = getattr(self, when)
        if not ends:
            return 0.0, 0.0
        first, last = (found[f"phi_{end}"] for end in ends)
        since, lasts = found[thread_way.PHI] - first, thread_way.turned(last - first)
        # No thread passes in no time: between events at one crank angle neither its length nor its rate is defined.
        share = thread_way.turned(since) / np.where(np.real(lasts) > 0.0, lasts, np.nan)
        share = np.where(np.real(share) > 1.0, 1.0, share)
        # a cycloid: thread begins to pass and ends without a jump of its speed
        passed = share - np.sin(TWO_PI * share) / TWO_PI + np.floor(np.real(since) / TWO_PI)
        whole = found[f"{self.name}_sewn"]
        return whole * passed, whole * (1.0 - np.cos(TWO_PI * share)) / lasts

    def _hurried(self, columns: Mapping[str, Any], found: Mapping[str, Any]) -> Any:
        """Return the factor of the speed on the tension, (7), within the measured range; 1 without a speed."""
        if "velocity" not in columns:
            return 1.0
        reference, share, exponent = (float(p.default or 0.0) for p in SPEED_CONSTANTS)
        square = (columns["velocity"] / MM_PER_M) ** 2
        low, high = MEASURED_SPEED.low**2, MEASURED_SPEED.high**2
        square = np.where(np.real(square) < low, low, np.where(np.real(square) > high, high, square))
        ratio = 1.0 + share * ((square / reference**2) ** (0.5 * exponent) - 1.0)
        return np.where(found[f"{self.name}_speed"] == 0.0, 1.0, ratio)

    def _tension(self, pull: Any, wraps: Sequence[Any]) -> Any:
        """Return the tension behind the last bend by the law of contours, with the reported constants."""
        pull = np.where(np.real(pull) > 0.0, pull, 0.0) / GF
        alpha, beta, bending, count, density = (float(p.default or 0.0) for p in CONTOUR_CONSTANTS)
        own = 1.0 / np.sqrt(np.pi * density * count)
        for radius, wrap in zip(self.radii, wraps, strict=True):
            grown = np.expm1(beta * 180.0 / np.pi * wrap)
            pull = pull * (1.0 + grown) + (bending / (radius + own) ** 2 + alpha * radius / beta) * grown
        return GF * pull


def _is_take_up(place: thread_way.Waypoint) -> bool:
    return isinstance(place.on, thread_way.TakeUp)


def _past_ends(run: thread_way.Run, found: Mapping[str, Any]) -> list[Any]:
    """Return the place of the shortest way along each blade of a run, measured from either end."""
    pieces, past = thread_way.placed_points(run, found, False), []
    for k, place in enumerate(run):
        if isinstance(place.on, thread_way.Edge):
            ends = (spot.position(found) for spot in thread_way.spots(place))
            before, after = (thread_way.beside(pieces, k, step).at for step in (-1, 1))
            along = thread_way.nearest_way(before, after, *ends)
            past += [along, along - 1.0]
    return past


def _over(curve: TableCurve, phi: Any) -> Any:
    """Evaluate a curve at real or complex angles (derivative by the complex step)."""
    if not np.iscomplexobj(phi):
        return curve(phi)
    return curve(phi.real) + 1j * phi.imag * curve.slope(phi.real)
