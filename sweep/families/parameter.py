"""A parameter of a mechanism family: a column of the design matrix, with its unit and what it may be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Unit = Literal[
    "length", "1/length", "angle", "ratio", "sign", "count", "none", "choice",
    "mass", "inertia", "force", "torque", "pressure", "stiffness", "damping", "speed", "angular_acceleration",
    "acceleration", "time", "rotary_damping",
]  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """One column of the design matrix."""

    name: str
    unit: Unit
    text: str
    positive: bool = False
    default: float | None = None
    choices: tuple[float, ...] | None = None
    not_negative: bool = False
    not_zero: bool = False

    @property
    def sign(self) -> str:
        """What its sign may be, in a word; empty if anything."""
        words = ((self.positive, "positive"), (self.not_negative, "non-negative"), (self.not_zero, "non-zero"))
        return next((word for holds, word in words if holds), "")

    def wrong_sign(self, values: NDArray[np.float64] | float) -> NDArray[np.bool_]:
        """Return which values have a sign that it may not have."""
        if self.not_zero:
            return np.asarray(values == 0.0)
        if not self.sign:
            return np.zeros(np.shape(values), np.bool_)
        return np.asarray(values <= 0.0 if self.positive else values < 0.0)

    @property
    def choice(self) -> str:
        """The values it may have, in words; signs are shown where they are the choice."""
        signed = any(x < 0.0 for x in self.choices or ())
        return " or ".join(f"{x:+g}" if signed else f"{x:g}" for x in self.choices or ())
