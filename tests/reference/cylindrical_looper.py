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


def pins(design, phi):
    """Pins of both cranks in the frame of the looper; the shaft's foot is the origin of crank 2's own frame."""
    a1, _, _, e1, f1, g1, alpha1, _, a2, _, e2, f2, alpha2, offset2 = design[:14]
    x, y, z = crank_pin(a2, f2, alpha2, phi + offset2)
    # the frame of crank 2 has its y along the shaft, which stands at x = e2 there
    sideways, third = turned(UP, design[21], vector(1, 0, 0)), turned(UP, design[21], vector(0, -1, 0))
    return crank_pin(a1, f1, alpha1, phi), vector(e1, 0, g1) + sideways * (x - e2) + third * z + UP * y


def gaps(design, phi):
    """What both couplers' squares lack, as functions of the shaft's angle and place: points and distances alone."""
    _, b1, c1, e1, _, g1, _, _, _, b2, _, _, _, _, _, slides = design[:16]
    d2, beta2 = design[19:21]
    foot = vector(e1, 0, g1)
    pin1, pin2 = pins(design, phi)

    def first(psi, s):
        return length(foot + UP * (s * slides) + turned(UP, psi, vector(c1, 0, 0)) - pin1) ** 2 - b1**2

    def second(psi, s):
        return length(foot + UP * s + turned(UP, psi + beta2, vector(d2, 0, 0)) - pin2) ** 2 - b2**2

    return first, second


def coupled(design, phi, near):
    """Angle and place of the shaft and the working point of a looper whose second ball is off the axis."""
    first, second = gaps(design, phi)
    root = mp.findroot(lambda psi, s: (first(psi, s), second(psi, s)), (near["psi"], near["s"]), tol=mp.mpf(10) ** -160)
    point = vector(design[3], 0, design[5]) + UP * root[1] + turned(UP, root[0], vector(*design[16:19]))
    return {"psi": root[0], "s": root[1], "x_p": point[0], "y_p": point[1], "z_p": point[2]}


def position(design, phi, near=None):
    """Angle and place of the shaft and the working point, or None where the links do not reach."""
    a1, b1, c1, e1, f1, g1, alpha1, branch1, a2, b2, e2, f2, alpha2, offset2, branch2, slides, *tip = design[:19]
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


def outputs(design, phi, near=None):
    """psi, s and the working point with three derivatives each, or None; with ``near`` of the coupled looper there."""
    with mp.workdps(100):
        numbers = exact(design)
        if near is not None:
            return derivatives(lambda x, start: coupled(numbers, x, start or near), mp.mpf(float(phi)))
        return derivatives(lambda x, near: position(numbers, x, near), mp.mpf(float(phi)))
