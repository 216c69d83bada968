"""Work and precision: error against the reference and time per design of every method in every region."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy import reference
from studies.accuracy.lookup import position_methods
from studies.accuracy.methods import Method, acceleration_methods, swing_methods
from studies.accuracy.regions import Region
from studies.accuracy.timing import Spread, spread
from sweep.families.base import Angles, Array

if TYPE_CHECKING:
    import pandas as pd

SAMPLES = tuple(2**k for k in range(5, 15))
TARGETS = tuple(10.0**-k for k in range(3, 13))
DESIGNS, ANGLES, JUDGED = 200, 360, 12  # of positions: designs a region, crank angles timed, crank angles judged
SMOKE_SAMPLES, SMOKE_TARGETS = (32, 512), (1e-3, 1e-9)


def work_table(regions: Iterable[Region], smoke: bool) -> pd.DataFrame:
    """Return one row per quantity, region and method:
    largest and median error, time, how many designs without an answer.

    Errors of extrema are relative, those of positions in rad; a time is that of one design, of positions for
    :data:`ANGLES` of its crank angles.
    """
    samples, targets = (SMOKE_SAMPLES, SMOKE_TARGETS) if smoke else (SAMPLES, TARGETS)
    rows = []
    for region in regions:
        rows += _position_rows(region, samples, 8 if smoke else DESIGNS)
        exact = reference.largest_acceleration(region.designs)
        rows += _extremum_rows("max_abs_d2psi", region, region.designs, exact, acceleration_methods(samples, targets))
        swing = reference.swing(region.designs)
        swings = np.isfinite(swing)
        designs = np.ascontiguousarray(region.designs[swings])
        rows += _extremum_rows("swing", region, designs, swing[swings], swing_methods(samples, targets))
    return _frame(rows)


def _position_rows(region: Region, samples: tuple[int, ...], count: int) -> list[dict[str, object]]:
    """Return errors at few angles, a third of them crowded about the sharpest place; times at many."""
    generator = np.random.default_rng(len(region.name))
    designs = np.ascontiguousarray(region.designs[:count])
    many = generator.uniform(0.0, 2.0 * np.pi, (len(designs), ANGLES))
    few = many[:, :JUDGED].copy()
    away = 10.0 ** generator.uniform(-9.0, 0.0, (len(designs), JUDGED // 3))
    few[:, : JUDGED // 3] = np.mod(reference.hardest_angle(designs)[:, None] + away, 2.0 * np.pi)
    exact = [[reference.position(design, phi) for phi in row] for design, row in zip(designs, few, strict=True)]
    rows = []
    for judged, timed in zip(position_methods(samples, few), position_methods(samples, many), strict=True):
        found = judged.run(designs)
        error = np.array(
            [
                max(
                    reference.angle_error(got, psi) if np.isfinite(got) else np.nan
                    for got, psi in zip(*pair, strict=True)
                )
                for pair in zip(found, exact, strict=True)
            ]
        )
        took = spread(_call(timed.run, designs))
        rows.append(_row("psi", region, judged, error, took))
    return rows


def _extremum_rows(
    quantity: str, region: Region, designs: Array, exact: Array, methods: list[Method]
) -> list[dict[str, object]]:
    return [
        _row(
            quantity,
            region,
            method,
            np.abs(method.run(designs) - exact) / exact,
            spread(_call(method.run, designs)),
        )
        for method in methods
    ]


def _row(quantity: str, region: Region, method: Method, error: Array, took: Spread) -> dict[str, object]:
    answered = np.isfinite(error)
    return {
        "quantity": quantity,
        "region": region.name,
        "method": method.curve,
        "setting": method.setting,
        "largest_error": float(error[answered].max(initial=0.0)),
        "median_error": float(np.median(error[answered])) if answered.any() else float("nan"),
        "designs": len(error),
        "unanswered": int((~answered).sum()),
        **took.columns(len(error), "design"),
    }


def _call(run: Callable[[Array], Array], designs: Array) -> Callable[[], Array]:
    return lambda: run(designs)


def position_table(regions: Iterable[Region], poses: int) -> pd.DataFrame:
    """Return errors of the poses against 60 digits per region and output:
    largest, and in units of 2^-53 max(cond, |y|).
    """
    rows = []
    for region in regions:
        designs = region.designs[:poses]
        phi = np.random.default_rng(len(region.name)).uniform(0.0, 2.0 * np.pi, len(designs))
        angles = Angles.of(phi[:, None])
        columns = reference.RSSR.poses(designs, angles, frozenset(reference.ORDERS))
        exact = [reference.transfer_functions(*pair) for pair in zip(designs, phi, strict=True)]
        cond = [reference.condition(*pair) for pair in zip(designs, phi, strict=True)]
        for order, name in enumerate(reference.ORDERS):
            got = np.asarray(columns[name], np.float64)[:, 0]
            errors = [_error(order, g, y[order]) for g, y in zip(got, exact, strict=True)]
            # One condition number may vanish by accident, so those of the lower derivatives count too.
            lower = range(min(order, 1), order + 1)
            sizes = [max(max(c[k], abs(float(y[k]))) for k in lower) for c, y in zip(cond, exact, strict=True)]
            single = [_error(order, float(np.float32(g)), y[order]) for g, y in zip(got, exact, strict=True)]
            rows.append(
                {
                    "output": name,
                    "region": region.name,
                    "poses": len(designs),
                    "largest_error": max(errors),
                    "largest_factor": max(e / (2.0**-53 * s) for e, s in zip(errors, sizes, strict=True)),
                    "largest_error_stored_float32": max(single),
                }
            )
    return _frame(rows)


def _error(order: int, got: float, exact: object) -> float:
    if order == 0:
        return reference.angle_error(got, exact)
    import mpmath

    with mpmath.workdps(reference.DIGITS):
        return float(abs(mpmath.mpf(got) - exact))


def _frame(rows: list[dict[str, object]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(rows)
