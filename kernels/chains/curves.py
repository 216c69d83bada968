"""Curves over the crank angle whose extrema are searched: derivatives of the last stage's output, or its margin.

With (x, y) the output of a chain, a curve is a x + b y + c, or a derivative of it, with three numbers per design; so
one kernel serves travel, deviation and the coordinates of a guided point in any frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kernels.chains.chain import Chained
from kernels.chains.form import Helper, Travel
from kernels.chains.links import Input
from kernels.curves.polynomials import rotate
from kernels.jit import generated_inline, inline

MARGIN = -1  # instead of an order: the squared cosine of the last stage's pressure angle
JERK = 3  # the highest order
Y0 = Travel._fields.index("y0")
AHEAD = 1e-5  # [rad] of the difference quotient for the fifth derivative, which only steers the iteration


@dataclass(frozen=True)
class Sampling:
    """Closures that sample one curve, or two of one motion together; k: constants of a design, (a, b, c): coefficients.

    Samples are taken in two loops, one up to the last stage and one for the last stage: the loops are half as long, and
    the processor overlaps two rounds of each, which hides that a root waits for a root.

    Parameters
    ----------
    name : for the functions that are generated from it
    curves : number of curves, 1 or 2
    guarded : number of stages behind the first whose discriminant must be positive
    ends : whether the last stage is one of them
    density : least number of samples per distance of the nearest singularity
    drive : (k, u, v) -> `Input` of the last stage, discriminants of the stages before; (u, v): cosine and sine of the
        crank
    sample : (k, a, b, c, input) -> tuple of the curves, and the discriminant of the last stage
    hand, take : (rows, i, input) and (rows, i) -> input: write and read the input of a sample at place i of five rows
    """

    name: str
    curves: int
    guarded: int
    ends: bool
    density: float
    drive: Helper
    sample: Helper
    hand: Helper
    take: Helper


@dataclass(frozen=True)
class Curve:
    """A curve whose extrema are searched.

    Parameters
    ----------
    alone : its samples
    jet : (k, a, b, c, u, v) -> the curve and its first two derivatives
    rounding : (k, a, b, u, v) -> estimate of the curve's rounding error
    """

    alone: Sampling
    jet: Helper
    rounding: Helper


def sampling(chain: Chained, orders: tuple[int, ...], along: bool) -> Sampling:
    """Make the samples of derivatives of these orders 0 to 3, or of the `MARGIN`; with ``along`` every b is 0."""
    highest, margin = max(orders), orders == (MARGIN,)
    kind = "margin" if margin else f"{'along' if along else 'order'}{''.join(map(str, orders))}"
    name = f"{kind}_{chain.record.name}"
    sample = _squared_cosine(chain) if margin else _derivatives(chain, orders, _along if along else _in_frame)
    made = (generated_inline(f"{f.__name__}_{name}", f) for f in (sample, *_handing(max(highest, 0))))
    guarded, density = chain.stages - (2 if margin else 1), 18.0 if highest == JERK else 12.0
    return Sampling(name, len(orders), guarded, not margin, density, chain.drive, *made)


def curve(chain: Chained, order: int, along: bool) -> Curve:
    """Make the curve that is the derivative of ``order``, or the `MARGIN`, as `sampling` does."""
    alone = sampling(chain, (order,), along)
    made = _margin(chain) if order == MARGIN else _derivative(chain, order, _along if along else _in_frame)
    return Curve(alone, *(generated_inline(f"{f.__name__}_{alone.name}", f) for f in made))


def _handing(order: int) -> tuple[Helper, Helper]:
    """Make the functions that write an `Input` with ``order`` derivatives to rows and read it; higher ones are 0."""

    def hand(rows: Any, i: int, t: Any) -> None:
        rows[0][i], rows[1][i] = t.u, t.v
        if order >= 1:
            rows[2][i] = t.t1
        if order >= 2:
            rows[3][i] = t.t2
        if order >= 3:
            rows[4][i] = t.t3

    def take(rows: Any, i: int) -> Any:
        t1 = rows[2][i] if order >= 1 else 0.0
        t2 = rows[3][i] if order >= 2 else 0.0
        t3 = rows[4][i] if order >= 3 else 0.0
        return Input(rows[0][i], rows[1][i], t1, t2, t3, 0.0)

    return hand, take


@inline
def _in_frame(a: Any, b: Any, x: Any, y: Any) -> Any:
    return a * x + b * y


@inline
def _plus(value: Any, constant: Any) -> Any:
    return value + constant


@inline
def _first(value: Any, constant: Any) -> Any:
    return value  # a derivative has no constant


@inline
def _along(a: Any, b: Any, x: Any, y: Any) -> Any:
    return a * x  # so the compiler drops the computation of y


def _derivatives(chain: Chained, orders: tuple[int, ...], made: Helper) -> Helper:
    land, first, last = chain.land, orders[0], orders[-1]
    plus = _plus if first == 0 else _first

    def sample(k: Any, a: Any, b: Any, c: Any, t: Any) -> Any:
        m = land(k, t)
        return (plus(made(a, b, m[first], m[Y0 + first]), c),), m.delta

    def sample_two(k: Any, a: Any, b: Any, c: Any, t: Any) -> Any:
        m = land(k, t)
        value = plus(made(a, b, m[first], m[Y0 + first]), c)
        return (value, made(a, b, m[last], m[Y0 + last])), m.delta

    return sample if len(orders) == 1 else sample_two


def _derivative(chain: Chained, order: int, made: Helper) -> tuple[Helper, Helper]:
    travel, blur = chain.travel, chain.blur
    x, y = order, Y0 + order  # places in `Travel`
    e, f = order, JERK + 1 + order  # places among the rounding errors
    plus = _plus if order == 0 else _first

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        return plus(made(a, b, m[x], m[y]), c), made(a, b, m[x + 1], m[y + 1]), made(a, b, m[x + 2], m[y + 2])

    def jerk_jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        n, _ = travel(k, *rotate(u, v, AHEAD))
        slope = made(a, b, m.x4, m.y4)
        return made(a, b, m.x3, m.y3), slope, (made(a, b, n.x4, n.y4) - slope) / AHEAD

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        errors = blur(k, u, v)
        return abs(a) * errors[e] + abs(b) * errors[f]

    return (jerk_jet if order == JERK else jet), rounding


def _squared_cosine(chain: Chained) -> Helper:
    dip = chain.dip

    def sample(k: Any, a: Any, b: Any, c: Any, t: Any) -> Any:
        y, _, _ = dip(k, t)
        return (y,), y

    return sample


def _margin(chain: Chained) -> tuple[Helper, Helper]:
    drive, dip, blur = chain.drive, chain.dip, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        t, _ = drive(k, u, v)
        return dip(k, t)

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        return blur(k, u, v)[8]

    return jet, rounding
