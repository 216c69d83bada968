"""Rack on three leads: rocker pin and two eccentrics, each with a link to the rack; (15)-(17) of docs/feed.md.

The three closures are solved by Newton's method for the tooth and the rack's angle.  A design starts from its given
guess at phi = 0 and goes round in NODES steps; a pose starts from the node before it.  So every pose of a design lies
on the assembly that the guess chooses, whatever other poses are asked for.

The guess chooses the assembly as follows: links of the lengths that fit the guess are changed to their own lengths,
without passing a position in which the leads lock.  Newton's method alone may wander before it converges to some
assembly, and the rounding of the lengths would decide to which.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import unit_near
from kernels.families.feed.closure import Driven, eccentric, rocker_pin
from kernels.jit import inline, kernel
from kernels.linkage.driven_ball import reduce_crank
from kernels.types import EPS, TWO_PI, Array, Status

NODES = 180
_MOST_STEPS = 40
_SMALL = 1e-9  # steps of Newton's method from here on are quadratically short, or rounding
# From the guess to the links' own lengths: steps of Newton's method in all and at one stage, which ends when a step is
# as small as CLOSE, and the least share of the way that one stage may be.
_MOST_IN_ALL, _MOST_OF_STAGE, _CLOSE, _LEAST_SHARE = 400, 12, 1e-3, 2.0**-16

_LENGTHS = (0, 1, 2, 3, 4, 5, 7, 9, 10, 11, 13, 14, 15, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27)


@inline
def _scaled(designs: Array, i: int, d: Array) -> tuple[float, bool]:
    """Columns of one design in units of a power of two near its greatest length; the unit, and whether valid.

    Newton's steps are measured against 1, so the greatest length sets the scale, not some link that may be tiny.
    """
    greatest = 0.0
    for k in _LENGTHS:
        greatest = max(greatest, abs(designs[i, k].real))
    unit, per_unit = unit_near(greatest if greatest < math.inf else 1.0)
    good = True
    for k in range(designs.shape[1]):
        d[k] = designs[i, k]
        good = good and abs(designs[i, k].real) < math.inf
    for k in _LENGTHS:
        d[k] = designs[i, k] * per_unit
        good = good and abs(d[k].real) < 1e70
    for k in (0, 1, 2, 23, 24, 25):
        good = good and d[k].real > 0.0
    for k in (6, 8, 12, 16, 28):
        good = good and abs(d[k].real) < 1e5
    return unit, good and d[29].real * d[29].real == 1.0


@inline
def _leads(d: Array, u: Any, v: Any) -> tuple[Driven, Driven, Driven, int]:
    """Three driven points with their derivatives, and the status of the rocker."""
    rocker, pin = rocker_pin(reduce_crank(d, 1.0, d[29].real), d[7], np.cos(d[8]), np.sin(d[8]), u, v)
    second = eccentric(d[9], d[10], d[11], np.cos(d[12]), np.sin(d[12]), u, v)
    third = eccentric(d[13], d[14], d[15], np.cos(d[16]), np.sin(d[16]), u, v)
    return pin, second, third, rocker.status


@inline
def _solved(m: Any, a: Any, b: Any, c: Any) -> tuple[Any, Any, Any, Any]:
    """Solve a 3 x 3 system by Cramer's rule; also its determinant.  ``m`` holds the rows."""
    m0, m1, m2, m3, m4, m5, m6, m7, m8 = m
    c0, c1, c2 = m4 * m8 - m5 * m7, m5 * m6 - m3 * m8, m3 * m7 - m4 * m6
    det = m0 * c0 + m1 * c1 + m2 * c2
    x = a * c0 + b * (m2 * m7 - m1 * m8) + c * (m1 * m5 - m2 * m4)
    y = a * c1 + b * (m0 * m8 - m2 * m6) + c * (m2 * m3 - m0 * m5)
    z = a * c2 + b * (m1 * m6 - m0 * m7) + c * (m0 * m4 - m1 * m3)
    return x / det, y / det, z / det, det


