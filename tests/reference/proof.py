"""A second, slow program that checks a certificate: ball arithmetic (python-flint), derivatives, nothing from kernels.

Every box of a certificate claims that a combination of rows is above a number for all designs in it.  The rows are
written down anew here, psi'' from the vectors of the joints; bounds come from the mean value theorem with exact
derivatives over the box, in balls of 80 bits.  That is coarser than the slopes of the first program, so a box that does
not yield is halved, which no claim is hurt by.
"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import flint
import pyarrow.parquet as pq
from flint import arb

DEEPEST = 16  # halvings of a box before it counts as refuted
flint.ctx.prec = 80


class Jet:
    """A number with its derivatives by the free coordinates."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: Any, slopes: list[Any]) -> None:
        self.value, self.slopes = value, slopes

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, [p + q for p, q in zip(self.slopes, other.slopes, strict=True)])

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, [p - q for p, q in zip(self.slopes, other.slopes, strict=True)])

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, [p * other for p in self.slopes])
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Jet(self.value * other.value, [p * other.value + self.value * q for p, q in pairs])

    def __truediv__(self, other: Jet) -> Jet:
        ratio = self.value / other.value
        return Jet(ratio, [(p - ratio * q) / other.value for p, q in zip(self.slopes, other.slopes, strict=True)])

    def root(self) -> Jet:
        root = self.value.sqrt()
        return Jet(root, [p / (2 * root) for p in self.slopes])

    def sine_cosine(self) -> tuple[Jet, Jet]:
        s, c = self.value.sin(), self.value.cos()
        return Jet(s, [c * p for p in self.slopes]), Jet(c, [-s * p for p in self.slopes])


def _dot(p: list[Jet], q: list[Jet]) -> Jet:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


