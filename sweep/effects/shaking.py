"""M1: shaking force without masses, for comparing mechanisms before anything is known of their masses."""

from __future__ import annotations

import numpy as np

from kernels.effects.shaking import centre_acceleration
from sweep.effects.base import Effect, Scene
from sweep.families.base import Columns, Output, filled

EQUATION = "M1 (1), (2)"
NAME = "shaking_estimate"

OUTPUTS = (
    Output(
        NAME, "length",
        "acceleration analogue of the links' common centre of mass: shaking force over moving mass and square of the "
        "crank speed, if the links are slender rods of one mass per length",
        EQUATION,
    ),
    *(Output(f"{NAME}_{axis}", "length", f"{axis} of the shaking estimate, fixed axes", EQUATION) for axis in "xyz"),
)  # fmt: skip
_NAMES = tuple(o.name for o in OUTPUTS)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the magnitude and components of every pose; in a chain with respect to the crank angle of stage 1."""
    first, second = scene.rates or (np.ones(scene.shape), np.zeros(scene.shape))
    rates = np.ascontiguousarray(first), np.ascontiguousarray(second)
    return filled(centre_acceleration, (*scene.records, *rates), _NAMES, wanted, scene.status())


EFFECT = Effect(
    key="M1",
    name="shaking",
    title="shaking force without masses: links like slender rods of one mass per length",
    equation=EQUATION,
    formulas=(
        "(1) (a + b + c) S'' = a B''/2 + b (B'' + C'')/2 + c C''/2; a slider counts for nothing (c = 0)",
        "(2) crank of a chain's later stage: P'' becomes w^2 P'' + w' P', w = its speed over that of stage 1",
        "    shaking force = moving mass * crank speed^2 * S''",
    ),
    needs=(),
    inputs=(),
    outputs=OUTPUTS,
    compute=compute,
    called_for="comparing mechanisms before masses are known; joint loads give the shaking force itself",
    negligible="slow machines, heavy frames",
)
