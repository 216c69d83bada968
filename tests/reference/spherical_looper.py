"""The looper on a sphere from its joints alone: rotations by Rodrigues, both angles by root finding on distances."""

from __future__ import annotations

import mpmath as mp

from tests.reference.space import crank_pin, derivatives, exact, length, root, turned, vector

UP = vector(0, 0, 1)


def axis_of(delta, gamma):
    """The looper's axis at psi = 0."""
    return vector(mp.sin(delta) * mp.cos(gamma), mp.sin(delta) * mp.sin(gamma), mp.cos(delta))


def second_pin(a, centre, theta, beta, angle):
    """Ball of crank 2: the crank x turned about y by theta, then about z by beta, its shaft as z."""
    shaft = turned(UP, beta, turned(vector(0, 1, 0), theta, UP))
    zero = turned(UP, beta, turned(vector(0, 1, 0), theta, vector(1, 0, 0)))
    return centre + turned(shaft, angle, zero * a)


def position(design, phi, near=None):
    """Both angles and the working point, or None where the links do not reach."""
    (a1, b1, c1, e1, f1, g1, alpha1, branch1, o, delta, gamma, *rest) = design
    ball, tip = vector(*rest[0:3]), vector(*rest[3:6])
    a2, b2, x2, y2, z2, theta2, beta2, offset2, branch2 = rest[6:]
    pin1 = crank_pin(a1, f1, alpha1, phi)
    pin2 = second_pin(a2, vector(x2, y2, z2), theta2, beta2, phi + offset2)
    centre, axis = vector(e1, 0, o), axis_of(delta, gamma)

    def first(psi):
        return length(vector(e1, 0, g1) + turned(UP, psi, vector(c1, 0, 0)) - pin1) ** 2 - b1**2

    psi = root(first, branch1, near and near["psi"])
    if psi is None:
        return None

    def carried(chi, a):
        return centre + turned(UP, psi, turned(axis, chi, a))

    chi = root(lambda x: length(carried(x, ball) - pin2) ** 2 - b2**2, branch2, near and near["chi"])
    if chi is None:
        return None
    point = carried(chi, tip)
    return {"psi": psi, "chi": chi, "x_p": point[0], "y_p": point[1], "z_p": point[2]}


def outputs(design, phi):
    """psi, chi and the working point with three derivatives each, or None."""
    with mp.workdps(100):
        numbers = exact(design)
        return derivatives(lambda x, near: position(numbers, x, near), mp.mpf(float(phi)))