class Rows:
    """The rows of a certificate over one box, or at one design, in coordinates e, f, g, alpha of the axes."""

    def __init__(self, question: dict[str, Any], place: list[Any]) -> None:
        n = len(place)
        free = {name: k for k, name in enumerate(question["free"])}
        zero = [arb(0)] * n
        known = dict(zip(question["coordinates"], question["given"], strict=True))
        x = {
            name: Jet(place[free[name]], [arb(int(j == free[name])) for j in range(n)])
            if name in free
            else Jet(arb(known[name]), zero)
            for name in question["coordinates"]
        }
        self.question, self.zero, self.branch = question, zero, arb(question["branch"])
        self.e, self.f, self.g, self.phi1 = x["e"], x["f"], x["g"], x["phi_ext"]
        self.sa, self.ca = x["alpha"].sine_cosine()
        s, c = x["swing"].sine_cosine()
        v1, u1 = x["phi_ext"].sine_cosine()
        v2, u2 = (x["phi_ext"] + x["phi0"]).sine_cosine()
        h = self.g * self.sa
        # Both limit positions: u (ca Y - h) = v (e + X), with (X2, Y2) = (X1, Y1) turned by the swing; Cramer's rule.
        m11, m12, r1 = v1 * -1, u1 * self.ca, v1 * self.e + u1 * h
        m21 = u2 * self.ca * s - v2 * c
        m22, r2 = u2 * self.ca * c + v2 * s, v2 * self.e + u2 * h
        self.det = m11 * m22 - m12 * m21
        self.nx, self.ny = r1 * m22 - m12 * r2, m11 * r2 - r1 * m21
        nx2, ny2 = self.nx * c - self.ny * s, self.ny * c + self.nx * s
        self.n1 = u1 * (self.e * self.det + self.nx) + v1 * (self.ca * self.ny - h * self.det)
        self.n2 = (u2 * (self.e * self.det + nx2) + v2 * (self.ca * ny2 - h * self.det)) * -1
        self.total = self.n1 + self.n2
        # |BC|^2 is (rho - a)^2 + ... and (rho + a)^2 + ...: their difference is linear in the crank.
        self.crank = self.e * (self.nx - nx2) - self.f * self.sa * (self.ny - ny2)
        self.sides = [self._side(u1, v1, self.nx, self.ny), self._side(u2, v2, nx2, ny2)]

    def _side(self, u: Jet, v: Jet, x: Jet, y: Jet) -> Jet:
        across = self.e * self.total - self.crank * u
        along = self.f * self.sa * self.total + self.crank * self.ca * v
        return (across * y + along * x) * -self.branch

    def limit(self, kind: int) -> Jet:
        """One of the rows that ask for no crank angle."""
        if kind < 5:
            return [self.n1 * self.n2, self.total * self.det, self.crank * self.total, *self.sides][kind]
        name = ("a", "c", "b")[(kind - 5) // 2]
        end = arb(self.question["links"][name][(kind - 5) % 2])
        size, unit = {
            "a": (self.crank * self.crank, self.total * self.total),
            "c": (self.nx * self.nx + self.ny * self.ny, self.det * self.det),
            "b": (self._coupler2(), Jet(arb(1), self.zero)),
        }[name]
        row = size - unit * (end * end)
        return row if kind % 2 else row * -1

    def _crank(self) -> Jet:
        return self.crank / self.total

    def _coupler2(self) -> Jet:
        radial, axial = self.n1 / self.det - self._crank(), self.ny / self.det * self.sa + self.g * self.ca - self.f
        return radial * radial + axial * axial

    def _vectors(self, theta: float) -> tuple[Jet, list[Jet], list[Jet], list[Jet], Jet]:
        """Discriminant; crank pin with its two derivatives; rocker length."""
        a, b2 = self._crank(), self._coupler2()
        c = ((self.nx * self.nx + self.ny * self.ny) / (self.det * self.det)).root()
        v, u = (self.phi1 + Jet(arb(theta), self.zero)).sine_cosine()
        zero = Jet(arb(0), self.zero)
        pin = [a * u, self.f * self.sa + a * self.ca * v, self.f * self.ca - a * self.sa * v]
        first = [a * v * -1, a * self.ca * u, a * self.sa * u * -1]
        second = [pin[0] * -1, self.f * self.sa - pin[1], self.f * self.ca - pin[2]]
        x, y, z = self.e - pin[0], pin[1], self.g - pin[2]
        w = (c * c - b2 + x * x + y * y + z * z) / (c * 2)
        delta = x * x + y * y - w * w
        self._w, self._pin, self._zero = w, pin, zero
        return delta, pin, first, second, c

    def pressure(self, theta: float) -> Jet:
        """Discriminant over its least allowed value."""
        delta = self._vectors(theta)[0]
        return delta - self._coupler2() * arb(self.question["cos2"])

    def objective(self, theta: float) -> Jet:
        """psi'' from  d . d' = 0, d = C - B."""
        delta, pin, first, second, c = self._vectors(theta)
        x, y, t = self.e - pin[0], pin[1], delta.root() * self.branch
        r = x * x + y * y
        cos, sin = (x * self._w + y * t) / r * -1, (y * self._w - x * t) / r
        ball = [self.e + c * cos, c * sin, self.g]
        d = [p - q for p, q in zip(ball, pin, strict=True)]
        turn, inward = [c * sin * -1, c * cos, self._zero], [c * cos * -1, c * sin * -1, self._zero]
        p = _dot(d, first) / _dot(d, turn)
        rate = [turn[k] * p - first[k] for k in range(3)]
        rest = [inward[k] * p * p - second[k] for k in range(3)]
        return (_dot(rate, rate) + _dot(d, rest)) / _dot(d, turn) * -1

    def row(self, kind: int, theta: float) -> Jet:
        """A row by its number in the certificate."""
        if kind == 15:
            return self.pressure(theta)
        if kind >= 16:
            return self.objective(theta) * (1 if kind == 16 else -1)
        return self.limit(kind)


def _combined(question: dict[str, Any], leaf: dict[str, Any], place: list[Any]) -> Jet:
    rows = Rows(question, place)
    total = Jet(arb(0), rows.zero)
    for kind, theta, factor in zip(leaf["kinds"], leaf["theta"], leaf["factors"], strict=True):
        total = total + rows.row(kind, theta) * arb(factor)
    return total


def _holds(question: dict[str, Any], leaf: dict[str, Any], low: list[float], high: list[float], deep: int) -> bool:
    """Whether the claim of a leaf holds on a part of it."""
    centre = [0.5 * (p + q) for p, q in zip(low, high, strict=True)]
    whole = [arb(p).union(arb(q)) for p, q in zip(low, high, strict=True)]
    over = _combined(question, leaf, whole)
    bound = _combined(question, leaf, [arb(x) for x in centre]).value
    for slope, ball, x in zip(over.slopes, whole, centre, strict=True):
        bound += slope * (ball - arb(x))
    least = arb(0) if leaf["outcome"] == "empty" else arb(question["target"])
    if any(claim > least or (claim >= least and leaf["outcome"] == "bound") for claim in (bound, over.value)):
        return True
    if deep == 0:
        return False
    # The side whose slope is known worst; where the box is too wide for slopes, the widest in terms of the space.
    known = all(slope.is_finite() for slope in over.slopes)
    space = [q - p for p, q in zip(question["low"], question["high"], strict=True)]
    costs = [float(slope.rad()) if known else 1.0 / width for slope, width in zip(over.slopes, space, strict=True)]
    widest = max(range(len(low)), key=lambda k: (high[k] - low[k]) * costs[k])
    left, right = list(high), list(low)
    left[widest] = right[widest] = centre[widest]
    return _holds(question, leaf, low, left, deep - 1) and _holds(question, leaf, right, high, deep - 1)


def refuted(path: Path, deepest: int = DEEPEST) -> tuple[int, int]:
    """Boxes that were checked, and those whose claim could not be confirmed.

    Parameters
    ----------
    path : a certificate
    deepest : halvings of a box before it counts as refuted
    """
    table = pq.read_table(path)
    question = json.loads(table.schema.metadata[b"question"])
    leaves = table.to_pylist()
    checked = wrong = 0
    for leaf in leaves:
        assert leaf["outcome"] in ("bound", "empty")
        # Weights of the objective may not add up to more than 1, and those of limits are not positive.
        weights = [Fraction(w) for w, kind in zip(leaf["factors"], leaf["kinds"], strict=True) if kind >= 16]
        rest = [w for w, kind in zip(leaf["factors"], leaf["kinds"], strict=True) if kind < 16]
        fair = sum(weights) <= 1 and all(w >= 0 for w in weights) and all(w <= 0 for w in rest)
        fair = fair and (leaf["outcome"] == "bound" or not weights)
        low = [leaf[f"{name}_low"] for name in question["free"]]
        high = [leaf[f"{name}_high"] for name in question["free"]]
        checked += 1
        wrong += not (fair and _holds(question, leaf, low, high, deepest))
    return checked, wrong


def covers(path: Path) -> bool:
    """Whether the boxes of a certificate tile the space: they are what halving it again and again leaves."""
    table = pq.read_table(path)
    question = json.loads(table.schema.metadata[b"question"])
    names = question["free"]
    boxes = [tuple((leaf[f"{n}_low"], leaf[f"{n}_high"]) for n in names) for leaf in table.to_pylist()]
    return _tiled(tuple(zip(question["low"], question["high"], strict=True)), boxes)


def _tiled(whole: tuple[tuple[float, float], ...], boxes: list[tuple[tuple[float, float], ...]]) -> bool:
    if len(boxes) <= 1:
        return boxes == [whole]
    for k, (low, high) in enumerate(whole):
        middle = 0.5 * (low + high)
        left = [box for box in boxes if box[k][1] <= middle]
        right = [box for box in boxes if box[k][0] >= middle]
        if len(left) + len(right) == len(boxes) and left and right:
            halves = ((*whole[:k], end, *whole[k + 1 :]) for end in ((low, middle), (middle, high)))
            return all(_tiled(half, part) for half, part in zip(halves, (left, right), strict=True))
    return False
