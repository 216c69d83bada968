"""How finely a turn is looked at: how many samples a curve needs at least, and where it is cut into panels.

A family says what it knows of its curves by capabilities (`sweep.families.curve_features`).
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI, Status
from sweep.families.base import Angles, Array, Family
from sweep.families.curve_features import (
    Bends,
    Crossing,
    Singular,
    SingularCurve,
    bends,
    singular_curves,
    switches,
    waves,
)
from sweep.numerics.events import near_zeros, sign_changes, with_events
from sweep.numerics.singularities import FAR, SAMPLES, SHORTEST, Curve, Singularities, crowded, singularities
from sweep.reductions.sampling import DESIGN_STATUS, Index, blocks, pose_columns

PER_WAVE = 2.0  # waves that the fewest samples of any curve resolve
SHARES = 16.0  # samples of a turn are a multiple of this over the shortest way between two switches
PER_SINGULARITY = 12.0  # samples per distance of the nearest complex singularity
FEWEST = 32.0  # samples of any curve
MOST = 1024.0  # times the fewest samples
# Distance of a singularity [rad] up to which it is looked at closely: twice that from which on it decides on samples.
MATTERS = 2.0 * PER_SINGULARITY / FEWEST


def denser(family: Family, designs: Array, outputs: Collection[str], near: Singularities | None = None) -> Array:
    """Return by which power of two the fewest samples of pose outputs over a turn are multiplied, (n,).

    ``near`` are the nearest singularities if they are known.

    Between two switches stand several samples, in a wave at least half of what else stands in a turn, and 12 in the
    distance of a singularity that the samples themselves would not see.
    """
    factor = np.maximum(waves(family, designs) / PER_WAVE, 1.0)
    angles = np.sort(switches(family, designs, outputs), axis=1)
    if angles.shape[1] > 1:
        gaps = np.concatenate([np.diff(angles, axis=1), angles[:, :1] + TWO_PI - angles[:, -1:]], axis=1)
        # Two switches in one place are one.
        shortest = np.where(gaps > 1e-9, gaps, TWO_PI).min(axis=1)
        factor = np.maximum(factor, TWO_PI / (SHARES * shortest))
    if family.every(Singular):
        near = nearest(family, designs, MATTERS) if near is None else near
        rho = near.rho.min(axis=1)
        factor = np.where(rho < FAR, np.maximum(factor, PER_SINGULARITY / (FEWEST * rho)), factor)
    found: Array = np.exp2(np.ceil(np.log2(np.minimum(factor, MOST))))
    return found


def nearest(family: Family, designs: Array, within: float = FAR) -> Singularities:
    """Nearest singularities of a family's designs, from its most accurate poses.

    Those farther away than ``within`` [rad] are as good as even samples show them.
    """
    curves = singular_curves(family.precise())

    def of_rows(some: Index, curve: SingularCurve) -> Curve:
        return lambda rows, phi: curve(designs[some[rows]], Angles.of(phi))

    parts = [
        singularities([of_rows(some, curve) for curve in curves], some.size, within)
        for some in blocks(np.arange(len(designs)), SAMPLES, len(curves))
    ]
    if not parts:
        return singularities([of_rows(np.arange(0), curve) for curve in curves], 0)
    return Singularities(*(np.concatenate(found) for found in zip(*parts, strict=True)))


def broken(family: Family, designs: Array, near: Singularities, status: Status) -> None:
    """Write the status of designs that have no pose where a singularity is as near as can be told.

    The gap may be narrower than any samples.
    """
    close = np.flatnonzero((near.rho <= SHORTEST).any(axis=1))
    for rows in blocks(close, near.phi.shape[1]):
        _, each = pose_columns(family, designs[rows], near.phi[rows], [family.pose_names[0]])
        each = np.where(near.rho[rows] <= SHORTEST, each, st.OK)
        gap = (each != st.OK).any(axis=1)
        status[rows[gap]] = DESIGN_STATUS[each[gap, (each[gap] != st.OK).argmax(axis=1)]]


FAR, CLOSE = 10.0, 0.1  # distances of singularities [rad]; from the latter on panels crowd about one
BENDING = 128  # even samples among which functions of effects are seen to pass zero
LOOK = 0.25  # spacing of further samples against the distance of a singularity
PER_PANEL = 0.25  # waves that a first panel may hold


def ends(family: Family, designs: Array, even: int, looks: int, output: str) -> Array:
    """Return the ends of panels of a turn for curves of a pose output, in rising order, (n, p + 1).

    There are ``even`` panels, and more about singularities.  They are cut at angles known beforehand, and where one of
    ``looks`` samples or the next shows that a pose output passes its level, that a follower reverses, or that a
    function passes zero at which curves of the output bend.
    """
    n = len(designs)
    edges = np.tile(np.linspace(0.0, TWO_PI, even + 1), (n, 1))
    known = switches(family, designs, (output,))
    edges = with_events(edges, np.repeat(np.arange(n), known.shape[1]), known.ravel())
    fast = np.ceil(waves(family, designs) / PER_PANEL).astype(np.int64)  # even ends of so many panels
    more = np.repeat(np.arange(n), np.where(fast > even, fast, 0))
    place = np.arange(more.size) - np.searchsorted(more, more)
    edges = with_events(edges, more, TWO_PI * place / fast[more])
    near = nearest(family, designs)
    close = np.flatnonzero(near.rho.min(axis=1, initial=FAR) < CLOSE)
    about = crowded(near.only(close), 1.0)
    edges = with_events(edges, np.repeat(close, about.shape[1]), about.ravel())
    angles = crowded(near.only(close), LOOK)
    edges = with_events(edges, *_passed(family, designs, (output,), _looked(n, looks, close, angles)))
    for bent in bends(family, output):

        def bending(rows: Index, phi: Array, bent: Bends = bent) -> Array:
            return np.nan_to_num(bent.curves(designs[rows], Angles.of(phi)))

        looked = _looked(n, BENDING, close, angles)
        places = near_zeros(bending, looked, CLOSE) if bent.squares else sign_changes(bending, looked)
        edges = with_events(edges, *places)
    return edges


def events(family: Family, designs: Array, looks: int, outputs: Collection[str]) -> tuple[Index, Array]:
    """Return designs (k,) and angles (k,) where a pose output passes its level, or a follower reverses.

    They are looked for between ``looks`` even samples of the turn, as far as ``outputs`` depend on them.
    """
    even = np.arange(looks) * (TWO_PI / looks)
    return _passed(family, designs, outputs, np.tile(even, (len(designs), 1)))


def _passed(family: Family, designs: Array, outputs: Collection[str], looked: Array) -> tuple[Index, Array]:
    """Return designs and angles where an output passes its level or a speed passes zero, as seen at ``looked``."""
    crossings = family.every(Crossing)
    # What reverses is felt by friction and loads, of effects; a family knows its own kinks.
    speeds = () if family.dear.keys().isdisjoint(outputs) else reversing(family)
    if not speeds and not crossings:
        return np.zeros(0, np.intp), np.zeros(0)
    names = list(dict.fromkeys([*speeds, *(crossing.of for crossing in crossings)]))

    def functions(rows: Index, phi: Array) -> Array:
        columns, _ = pose_columns(family, designs[rows], phi, names)
        passed = [columns[crossing.of] - crossing.level(designs[rows])[:, None] for crossing in crossings]
        return np.nan_to_num(np.stack([*(columns[name] for name in speeds), *passed], axis=2))

    return sign_changes(functions, looked)


def _looked(n: int, even: int, close: Index, angles: Array) -> Array:
    """Even angles of a turn, (n, m), and further ones of the designs ``close``."""
    looked = np.tile(np.arange(even) * (TWO_PI / even), (n, 1))
    return with_events(looked, np.repeat(close, angles.shape[1]), angles.ravel())


def reversing(family: Family) -> tuple[str, ...]:
    """Pose outputs whose zeros cut the turn: the speeds of all positions of the family."""
    speeds = set(family.derivative_of.values())
    dear = set(family.dear)
    return tuple(rate for of, rate in family.derivative_of.items() if of not in speeds and rate not in dear)
