"""Rocker angle of the five-link at one crank angle, by Newton's method from that of a crank-rocker, or by a scan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor
from kernels.curves.arc_roots import MOST
from kernels.curves.polynomials import rotate
from kernels.families.five_link.closure import (
    NONE,
    ONE,
    Joint,
    all_roots,
    axial_reach,
    polished,
    reaches,
    residual_size,
    slope,
    solutions,
)
from kernels.jit import inline, kernel
from kernels.linkage.crank_closure import Reduced, discriminant_tolerance
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array

ROUNDS = 10  # of Newton's method; 3 to 5 are usual, and a pose that needs more is left to the scan
NEAR = 1e-5  # a step below this leaves 1e-10, and the two rounds that follow leave rounding only


@inline
def pose_terms(r: Reduced, u: Any, v: Any) -> tuple[Any, Any, Any]:
    """Return X, Y, W of the crank-rocker at (cos phi, sin phi)."""
    return r.e - u, r.y0 + r.ca * v, r.k0 - (r.k2 * u - r.k1 * v)


@kernel
def _newton(joint: Joint, x: float, y: float, w: float) -> tuple[bool, float, float]:
    """Find a root with dG5/dpsi > 0 by Newton's method: whether it converged, cosine and sine of the root; (3)."""
    square = x * x + y * y
    c, s = 0.0, 0.0
    # Start from crank-rockers whose coupler follows from the last angle, first a quarter turn off the crank pin.
    _, reach = axial_reach(joint, -x / math.sqrt(square))
    for _ in range(2):
        close = w - joint.shift - joint.share * math.sqrt(max(reach, 0.0))
        root = math.sqrt(max(square - close * close, 0.0))
        c, s = -(x * close + y * root), y * close - x * root
        length = math.sqrt(c * c + s * s)
        c, s = c / length, s / length
        _, reach = axial_reach(joint, s)
    for _ in range(ROUNDS):
        at = slope(joint, x, y, w, c, s)
        step = -at.value / at.first
        if not at.first > 0.0 or not abs(step) < 1e3:
            return False, c, s
        c, s = rotate(c, s, min(max(step, -0.5), 0.5))
        if abs(step) < NEAR:
            return True, c, s
    return False, c, s


@kernel
def _scanned(joint: Joint, x: float, y: float, w: float, noise: float, at: Array) -> tuple[int, float, float]:
    """Find the root of a branch and mode by a scan: status, cosine, sine; section "Assembly modes" of the page.

    Of the roots with dG5/dpsi > 0 it is the one with the mode-th largest (C - B) . k'.  ``at`` has 2 MOST numbers.
    """
    count = all_roots(joint, x, y, w, noise, at)
    found, touching = 0, math.nan
    for k in range(count):
        c, s = math.cos(at[k]), math.sin(at[k])
        here = slope(joint, x, y, w, c, s)
        # at a double root the slope is no larger than the noise of G5 alone makes it
        if here.first * here.first <= 4.0 * noise * abs(here.second):
            touching = at[k]
        if here.first > 0.0:
            at[MOST + found], at[found] = -(x * s + y * c), at[k]
            found += 1
    if found < joint.mode:
        if touching != touching or joint.mode > 1:
            return st.NOT_ASSEMBLED, math.nan, math.nan
        return st.DEAD_POINT, math.cos(touching), math.sin(touching)
    best = 0
    for _ in range(joint.mode):
        best = 0
        for k in range(found):
            if at[MOST + k] > at[MOST + best]:
                best = k
        at[MOST + best] -= 1e300 if joint.mode > 1 else 0.0
    return st.OK, math.cos(at[best]), math.sin(at[best])


