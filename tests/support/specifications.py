"""Random specifications of crank-rockers with c = 1: swing, phi0, pressure angle limit and ranges of the links."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem
from sweep.study import Limit

RSSR = family("rssr")
NAMES = ("a", "b", "e", "f", "g", "alpha")  # relative to c
LOW, HIGH = np.array([0.1, 0.5, 0.0, -1.5, -1.5, 0.0]), np.array([0.9, 4.0, 2.5, 1.5, 1.5, math.pi / 2])


def specifications(seed: int) -> Iterator[Problem]:
    """Yield problems with swing and phi0 of a random turning mechanism, a limit on the pressure angle, a random box.

    The mechanism itself is unknown to the search; it ensures that a solution exists.
    """
    rng = np.random.default_rng(seed)
    while True:
        middle = LOW + rng.random(len(NAMES)) * (HIGH - LOW)
        lower, upper = LOW + 0.7 * rng.random() * (middle - LOW), HIGH - 0.7 * rng.random() * (HIGH - middle)
        names = ["swing", "phi0", "max_pressure_angle", "margin"]
        design = [*middle[:2], 1.0, *middle[2:], rng.choice([-1.0, 1.0])]
        found = design_outputs(RSSR, np.array([design]), names, Accuracy(target=1e-9))
        swing, phi0, pressure, margin = (float(found[name][0]) for name in names)
        if not margin > 0.1 or not 0.35 < abs(swing) < 2.0 or not pressure < math.radians(60):
            continue
        limit = min(pressure + rng.random() * math.radians(15), math.radians(65))
        limits = (
            Limit("swing", abs(swing), abs(swing)),
            Limit("phi0", phi0, phi0),
            Limit("max_pressure_angle", None, limit),
        )
        yield Problem(RSSR, NAMES, lower, upper, {"c": 1.0}, "max_abs_d2psi", limits)
