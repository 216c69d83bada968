"""Integrals over one turn of many curves at once: Gauss-Kronrod rules on panels that are halved adaptively.

With every halving the error of smooth curves falls by orders of magnitude, of kinks by four, of jumps by two; none of
them has to be known in advance, as long as the first panels see them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.types import EPS, Array
from sweep.numerics.records import Indices, Mask, only

Integrand: TypeAlias = Callable[[Indices, Indices, Array], Array]
"""``f(rows, origins, x)``: values (k, 17, q) of the curves ``rows`` (k,) at ``x`` (k, 17); ``origins`` (k,) are the
first panels in which these lie."""

# Kronrod's extension of the Gauss rule of seven points (Piessens et al., QUADPACK, 1983): nodes and both weights on
# [-1, 1]; tests/numerics/test_quadrature.py checks their degree of exactness.
_NODES = (0.991455371120812639206854697526329, 0.949107912342758524526189684047851, 0.864864423359769072789712788640926,
          0.741531185599394439863864773280788, 0.586087235467691130294144838258730, 0.405845151377397166906606412076961,
          0.207784955007898467600689403773245)  # fmt: skip
_KRONROD = (0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
            0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
            0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
            0.204432940075298892414161999234649)  # fmt: skip
_GAUSS = (0.0, 0.129484966168869693270611432679082, 0.0, 0.279705391489276667901467771423780, 0.0,
          0.381830050505118944950369775488975, 0.0)  # fmt: skip
NODES = np.array([*(-x for x in _NODES), 0.0, *_NODES[::-1]])
KRONROD = np.array([*_KRONROD, 0.209482141084727828012999174891714, *_KRONROD[::-1]])
GAUSS = np.array([*_GAUSS, 0.417959183673469387755102040816327, *_GAUSS[::-1]])
# Beyond the last nodes a jump or a kink is not seen: values just inside both ends are compared with the interpolating
# polynomial through all nodes.  They do not enter the integral.
_END = 1.0 - 2.0**-30
PROBED = np.array([-_END, *NODES, _END])
_THERE = np.array([np.prod([(_END - x) / (node - x) for x in NODES if x != node]) for node in NODES])
# For some places of a kink in a panel the difference of both rules vanishes, but the last two Legendre coefficients do
# not both vanish; weighted by this factor they count as a difference: no kink of 16 000 tested is missed then.
_LAST = [(n + 0.5) * KRONROD * np.polynomial.legendre.Legendre.basis(n)(NODES) for n in (13, 14)]
_COUNTS = 0.03
# The power 1.5 below belongs to smooth curves.  A kink far smaller than the spread errs by as much as both rules
# differ, and by more at some places: at none of 16 000 by more than _FLAT times the difference, or than _FLAT times
# this share of the last coefficients.
_PLAIN, _FLAT = 0.3, 4.0
_ROUNDED = 16.0 * EPS  # share of a panel's integral that counts as rounding

PASSES = 60  # halvings of a first panel, after which only a jump between two doubles can be left
MOST = 4096  # panels of one curve at most
SHARED = 0.1  # a panel is suspected of noise if each half keeps more than this share of its error
NOISE = 4  # generations of suspected panels after which the error is taken for noise
SMALL = 1e-4  # largest error, as a share of the integral, that is taken for noise


class Integrals(NamedTuple):
    """Integrals of n curves and their error estimates, each (n, q), and (n,) whether the target is met.

    The integrals of a curve whose values are not all finite are nan.
    """

    value: Array
    err: Array
    settled: Mask


class _Panels(NamedTuple):
    """Panels of all curves, each (k,); integrals and errors (k, q), generations of suspected noise (k, 1)."""

    row: Indices
    origin: Indices
    low: Array
    high: Array
    value: Array
    err: Array
    idle: Array


def integrate(function: Integrand, edges: Array, target: float) -> Integrals:
    """Integrate n curves over x, each to a relative error.

    Parameters
    ----------
    function : the curves; a nan value ends the integration of its curve
    edges : (n, p + 1) rising edges of the first panels
    target : error of each integral relative to its magnitude

    Notes
    -----
    The error of a panel is QUADPACK's (200 |K - G|/spread)^1.5 spread, where the difference of both rules is bounded
    below by the last Legendre coefficients, or a multiple of the difference if that is more, as beside a small kink,
    plus an estimate for a jump or a kink beyond the last nodes.  An error
    that does not shrink as panels are halved is rounding of the curve, and stays in the sum.
    """
    n, p = edges.shape[0], edges.shape[1] - 1
    row, origin = np.repeat(np.arange(n), p), np.tile(np.arange(p), n)
    low, high = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    wide = high > low
    new = _evaluated(function, row[wide], origin[wide], low[wide], high[wide])
    shape = (n, new.value.shape[1])
    done, done_err = np.zeros(shape), np.zeros(shape)
    panels = new
    seen: Mask = np.ones(n, np.bool_)
    settled: Mask = np.zeros(n, np.bool_)
    count = np.bincount(panels.row, minlength=n)
    for _ in range(PASSES):
        seen[panels.row[~np.isfinite(panels.value).all(axis=1)]] = False
        panels = only(panels, seen[panels.row])
        total, err = done.copy(), done_err.copy()
        np.add.at(total, panels.row, panels.value)
        np.add.at(err, panels.row, panels.err)
        size = np.abs(total)  # of this pass: a first estimate may be many times too large
        settled = np.asarray((err <= target * size).all(axis=1))
        allowed = (target * size / np.maximum(2.0 * count, 1.0)[:, None])[panels.row]
        noisy = (panels.idle >= NOISE)[:, 0] & (panels.err <= SMALL * size[panels.row]).all(axis=1)
        narrow = panels.high - panels.low <= 16.0 * EPS * np.abs(panels.high)
        halve = (panels.err > allowed).any(axis=1) & ~noisy & ~narrow & ~settled[panels.row]
        halve &= count[panels.row] < MOST
        rest = only(panels, ~halve)
        np.add.at(done, rest.row, rest.value)
        np.add.at(done_err, rest.row, rest.err)
        panels = only(panels, halve)
        if not panels.row.size:
            break
        count += np.bincount(panels.row, minlength=n)
        panels = _halved(function, panels)
    np.add.at(done, panels.row, panels.value)  # panels that all passes have halved
    np.add.at(done_err, panels.row, panels.err)
    done[~seen], done_err[~seen] = np.nan, np.nan
    return Integrals(done, done_err, settled & seen)


def _halved(function: Integrand, panels: _Panels) -> _Panels:
    middle = 0.5 * (panels.low + panels.high)
    row, origin = (np.concatenate([x, x]) for x in (panels.row, panels.origin))
    low, high = np.concatenate([panels.low, middle]), np.concatenate([middle, panels.high])
    halves = _evaluated(function, row, origin, low, high)
    k = panels.row.size
    # Beside a kink or a jump one half is smooth; noise is in both halves.
    both = np.minimum(halves.err[:k].max(axis=1), halves.err[k:].max(axis=1)) > SHARED * panels.err.max(axis=1)
    idle = np.where(both[:, None], panels.idle + 1.0, np.maximum(panels.idle - 1.0, 0.0))
    return halves._replace(idle=np.concatenate([idle, idle]))


def _weighted(weights: Array, values: Array) -> Array:
    """Weighted sums (k, q) over the nodes of values (k, j, q), in an order that does not depend on k."""
    total: Array = weights[0] * values[:, 0]
    for j in range(1, weights.size):
        total += weights[j] * values[:, j]
    return total


def _evaluated(function: Integrand, row: Indices, origin: Indices, low: Array, high: Array) -> _Panels:
    half = 0.5 * (high - low)
    x = (0.5 * (low + high))[:, None] + half[:, None] * PROBED
    every = function(row, origin, x)
    y = every[:, 1:-1]
    value = half[:, None] * _weighted(KRONROD, y)
    coarse = half[:, None] * _weighted(GAUSS, y)
    mean = _weighted(KRONROD, y)[:, None, :] / 2.0
    spread = half[:, None] * _weighted(KRONROD, np.abs(y - mean))
    last = half[:, None] * (np.abs(_weighted(_LAST[0], y)) + np.abs(_weighted(_LAST[1], y)))
    apart = np.abs(value - coarse)
    off = np.maximum(apart, _COUNTS * last)
    sharp = np.minimum(200.0 * off / np.maximum(spread, 1e-300), 1.0) ** 1.5 * spread
    err = np.where(spread > 0.0, np.maximum(np.minimum(sharp, spread), 0.0), off)
    size = half[:, None] * _weighted(KRONROD, np.abs(y))
    err = np.maximum(err, _FLAT * np.maximum(apart, _PLAIN * last) - _ROUNDED * size)
    err = np.maximum(err, 8.0 * EPS * size)
    beyond = np.abs(every[:, -1] - _weighted(_THERE, y)) + np.abs(every[:, 0] - _weighted(_THERE[::-1], y))
    err += np.nan_to_num((1.0 - NODES[-1]) * half[:, None] * beyond)
    return _Panels(row, origin, low, high, value, err, np.zeros((row.size, 1)))