@inline
def _links(d: Array, leads: tuple[Driven, Driven, Driven], x: Any, y: Any, chi: Any) -> tuple[Any, Any, Any]:
    """Rows of the Jacobian, closures |link|^2 - q^2 (halved) and arms on the rack at (x, y, chi)."""
    one, two, three = leads
    cos, sin = np.cos(chi), np.sin(chi)
    g1x, g1y = cos * d[17] - sin * d[18], sin * d[17] + cos * d[18]
    g2x, g2y = cos * d[19] - sin * d[20], sin * d[19] + cos * d[20]
    g3x, g3y = cos * d[21] - sin * d[22], sin * d[21] + cos * d[22]
    d1x, d1y = x + g1x - one.x, y + g1y - one.y
    d2x, d2y = x + g2x - two.x, y + g2y - two.y
    d3x, d3y = x + g3x - three.x, y + g3y - three.y
    rows = (
        d1x, d1y, d1y * g1x - d1x * g1y, d2x, d2y, d2y * g2x - d2x * g2y, d3x, d3y, d3y * g3x - d3x * g3y,
    )  # fmt: skip
    closures = (
        0.5 * (d1x * d1x + d1y * d1y - d[23] * d[23]), 0.5 * (d2x * d2x + d2y * d2y - d[24] * d[24]),
        0.5 * (d3x * d3x + d3y * d3y - d[25] * d[25]),
    )  # fmt: skip
    return rows, closures, (g1x, g1y, g2x, g2y, g3x, g3y)


@inline
def _newton(d: Array, u: float, v: float, x: float, y: float, chi: float) -> tuple[float, float, float, float, int]:
    """Find tooth and rack angle at one crank angle from a start nearby; also the determinant and the status."""
    one, two, three, code = _leads(d, u, v)
    det = math.nan
    if code != st.OK:
        return x, y, chi, det, code
    before = math.inf
    for _ in range(_MOST_STEPS):
        rows, f, _ = _links(d, (one, two, three), x, y, chi)
        dx, dy, dchi, det = _solved(rows, f[0], f[1], f[2])
        size = abs(dx) + abs(dy) + abs(dchi)
        # written so that a nan counts too: the determinant was zero
        if not size < math.inf:
            return x, y, chi, det, st.SINGULAR
        # Steps that grow go across a locking position onto another assembly.
        if size > before and size > _SMALL:
            return x, y, chi, det, st.SINGULAR
        x, y, chi = x - dx, y - dy, chi - dchi
        # Steps of a few roundings that no longer shrink: rounding of the closures allows no better
        if size <= 4.0 * EPS or (size <= _SMALL and size >= 0.5 * before):
            return x, y, chi, det, st.OK
        before = size
    return x, y, chi, det, st.NOT_CONVERGED


@inline
def _begun(d: Array, x: float, y: float, chi: float) -> tuple[float, float, float, int]:
    """Find tooth and rack angle at phi = 0 on the assembly that a guess chooses.

    Half the squares of the links' lengths go from those of the guess to their own in stages, so short that Newton's
    steps keep halving; a good guess takes one stage.  NOT_CONVERGED where the leads lock on the way.
    """
    one, two, three, code = _leads(d, 1.0, 0.0)
    if code != st.OK:
        return x, y, chi, code
    rows, f, _ = _links(d, (one, two, three), x, y, chi)
    a, b, c = f
    _, _, _, det = _solved(rows, a, b, c)
    positive, left, share, count = det > 0.0, 1.0, 1.0, 0
    while left > 0.0 and count < _MOST_IN_ALL:
        goal = max(left - share, 0.0)
        nx, ny, nchi, before, near = x, y, chi, math.inf, False
        for _ in range(_MOST_OF_STAGE):
            count += 1
            rows, f, _ = _links(d, (one, two, three), nx, ny, nchi)
            dx, dy, dchi, det = _solved(rows, f[0] - goal * a, f[1] - goal * b, f[2] - goal * c)
            size = abs(dx) + abs(dy) + abs(dchi)
            # written so that a nan ends it too
            if (det > 0.0) != positive or not (size <= 0.5 * before or size <= _SMALL):
                break
            nx, ny, nchi, before = nx - dx, ny - dy, nchi - dchi, size
            if size <= (_CLOSE if goal > 0.0 else _SMALL):
                near = True
                break
        if near:
            x, y, chi, left, share = nx, ny, nchi, goal, 2.0 * share
        else:
            share *= 0.5
            if share < _LEAST_SHARE:
                break
    return x, y, chi, st.OK if left <= 0.0 else st.NOT_CONVERGED


