"""The rows of a certificate in ball arithmetic with exact derivatives, written down from the vectors of the joints.

Nothing here comes from kernels; :mod:`tests.reference.proof` checks certificates with it.
"""

from __future__ import annotations

from typing import Any

import flint
from flint import arb

OBJECTIVE = (16, 17)  # kinds of rows that the target bounds; all others are limits
ANY_CRANK = (20, 21, 22, 23)  # kinds of rows with a crank length of their own
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


def _coordinates(question: dict[str, Any], place: list[Any]) -> dict[str, Jet]:
    """Every coordinate with its derivatives by the free ones; a crank length of its own after them, if there is one."""
    n = len(place)
    units = [[arb(int(j == k)) for j in range(n)] for k in range(n)]
    x = {
        name: Jet(arb(value), [arb(0)] * n)
        for name, value in zip(question["coordinates"], question["given"], strict=True)
    }
    names = [*question["free"], "any crank"]
    return x | {name: Jet(ball, unit) for name, ball, unit in zip(names, place, units, strict=False)}


class Rows:
    """The rows of a certificate over one box or at one design, which axes e, f, g, alpha or the rocker give."""

    def __init__(self, question: dict[str, Any], place: list[Any]) -> None:
        x = _coordinates(question, place)
        self.x, self.question, self.zero, self.branch = x, question, [arb(0)] * len(place), arb(question["branch"])
        self.f, self.phi1 = x["f"], x["phi_ext"]
        self.sa, self.ca = x["alpha"].sine_cosine()
        s, c = x["swing"].sine_cosine()
        v1, u1 = x["phi_ext"].sine_cosine()
        v2, u2 = (x["phi_ext"] + x["phi0"]).sine_cosine()
        self.by_rocker = "psi_ext" in x
        if self.by_rocker:
            nx2, ny2 = self._from_rocker(u1, v1, u2, v2)
        else:
            nx2, ny2 = self._from_axes(u1, v1, u2, v2, s, c)
        self.total = self.n1 + self.n2
        # |BC|^2 is (rho - a)^2 + ... and (rho + a)^2 + ...: their difference is linear in the crank.
        self.crank = self.e * (self.nx - nx2) - self.f * self.sa * (self.ny - ny2)
        self.sides = [self._side(u1, v1, self.nx, self.ny), self._side(u2, v2, nx2, ny2)]

    def _from_rocker(self, u1: Jet, v1: Jet, u2: Jet, v2: Jet) -> tuple[Jet, Jet]:
        """Solve both limit positions, (e + X1, ca Y1 - h) = rho1 (u1, v1), (e + X2, ca Y2 - h) = -rho2 (u2, v2).

        Their difference gives rho1 and rho2 by Cramer's rule, the first of them e and h then.
        """
        sine1, cosine1 = self.x["psi_ext"].sine_cosine()
        sine2, cosine2 = (self.x["psi_ext"] + self.x["swing"]).sine_cosine()
        length = self.x["c"]
        dx, dy = length * (cosine1 - cosine2), length * (sine1 - sine2) * self.ca
        turned, _ = self.x["phi0"].sine_cosine()
        self.n1, self.n2 = (dx * v2 - dy * u2) / turned, (dy * u1 - dx * v1) / turned
        self.nx, self.ny, self.det = length * cosine1, length * sine1, Jet(arb(1), self.zero)
        self.e, self.g = self.n1 * u1 - self.nx, (self.ca * self.ny - self.n1 * v1) / self.sa
        return length * cosine2, length * sine2

    def _from_axes(self, u1: Jet, v1: Jet, u2: Jet, v2: Jet, s: Jet, c: Jet) -> tuple[Jet, Jet]:
        self.e, self.g = self.x["e"], self.x["g"]
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
        return nx2, ny2

    def _side(self, u: Jet, v: Jet, x: Jet, y: Jet) -> Jet:
        across = self.e * self.total - self.crank * u
        along = self.f * self.sa * self.total + self.crank * self.ca * v
        return (across * y + along * x) * -self.branch

    def limit(self, kind: int) -> Jet:
        """One of the rows that ask for no crank angle."""
        if kind < 5:
            from_axes = [self.n1 * self.n2, self.total * self.det, self.crank * self.total, *self.sides]
            return [self.n1, self.n2, self.crank, *self.sides][kind] if self.by_rocker else from_axes[kind]
        name = list(self.question["links"])[(kind - 5) // 2]
        end, one = arb(self.question["links"][name][(kind - 5) % 2]), Jet(arb(1), self.zero)
        if name == "b":
            row = self._coupler2() - one * (end * end)
        elif self.by_rocker:
            size, unit = {"a": (self.crank, self.total), "e": (self.e, one), "g": (self.g, one)}[name]
            row = size - unit * end
        else:
            size, unit = {
                "a": (self.crank * self.crank, self.total * self.total),
                "c": (self.nx * self.nx + self.ny * self.ny, self.det * self.det),
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

    def passed(self, theta: float, angle: Any, any_crank: bool) -> Jet:
        """Half of |BC|^2 at a crank angle and a rocker angle after the extended position, less half of b^2, with the
        sign of the branch; times rho1 + rho2, or for a crank length of its own.
        """
        u, v = (self.phi1 + Jet(arb(theta), self.zero)).sine_cosine()[::-1]
        u1, v1 = self.phi1.sine_cosine()[::-1]
        s, c = Jet(arb(angle), self.zero).sine_cosine()
        first = [self.e * self.det + self.nx, self.ny, self.g * self.det]
        ball = [self.e * self.det + self.nx * c - self.ny * s, self.ny * c + self.nx * s, self.g * self.det]
        radial, radial1 = [u, self.ca * v, self.sa * v * -1], [u1, self.ca * v1, self.sa * v1 * -1]
        # B = a radial + f axis has one length: what changes of |C - B|^2/2 is (|C|^2)/2 and the product of B and C.
        # Of |C|^2 only e X changes.
        along, axial = _dot(ball, radial) - _dot(first, radial1), (ball[1] - first[1]) * self.sa * self.f
        squares = self.e * (ball[0] - first[0])
        if any_crank:
            return (squares - axial - self.x["any crank"] * along) * self.branch
        return (self.total * (squares - axial) - self.crank * along) * self.branch

    def row(self, kind: int, theta: float, sides: tuple[Any, Any]) -> Jet:
        """A row by its number in the certificate; ``sides`` of the tube are known where the row is one of them."""
        if kind == 15:
            return self.pressure(theta)
        if kind in OBJECTIVE:
            return self.objective(theta) * (1 if kind == 16 else -1)
        if kind in (18, 20):
            return self.passed(theta, sides[1], kind == 20)
        if kind in (19, 21):
            return self.passed(theta, sides[0], kind == 21) * -1
        if kind in (22, 23):
            return (self.x["any crank"] * self.total - self.crank) * (1 if kind == 22 else -1)
        return self.limit(kind)