@inline
def solve_plain(r: Reduced, joint: Joint, x: Any, y: Any, w: Any) -> tuple[int, Any, Any, Any]:
    """Status, minus cosine, minus sine and dG5/dpsi of a crank-rocker's closure: (2*) of docs/rssr.md."""
    square = x * x + y * y
    delta = square - w * w
    tolerance = discriminant_tolerance(r, x, y, w) + 16.0 * EPS * abs(w.real) * joint.size
    code = pose_status(True, delta.real, tolerance, square.real)
    t = np.sqrt(delta) if code == st.OK else 0.0 * delta
    per = divisor(square)
    return code, (x * w + y * t) / per, (x * t - y * w) / per, t


@inline
def solve_general(r: Reduced, joint: Joint, x: Any, y: Any, w: Any, at: Array) -> tuple[int, Any, Any, Any]:
    """Solve as :func:`solve_plain` does, for every five-link."""
    xr, yr, wr = x.real, y.real, w.real
    noise = residual_size(r, joint, x, y)
    real = real_joint(joint)
    code, settled, c0, s0 = st.OK, False, 0.0, 0.0
    few = solutions(real, xr, yr, wr)
    if few == NONE or (few == ONE and joint.mode > 1):
        return st.NOT_ASSEMBLED, x, y, w
    if few == ONE:
        settled, c0, s0 = _newton(real, xr, yr, wr)
    if not settled:
        code, c0, s0 = _scanned(real, xr, yr, wr, noise, at)
    c, s = c0 + 0.0 * x, s0 + 0.0 * x
    if code == st.OK:
        # Two Newton steps on the complex numbers: only rounding is left, and the imaginary parts are exact.
        for _ in range(2):
            here = slope(joint, x, y, w, c, s)
            c, s = rotate(c, s, -here.value / divisor(here.first))
    if code == st.OK or code == st.DEAD_POINT:
        here = slope(joint, x, y, w, c, s)
        if not reaches(real, s.real):
            code = st.SINGULAR
        elif not here.first.real * here.first.real > 2.0 * noise * abs(here.second.real):
            code = st.DEAD_POINT
        return code, -c, -s, here.first
    return code, -c, -s, c


@inline
def real_joint(joint: Joint) -> Joint:
    """Constants of the joint without their imaginary parts."""
    return Joint(
        joint.coupler.real, joint.sweep.real, joint.axial.real, joint.shift.real, joint.share.real, joint.h.real,
        joint.s2.real, joint.plain, joint.size, joint.mode, joint.valid,
    )  # fmt: skip


@inline
def solve(r: Reduced, joint: Joint, u: Any, v: Any, at: Array) -> tuple[int, Any, Any, Any, Any]:
    """Solve the closure: status, minus cosine and minus sine of the mirrored rocker angle, dG5/dpsi and W there.

    W is that of a crank-rocker.  ``at`` is scratch for the scan.
    """
    x, y, w = pose_terms(r, u, v)
    code = st.INVALID_INPUT
    c, s, t = math.nan * x, math.nan * x, math.nan * x
    if r.valid and joint.valid and (x * x + y * y + w * w).real < 1e280:
        if joint.plain:
            close = w - joint.shift
            _, reach = axial_reach(joint, 0.0 * x)
            if joint.sweep == 0.0 and joint.share != 0.0:
                close = close - joint.share * np.sqrt(reach)
            code, c, s, t = solve_plain(r, joint, x, y, close)
            if code == st.OK and joint.mode > 1:
                code = st.NOT_ASSEMBLED
            if joint.share != 0.0 or joint.s2 != 0.0:
                _, reach = axial_reach(joint, -s)
                code = code if reach.real > 0.0 else st.NOT_ASSEMBLED
        else:
            code, c, s, t = solve_general(r, joint, x, y, w, at)
        # without its offsets it is the crank-rocker, bit for bit
        offset = joint.share.real != 0.0 or joint.s2.real != 0.0
        if code == st.OK and offset and 2.0 * joint.coupler.real < r.rocker.real:
            c, s, t = polished(r, joint, x, y, w, v, -c, -s)
    if code != st.OK and code != st.DEAD_POINT:
        c, s, t = math.nan * x, math.nan * x, math.nan * x
    return code, c, s, t, w
