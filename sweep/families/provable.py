"""Loci of limit positions with proven bounds over boxes.

The kernels of the proof are imported by a proof alone, because other evaluations would wait for the import.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from kernels.types import Numbers
from sweep.families.capabilities import ProvableLocus


def _explored(
    by_rocker: bool, question: tuple[Any, ...], search: tuple[Any, ...], leaves: tuple[Numbers, ...]
) -> tuple[int, int]:
    """Return the numbers of leaves filled and boxes judged by :func:`kernels.families.rssr.proof.explore`."""
    from kernels.families.rssr import box_locus, proof
    from kernels.families.rssr.box_problem import BoxQuestion

    formulas = box_locus.by_rocker() if by_rocker else box_locus.by_axes()
    whole: Any = (BoxQuestion(*question), formulas, *search, proof.Leaves(*leaves))
    found = proof.explore(*whole)
    return int(found[0]), int(found[1])


def _tests(lengths: tuple[str, ...]) -> tuple[str, ...]:
    """Return the reasons for failure, one for each kind of row."""
    room = 5 - len(lengths)
    return (
        "ball on the other side of the crank axis", "limits change places", "crank not positive",
        "extended position on the other branch", "folded position on the other branch",
        *(f"{name} too {word}" for name in lengths for word in ("small", "large")), *[""] * (2 * room),
        "pressure angle", "objective", "objective",
        *("rocker earlier than the bound allows", "rocker later than the bound allows") * 2,
        "crank too long for the limits", "crank too short for the limits",
    )  # fmt: skip


OBJECTIVES = {"max_abs_d2psi": 2, "max_abs_dpsi": 1, "max_pressure_angle": 0}

CRANK_ROCKER_BY_AXES = ProvableLocus(
    coordinates=("swing", "phi0", "phi_ext", "e", "f", "g", "alpha"),
    links=("a", "c", "b"),
    objectives=OBJECTIVES,
    rows=_tests(("a", "c", "b")),
    explore=partial(_explored, False),
)

CRANK_ROCKER_BY_ROCKER = ProvableLocus(
    coordinates=("swing", "phi0", "phi_ext", "psi_ext", "c", "f", "alpha"),
    links=("a", "e", "g", "b"),
    objectives=OBJECTIVES,
    rows=_tests(("a", "e", "g", "b")),
    explore=partial(_explored, True),
)
