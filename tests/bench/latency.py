"""A number at once, next to a plain numba function and pylinkage: ``make bench-latency``; five minutes, writes no page.

One design of the planar four-bar, position to acceleration of the rocker; what outputs of many designs take next to the
largest acceleration; what commands take next to the import of numpy and pandas.  Processor time: all of a table are
timed in turn, and the fastest of many short batches counts, as what else the machine does lengthens some, not all.
"""

from __future__ import annotations

import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

import sweep
from studies.accuracy.machine import description
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Family
from tests.bench.peers import _pylinkage
from tests.support.rssr_designs import random_designs
from tests.support.turn_designs import NEEDLE, needle_drives

DESIGN = {"a": 10.0, "b": 40.0, "c": 30.0, "e": 45.0}
POSES, OUTPUTS = ["psi", "dpsi", "d2psi"], ["swing", "max_abs_d2psi"]
ANGLES = (1, 90, 360, 3600, 36000)
BATCH, SECONDS = 3e-4, 1.0  # of one batch, and of all of one table for each of its calls

FRAME = "DataFrame of ten columns"
COMPILED = "compiled poses, from the angle"
OVERHEAD, BOUND, FROM = 20.0, 1.1, 360  # of a bound design: us a call, and times its compiled poses from so many angles
MARKS = {"evaluate, dict": 1.5, "evaluate, DataFrame": 3.0, "summarise, dict": 1.5, "summarise, DataFrame": 3.0}

# Design outputs in bulk, as ratios to the largest acceleration of the same mechanisms, of random designs that turn.
BULK, FINE = 4096, Accuracy(target=1e-8)
SLOWEST, BOTH = 3.0, 1.4
SLOW = (
    "swing", "phi0", "max_pressure_angle", "max_abs_dpsi", "max_abs_d3psi", "max_d2psi", "min_d2psi", "range_d2psi",
    "rms_dpsi", "rms_d2psi",
)  # fmt: skip
SLOW_NEEDLE = ("stroke", "max_abs_ds", "max_pressure_angle1", "rms_ds", "rms_d2s")

# Commands from a full cache of kernels and of byte code: a new process, its processor time.
LIBRARIES, PLAIN = "import numpy, pandas", "a plain numba function, from its cache"
PLAIN_SOURCE = """
import numba, numpy
@numba.njit(cache=True)
def total(x):
    sum = 0.0
    for y in x:
        sum += y
    return sum
total(numpy.ones(3))
"""
REPORTED = ("needle208", "needle208-loads")  # their tiny versions
NUMBER = "import sweep; m = sweep.mechanism('rssr', a=10, b=40, c=25, e=35, f=5, g=-3, alpha='60 deg'); "
COMMANDS = {
    "first number, sweep.mechanism": ("-c", NUMBER + "m.outputs(['max_abs_d2psi'])"),
    "first number, sweep.summarise": ("-c", NUMBER + "sweep.summarise('rssr', m.dimensions, ['max_abs_d2psi'])"),
    "sweep check studies/joint-loads": ("-m", "sweep", "check", "studies/joint-loads"),
}
AT_MOST = {"first number, sweep.mechanism": 0.7, "first number, sweep.summarise": 0.7}  # s
AT_MOST |= {f"sweep report, {name}": 3.0 for name in REPORTED}
TIMES = {"sweep check studies/joint-loads": 3.0}  # of the import
STARTS = 3


@njit(error_model="numpy")
def plain(a: float, b: float, c: float, e: float, phi: np.ndarray, out: np.ndarray) -> None:
    """The textbook's four-bar, as somebody writes it down who needs it once: psi, dpsi, d2psi."""
    for i in range(phi.size):
        x, y = a * math.cos(phi[i]) - e, a * math.sin(phi[i])
        reach = x * x + y * y
        cosine = (reach + c * c - b * b) / (2.0 * c * math.sqrt(reach))
        psi = math.atan2(y, x) - math.acos(cosine)
        u, v = e + c * math.cos(psi) - a * math.cos(phi[i]), c * math.sin(psi) - a * math.sin(phi[i])
        theta = math.atan2(v, u)
        rate = a * math.sin(phi[i] - theta) / (c * math.sin(psi - theta))
        turning = a * math.sin(phi[i] - psi) / (b * math.sin(psi - theta))
        bend = a * math.cos(phi[i] - theta) + b * turning * turning - c * rate * rate * math.cos(psi - theta)
        out[0, i], out[1, i], out[2, i] = psi, rate, bend / (c * math.sin(psi - theta))


