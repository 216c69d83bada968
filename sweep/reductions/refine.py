"""Refinement of peaks between samples, from poses alone, vectorised over all candidates of all designs."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.curves import samples as scan
from kernels.types import EPS
from sweep.families.base import Array, Family
from sweep.numerics.records import Indices, Mask, only, put
from sweep.reductions.sampling import pose_columns

Sampler: TypeAlias = Callable[[Indices, Array], Array]
"""``sample(candidates, phi)``: values (k, m), times their signs, of candidates (k,) at the angles phi (k, m)."""

OFFSETS = np.arange(-2.0, 3.0)
SHRINK = 0.125
SHRINK_KINKED = 0.25  # the quartic misplaces the tip of a kink by up to a quarter of a step
PASSES = 20
POLISHES = 3
NARROW, WIDE = 1e-8, 1e-4  # secants [rad]: the crank angle's rounding would dominate shorter ones
# The error of the quartic over a five-point window is proportional to at least the fourth power of its width, so each
# pass divides it by at least 8^4; a sixty-fourth of the last change is claimed, which leaves a factor of 64.
CLAIM = 1.0 / 64.0
RIPPLE = 0.25  # error per fourth difference, which is eight times the noise of one sample on average
# Second differences of five samples at a smooth maximum are nearly equal.  Where they are not, a kink may lie between
# them: there a fourth difference may vanish by chance, and halving the window only halves the error.
BENT, CLOSELY_BENT = 0.4, 0.15  # change of second differences relative to the largest, of first and of later samples
LEARNT = 0.8  # largest share of the previous error that a narrower window about a kink leaves
FLAT = 64.0  # times EPS of a height: change of second differences that rounding may make
LOST = 2.0  # blur, in steps, of a quartic whose bend is below its noise
SHORTEST, SHORTEST_KINKED = 1e-6, 1e-12  # steps of the last windows relative to the samples' spacing
BESIDE = 1e-3 * np.array([-2.0, -1.0, 1.0, 2.0])  # poses next to a place [rad]: two alike show a dwell
VARIES = 8.0  # ratio of the rounding at neighbouring poses to that at one pose, at most


class PeakCandidates(NamedTuple):
    """Samples next to a possible extremum, each (k,): request, row of the block, column, sign to make it a maximum."""

    request: Indices
    row: Indices
    column: Indices
    sign: Array


class Peaks(NamedTuple):
    """Refined peaks of k candidates, each (k,).

    Place [rad], height, their errors, first guess of the height, spacing of the samples, and step of the next five
    points [rad].
    """

    phi: Array
    height: Array
    err_phi: Array
    err_height: Array
    guess: Array
    spacing: Array
    step: Array


def first_peaks(centre: Array, spacing: Array, around: Array) -> Peaks:
    """Compute the peaks of the quartics through five samples.

    Parameters
    ----------
    centre, spacing : (k,) crank angles of the highest samples, and their distance from the next [rad]
    around : (k, 7) values at the highest sample and its three neighbours on either side
    """
    place, height, ripple, blur = _quartic(np.ascontiguousarray(around[:, 1:6]))
    # A sample two steps away may be higher: it belongs to another peak, with its own first guess.
    rival = np.abs(place) == 2.0
    place[rival], height[rival] = 0.0, around[rival, 3]
    # One fourth difference may vanish by chance where the curve is not yet resolved; three in a row do not.
    fourth = np.abs(around[:, :3] + around[:, 4:] - 4.0 * (around[:, 1:4] + around[:, 3:6]) + 6.0 * around[:, 2:5])
    widest = fourth.max(axis=1)
    error = RIPPLE * widest + 4.0 * EPS * np.abs(height) + _kink(around[:, 1:6], BENT)
    err_height = np.where(rival, np.inf, error)
    # The floor is proportional to the curve: scaling lengths by 2^k changes no bit.
    least = np.maximum(ripple, EPS * EPS * widest)
    blurred = np.divide(blur * widest, least, out=np.zeros(widest.size), where=least > 0.0)
    err_phi = spacing * np.minimum(blurred, 2.0)
    return Peaks(centre + spacing * place, height, err_phi, err_height, height, spacing, SHRINK * spacing)


def sharpen(sample: Sampler, peaks: Peaks, tolerance: Array, locate: Array) -> Peaks:
    """Refine peaks by quartics through five points with shrinking spacing.

    Parameters
    ----------
    sample : evaluates the curves; called with the candidates that are not finished yet
    peaks : k peaks as known so far
    tolerance : (k,) allowed error of the height
    locate : (k,) allowed error of the place [rad]; inf accepts the place that the height needs

    Notes
    -----
    No derivative is needed, so every pose output is refined by the same few passes of five poses each: none for 1e-2,
    one for 1e-4, two for 1e-8, three or four where the place is wanted.  A peak that leaves its window is followed.
    """
    phi, height, err_phi, err_height, guess, spacing, step = (column.copy() for column in peaks)
    looked = step.copy()  # widths of the last windows that held their peaks
    active = np.flatnonzero((err_height > tolerance) | (err_phi > locate))
    for _ in range(PASSES):
        if not active.size:
            break
        u = step[active]
        values = sample(active, phi[active, None] + u[:, None] * OFFSETS)
        place, top, ripple, blur = _quartic(values)
        kink = _kink(values, CLOSELY_BENT)
        # On a top that is flat to rounding the window looks bent, but its highest pose is chance.
        tip = kink > FLAT * EPS * np.abs(top)
        inside = np.abs(place) < 2.0
        claim = np.where(inside, CLAIM, 1.0)
        # Samples that deviate from a quartic are noise, which does not shrink with the window.
        error = claim * np.abs(top - height[active]) + RIPPLE * ripple + 4.0 * EPS * np.abs(top) + kink
        # Too small a window shows only noise: it may refine the height, but must not change the place.
        misplaced = np.where(tip, SHRINK_KINKED, 0.0)
        err_place = u * (claim * np.abs(place) + blur + misplaced) + 4.0 * EPS * np.pi
        # Where noise hides the bend, the peak may lie anywhere about the window, however narrow it is.
        err_place[inside & (blur >= LOST) & ~tip] = np.inf
        err_place[~inside] = np.maximum(err_place, err_phi[active])[~inside]
        # At a kink the error shrinks with the window.  Noise looks bent too, but its error stays, and it is ignored.
        noisy = inside & (kink > 0.0) & (error >= LEARNT * err_height[active]) & (u < looked[active])
        looked[active] = np.where(inside, u, looked[active])
        sharper = ~inside | (((err_place < err_phi[active]) | tip) & ~noisy)
        phi[active[sharper]] += (u * place)[sharper]
        height[active] = top
        err_height[active] = error
        err_phi[active[sharper]] = err_place[sharper]
        enough = inside & (error <= tolerance[active]) & ((err_phi[active] <= locate[active]) | ~sharper)
        # A window that has lost its peak was too small.
        shrink = np.where(kink > 0.0, SHRINK_KINKED, SHRINK)
        step[active] = np.where(inside, shrink * u, np.minimum(u / SHRINK, SHRINK * spacing[active]))
        shortest = np.where(kink > 0.0, SHORTEST_KINKED, SHORTEST)
        active = active[~enough & ~noisy & (step[active] > shortest * spacing[active])]
    return Peaks(phi, height, err_phi, err_height, guess, spacing, step)


def confirmed(
    sample: Sampler, peaks: Peaks, tolerance: Array, locate: Array, rounding: Array | float = 0.0,
    there: Array | None = None,
) -> Peaks:  # fmt: skip
    """Replace the heights of peaks by values of precise poses at their places, and refine them again if needed.

    One pose at the place of a peak measures how far rounding and interpolation have moved its value.  The peak is
    refined again only where that exceeds the ``tolerance``, or the place is not known to ``locate``.

    Parameters
    ----------
    sample : evaluates the curves with less rounding than the poses that the peaks come from
    peaks, tolerance, locate : as in `sharpen`
    rounding : (k,) possible effect of rounding on the heights of the given peaks: the place may be wrong even where one
        pose shows no error by chance
    there : (k,) values of ``sample`` at the places of the peaks, if they are known
    """
    before = peaks.height
    peaks = attained(sample, peaks, np.arange(peaks.phi.size)) if there is None else reaching(there, peaks)
    rounded = np.abs(peaks.height - before)
    # The same rounding has moved the places; it varies along the curve, and one pose sees one value of it.
    peaks.err_height[:] += VARIES * rounded
    again = np.flatnonzero((peaks.err_height > tolerance) | (peaks.err_phi > locate))
    if again.size:
        # Rounding may have moved the place too, which stays hidden if neighbouring poses round alike: where the height
        # has changed the search starts anew, otherwise with a window as wide as the error of the place.
        fresh = SHRINK * peaks.spacing
        spoilt = np.maximum(rounded, rounding) > tolerance
        err_phi = np.where(spoilt, np.maximum(peaks.err_phi, fresh), peaks.err_phi)
        step = np.maximum(peaks.step, np.minimum(err_phi, fresh))
        rough = only(peaks._replace(step=step, err_phi=err_phi), again)
        sharper = sharpen(lambda active, phi: sample(again[active], phi), rough, tolerance[again], locate[again])
        sharper = attained(sample, sharper, again)
        # Both heights are attained, so the higher one is closer; a narrow window may show noise, or another peak.
        rougher = only(peaks, again)
        lower = np.maximum(rougher.height - sharper.height, 0.0)
        moved = np.abs(sharper.phi - rougher.phi)
        kept = lower > 0.0
        sharper.phi[kept], sharper.height[kept] = rougher.phi[kept], rougher.height[kept]
        sharper.err_height[:] += lower
        sharper.err_phi[kept] += moved[kept]
        put(peaks, again, sharper)
    return peaks


def attained(sample: Sampler, peaks: Peaks, which: Indices) -> Peaks:
    """Evaluate the heights at the places themselves, where the slope and the effect of a rounded angle vanish."""
    return reaching(sample(which, peaks.phi[:, None])[:, 0], peaks)


def reaching(height: Array, peaks: Peaks) -> Peaks:
    """Set the heights of peaks, and add the changes to their errors."""
    return peaks._replace(height=height, err_height=peaks.err_height + np.abs(height - peaks.height))


def polish_places(slope: Sampler, phi: Array, err_phi: Array) -> tuple[Array, Array]:
    """Refine the places of extrema by the roots of the derivative; return places and errors.

    Parameters
    ----------
    slope : evaluates the derivative; called with indices of places (k,) and angles (k, 3)
    phi, err_phi : (n,) places and their errors [rad] from `sharpen`

    Notes
    -----
    Secant steps, each as wide as the place is uncertain; one that leads much farther is not taken.  The height of a
    maximum determines its place to the square root of its rounding only, the derivative to its own rounding.
    """
    every = np.arange(phi.size)
    phi, err_phi = phi.copy(), err_phi.copy()
    last = np.zeros(phi.size)
    for _ in range(POLISHES):
        step = np.clip(64.0 * err_phi, NARROW, WIDE)
        below, here, above = slope(every, phi[:, None] + step[:, None] * np.arange(-1.0, 2.0)).T
        bend = (above - below) / (2.0 * step)
        move = -np.divide(here, bend, out=np.full(phi.size, np.inf), where=bend != 0.0)
        better = np.abs(move) <= np.maximum(step, VARIES * err_phi)
        phi[better] += move[better]
        # The noise of the derivative determines the last steps; one may be short by chance.
        err_phi[better] = 4.0 * np.maximum(np.abs(move), last)[better] + 8.0 * EPS * np.pi
        last = SHRINK * np.abs(move)
    # Rounding may have made a top of its own; then the root of the derivative is far away.
    far = ~better & np.isfinite(move)
    err_phi[far] = np.maximum(err_phi, np.minimum(2.0 * np.abs(move), np.pi))[far]
    return phi, err_phi


def polished(family: Family, designs: Array, slope: str, phi: Array, err_phi: Array) -> tuple[Array, Array]:
    """Refine the places of maxima, one of each design, by roots of the pose output ``slope``, with `polish_places`.

    A maximum is flat but its slope is steep; the family's most accurate poses are used.
    """
    precise = family.precise()

    def sample(active: Indices, angles: Array) -> Array:
        return pose_columns(precise, designs[active], angles, [slope])[0][slope]

    return polish_places(sample, phi, err_phi)


def dwells(family: Family, designs: Array, pose: str, phi: Array) -> Mask:
    """Whether a curve is level beside its extremum, one of each design: panels show how far the dwell extends."""
    values = pose_columns(family.precise(), designs, phi[:, None] + BESIDE, [pose])[0][pose]
    change, size = np.abs(values[:, ::3] - values[:, 1:3]), np.abs(values).max(axis=1, keepdims=True)
    level: Mask = (change <= 16.0 * EPS * size).any(axis=1)
    return level


def _kink(values: Array, bent: float) -> Array:
    """Bound the height that a kink between five samples (k, 5) may hide; 0 where they bend alike."""
    a, b, c, d, e = values.T
    left, middle, right = a - 2.0 * b + c, b - 2.0 * c + d, c - 2.0 * d + e
    change = np.maximum(np.abs(middle - left), np.abs(right - middle))
    largest = np.maximum(np.maximum(np.abs(left), np.abs(right)), np.abs(middle))
    return np.where(change > bent * largest, change, 0.0)


def _quartic(values: Array) -> tuple[Array, Array, Array, Array]:
    place, height, ripple, blur = (np.empty(values.shape[0]) for _ in range(4))
    scan.quartic_peak(values, place, height, ripple, blur)
    return place, height, ripple, blur
