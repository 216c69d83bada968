"""Design outputs of whole-turn effects: reductions of curves that the effect knows as Fourier series."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from kernels.turn_series import turn_extremes
from sweep.effects.base import Status
from sweep.families.base import Array, Columns, Output

RESOLVED = 1e-9

_TEXTS = {
    "max": "largest value over one turn of",
    "min": "smallest value over one turn of",
    "max_abs": "largest magnitude over one turn of",
    "phi_max_abs": "crank angle of the largest magnitude of",
    "range": "largest minus smallest value over one turn of",
    "rms": "root mean square over one turn of",
}


def reduction_outputs(outputs: Sequence[Output]) -> tuple[Output, ...]:
    """The reductions over the turn of these pose outputs, as design outputs of the effect itself."""
    return tuple(
        Output(f"{base}_{o.name}", "rad" if base == "phi_max_abs" else o.unit, f"{text} {o.name}: {o.text}", o.equation)
        for o in outputs
        for base, text in _TEXTS.items()
    )


def reductions(name: str, values: Array, status: Status) -> Columns:
    """All reductions of one curve from its samples on a uniform odd grid, (n, N), with their errors.

    ``status`` (n,) becomes NOT_CONVERGED where the grid does not resolve the curve; what is not OK gives nan.
    """
    n = len(values)
    largest, phi_largest, least, phi_least, rms, missed = (np.empty(n) for _ in range(6))
    turn_extremes(np.ascontiguousarray(values), largest, phi_largest, least, phi_least, rms, missed)
    status[(status == st.OK) & ~(missed < RESOLVED)] = st.NOT_CONVERGED
    upward = np.abs(largest) >= np.abs(least)
    size = np.maximum(np.abs(largest), np.abs(least))
    # The curve itself is known as well as the steady state it comes from was resolved.
    err = (missed + RESOLVED) * size
    found = {
        "max": (largest, err),
        "min": (least, err),
        "max_abs": (size, err),
        # The slope's zero is as sharp as the square root of the value's error.
        "phi_max_abs": (np.where(upward, phi_largest, phi_least), np.full(n, np.sqrt(RESOLVED))),
        "range": (largest - least, 2.0 * err),
        "rms": (rms, err),
    }
    columns: Columns = {}
    for base, (value, error) in found.items():
        columns[f"{base}_{name}"] = np.where(status == st.OK, value, np.nan)
        columns[f"err_{base}_{name}"] = error
    return columns


def chosen(columns: Columns, wanted: frozenset[str], status: Status) -> Columns:
    """The wanted outputs with their errors, and the status."""
    return {name: x for name, x in columns.items() if name.removeprefix("err_") in wanted} | {"status": status}
