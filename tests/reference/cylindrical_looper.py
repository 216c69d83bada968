"""The looper on a cylinder from its joints alone: angle and place of the shaft by root finding on distances."""

from __future__ import annotations

import mpmath as mp

from tests.reference.space import crank_pin, derivatives, exact, length, root, turned, vector

UP = vector(0, 0, 1)


def slide(a, b, e, f, alpha, branch, phi, near=None):
    """Place of the ball of the slider-crank on its line x = e, z = 0; None where the links do not reach."""
    pin = crank_pin(a, f, alpha, phi)

    def gap(s):
        return length(vector(e, s, 0) - pin) ** 2 - b**2

    if near is None:
        if gap(pin[1]) > 0:
            return None
        low, high = pin[1], pin[1] + branch * 2 * b
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) < 0 else (low, middle)
        near = (low + high) / 2
    return mp.findroot(gap, near, tol=mp.mpf(10) ** -90)


def position(design, phi, near=None):
    """Angle and place of the shaft and the working point, or None where the links do not reach."""
    a1, b1, c1, e1, f1, g1, alpha1, branch1, a2, b2, e2, f2, alpha2, offset2, branch2, slides, *tip = design
    s = slide(a2, b2, e2, f2, alpha2, branch2, phi + offset2, near and near["s"])
    if s is None:
        return None
    pin = crank_pin(a1, f1, alpha1, phi)
    foot = vector(e1, 0, g1)

    def gap(psi):
        return length(foot + UP * (s * slides) + turned(UP, psi, vector(c1, 0, 0)) - pin) ** 2 - b1**2

    psi = root(gap, branch1, near and near["psi"])
    if psi is None:
        return None
    point = foot + UP * s + turned(UP, psi, vector(*tip))
    return {"psi": psi, "s": s, "x_p": point[0], "y_p": point[1], "z_p": point[2]}


def outputs(design, phi):
    """psi, s and the working point with three derivatives each, or None."""
    with mp.workdps(100):
        numbers = exact(design)
        return derivatives(lambda x, near: position(numbers, x, near), mp.mpf(float(phi)))
