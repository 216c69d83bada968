"""Sine and cosine for the locus kernels."""

from __future__ import annotations

from kernels.arithmetic.sincos import sincos
from kernels.jit import inline

PI = 3.141592653589793


@inline
def sine_cosine(angle: float) -> tuple[float, float]:
    """Return (sin, cos) of an angle; one call site,
    as numba warns when ``sincos`` is expanded twice in one function.
    """
    return sincos(angle)
