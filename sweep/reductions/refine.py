"""Refine peaks between samples: all candidates of all designs at the same time, from poses alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels import scan
from sweep.families.base import Array
from sweep.sampling import Index

Sampler: TypeAlias = Callable[[Index, Array], Array]
"""``sample(candidates, phi)``: measured values (k, 5) of the candidates with these numbers at the angles phi (k, 5)."""

OFFSETS = np.arange(-2.0, 3.0)
SHRINK = 0.125
PASSES = 12
POLISHES = 2
# The quartic over a five-point window errs in proportion to at least the fourth power of its width, so one pass to the
# next divides the error by at least 8^4; a sixty-fourth of the last change is claimed, which leaves a factor of 64.
CLAIM = 1.0 / 64.0
RIPPLE = 0.25  # of the fourth difference: eight times the noise of one sample on average, and what a quartic leaves out
EPS = 2.0**-53


class Peaks(NamedTuple):
    """Refined peaks of k candidates, each (k,): place [rad], measured value, their errors, first guess from samples."""

    phi: Array
    height: Array
    err_phi: Array
    err_height: Array
    guess: Array


def refine_peaks(
    sample: Sampler,
    centre: Array,
    spacing: float,
    around: Array,
    tolerance: Array,
    locate: float | None = None,
) -> Peaks:
    """Highest points near the given samples, by quartics through five points ever closer together.

    Parameters
    ----------
    sample : evaluates the measured quantity; called with the candidates that are not finished yet
    centre : (k,) crank angles of the best samples [rad]
    spacing : distance of the samples [rad]
    around : (k, 7) measured values at the best sample and its three neighbours on either side
    tolerance : (k,) error allowed in the height
    locate : error allowed in the place [rad]; without it the place is as good as the height left it

    Notes
    -----
    No derivative is needed, so every pose output is refined by the same few passes of five poses each: none for
    1e-2, one for 1e-4, two for 1e-8, three or four where the place is wanted.  A peak that leaves its window is
    followed.
    """
    place, height, ripple, blur = _quartic(np.ascontiguousarray(around[:, 1:6]))
    # One fourth difference may vanish by chance where the curve is not yet resolved; three in a row do not.
    fourth = np.abs(around[:, :3] + around[:, 4:] - 4.0 * (around[:, 1:4] + around[:, 3:6]) + 6.0 * around[:, 2:5])
    widest = fourth.max(axis=1)
    guess = height.copy()
    phi = centre + spacing * place
    err_height = RIPPLE * widest + 4.0 * EPS * np.abs(height)
    err_phi = spacing * np.minimum(blur * widest / np.maximum(ripple, EPS * EPS), 2.0)
    step = np.full(centre.size, SHRINK * spacing)
    enough = (np.abs(place) < 2.0) & (err_height <= tolerance)
    if locate is not None:
        enough &= err_phi <= locate
    active = np.flatnonzero(~enough)
    for _ in range(PASSES):
        if not active.size:
            break
        u = step[active]
        place, top, ripple, blur = _quartic(sample(active, phi[active, None] + u[:, None] * OFFSETS))
        inside = np.abs(place) < 2.0
        claim = np.where(inside, CLAIM, 1.0)
        # Samples that no longer follow a quartic are noise, and noise does not shrink with the window.
        error = claim * np.abs(top - height[active]) + RIPPLE * ripple + 4.0 * EPS * np.abs(top)
        # Too small a window sees only noise: it may sharpen the height but must not spoil the place.
        err_place = u * (claim * np.abs(place) + blur) + 4.0 * EPS * np.pi
        sharper = ~inside | (err_place < err_phi[active])
        phi[active[sharper]] += (u * place)[sharper]
        height[active] = top
        err_height[active] = error
        err_phi[active[sharper]] = err_place[sharper]
        enough = inside & (error <= tolerance[active])
        if locate is not None:
            enough &= (err_phi[active] <= locate) | ~sharper
        step[active] = np.where(inside, SHRINK * u, u)
        active = active[~enough & (step[active] > 1e-6 * spacing)]
    return Peaks(phi, height, err_phi, err_height, guess)


def polish_places(slope: Sampler, phi: Array, err_phi: Array) -> tuple[Array, Array]:
    """Places of extrema from the zeros of the derivative, and their errors.

    Parameters
    ----------
    slope : evaluates the derivative; called with numbers of places (k,) and angles (k, 3)
    phi, err_phi : (n,) places and their errors [rad] as `refine_peaks` left them

    Notes
    -----
    Secant steps over 1e-4 rad; a step much longer than the error it should remove, or than the secant, is not taken.
    The height of a top fixes its place to the square root of its rounding only, the derivative to its own rounding.
    """
    step, every = 1e-4, np.arange(phi.size)
    phi, err_phi = phi.copy(), err_phi.copy()
    for _ in range(POLISHES):
        below, here, above = slope(every, phi[:, None] + step * np.arange(-1.0, 2.0)).T
        bend = (above - below) / (2.0 * step)
        move = -np.divide(here, bend, out=np.full(phi.size, np.inf), where=bend != 0.0)
        better = np.abs(move) <= np.clip(64.0 * err_phi, 0.01 * step, step)
        phi[better] += move[better]
        # The last step is as long as the noise of the derivative lets it be.
        err_phi[better] = 4.0 * np.abs(move[better]) + 4.0 * EPS * np.pi
    return phi, err_phi


def _quartic(values: Array) -> tuple[Array, Array, Array, Array]:
    place, height, ripple, blur = (np.empty(values.shape[0]) for _ in range(4))
    scan.quartic_peak(values, place, height, ripple, blur)
    return place, height, ripple, blur
