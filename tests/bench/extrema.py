"""The search for true extrema from poses alone: its errors, its estimates of them, its time: ``make bench-extrema``.

The two tables of docs/extrema.md.  Errors against the same search with eight times the samples to begin with and a
target of 1e-13, which tests/test_extrema_reference.py compares with brute force.  Families without their own steps.
Then the crank-rocker's own search against the proof of its maxima.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from kernels import status as st
from studies.accuracy.machine import description
from studies.accuracy.regions import rotatable
from studies.accuracy.timing import seconds
from sweep.families.base import Accuracy
from sweep.reductions import extrema
from sweep.summaries import design_outputs
from tests.turn_designs import GUIDE, NEEDLE, RSSR, crank_rockers, guided_four_bars, needle_drives

MARGIN, WRONG_PEAK = 1e-5, 1e-4
PROVEN, PROVEN_SEEDS = 300_000, (1, 2, 3)
FINE = (1e-2, 1e-4, 1e-6, 1e-8, 1e-12)
WHOLE = None
ALONE = replace(RSSR, steps=())
# Family, designs, how many, output, window, targets.
ERRORS: tuple[tuple[Any, Any, int, str, tuple[float, float] | None, tuple[float, ...]], ...] = (
    (ALONE, crank_rockers, 100_000, "max_abs_d2psi", WHOLE, (1e-8,)),
    (ALONE, crank_rockers, 100_000, "max_abs_d3psi", WHOLE, (1e-8,)),
    (NEEDLE, needle_drives, 20_000, "max_abs_d2s", WHOLE, FINE),
    (NEEDLE, needle_drives, 20_000, "max_abs_d3s", WHOLE, (1e-8,)),
    (NEEDLE, needle_drives, 20_000, "max_abs_dev", (0.0, 0.6), (1e-8,)),
    (NEEDLE, needle_drives, 20_000, "stroke", WHOLE, (1e-8,)),
)
TIMES: tuple[tuple[Any, Any, str, tuple[float, float] | None], ...] = (
    (ALONE, crank_rockers, "max_abs_d2psi", WHOLE),
    (GUIDE, guided_four_bars, "max_abs_d2s", WHOLE),
    (GUIDE, guided_four_bars, "max_abs_dev", (0.0, 0.6)),
    (GUIDE, guided_four_bars, "stroke", WHOLE),
    (ALONE, crank_rockers, "margin", WHOLE),
    (GUIDE, guided_four_bars, "margin", WHOLE),
    (NEEDLE, needle_drives, "margin", WHOLE),
)
DIALS = (*(Accuracy(target=x) for x in (1e-2, 1e-4, 1e-8, 1e-12)), Accuracy(samples=360))


def turning(family: Any, make: Any, n: int) -> Any:
    """Designs that turn with a margin above 1e-5."""
    found: list[Any] = []
    seed = 21
    while sum(map(len, found)) < n:
        designs, seed = make(4 * n, seed), seed + 1
        margin = design_outputs(family, designs, ["margin"], Accuracy(target=1e-8))
        found.append(designs[(margin["status"] == st.OK) & (margin["margin"] > MARGIN)])
    return np.ascontiguousarray(np.concatenate(found)[:n])


def errors() -> None:
    """Largest relative error, wrong peaks and estimates that were too small."""
    print(
        f"{'designs':>8} {'family':12} {'output':14} {'target':>7} {'error':>8} {'wrong peaks':>12} {'above err_':>11}"
    )
    for family, make, n, name, window, targets in ERRORS:
        designs = turning(family, make, n)
        with patch.object(extrema, "START", 8 * extrema.START):
            exact = design_outputs(family, designs, [name], Accuracy(target=1e-13), window)
        for target in targets:
            found = design_outputs(family, designs, [name], Accuracy(target=target), window)
            off = np.abs(found[name] - exact[name])
            share = off / np.abs(exact[name])
            wrong = (share > max(WRONG_PEAK, target)).sum()
            above = (off > found[f"err_{name}"] + exact[f"err_{name}"]).sum()
            print(f"{n:8d} {family.name:12} {name:14} {target:7.0e} {share.max():8.1e} {wrong:12d} {above:11d}")


def missed() -> None:
    """Maxima of random crank-rockers that their own search missed, by the proof."""
    print()
    for name in ("max_abs_dpsi", "max_abs_d2psi", "max_abs_d3psi"):
        wrong = unproven = 0
        for seed in PROVEN_SEEDS:
            designs = rotatable(PROVEN, seed)
            found = design_outputs(RSSR, designs, [name], Accuracy(target=1e-8))
            proof = design_outputs(RSSR, designs, [name], Accuracy(target=1e-8, certify=True))
            wrong += int((proof[name] - found[name] > 1e-7 * proof[name]).sum())
            unproven += int((proof["status"] != st.OK).sum())
        print(f"{len(PROVEN_SEEDS) * PROVEN} crank-rockers, {name}: {wrong} peaks missed, {unproven} not proven")


def times() -> None:
    """Microseconds per design."""
    print(f"\n{'us per design':28}" + "".join(f"{d.target or f'N {d.samples}':>9}" for d in DIALS))
    for family, make, name, window in TIMES:
        designs = turning(family, make, 2000)
        took = [seconds(lambda d=dial: design_outputs(family, designs, [name], d, window), 3) for dial in DIALS]  # type: ignore[misc]  # noqa: B023
        print(f"{family.name:12} {name:15}" + "".join(f"{1e6 * t / len(designs):9.1f}" for t in took))


if __name__ == "__main__":
    print(description())
    errors()
    missed()
    times()
