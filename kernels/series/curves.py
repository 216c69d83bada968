"""The curves over the crank angle whose extrema are searched: a derivative of what the last stage moves, or its margin.

Of a chain that moves (x, y) a curve is a x + b y + c, or a derivative of it, with three numbers per design; so
travel, deviation and the coordinates of a guided point in any frame are one kernel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kernels._jit import generated_inline
from kernels.series.chain import Chained
from kernels.series.form import Helper
from kernels.trigpoly import rotate

MARGIN = -1  # instead of an order: the squared cosine of the last stage's pressure angle
JERK = 3  # the highest order
AHEAD = 1e-5  # [rad] of the difference quotient for the fifth derivative, which only steers the iteration


@dataclass(frozen=True)
class Curve:
    """Closures of a curve; k are the constants of a design, (a, b, c) what it is made of, (u, v) cosine and sine.

    Parameters
    ----------
    name : for the functions that are made of it
    guarded : how many stages behind the first have a discriminant that the curve needs to be positive
    samples : per distance of the nearest singularity, at least
    jet : (k, a, b, c, u, v) -> the curve and its first two derivatives
    sample : (k, a, b, c, u, v) -> the curve, and the discriminants of the first ``guarded`` + 1 stages
    rounding : (k, a, b, u, v) -> estimate of its rounding error
    """

    name: str
    guarded: int
    samples: float
    jet: Helper
    sample: Helper
    rounding: Helper


def curve(chain: Chained, order: int) -> Curve:
    """Return the derivative of that order, 0 to 3, or the `MARGIN`."""
    kind = "margin" if order == MARGIN else f"order{order}"
    name = f"{kind}_{chain.record.name}"
    derivatives = (_position, _velocity, _acceleration, _jerk)
    jet, sample, rounding = _margin(chain) if order == MARGIN else derivatives[order](chain)
    made = [generated_inline(f"{f.__name__}_{name}", f) for f in (jet, sample, rounding)]
    guarded, samples = chain.stages - (2 if order == MARGIN else 1), 18.0 if order == JERK else 12.0
    return Curve(name, guarded, samples, *made)


def _position(chain: Chained) -> tuple[Helper, Helper, Helper]:
    travel, blur = chain.travel, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        return a * m.x0 + b * m.y0 + c, a * m.x1 + b * m.y1, a * m.x2 + b * m.y2

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, deltas = travel(k, u, v)
        return a * m.x0 + b * m.y0 + c, deltas

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        e0, _, _, _, f0, _, _, _, _ = blur(k, u, v)
        return abs(a) * e0 + abs(b) * f0

    return jet, sample, rounding


def _velocity(chain: Chained) -> tuple[Helper, Helper, Helper]:
    travel, blur = chain.travel, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        return a * m.x1 + b * m.y1, a * m.x2 + b * m.y2, a * m.x3 + b * m.y3

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, deltas = travel(k, u, v)
        return a * m.x1 + b * m.y1, deltas

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        _, e1, _, _, _, f1, _, _, _ = blur(k, u, v)
        return abs(a) * e1 + abs(b) * f1

    return jet, sample, rounding


def _acceleration(chain: Chained) -> tuple[Helper, Helper, Helper]:
    travel, blur = chain.travel, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        return a * m.x2 + b * m.y2, a * m.x3 + b * m.y3, a * m.x4 + b * m.y4

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, deltas = travel(k, u, v)
        return a * m.x2 + b * m.y2, deltas

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        _, _, e2, _, _, _, f2, _, _ = blur(k, u, v)
        return abs(a) * e2 + abs(b) * f2

    return jet, sample, rounding


def _jerk(chain: Chained) -> tuple[Helper, Helper, Helper]:
    travel, blur = chain.travel, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        ahead, _ = travel(k, *rotate(u, v, AHEAD))
        slope = a * m.x4 + b * m.y4
        return a * m.x3 + b * m.y3, slope, (a * ahead.x4 + b * ahead.y4 - slope) / AHEAD

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, deltas = travel(k, u, v)
        return a * m.x3 + b * m.y3, deltas

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        _, _, _, e3, _, _, _, f3, _ = blur(k, u, v)
        return abs(a) * e3 + abs(b) * f3

    return jet, sample, rounding


def _margin(chain: Chained) -> tuple[Helper, Helper, Helper]:
    dip, before, blur = chain.dip, chain.before, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        return dip(k, u, v)

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        y, _, _ = dip(k, u, v)
        return y, before(k, u, v)

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        return blur(k, u, v)[8]

    return jet, sample, rounding
