"""The search for true extrema from poses alone: its errors, its estimates of them, its time: ``make bench-extrema``.

The two tables of docs/extrema.md.  Errors against poses in twice the working precision about the peaks that eight times
the samples find, which tests/reductions/test_extrema_reference.py compares with brute force.  Families without their
own steps.  Then the crank-rocker's own search against the proof of its maxima, and limit positions against 50 digits.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from kernels import status as st
from studies.accuracy.machine import description
from studies.accuracy.regions import regions, rotatable
from studies.accuracy.timing import seconds
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.families.reduction import Mode
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, peak_search
from tests.bench.limits import limits
from tests.support.climbing import climbed
from tests.support.turn_designs import (
    GUIDE,
    NEEDLE,
    RSSP,
    RSSR,
    crank_rockers,
    guided_four_bars,
    needle_drives,
    slider_cranks,
)

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
    (RSSP, slider_cranks, 20_000, "max_abs_d2s", WHOLE, (1e-8, 1e-12)),
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


def exact(family: Any, designs: Any, name: str, window: tuple[float, float] | None) -> tuple[Any, Any]:
    """Values and bounds of their errors: climbed in twice the working precision, windowed ones searched again."""
    with patch.object(peak_search, "START", 8 * peak_search.START):
        if window is not None:
            found = design_outputs(family, designs, [name], Accuracy(target=1e-13), window)
            return found[name], found[f"err_{name}"]
        modes: dict[str, tuple[tuple[str, Mode], ...]] = {"stroke": (("s", 1), ("s", -1))}
        requests = [Request(*r) for r in modes.get(name, ((name.removeprefix("max_abs_"), 0),))]
        found, _ = extrema.true_extrema(family, designs, requests, 1e-10, locate=True)
    values = [climbed(family, designs, r.pose, r.mode, found[r].phi) for r in requests]
    return values[0] - values[1] if name == "stroke" else values[0], 0.0


def errors() -> None:
    """Largest relative error, wrong peaks and estimates that were too small."""
    print(
        f"{'designs':>8} {'family':24} {'output':14} {'target':>7} {'error':>8} {'wrong peaks':>12} {'above err_':>11}"
    )
    for family, make, n, name, window, targets in ERRORS:
        designs = turning(family, make, n)
        _compare(family, designs, family.name, name, window, targets)
    for region in regions(2000, 5):
        _compare(ALONE, region.designs, region.name, "max_abs_d2psi", WHOLE, (1e-3, 1e-8, 1e-12))


def _compare(
    family: Any, designs: Any, label: str, name: str, window: tuple[float, float] | None, targets: tuple[float, ...]
) -> None:
    values, known = exact(family, designs, name, window)
    for target in targets:
        found = design_outputs(family, designs, [name], Accuracy(target=target), window)
        good = found["status"] == st.OK  # close to a change point the samples may not resolve the curve
        off = np.abs(found[name] - values)[good]
        share = off / np.abs(values[good])
        wrong = (share > max(WRONG_PEAK, target)).sum()
        above = (off > (found[f"err_{name}"] + known)[good]).sum()
        print(
            f"{good.sum():8d} {label:24} {name:14} {target:7.0e} {share.max():8.1e} {wrong:12d} {above:11d}", flush=True
        )


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
    limits()
    times()
