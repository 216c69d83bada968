"""Look for wrong answers of `summarise` that call themselves right: ``make search-wrong`` (minutes, not part of CI).

Random designs of every family, chain and effect of the register, ordinary ones and hard ones.  Every reduction of every
pose output is held against the highest of 20 000 poses, climbed; every other design output against itself at a finer
accuracy.  Reported is what differs by more than its ``err_`` and what rounding the inputs does, where the status is OK.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Columns, Family, Interval
from sweep.families.chain import Chain
from sweep.families.names import error_of
from sweep.families.reduction import prefixes
from sweep.quantities.resolve import output_names
from sweep.reductions.sampling import on_closed_turn
from tests.search.brute import TWO_PI, Best, climbed, dense, poses
from tests.search.subjects import KINDS, Subject, all_at_once, random_designs, subjects

TARGETS = (1e-4, 1e-8)
WINDOWS = ((0.0, 0.6), (0.3, 0.35), (0.9, 1.0))  # shares of the stroke
ROUNDING = 1e-13  # of a curve's size: what a pose may be wrong by anyhow
BLUR = 8.0  # times what rounding the inputs moved a value by in eight tries


class Fault(dict):  # type: ignore[type-arg]
    """One answer that is wrong, as a row of the report."""


def reductions(full: Family, output: str) -> list[str]:
    """Return the design outputs made of a pose output."""
    return [f"{prefix}{output}" for prefix in prefixes(full.domain)]


def asked(full: Family, designs: Array, names: Sequence[str], target: float) -> Columns:
    """Return design outputs with their errors."""
    return design_outputs(full, designs, names, Accuracy(target=target))


def faults_of_curve(subject: Subject, full: Family, designs: Array, output: str, curve: Array) -> Iterator[Fault]:
    """Yield what is wrong about one pose output; ``curve`` (n, DENSE) is its dense grid."""
    closed = on_closed_turn(full)
    variable = full.domain.name
    names = reductions(full, output)
    size, span = np.abs(curve).max(axis=1), np.ptp(curve, axis=1)
    wraps = full.pose_output[output].wraps
    tops = {mode: climbed(closed, designs, output, mode, curve) for mode in (0, 1, -1)}
    for target in TARGETS:
        got = asked(full, designs, names, target)
        ok = got["status"] == st.OK
        for kind, mode in (("max_abs", 0), ("max", 1), ("min", -1)):
            if (wraps and mode == 0) or (isinstance(full, Chain) and f"{kind}_{output}" == "max_pressure_angle"):
                continue  # the magnitude of an angle known up to full turns; of a chain the stage where it is largest
            name, place = f"{kind}_{output}", f"{variable}_{kind}_{output}"
            best, sign = tops[mode], -1.0 if mode == -1 else 1.0
            value, err = sign * np.asarray(got[name]), np.asarray(got[error_of(name)])
            low = best.value - value
            if wraps:
                low -= TWO_PI * np.rint(low / TWO_PI)
            allowed = err + BLUR * best.blur + ROUNDING * size
            yield from faults("low", name, target, ok & ~(low <= allowed), value, best.value, err, allowed, low)
            yield from faults("high", name, target, ok & ~(-low <= allowed), value, best.value, err, allowed, -low)
            loose = ok & (err > 1.01 * target * np.where(mode == 0, size, span) + BLUR * best.blur + ROUNDING * size)
            yield from faults("loose", name, target, loose, value, best.value, err, target * size, err)
            at, err_at = np.asarray(got[place]), np.asarray(got[error_of(place)])
            lacks = missed(full, designs, output, mode, at, err_at, best, wraps)
            allowed = err + BLUR * best.blur + ROUNDING * size
            yield from faults("place", place, target, ok & ~(lacks <= allowed), at, best.phi, err_at, allowed, lacks)
        if not isinstance(full.domain, Interval):
            name = f"rms_{output}"
            mean = np.sqrt((curve**2).mean(axis=1))
            parts = [np.sqrt((curve[:, k::p] ** 2).mean(axis=1)) for p in (2, 5) for k in range(p)]
            doubt = 2.0 * np.max([np.abs(part - mean) for part in parts], axis=0)
            value, err = np.asarray(got[name]), np.asarray(got[error_of(name)])
            allowed = err + doubt + BLUR * tops[0].blur + ROUNDING * size
            off = np.abs(value - mean)
            yield from faults("mean", name, target, ok & ~(off <= allowed), value, mean, err, allowed, off)


def missed(
    full: Family, designs: Array, output: str, mode: int, at: Array, err_at: Array, best: Best, wraps: bool
) -> Array:
    """Return how much lower than the best the curve is at a place and as far beside it as its error says."""
    step = np.where(np.isfinite(err_at), err_at, 0.0)
    beside = np.where(np.isfinite(at), at, 0.0)[:, None] + step[:, None] * np.linspace(-1.0, 1.0, 9)
    if isinstance(full.domain, Interval):
        low, high = full.domain.ends(designs)
        beside = np.clip(beside, np.minimum(low, high)[:, None], np.maximum(low, high)[:, None])
    found, status = poses(full, designs, beside, (output,))
    values = np.abs(found[output]) if mode == 0 else mode * found[output]
    lacks = best.value[:, None] - values
    if wraps:
        lacks -= TWO_PI * np.rint(lacks / TWO_PI)
    lacks = np.where(status == st.OK, lacks, np.inf).min(axis=1)
    return np.where(np.isfinite(at), lacks, np.inf)


def faults(
    kind: str, name: str, target: float, which: Array, value: Array, true: Array, err: Array, allowed: Array, off: Array
) -> Iterator[Fault]:
    """Yield one row of the report for each design in ``which``."""
    for k in np.flatnonzero(which):
        numbers = {"value": value[k], "true": true[k], "err": err[k], "off": off[k], "allowed": allowed[k]}
        yield Fault(kind=kind, name=name, target=target, design=int(k), **{n: float(x) for n, x in numbers.items()})


def faults_of_others(full: Family, designs: Array, curves: set[str], timeout: float) -> Iterator[Fault]:
    """Yield design outputs, no reductions, that differ from themselves at a finer accuracy by more than errors."""
    reduced = {name for output in full.pose_names for name in reductions(full, output)}
    start = time.process_time()
    for name in output_names(full):
        if name in reduced or name in full.parameter_names or time.process_time() - start > timeout:
            continue
        if "." in name:  # a member says that as it says it alone
            continue
        window = (0.2, 0.7) if name == "window_angle" else None
        answers = [design_outputs(full, designs, [name], Accuracy(target=t), window) for t in (1e-3, 1e-6, 1e-10)]
        fine = answers[-1]
        for target, got in zip((1e-3, 1e-6), answers, strict=False):
            ok = (got["status"] == st.OK) & (fine["status"] == st.OK)
            value, true = (np.asarray(x[name], np.float64) for x in (got, fine))
            err = np.asarray(got[error_of(name)], np.float64) + np.asarray(fine[error_of(name)], np.float64)
            off = np.abs(value - true)
            off = np.minimum(off, np.abs(off - TWO_PI)) if name.startswith("phi") else off
            allowed = err + ROUNDING * np.abs(true)
            yield from faults("itself", name, target, ok & ~(off <= allowed), value, true, err, allowed, off)


def faults_of_window(full: Family, designs: Array, output: str, curve: Array, place: Array) -> Iterator[Fault]:
    """Yield what is wrong about the part of a curve inside a window of the stroke, against the poses of its grid.

    A window ends between two poses of the grid: there the curve may be higher by what one step changes.
    """
    least, most = place.min(axis=1, keepdims=True), place.max(axis=1, keepdims=True)
    for part in WINDOWS:
        low, high = (least + share * (most - least) for share in part)
        values = np.where((place >= low) & (place <= high), np.abs(curve), -np.inf)
        highest, step = values.max(axis=1), np.abs(np.diff(curve, axis=1)).max(axis=1)
        for target in TARGETS:
            name = f"max_abs_{output}"
            got = design_outputs(full, designs, [name], Accuracy(target=target), part)
            ok, value, err = got["status"] == st.OK, np.asarray(got[name]), np.asarray(got[error_of(name)])
            slack = err + step  # the grid's own window is that of the highest and lowest of its poses
            yield from faults("window low", name, target, ok & ~(highest <= value + slack), value, highest, err, slack,
                              highest - value)  # fmt: skip
            slack = err + 2.0 * step
            yield from faults("window high", name, target, ok & ~(value <= highest + slack), value, highest, err, slack,
                              value - highest)  # fmt: skip


def search(subject: Subject, kind: str, n: int, seed: int) -> list[Fault]:
    """Return all faults of some designs of one kind."""
    designs = random_designs(subject, kind, n, seed)
    if not len(designs):
        return []
    full = all_at_once(subject.family)
    curves, exist = dense(on_closed_turn(full), designs, subject.outputs)
    designs, curves = designs[exist], {name: values[exist] for name, values in curves.items()}
    found: list[Fault] = []
    for output in subject.outputs if len(designs) else ():
        if not np.isfinite(curves[output]).all():
            found.append(Fault(kind="nan", name=output, target=0.0, design=-1))
            continue
        found += faults_of_curve(subject, full, designs, output, curves[output])
        if full.pose_output[output].windowed and full.position in curves:
            found += faults_of_window(full, designs, output, curves[output], curves[full.position])
    if len(designs):
        found += faults_of_others(full, designs, set(subject.outputs), 30.0)
    for fault in found:
        fault["subject"], fault["designs"] = subject.name, kind
        if fault["design"] >= 0:
            fault["hex"] = [float(x).hex() for x in designs[fault["design"]]]
    return found


def main() -> None:
    """Search, print a table of faults by class, and write them all to a file."""
    parser = argparse.ArgumentParser(prog="python -m tests.search.wrong", description=__doc__)
    parser.add_argument("--subject", action="append", help="a family, chain or effect; all if left out")
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--designs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", default="")
    arguments = parser.parse_args()
    known = subjects()
    everything: list[Fault] = []
    for name in arguments.subject or known:
        start = time.process_time()
        subject = known[name]()
        found = [
            f for kind in arguments.kind or KINDS for f in search(subject, kind, arguments.designs, arguments.seed)
        ]
        everything += found
        count = Counter((f["kind"], f["name"]) for f in found if f["kind"] != "loose")
        loose = sum(f["kind"] == "loose" for f in found)
        print(f"{name:40} {time.process_time() - start:6.1f} s  {len(found) - loose} wrong, {loose} loose", flush=True)
        for (kind, output), number in count.most_common(12):
            worst = max((f for f in found if (f["kind"], f["name"]) == (kind, output)), key=lambda f: f.get("off", 0.0))
            numbers = ", ".join(f"{key} {worst[key]:.10g}" for key in ("value", "true", "err", "off") if key in worst)
            print(f"    {number:4} {kind:6} {output}: {worst['designs']} {worst['target']:g}: {numbers}", flush=True)
        if arguments.out:
            Path(arguments.out).write_text(json.dumps(everything), encoding="utf-8")
    sys.exit(bool([f for f in everything if f["kind"] != "loose"]))


if __name__ == "__main__":
    main()
