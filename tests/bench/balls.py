"""Balls of python-flint over boxes of designs: what Taylor models are compared with.

Three ways, at 53 bits: plain balls; the mean value form with derivatives over the box (``arb_series`` of length 2 along
every axis); the form of second order (length 3 along every axis and every diagonal).  :mod:`tests.bench.libflint` has
the second of them without Python in between.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import flint
import numpy as np
from flint import arb, arb_series

from kernels.boxes.tape import COMBINE, CONSTANT, INVERSE, MULTIPLY, ROOT
from kernels.boxes.taylor import least
from tests.bench.boxes import Array, Boxes, Formula

BITS = 53


def _done(operation: Any, factors: Any, x: list[Any]) -> None:
    """Carry out one operation of a tape on balls or series."""
    what, out, a, b = operation
    p, q = factors
    if what == COMBINE:
        x[out] = (x[a] if p == 1.0 else p * x[a]) + (x[b] if q == 1.0 else q * x[b]) if q else p * x[a]
    elif what == MULTIPLY:
        x[out] = x[a] * x[b]
    elif what == INVERSE:
        x[out] = 1 / x[a]
    elif what == ROOT:
        x[out] = x[a].sqrt()
    elif what == CONSTANT:
        x[out] = arb(p)
    else:
        x[out], x[out + 1] = (x[a] if p == 1.0 else p * x[a]).sin_cos()


class Replay:
    """The operations of a formula on balls or series."""

    def __init__(self, formula: Formula, boxes: Boxes) -> None:
        self.rows = list(zip(formula.operations.tolist(), formula.factors.tolist(), strict=True))
        self.formula, self.boxes = formula, boxes

    def given(self, i: int) -> list[Any]:
        """All forms of box i, with those that do not vary."""
        x: list[Any] = [None] * self.formula.forms
        for form, value, error in zip(self.boxes.given, self.boxes.values[i], self.boxes.errors, strict=True):
            x[form] = arb(float(value), float(error))
        return x

    def __call__(self, start: list[Any], place: list[Any]) -> list[Any]:
        """The wanted numbers where the variables are ``place``."""
        x = list(start)
        for form, ball in zip(self.boxes.varied, place, strict=True):
            x[form] = ball
        for operation, factors in self.rows:
            _done(operation, factors, x)
        return [x[form] for form in self.formula.wanted]


Way: TypeAlias = Callable[[Replay, int, list[arb], list[float]], list[tuple[float, float]]]


def ends(ball: arb) -> tuple[float, float]:
    """Ends of a ball as floats that it does not pass; infinite for a ball without ends."""
    if not ball.is_finite():
        return -np.inf, np.inf
    return np.nextafter(float(ball.lower()), -np.inf), np.nextafter(float(ball.upper()), np.inf)


def _over(way: Way, formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Ends of the wanted numbers over every box; nan where there is no enclosure."""
    replay, found = Replay(formula, boxes), np.full((2, len(boxes), len(formula.wanted)), np.nan)
    with flint.ctx.workprec(BITS):
        for i in range(len(boxes)):
            centre = [arb(float(x)) for x in boxes.centre[i]]
            try:
                pairs = way(replay, i, centre, [float(h) for h in boxes.half[i]])
            except (ZeroDivisionError, ValueError):  # a series has no inverse where its first ball holds zero
                continue
            found[:, i] = np.array(pairs).T
    found[np.isinf(found)] = np.nan
    return found[0], found[1]


def _whole(centre: list[arb], half: list[float]) -> list[arb]:
    return [arb(c, h) for c, h in zip(centre, half, strict=True)]


def plain(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Enclosures by balls alone."""
    return _over(
        lambda f, i, centre, half: [ends(x) for x in f(f.given(i), _whole(centre, half))], formula, boxes
    )  # fmt: skip


def _along(place: list[arb], steps: list[float], length: int) -> list[Any]:
    """Variables that go along a direction, as series in one number."""
    return [arb_series([x, h], length) if h else x for x, h in zip(place, steps, strict=True)]


def _axes(half: list[float], *which: int) -> list[float]:
    return [h if k in which else 0.0 for k, h in enumerate(half)]


def _first(f: Replay, i: int, centre: list[arb], half: list[float]) -> list[tuple[float, float]]:
    start, whole, unit = f.given(i), _whole(centre, half), arb(0, 1)
    total = f(start, centre)
    for k in range(len(half)):
        along = f(start, _along(whole, _axes(half, k), 2))
        total = [t + s[1] * unit for t, s in zip(total, along, strict=True)]
    pairs = [(ends(t), ends(s[0])) for t, s in zip(total, along, strict=True)]
    return [(max(p[0], q[0]), min(p[1], q[1])) for p, q in pairs]


def first_order(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Enclosures by F(centre) + derivatives over the box times the distance, cut with those by balls alone."""
    return _over(_first, formula, boxes)


def _second(f: Replay, i: int, centre: list[arb], half: list[float]) -> list[tuple[float, float]]:
    start, whole, n = f.given(i), _whole(centre, half), len(half)
    slopes = [f(start, _along(centre, _axes(half, k), 2)) for k in range(n)]
    bends = [f(start, _along(whole, _axes(half, k), 3)) for k in range(n)]
    found = []
    cross = {(k, m): f(start, _along(whole, _axes(half, k, m), 3)) for k in range(n) for m in range(k + 1, n)}
    for j in range(len(slopes[0])):
        terms = [slopes[0][j][0], *(s[j][1] for s in slopes)]
        for k in range(n):
            terms.append(bends[k][j][2])
            terms += [cross[k, m][j][2] - bends[k][j][2] - bends[m][j][2] for m in range(k + 1, n)]
        form = np.array([*(float(x.mid()) for x in terms), sum(float(x.rad()) for x in terms) * (1.0 + 2.0**-48)])
        low = least(form, n)
        form[:-1] *= -1.0
        found.append((low, -least(form, n)))
    return found


def second_order(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Enclosures by F(centre) + derivatives there + half the second ones over the box, mixed ones by polarisation.

    The bound of the polynomial of second degree is that of the Taylor models.
    """
    return _over(_second, formula, boxes)