def fastest(calls: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Return the least time of each call [s], of batches that take turns."""
    counts = {}
    for name, call in calls.items():
        call()
        begin = time.process_time()
        call()
        counts[name] = max(1, int(BATCH / (time.process_time() - begin)))
    least = dict.fromkeys(calls, math.inf)
    until = time.process_time() + SECONDS * len(calls)
    while time.process_time() < until:
        for name, call in calls.items():
            begin = time.process_time()
            for _ in range(counts[name]):
                call()
            least[name] = min(least[name], (time.process_time() - begin) / counts[name])
    return least


def tables() -> list[str]:
    """Time one pose and one design from a dict and from a DataFrame, as ratios to making a DataFrame."""
    pose, design = DESIGN | {"phi": 0.5}, DESIGN
    ten = {f"c{k}": [1.0] for k in range(10)}
    poses, designs, bound = pd.DataFrame([pose]), pd.DataFrame([design]), sweep.mechanism("four_bar", **DESIGN)
    found = fastest(
        {
            FRAME: lambda: pd.DataFrame(ten),
            "evaluate, dict": lambda: sweep.evaluate("four_bar", pose, POSES),
            "evaluate, DataFrame": lambda: sweep.evaluate("four_bar", poses, POSES),
            "summarise, dict": lambda: sweep.summarise("four_bar", design, OUTPUTS),
            "summarise, DataFrame": lambda: sweep.summarise("four_bar", designs, OUTPUTS),
            "mechanism, poses": lambda: bound.poses(0.5, POSES),
            "mechanism, outputs": lambda: bound.outputs(OUTPUTS),
            "mechanism, with_": lambda: bound.with_(a=10.5),
        }
    )
    lines = [f"one design{'':22}   us    x {FRAME}"]
    for name, seconds in found.items():
        ratio = seconds / found[FRAME]
        mark = "" if name not in MARKS else f"  {'holds' if ratio <= MARKS[name] else 'missed'}: {MARKS[name]:g}"
        lines.append(f"{name:28}{1e6 * seconds:10.1f}{ratio:10.2f}{mark}")
    return lines


def turns() -> list[str]:
    """Time a design over more and more angles, as ratios to its compiled poses."""
    bound, precise = sweep.mechanism("four_bar", **DESIGN), family("four_bar").precise()
    matrix = np.array([[DESIGN.get(p.name, p.default) for p in precise.parameters]], np.float64)
    lines = [f"{COMPILED} [us], and others as ratios to it"]
    for count in ANGLES:
        phi = np.arange(count) * (2.0 * math.pi / count)
        out = np.empty((3, count))
        calls: dict[str, Callable[[], object]] = {
            COMPILED: lambda phi=phi: precise.poses(matrix, Angles.of(phi[None]), frozenset(POSES)),
            "mechanism": lambda phi=phi: bound.poses(phi, POSES),
            "evaluate": lambda phi=phi: sweep.evaluate("four_bar", DESIGN, POSES, phi=phi),
            "plain numba": lambda phi=phi, out=out: plain(*DESIGN.values(), phi, out),
        }
        if here("pylinkage") and count > 1:
            calls["pylinkage"] = _pylinkage(matrix[0], count)
        found = fastest(calls)
        base = found.pop(COMPILED)
        words = ", ".join(f"{name} {seconds / base:.2f}" for name, seconds in found.items())
        if count == 1:
            above = 1e6 * (found["mechanism"] - base)
            words += f"  mechanism {above:.0f} us more, {'holds' if above <= OVERHEAD else 'missed'}: {OVERHEAD:g} us"
        elif count >= FROM:
            words += f"  mechanism {'holds' if found['mechanism'] <= BOUND * base else 'missed'}: {BOUND:g}"
        lines.append(f"{count:6} angles{1e6 * base:10.1f} us   {words}")
    if not here("pylinkage"):
        lines.append("pylinkage is not in this environment; make bench-peers makes one that has it")
    return lines


def outputs(
    mechanism: Family, designs: np.ndarray, base: str, names: tuple[str, ...], both: tuple[str, str]
) -> list[str]:
    """Time design outputs of many designs, as ratios to the largest acceleration, and two of one motion together."""

    def asked(*wanted: str) -> Callable[[], object]:
        return lambda: design_outputs(mechanism, designs, wanted, FINE)

    together = " and ".join(both)
    found = fastest({base: asked(base), **{name: asked(name) for name in names}, together: asked(*both)})
    lines = [f"{mechanism.name}, {len(designs)} designs{'':10}  ns    x {base}"]
    dearer = max(found[name] for name in both)
    for name, seconds in found.items():
        if name == together:
            ratio, most, of = seconds / dearer, BOTH, f" x {max(both, key=lambda one: found[one])}"
        else:
            ratio, most, of = seconds / found[base], SLOWEST, ""
        mark = "" if name == base else f"  {'holds' if ratio <= most else 'missed'}: {most:g}"
        lines.append(f"{name:36}{1e9 * seconds / len(designs):8.0f}{ratio:8.2f}{of}{mark}")
    return lines


def bulk() -> list[str]:
    """Time the outputs of crank-rockers and of needle drives."""
    rockers, needles = random_designs(BULK, 1, rotatable=True), needle_drives(8 * BULK, 1)
    swings = design_outputs(family("rssr"), rockers, ["swing"], FINE)["status"] == 0
    turns = design_outputs(NEEDLE, needles, ["margin"], FINE)["status"] == 0
    both = ("max_abs_dpsi", "max_abs_d2psi")
    lines = outputs(family("rssr"), np.ascontiguousarray(rockers[swings]), both[1], SLOW, both)
    needle = ("max_abs_ds", "max_abs_d2s")
    return [*lines, "", *outputs(NEEDLE, np.ascontiguousarray(needles[turns][:BULK]), needle[1], SLOW_NEEDLE, needle)]


def commands() -> list[str]:
    """Time new processes, with what they have imported and compiled before on disk."""
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder, "plain.py")
        own.write_text(PLAIN_SOURCE)
        calls = {LIBRARIES: ("-c", LIBRARIES), PLAIN: (str(own),), **COMMANDS}
        for name in REPORTED:
            out = f"{folder}/{name}/designs"
            _processor_seconds(("-m", "sweep", "run", f"studies/{name}", "--smoke", "--force", "--out", out))
            calls[f"sweep report, {name}"] = ("-m", "sweep", "report", out)
        least = dict.fromkeys(calls, math.inf)
        for arguments in calls.values():
            _processor_seconds(arguments)
        for _ in range(STARTS):
            for name, arguments in calls.items():
                least[name] = min(least[name], _processor_seconds(arguments))
    lines = [f"a new process{'':27}s    x {LIBRARIES}"]
    for name, seconds in least.items():
        ratio = seconds / least[LIBRARIES]
        mark = ""
        if name in AT_MOST:
            mark = f"  {'holds' if seconds <= AT_MOST[name] else 'missed'}: {AT_MOST[name]:g} s"
        elif name in TIMES:
            mark = f"  {'holds' if ratio <= TIMES[name] else 'missed'}: {TIMES[name]:g}"
        lines.append(f"{name:38}{seconds:8.2f}{ratio:8.2f}{mark}")
    return lines


def _processor_seconds(arguments: tuple[str, ...]) -> float:
    """Run Python to its end, with the byte code that it keeps, and return the processor time that it took."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments], check=True, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime)


def here(package: str) -> bool:
    """Tell whether a package is installed."""
    try:
        return bool(version(package))
    except PackageNotFoundError:
        return False


def main() -> None:
    """Print the tables, with every mark and whether it holds."""
    phi, out = np.linspace(0.0, 6.0, 50), np.empty((3, 50))
    plain(*DESIGN.values(), phi, out)
    found = sweep.mechanism("four_bar", **DESIGN, branch=branch(out[0], phi)).poses(phi, POSES)
    for values, name in zip(out, POSES, strict=True):
        off = values - found[name]
        np.testing.assert_allclose(off - 2.0 * math.pi * np.rint(off / (2.0 * math.pi)), 0.0, atol=1e-12)
    print(description())
    for part in (tables, turns, bulk, commands):
        print("\n".join(["", *part()]), flush=True)


def branch(psi: np.ndarray, phi: np.ndarray) -> float:
    """Return the assembly mode in which the rocker stands at these angles."""
    tried = {sign: sweep.mechanism("four_bar", **DESIGN, branch=sign).poses(phi, "psi")["psi"] for sign in (1.0, -1.0)}
    return min(tried, key=lambda sign: float(np.abs(np.exp(1j * tried[sign]) - np.exp(1j * psi)).max()))


if __name__ == "__main__":
    main()
