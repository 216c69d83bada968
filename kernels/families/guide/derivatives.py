"""Derivatives of the guided four-bar's rocker angle psi by its crank angle, at one pose; (5) of docs/guide.md.

The one set of formulas behind the motion at given angles and behind the fused kernels of chains.  Derivatives of the
closure F = X cos psi - Y sin psi + W are F_phi = ``g_ph``, F_phi psi = -``g_near``, F_phi phi psi = ``g_turn``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from kernels._jit import inline
from kernels.families.guide.closure import Place


class First(NamedTuple):
    """Derivatives of the closure, and psi'."""

    g_turn: Any
    g_near: Any
    g_ph: Any
    p: Any


@inline
def velocity(r: Any, at: Place, cos_psi: Any, sin_psi: Any, per_t: Any) -> First:
    """psi'; ``r`` has the fields a and k2 of :class:`kernels.families.guide.closure.Reduced`, ``per_t`` is 1/T."""
    u, v = at.u, at.v
    g_turn, g_near = r.a * (v * cos_psi - u * sin_psi), r.a * (u * cos_psi + v * sin_psi)
    g_ph = g_turn + r.k2 * v
    return First(g_turn, g_near, g_ph, -g_ph * per_t)


@inline
def acceleration(r: Any, at: Place, first: First, per_t: Any) -> Any:
    """Psi''."""
    p = first.p
    return -(first.g_near + r.k2 * at.u + p * (at.w * p - 2.0 * first.g_near)) * per_t


@inline
def jerk(at: Place, first: First, q: Any, t: Any, per_t: Any) -> Any:
    """Psi''' from psi'' = ``q`` and T."""
    p, g_turn = first.p, first.g_turn
    linear = first.g_ph - p * (3.0 * g_turn - p * (3.0 * g_turn + t * p))
    return (linear - 3.0 * q * (at.w * p - first.g_near)) * per_t


@inline
def snap(r: Any, at: Place, first: First, q: Any, j: Any, t: Any, per_t: Any) -> Any:
    """Return the fourth derivative of psi from psi'' = ``q``, psi''' = ``j`` and T."""
    p, g_turn, g_near, w = first.p, first.g_turn, first.g_near, at.w
    by_p = p * (4.0 * g_near - p * (6.0 * g_near - p * (4.0 * g_near - w * p)))
    by_q = q * (6.0 * g_turn - p * (12.0 * g_turn + 6.0 * t * p) + 3.0 * w * q)
    return (g_near + r.k2 * at.u - by_p - by_q - 4.0 * j * (w * p - g_near)) * per_t
