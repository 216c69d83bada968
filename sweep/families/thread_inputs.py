"""Inputs of the thread laws with their defaults: the constants the source reports, and where they were measured."""

from __future__ import annotations

from typing import NamedTuple

from sweep.families.base import Parameter


class Range(NamedTuple):
    """The values of a quantity between which the reported constants were measured."""

    name: str
    unit: str
    low: float
    high: float


# Polukhin 1971, chapter VI; what is assumed is said so (docs/thread.md, section 3).
ALPHA = Parameter("alpha", "none", "adhesion, gf/(mm deg); reported 6.17e-3", not_negative=True, default=6.17e-3)
BETA = Parameter("beta", "none", "friction, 1/deg; reported 1.12e-2", not_negative=True, default=1.12e-2)
BENDING = Parameter("B", "none", "bending, gf mm^2; reported 0.714", not_negative=True, default=0.714)
COUNT = Parameter("N", "none", "metric count of the thread, m/g; reported No. 98/3", positive=True, default=98.0 / 3.0)
DENSITY = Parameter("gamma", "none", "density of the thread, g/cm^3; assumed", positive=True, default=0.8)
RADIUS = Parameter("R", "none", "radius of the contour, mm", not_negative=True)
CONTOUR_CONSTANTS = (ALPHA, BETA, BENDING, COUNT, DENSITY)
MEASURED_RADIUS = Range("R", "mm", 0.125, 7.5)

# Through all three reported points: x 1.19 from 0.08 to 1.23 m/s, x 1.16 from there to 7.4 m/s.
REFERENCE_SPEED = Parameter("v_ref", "none", "speed at which the tension is known, m/s", positive=True, default=1.23)
SHARE = Parameter("K", "none", "share of the tension that grows with the speed", default=0.39494858849527207)
EXPONENT = Parameter("n", "none", "exponent of the speed", positive=True, default=0.189538228897548)
SPEED_CONSTANTS = (REFERENCE_SPEED, SHARE, EXPONENT)
MEASURED_SPEED = Range("v", "m/s", 0.08, 7.4)
