"""Back-rest at given beam radii: the bracket angles that solve its equation, geometry, tension and reactions.

Roots are bracketed on a grid, with edges of validity and near double roots.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor
from kernels.curves.root_search import bisected, false_position, least_value
from kernels.families.backrest.closure import BracketPose, Mode, forces, place, residual, scaled, spring
from kernels.jit import inline, kernel
from kernels.types import Array, Status

CELLS = 400
MOST = 8


@inline
def _defined(phi: float, d: Array, rho: float, mode: int) -> bool:
    return residual(d, phi, rho, mode)[1]


@inline
def _residual(phi: float, d: Array, rho: float, mode: int) -> float:
    value: float = residual(d, phi, rho, mode)[0]
    return value


@inline
def _bracketed(d: Array, a: float, fa: float, b: float, fb: float, rho: float, mode: int) -> float:
    """Root between a, where the residual may be zero, and b, where its sign is another one."""
    return a if fa == 0.0 else false_position(_residual, a, b, fa, fb, d, rho, mode)


@inline
def _size(phi: float, sign: float, d: Array, rho: float, mode: int) -> float:
    return sign * residual(d, phi, rho, mode)[0]  # type: ignore[no-any-return]


@inline
def _kept(roots: Any, count: int, root: float) -> int:
    # a dip that just touches zero gives the same root from both of its sides
    if count < MOST and (count == 0 or root != roots[count - 1]):
        roots[count] = root
        return count + 1
    return count


@inline
def all_roots(d: Array, rho: float, mode: int, roots: Array) -> int:
    """Write the roots between phi_lo and phi_hi, ascending, into ``roots`` (at least MOST); return their number.

    The interval is cut into CELLS cells.  A cell with one undefined end is cut at the edge; a cell pair whose middle is
    a dip towards zero is searched for a pair of roots, so that two close roots are not stepped over.  An equation that
    is empty, zero everywhere, has none.
    """
    low, high = d[29].real, d[30].real
    count = 0
    step = (high - low) / CELLS
    x0, f0, x1 = math.nan, math.nan, low
    f1, ok1 = residual(d, low, rho, mode)
    ok0 = False
    for k in range(CELLS):
        x2 = high if k == CELLS - 1 else low + (k + 1) * step
        f2, ok2 = residual(d, x2, rho, mode)
        left, f_left, right, f_right = x1, f1, x2, f2
        # towards the edge the residual may still change its sign: the part up to it is a cell of its own
        if ok1 and not ok2:
            right, _ = bisected(_defined, x1, x2, d, rho, mode)
            f_right, _ = residual(d, right, rho, mode)
        if ok2 and not ok1:
            left, _ = bisected(_defined, x2, x1, d, rho, mode)
            f_left, _ = residual(d, left, rho, mode)
        if ok0 and ok1 and ok2 and f0 * f1 > 0.0 and f1 * f2 > 0.0 and abs(f1) <= min(abs(f0), abs(f2)):
            sign = math.copysign(1.0, f1)
            dip, f_dip = least_value(_size, x0, x2, sign, d, rho, mode)
            f_dip *= sign
            if f_dip * f1 <= 0.0:
                count = _kept(roots, count, _bracketed(d, dip, f_dip, x0, f0, rho, mode))
                count = _kept(roots, count, _bracketed(d, dip, f_dip, x2, f2, rho, mode))
        elif (ok1 or ok2) and f_left == 0.0 and f_right != 0.0:
            count = _kept(roots, count, left)
        elif (ok1 or ok2) and f_left * f_right < 0.0:
            count = _kept(roots, count, _bracketed(d, left, f_left, right, f_right, rho, mode))
        x0, f0, ok0 = x1, f1, ok1
        x1, f1, ok1 = x2, f2, ok2
    if ok1 and f1 == 0.0 and f0 != 0.0:
        count = _kept(roots, count, x1)
    return count


@inline
def _by_law(d: Array, rho: Any) -> tuple[Any, bool]:
    """Bracket angle of the let-off regulator, linear in 1/rho; (13)."""
    # constant angle: then the radii of the full and the empty beam need not be given
    if d[25].real == 0.0:
        return d[24] + 0.0 * d[25], True
    full, empty = d[26], d[27]
    ordered = full.real > empty.real > 0.0
    if not ordered:  # compiled complex numbers raise where real ones give inf
        return math.nan * d[24], False
    return d[24] + d[25] * (empty * (full - rho)) / divisor(rho * (full - empty)), True


@inline
def _by_root(d: Array, plain: Array, rho: Any, mode: int, roots: Array) -> tuple[Any, int, int]:
    """Solve the equation of the mode: the chosen bracket angle, the number of roots, and the status.

    The last Newton step carries the imaginary parts of a complex design or radius: it differentiates the root exactly.
    """
    count = all_roots(plain, rho.real, mode, roots)
    which = int(plain[31]) - 1
    if not 0 <= which < count:
        return math.nan * d[24], count, st.NO_ROOT
    phi = roots[which]
    # the slope by a complex step, which has no difference to cancel
    slope = residual(plain, complex(phi, 1e-100), rho.real, mode)[0].imag * 1e100
    value, _ = residual(d, phi + 0.0 * d[24], rho, mode)
    step = value / divisor(slope)
    # At a double root the step is noise: the bracket is better.
    return phi - (step if abs(step) < 1e-12 else 0.0 * step), count, st.OK


@inline
def _code(valid: bool, at: BracketPose, code: int) -> int:
    if not valid:
        return st.INVALID_INPUT
    if code != st.OK:
        return code
    if at.sin_d.real == 0.0:
        return st.SINGULAR
    return st.OK if at.defined else st.NOT_ASSEMBLED


@kernel
def poses(
    designs: Array, rho: Array, modes: Status, status: Status, geometry: Array | None, loads: Array | None,
    band: Array | None,
) -> None:  # fmt: skip
    """Compute the geometry, tension and reactions of every design at its beam radii; (1)-(13) of docs/backrest.md.

    Parameters
    ----------
    designs : (n, 32) columns of ``Design``
    rho : (n, m), or (1, m) shared by all designs; radius of the yarn on the beam [length], complex where designs are
    modes : (n,) numbers of :class:`Mode`
    status : (n, m) out; OK, NO_ROOT (fewer roots than ``root``), NOT_ASSEMBLED (a yarn branch has no length), SINGULAR
        (bracket parallel to the guide) or INVALID_INPUT; where it is not OK all values are nan, but the count of roots
    geometry : (13, n, m) out, or None: phi, R1, h, theta, gamma, L1, L2, Lc, wrap, x and y of the axis, clearance of
        beam and back-rest, how many roots
    loads : (9, n, m) out, or None: K, N1, N2; K, N1, N2 with the slider's couple, its offset; spring force and length
    band : (2, n, m) out, or None: K with the slider's couple for friction of both signs, (-, -) and (+, +)
    """
    plain = designs.real
    d, flat, roots = np.empty_like(designs[0]), np.empty(designs.shape[1]), np.empty(MOST)
    for i in range(designs.shape[0]):
        unit, valid = scaled(designs, i, d)
        scaled(plain, i, flat)
        row, mode = i if rho.shape[0] > 1 else 0, modes[i]
        for j in range(rho.shape[1]):
            radius = rho[row, j] / unit
            good, code, count = valid and 0.0 < radius.real < 1e140, st.OK, 1
            if mode == Mode.LAW:
                phi, ordered = _by_law(d, radius)
                good = good and ordered and (0.0 * phi).real == 0.0  # false for inf and nan
            elif good:
                phi, count, code = _by_root(d, flat, radius, mode, roots)
            else:
                phi = math.nan * d[24]
            at = place(d, phi, radius)
            code = _code(good, at, code)
            status[i, j] = code
            # once more with nan, so that whatever follows is nan without a branch for each output
            if code != st.OK:
                phi = math.nan * phi
                at = place(d, phi, radius)

            if geometry is not None:
                values = (
                    phi, at.R1 * unit, ((d[8] - at.x) * np.cos(d[7]) + (at.y - d[9]) * np.sin(d[7])) * unit,
                    at.theta, at.gamma, np.sqrt(at.reach1) * unit, np.sqrt(at.reach2) * unit, d[5] * at.wrap * unit,
                    at.wrap, at.x * unit, at.y * unit, (np.sqrt(at.x * at.x + at.y * at.y) - radius - d[5]) * unit,
                )  # fmt: skip
                for k in range(12):
                    geometry[k, i, j] = values[k]
                geometry[12, i, j] = count if good else math.nan
            if loads is not None or band is not None:
                length, force, moment = spring(d, phi)
                if loads is not None:
                    n = forces(d, phi, at, moment, d[22], d[23])
                    loads[0, i, j], loads[1, i, j], loads[2, i, j] = n.K, n.N1, n.N2
                    loads[3, i, j], loads[4, i, j], loads[5, i, j] = n.K_couple, n.N1_couple, n.N2_couple
                    offset = d[10] * (d[22] * n.N1_couple * d[6] - d[23] * n.N2_couple * d[4]) / divisor(n.N2_couple)
                    loads[6, i, j] = offset * unit
                    loads[7, i, j], loads[8, i, j] = force, length * unit
                if band is not None:
                    one = 1.0 + 0.0 * d[22]
                    band[0, i, j] = forces(d, phi, at, moment, -one, -one).K_couple
                    band[1, i, j] = forces(d, phi, at, moment, one, one).K_couple


@kernel
def positions(designs: Array, rho: Array, mode: int, angles: Array, count: Status) -> None:
    """Compute all bracket angles of every design at one beam radius each; (12) of docs/backrest.md.

    Parameters
    ----------
    designs : (n, 32) columns of ``Design``; rho : (n,) [length]
    mode : TENSION, COUPLE or CLOSURE of :class:`Mode`
    angles : (n, 8) out; ascending, nan last [rad]
    count : (n,) out
    """
    d = np.empty(designs.shape[1])
    for i in range(designs.shape[0]):
        unit, valid = scaled(designs, i, d)
        angles[i, :] = math.nan
        count[i] = all_roots(d, rho[i] / unit, mode, angles[i]) if valid else 0
