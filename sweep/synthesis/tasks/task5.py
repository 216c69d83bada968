"""Task 5: crank-rocker and slotted link, prescribed path of the sliding pin along the slot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families import slotted
from sweep.families.base import Angles, Array
from sweep.synthesis.tasks.crank_rocker import (
    check_given,
    designs_on_locus,
    motion,
    named,
    pressure_limit,
    size_limits,
    size_names,
    turn,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked


class SlotPosition(NamedTuple):
    """An intermediate value: crank angle from the extended position on [rad], and how far rho has changed [length]."""

    dphi: float
    drho: float


class Slot(NamedTuple):
    """Distance of the pin from the pivot of the slotted link and its derivatives with respect to the rocker angle."""

    rho: Array
    first: Array
    second: Array


def slot(a2: Array, e2: Array, t: Array) -> Slot:
    """Planar slotted link: pin at radius a2 on the rocker, pivot at distance e2, t the angle between them.

    Equation (17) of docs/tasks.md, which is the fork slot of docs/slotted.md.  ``a2``, ``e2`` : (n,), their signs are
    equal and without effect; ``t`` : (n, m).
    """
    places = {name: np.abs(values) for name, values in (("a", a2), ("e", e2))}
    matrix = np.array([[p.default or 0.0 for p in slotted.PARAMETERS]] * len(t))
    for k, parameter in enumerate(slotted.PARAMETERS):
        matrix[:, k] = places.get(parameter.name, matrix[:, k])
    columns = slotted.poses(matrix, Angles.of(t), frozenset({"rho", "drho", "d2rho"}))
    return Slot(*(np.asarray(columns[name], np.float64) for name in ("rho", "drho", "d2rho")))


@dataclass(frozen=True)
class Task5:
    """The unknowns are phi1 and f of stage 1, angle t1 and ratio e2/a2 of the slotted link; a2 follows from rho0.

    Parameters
    ----------
    swing, phi0, e, g, alpha, f_range : stage 1, as `EngineeringMethod`; |swing| < pi
    rho0 : change of rho from the extended to the folded position [length], signed
    positions : intermediate values, each an equation
    kappa : +1, or -1 if the slotted link is driven through a reversing gear
    ratio_range : where e2/a2 is looked for, not containing 1
    max_pressure_angle : limit of stage 1 over the whole turn [rad]
    bounds : of the lengths found, by name (a1, b1, c1, a2, e2)
    """

    swing: float
    phi0: float
    e: float
    g: float
    alpha: float
    f_range: tuple[float, float]
    rho0: float
    positions: tuple[SlotPosition, ...] = ()
    kappa: int = 1
    ratio_range: tuple[float, float] = (1.2, 5.0)
    max_pressure_angle: float = 0.5 * np.pi
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    objective: str = field(default="largest |d2rho/dphi2|", init=False)

    def __post_init__(self) -> None:
        check_given(self)
        if not abs(self.swing) < np.pi:
            raise InputError("swing", self.swing, "an angle below pi, or its negative", "Task5")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Places of both stages."""
        return (
            Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True),
            Unknown("f", *self.f_range),
            Unknown("t1", 0.0, 2.0 * np.pi, periodic=True),
            Unknown("ratio", *self.ratio_range),
        )

    @property
    def equations(self) -> tuple[str, ...]:
        """The intermediate values."""
        return tuple(f"rho at position {k + 1}" for k in range(len(self.positions)))

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angle of stage 1, a slot that does not turn back, bounds of the lengths."""
        return ("pressure angle", "a2 positive", "no return of the pin", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `SynthesisTask`."""
        ones = np.ones(len(x))
        phi1, t1, ratio = x[:, 0], x[:, 2], x[:, 3]
        fixed = (self.swing * ones, self.phi0 * ones, phi1, self.e * ones, x[:, 1])
        designs, psi1 = designs_on_locus(*fixed, self.g * ones, self.alpha * ones)
        t2 = t1 + self.kappa * self.swing
        gain = (slot(ones, ratio, t2[:, None]).rho - slot(ones, ratio, t1[:, None]).rho)[:, 0]
        a2 = self.rho0 / np.where(gain == 0.0, np.nan, gain)
        e2 = ratio * a2

        def rho_at(dphi: Array) -> tuple[Slot, Array, Array]:
            angles = type(turn()).of(phi1[:, None] + dphi)
            law = motion(designs, angles, "psi", "dpsi", "d2psi")
            t = t1[:, None] + self.kappa * (np.asarray(law["psi"], np.float64) - psi1[:, None])
            first, second = (np.asarray(law[name], np.float64) for name in ("dpsi", "d2psi"))
            return slot(a2, e2, t), first, second

        here, first, second = rho_at(turn().phi)
        curve = self.kappa * second * here.first + first * first * here.second
        start = slot(a2, e2, t1[:, None]).rho[:, 0]
        equations = []
        for position in self.positions:
            there, _, _ = rho_at(np.array([[position.dphi]]))
            equations.append((there.rho[:, 0] - start - position.drho) / abs(self.rho0))
        sign = np.sign(np.sin(0.5 * (t1 + t2)))
        slacks = [pressure_limit(designs, self.max_pressure_angle), a2 / abs(self.rho0),
                  np.minimum(sign * np.sin(t1), sign * np.sin(t2))]  # fmt: skip
        columns = named(designs, "1") | {"a2": a2, "e2": e2, "t1": t1, "kappa": self.kappa * ones}
        limits = stacked(len(x), [*slacks, *size_limits(columns, self.bounds)])
        return Candidates(stacked(len(x), equations), limits, curve, columns)
