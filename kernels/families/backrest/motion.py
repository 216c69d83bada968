"""Back-rest at given beam radii: bracket angle, geometry, tension and reactions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.backrest.closure import Array, Mode, Place, Status, forces, place, residual, scaled, spring
from kernels.families.backrest.roots import MOST, all_roots


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
    return d[24] + d[25] * (empty * (full - rho)) / (rho * (full - empty)), True


@inline
def _by_root(d: Array, plain: Array, rho: Any, mode: int, roots: Array) -> tuple[Any, int, int]:
    """Bracket angle from the equation of the mode, how many there are, and the status.

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
    step = value / slope
    # At a double root the step is noise: the bracket is better.
    return phi - (step if abs(step) < 1e-12 else 0.0 * step), count, st.OK


@inline
def _code(valid: bool, at: Place, code: int) -> int:
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
    designs : (n, 32) columns of :class:`Design`
    rho : (n, m), or (1, m) shared by all designs; radius of the yarn on the beam [length], complex where designs are
    modes : (n,) numbers of :class:`Mode`: what fixes the bracket angle
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
                    offset = d[10] * (d[22] * n.N1_couple * d[6] - d[23] * n.N2_couple * d[4]) / n.N2_couple
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
    designs : (n, 32) columns of :class:`Design`; rho : (n,) [length]
    mode : TENSION, COUPLE or CLOSURE of :class:`Mode`
    angles : (n, 8) out; ascending, nan last [rad]
    count : (n,) out
    """
    d = np.empty(designs.shape[1])
    for i in range(designs.shape[0]):
        unit, valid = scaled(designs, i, d)
        angles[i, :] = math.nan
        count[i] = all_roots(d, rho[i] / unit, mode, angles[i]) if valid else 0
