"""Points, axes and links in space, slowly and in the open: 50 digits, rotation matrices, root finding on distances."""

from __future__ import annotations

import mpmath as mp

DIGITS = 50


def exact(numbers):
    """The given doubles as exact numbers."""
    return [mp.mpf(float(x)) for x in numbers]


def vector(*components):
    return mp.matrix([mp.mpf(x) for x in components])


def dot(a, b):
    return (a.T * b)[0]


def cross(a, b):
    return vector(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return mp.sqrt(dot(a, a))


def turned(axis, angle, a):
    """The vector a turned about a unit axis, by Rodrigues' formula."""
    return a * mp.cos(angle) + cross(axis, a) * mp.sin(angle) + axis * (dot(axis, a) * (1 - mp.cos(angle)))


def crank_pin(a, f, alpha, phi):
    """Pin of a crank whose axis leaves the origin in the direction (0, sin alpha, cos alpha), its plane at f."""
    axis = vector(0, mp.sin(alpha), mp.cos(alpha))
    return axis * f + turned(axis, phi, vector(a, 0, 0))


def root(function, slope, near=None, samples=240):
    """The angle where ``function`` is zero and rises (slope +1) or falls (-1); the one near ``near`` if that is given.

    None if there is none.
    """
    if near is not None:
        return mp.findroot(function, near, tol=mp.mpf(10) ** -90)
    step = 2 * mp.pi / samples
    angles = [-mp.pi + step * (k + mp.mpf("0.37")) for k in range(samples + 1)]
    values = [function(x) for x in angles]
    for k in range(samples):
        if values[k] * values[k + 1] <= 0 and (values[k + 1] - values[k]) * slope > 0:
            return mp.findroot(function, (angles[k], angles[k + 1]), solver="anderson", tol=mp.mpf(10) ** -90)
    return None


def derivatives(outputs, phi, count=3, step="1e-10"):
    """``outputs(phi, near)`` gives a dict of numbers; each with its derivatives by phi, prefixed d, d2, d3."""
    start = outputs(phi, None)
    if start is None:
        return None
    step = mp.mpf(step)
    stencil = {k: outputs(phi + k * step, start) for k in range(-4, 5)}
    # central differences of eighth order: what is left out is below 1e-40 where nothing changes within 1e-5 rad
    weights = {
        1: {1: mp.mpf(4) / 5, 2: -mp.mpf(1) / 5, 3: mp.mpf(4) / 105, 4: -mp.mpf(1) / 280},
        2: {0: -mp.mpf(205) / 72, 1: mp.mpf(8) / 5, 2: -mp.mpf(1) / 5, 3: mp.mpf(8) / 315, 4: -mp.mpf(1) / 560},
        3: {1: -mp.mpf(61) / 30, 2: mp.mpf(169) / 120, 3: -mp.mpf(3) / 10, 4: mp.mpf(7) / 240},
    }
    result = dict(start)
    for name in start:
        for order in range(1, count + 1):
            total = mp.mpf(0)
            for k, weight in weights[order].items():
                mirror = stencil[-k][name] * (-1) ** order if k else 0
                total += weight * (stencil[k][name] + mirror)
            result[f"d{order if order > 1 else ''}{name}"] = total / step**order
    return result
