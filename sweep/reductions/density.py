"""How many samples of a turn a curve needs at least, from what its family says about it (`sweep.families.pace`)."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from sweep.families.base import Angles, Array, Family
from sweep.families.pace import Singular, SingularCurve, singular_curves, switches, waves
from sweep.numerics.singularities import FAR, SAMPLES, SHORTEST, Curve, Singularities, singularities
from sweep.reductions.request import DESIGN_STATUS
from sweep.reductions.sampling import TWO_PI, Index, Status, blocks, pose_columns

PER_WAVE = 2.0  # waves that the fewest samples of any curve resolve
SHARES = 16.0  # samples of a turn are a multiple of this over the shortest way between two switches
PER_SINGULARITY = 12.0  # samples per distance of the nearest complex singularity
FEWEST = 32.0  # samples of any curve
MOST = 1024.0  # times the fewest samples
# Distance of a singularity [rad] up to which it is looked at closely: twice that from which on it decides on samples.
MATTERS = 2.0 * PER_SINGULARITY / FEWEST


def denser(family: Family, designs: Array, near: Singularities | None = None) -> Array:
    """Return by which power of two the fewest samples of a turn are multiplied, (n,); ``near`` if it is known.

    Between two switches stand several samples, in a wave at least half of what else stands in a turn, and 12 in the
    distance of a singularity that the samples themselves would not see.
    """
    factor = np.maximum(waves(family, designs) / PER_WAVE, 1.0)
    angles = np.sort(switches(family, designs), axis=1)
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
    """Return the nearest singularities of a family's designs, from its most accurate poses.

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
    """Write the status of designs that have no pose where a singularity is as near as can be told: the gap may be
    narrower than any samples.
    """
    close = np.flatnonzero((near.rho <= SHORTEST).any(axis=1))
    for rows in blocks(close, near.phi.shape[1]):
        _, each = pose_columns(family, designs[rows], near.phi[rows], [family.pose_names[0]])
        each = np.where(near.rho[rows] <= SHORTEST, each, st.OK)
        gap = (each != st.OK).any(axis=1)
        status[rows[gap]] = DESIGN_STATUS[each[gap, (each[gap] != st.OK).argmax(axis=1)]]
