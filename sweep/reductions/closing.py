"""An interval as a closed turn, so that one search for extrema serves both.

The variable runs from one end of the interval to the other and back while an angle t makes a full turn:
x = middle - half cos(t).  Every smooth function of x is a smooth periodic function of t, and both ends of the interval
are stationary in t: an extremum at an end is found like any other.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from sweep.families.base import Angles, Array, Columns, Family, PoseFunction
from sweep.families.domain import Interval


def on_closed_turn(family: Family) -> Family:
    """Return the family with poses over a closed turn; the family itself unless its domain is an interval."""
    domain = family.domain
    if not isinstance(domain, Interval):
        return family
    precise = family.precise_poses
    return replace(
        family,
        poses=partial(_poses, family.poses, domain),
        precise_poses=None if precise is None else partial(_poses, precise, domain),
        derivative_of={},  # with respect to x, not to t
    )


def variable(family: Family, designs: Array, turned: Array, err: Array) -> tuple[Array, Array]:
    """Return the domain's variable at angles of the closed turn, (n,), and its error from that of the angle."""
    if not isinstance(family.domain, Interval):
        return turned, err
    low, high = family.domain.ends(designs)
    half = 0.5 * (high - low)
    # Near an end x is stationary in t: the second order counts there.
    return _place(low, high, np.cos(turned)), np.abs(half) * (np.abs(np.sin(turned)) * err + 0.5 * err**2)


def _place(low: Array, high: Array, cos: Array) -> Array:
    return 0.5 * (low + high) - 0.5 * (high - low) * cos


def _poses(poses: PoseFunction, domain: Interval, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    low, high = (end[:, None] for end in domain.ends(designs))
    place = _place(low, high, angles.cos)
    still = np.zeros_like(place)
    return poses(designs, Angles(np.ascontiguousarray(place), still, still), wanted)
