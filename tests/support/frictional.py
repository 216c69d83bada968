"""Random mechanisms with friction in all joints, and maxima over many poses."""

from __future__ import annotations

import numpy as np

from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import effect, extended
from sweep.effects.wanted import expanded
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Family

FAMILIES = (
    "friction", "slider_friction", "five_link_friction", "slotted_friction", "swivel_friction",
    "spherical_looper_friction", "cylindrical_looper_friction",
)  # fmt: skip
LINKS, INPUTS = 0.05, 0.5  # spread of the logarithms of lengths, and of the effect's inputs


def frictional(name: str, n: int, seed: int = 5) -> tuple[Family, tuple[str, ...], Array]:
    """Return the family with an effect, its outputs, and n designs; a larger n keeps the first designs."""
    bare = family(effect(name).families[0])
    wanted = tuple(expanded(bare, [name]))
    full = extended(bare, wanted)
    matrix = np.tile(ordinary(full, 1)[0], (n, 1))
    spread = np.random.default_rng(seed).uniform(-1.0, 1.0, matrix.shape)
    for k, p in enumerate(full.parameters):
        if p.choices is None:
            matrix[:, k] *= np.exp(spread[:, k] * (LINKS if k < len(bare.parameters) else INPUTS))
    return full, wanted, matrix


def dense(full: Family, designs: Array, wanted: tuple[str, ...], samples: int) -> dict[str, Array]:
    """Return the outputs from a dense grid: values that poses attain, so no maximum is lower."""
    found = design_outputs(full, designs, wanted=wanted, accuracy=Accuracy(samples=samples))
    return {name: np.asarray(values, np.float64) for name, values in found.items()}
