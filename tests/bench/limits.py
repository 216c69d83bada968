"""Limit positions of crank-rocker and slider-crank against 50 digits: are their error estimates exceeded?"""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp, mpf

from kernels import status as st
from studies.accuracy.regions import regions
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from tests.reference import rssp as slider
from tests.support.sixty_digits import turning_point
from tests.support.turn_designs import RSSP, RSSR, slider_cranks

EACH = 100
ANGLES = ("phi_ext", "phi_fold", "phi0", "stroke_ratio")
ROCKER = ("psi_ext", "psi_fold", "swing", *ANGLES)
SLIDER = ("s_ext", "s_fold", "stroke", *ANGLES)
DIAL = Accuracy(target=1e-8)


def exact_limits(ends: list[tuple[Any, Any]], names: tuple[str, ...]) -> dict[str, Any]:
    """All outputs from the crank angle and the follower's place of both limits."""
    (phi1, first), (phi2, second) = ends
    turn, travel = 2 * mp.pi, second - first
    phi0 = (phi2 - phi1) % turn
    values = (first, second, abs(travel) if "stroke" in names else travel)
    return dict(zip(names, (*values, phi1, phi2, phi0, phi0 / (turn - phi0)), strict=True))


def slider_place(design: Any, phi: float) -> tuple[Any, Any]:
    """Crank angle and position of the slider's limit next to phi."""

    def place(x: Any) -> Any:
        return slider.joints(*(mpf(float(v)) for v in design), x)[1][1]

    here = mp.findroot(lambda x: mp.diff(place, x), (mpf(phi), mpf(phi) + mpf(10) ** -10), tol=mpf(10) ** -40)
    return here, place(here)


def off(value: float, exact: Any, name: str) -> float:
    """Distance of the two, of angles whatever full turns lie between."""
    error = mpf(float(value)) - exact
    if name.startswith(("phi_", "phi0", "psi", "swing")):
        error -= 2 * mp.pi * mp.nint(error / (2 * mp.pi))
    return float(abs(error))


def limits() -> None:
    """Estimates that were exceeded, and the largest part of one that an error is, by region."""
    print(f"\n{'limit positions':34} {'estimates':>10} {'above':>6} {'largest error/err_':>20}")
    cases = [(RSSR, region.name, region.designs, ROCKER) for region in regions(EACH, 11)]
    cases.append((RSSP, "general", slider_cranks(5 * EACH, 11), SLIDER))
    for family, region, designs, names in cases:
        found = design_outputs(family, designs, names, DIAL)
        near, parts = turning_point if family is RSSR else slider_place, []
        for i in np.flatnonzero(found["status"] == st.OK):
            with mp.workdps(50):
                ends = [near(designs[i], float(found[name][i])) for name in ("phi_ext", "phi_fold")]
                exact = exact_limits(ends, names)
                parts += [(off(found[n][i], exact[n], n) / float(found[f"err_{n}"][i]), n) for n in names]
        above, (largest, where) = sum(part > 1.0 for part, _ in parts), max(parts)
        print(f"{family.name:8}{region:26} {len(parts):10d} {above:6d} {largest:7.2f} {where}")