@inline
def _rates(d: Array, leads: tuple[Driven, Driven, Driven], x: Any, y: Any, chi: Any) -> Any:
    """First and second derivatives of tooth and rack angle by phi, and the determinant; (16), (17)."""
    rows, _, arms = _links(d, leads, x, y, chi)
    one, two, three = leads
    first = (
        rows[0] * one.x1 + rows[1] * one.y1, rows[3] * two.x1 + rows[4] * two.y1,
        rows[6] * three.x1 + rows[7] * three.y1,
    )  # fmt: skip
    x1, y1, c1, det = _solved(rows, first[0], first[1], first[2])
    a1, b1 = x1 - c1 * arms[1] - one.x1, y1 + c1 * arms[0] - one.y1
    a2, b2 = x1 - c1 * arms[3] - two.x1, y1 + c1 * arms[2] - two.y1
    a3, b3 = x1 - c1 * arms[5] - three.x1, y1 + c1 * arms[4] - three.y1
    r1 = rows[0] * (one.x2 + c1 * c1 * arms[0]) + rows[1] * (one.y2 + c1 * c1 * arms[1]) - a1 * a1 - b1 * b1
    r2 = rows[3] * (two.x2 + c1 * c1 * arms[2]) + rows[4] * (two.y2 + c1 * c1 * arms[3]) - a2 * a2 - b2 * b2
    r3 = rows[6] * (three.x2 + c1 * c1 * arms[4]) + rows[7] * (three.y2 + c1 * c1 * arms[5]) - a3 * a3 - b3 * b3
    x2, y2, c2, _ = _solved(rows, r1, r2, r3)
    return x1, y1, c1, x2, y2, c2, det


@inline
def _round(d: Array, nodes: Array) -> int:
    """Solve the nodes round the turn from the given start; return the determinant's sign.

    ``nodes`` (NODES, 4) get x, y, chi and the status.
    """
    x, y, chi, code = _begun(d, d[26].real, d[27].real, d[28].real)
    sign = 0
    for k in range(NODES):
        if code == st.OK:
            angle = k * (TWO_PI / NODES)
            x, y, chi, det, code = _newton(d, math.cos(angle), math.sin(angle), x, y, chi)
            here = 1 if det > 0.0 else -1
            sign = here if k == 0 else sign
            # Another sign: the path went through a position in which the leads lock, onto another assembly.
            if code == st.OK and here != sign:
                code = st.SINGULAR
        nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3] = x, y, chi, code
    return sign


@kernel
def triad_poses(designs: Array, phi: Array, status: Status, outputs: Array) -> None:
    """Path of the tooth and angle of a rack on three leads, with two derivatives; (15)-(17) of docs/feed.md.

    Parameters
    ----------
    designs : (n, 30) columns as `TRIAD_PARAMETERS` of sweep/families/feed.py
    phi : (n, m), or (1, m) shared by all designs [rad]
    status : (n, m) out; OK, NOT_ASSEMBLED or DEAD_POINT (rocker), SINGULAR (the leads lock here or before),
        NOT_CONVERGED (no assembly near the start) or INVALID_INPUT; where it is not OK all outputs are nan
    outputs : (10, n, m) out in the order of `TRIAD_OUTPUTS` of sweep/families/feed.py [length, rad], the
        determinant in length^4
    """
    plain = designs.real
    d, flat = np.empty_like(designs[0]), np.empty(designs.shape[1])
    nodes = np.empty((NODES, 4))
    for i in range(designs.shape[0]):
        unit, valid = _scaled(designs, i, d)
        _scaled(plain, i, flat)
        sign = _round(flat, nodes) if valid else 0
        row = i if phi.shape[0] > 1 else 0
        for j in range(phi.shape[1]):
            angle = phi[row, j].real % TWO_PI
            code = st.OK if valid and abs(phi[row, j].real) < 1e5 else st.INVALID_INPUT
            x, y, chi = 0.0, 0.0, 0.0
            if code == st.OK:
                k = min(int(angle / TWO_PI * NODES), NODES - 1)
                code = int(nodes[k, 3])
                if code == st.OK:
                    u, v = math.cos(angle), math.sin(angle)
                    x, y, chi, det, code = _newton(flat, u, v, nodes[k, 0], nodes[k, 1], nodes[k, 2])
                    # from a node of the right assembly onto another one: a locking position lies between them
                    if code == st.OK and (det > 0.0) != (sign > 0):
                        code = st.SINGULAR
            status[i, j] = code
            if code != st.OK:
                for k in range(10):
                    outputs[k, i, j] = math.nan
                continue
            c, s = np.cos(phi[row, j] + 0.0 * d[0]), np.sin(phi[row, j] + 0.0 * d[0])
            one, two, three, _ = _leads(d, c, s)
            # One more step, in the type of the design: it carries the imaginary parts of the complex step exactly.
            rows, f, _ = _links(d, (one, two, three), x + 0.0 * c, y + 0.0 * c, chi + 0.0 * c)
            dx, dy, dchi, _ = _solved(rows, f[0], f[1], f[2])
            px, py, pchi = x - dx, y - dy, chi - dchi
            x1, y1, c1, x2, y2, c2, det_now = _rates(d, (one, two, three), px, py, pchi)
            values = (px * unit, py * unit, pchi, x1 * unit, y1 * unit, c1, x2 * unit, y2 * unit, c2, det_now * unit**4)
            for k in range(10):
                outputs[k, i, j] = values[k]
