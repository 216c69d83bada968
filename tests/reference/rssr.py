"""The spatial crank-rocker from its joints alone, slowly: 50 digits, root finding on the distance of the two balls."""

from __future__ import annotations

import mpmath as mp

DIGITS = 50


class Linkage:
    """One design; lengths and alpha are taken as exact numbers."""

    def __init__(self, a, b, c, e, f, g, alpha, branch):
        self.a, self.b, self.c, self.e, self.f, self.g = (mp.mpf(float(x)) for x in (a, b, c, e, f, g))
        self.sin, self.cos = mp.sin(mp.mpf(float(alpha))), mp.cos(mp.mpf(float(alpha)))
        self.branch = int(branch)

    def pin(self, phi):
        """Crank pin B: centre on the crank axis, then a turn about that axis."""
        axis = mp.matrix([0, self.sin, self.cos])
        across = mp.matrix([0, self.cos, -self.sin])
        return self.f * axis + self.a * (mp.cos(phi) * mp.matrix([1, 0, 0]) + mp.sin(phi) * across)

    def ball(self, psi):
        """Rocker ball C."""
        return mp.matrix([self.e + self.c * mp.cos(psi), self.c * mp.sin(psi), self.g])

    def gap(self, phi, psi):
        """|BC|^2 - b^2."""
        d = self.ball(psi) - self.pin(phi)
        return (d.T * d)[0] - self.b**2

    def slope(self, phi, psi):
        """Half the derivative of the gap by psi over c: (C - B) times the rocker's tangent."""
        d = self.ball(psi) - self.pin(phi)
        return -d[0] * mp.sin(psi) + d[1] * mp.cos(psi)

    def psi(self, phi, around=None):
        """Rocker angle of the branch; near ``around`` if that is given (a value of the same motion)."""
        if around is not None:
            return mp.findroot(lambda psi: self.gap(phi, psi), around)
        n = 360
        angles = [mp.mpf(2) * mp.pi * k / n for k in range(n + 1)]
        gaps = [self.gap(phi, x) for x in angles]
        for k in range(n):
            if gaps[k] * gaps[k + 1] <= 0 and (gaps[k + 1] - gaps[k]) * self.branch > 0:
                return mp.findroot(lambda psi: self.gap(phi, psi), (angles[k], angles[k + 1]), solver="anderson")
        return None

    def derivatives(self, phi, count):
        """psi and its derivatives by phi up to ``count``, by numerical differentiation at high precision."""
        start = self.psi(phi)
        return mp.taylor(lambda x: self.psi(x, start), phi, count, h=mp.mpf(10) ** -12), start

    def cosine_of_pressure_angle(self, phi, psi):
        """Between coupler and the rocker's tangent."""
        return abs(self.slope(phi, psi)) / self.b

    def discriminant(self, phi):
        """A1^2 + A2^2 - A3^2: squared amplitude of the gap over psi less the square of its constant, from three psi."""
        at = [self.gap(phi, x) for x in (mp.mpf(0), mp.pi / 2, mp.pi)]
        constant = (at[0] + at[2]) / 2
        return ((at[0] - at[2]) / 2) ** 2 + (at[1] - constant) ** 2 - constant**2

    def margin(self):
        """Least discriminant over 4 b^2 c^2, by scanning and golden section from every low sample."""
        n = 64
        values = [self.discriminant(2 * mp.pi * k / n) for k in range(n)]
        lows = [k for k in range(n) if values[k] <= values[k - 1] and values[k] <= values[(k + 1) % n]]
        least = min(golden_section(self.discriminant, 2 * mp.pi * (k - 1) / n, 2 * mp.pi * (k + 1) / n) for k in lows)
        return least / (2 * self.b * self.c) ** 2


def golden_section(function, lo, hi):
    """Least value of a function with one minimum between lo and hi; to 1e-24 of its curvature."""
    ratio = (mp.sqrt(5) - 1) / 2
    x, y = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
    fx, fy = function(x), function(y)
    for _ in range(55):
        if fx < fy:
            hi, y, fy = y, x, fx
            x = hi - ratio * (hi - lo)
            fx = function(x)
        else:
            lo, x, fx = x, y, fy
            y = lo + ratio * (hi - lo)
            fy = function(y)
    return min(fx, fy)
