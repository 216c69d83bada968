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

MARGIN = -1  # instead of an order: the squared cosine of the last stage's pressure angle


@dataclass(frozen=True)
class Curve:
    """Closures of a curve; k are the constants of a design, (a, b, c) what it is made of, (u, v) cosine and sine.

    Parameters
    ----------
    name : for the functions that are made of it
    guarded : how many stages behind the first have a discriminant that the curve needs to be positive
    jet : (k, a, b, c, u, v) -> the curve and its first two derivatives
    sample : (k, a, b, c, u, v) -> the curve, and the discriminants of the first ``guarded`` + 1 stages
    rounding : (k, a, b, u, v) -> estimate of its rounding error
    """

    name: str
    guarded: int
    jet: Helper
    sample: Helper
    rounding: Helper


def curve(chain: Chained, order: int) -> Curve:
    """Return the derivative of that order, 0, 1 or 2, or the `MARGIN`."""
    kind = "margin" if order == MARGIN else f"order{order}"
    name = f"{kind}_{chain.record.name}"
    jet, sample, rounding = _margin(chain) if order == MARGIN else (_position, _velocity, _acceleration)[order](chain)
    made = [generated_inline(f"{f.__name__}_{name}", f) for f in (jet, sample, rounding)]
    return Curve(name, chain.stages - (2 if order == MARGIN else 1), *made)


def _position(chain: Chained) -> tuple[Helper, Helper, Helper]:
    travel, blur = chain.travel, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, _ = travel(k, u, v)
        return a * m.x0 + b * m.y0 + c, a * m.x1 + b * m.y1, a * m.x2 + b * m.y2

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        m, deltas = travel(k, u, v)
        return a * m.x0 + b * m.y0 + c, deltas

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        e0, _, _, f0, _, _, _ = blur(k, u, v)
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
        _, e1, _, _, f1, _, _ = blur(k, u, v)
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
        _, _, e2, _, _, f2, _ = blur(k, u, v)
        return abs(a) * e2 + abs(b) * f2

    return jet, sample, rounding


def _margin(chain: Chained) -> tuple[Helper, Helper, Helper]:
    dip, before, blur = chain.dip, chain.before, chain.blur

    def jet(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        return dip(k, u, v)

    def sample(k: Any, a: Any, b: Any, c: Any, u: Any, v: Any) -> Any:
        y, _, _ = dip(k, u, v)
        return y, before(k, u, v)

    def rounding(k: Any, a: Any, b: Any, u: Any, v: Any) -> Any:
        return blur(k, u, v)[6]

    return jet, sample, rounding
