"""Poses of families that take no complex numbers, made to answer a complex step by central differences."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from sweep.families.base import Angles, Array, Columns, Family, PoseFunction

# Of the size of what is moved: error of second order against rounding, some 1e-10 of the derivative.
DIFFERENCE = 1e-5


def differentiable(family: Family) -> Family:
    """Return the family with poses that take complex designs and angles; the family itself where they do already."""
    if family.analytic:
        return family
    return replace(family, poses=partial(_poses, family.poses), analytic=True)


def _poses(poses: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    if not (np.iscomplexobj(designs) or np.iscomplexobj(angles.phi)):
        return poses(designs, angles, wanted)
    parts = (designs, *angles)
    sizes = [np.abs(x.imag) / np.maximum(np.abs(x.real), 1e-3) for x in parts]
    step = DIFFERENCE / max(max(float(size.max(initial=0.0)) for size in sizes), 1e-300)

    def moved(sign: float) -> Columns:
        x, phi, cos, sin = (np.ascontiguousarray(part.real + sign * step * part.imag) for part in parts)
        return poses(x, Angles(phi, cos, sin), wanted)

    here, ahead, behind = moved(0.0), moved(1.0), moved(-1.0)
    columns: Columns = {"status": here["status"]}
    for name in wanted:
        slope = (np.asarray(ahead[name], np.float64) - np.asarray(behind[name], np.float64)) / (2.0 * step)
        columns[name] = np.asarray(here[name], np.float64) + 1j * slope
    return columns
