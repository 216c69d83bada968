"""Speed of the sweep kernels on this machine: ``python -m tests.bench.kernels``.

One table: ns per (design, crank angle) of the dense loops next to numpy and, where gcc exists, C with
-O3 -march=native -ffast-math on the same designs in the same run; two threads against one; ns per design of the exact
margin, the limit positions and the true maxima, and their ratio to the dense loop of 360 angles.  All variants take
turns, and each counts with its fastest round, so that a busy machine disturbs all of them alike.
"""

from __future__ import annotations

import ctypes
import platform
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np

from kernels.families import geared_dwell, rssr
from sweep.families.geared_dwell import half_turn
from tests.bench.position import range_of_sine
from tests.bench.rivals import C_SOURCE, numpy_maxima
from tests.rssr_designs import random_designs

DESIGNS, SAMPLES, ROUNDS = 4096, 360, 25
FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
Run = Callable[[], object]


def compiled_rival() -> ctypes.CDLL | None:
    """The C versions as a shared library, or None without gcc."""
    if shutil.which("gcc") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "rival.c", Path(folder) / "rival.so"
        source.write_text(C_SOURCE)
        subprocess.run(["gcc", *FLAGS, str(source), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def in_threads(run: Callable[[slice], object], count: int) -> Run:
    """The run cut into two halves on two threads, or in one piece."""
    if count == 1:
        return lambda: run(slice(None))

    def both() -> None:
        halves = [
            threading.Thread(target=run, args=(part,)) for part in (slice(0, DESIGNS // 2), slice(DESIGNS // 2, None))
        ]
        for half in halves:
            half.start()
        for half in halves:
            half.join()

    return both


def variants() -> dict[str, tuple[Run, float]]:
    """What is timed: name -> (run, how many units one run makes)."""
    designs = random_designs(DESIGNS, 1, rotatable=True)
    phi = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    cos, sin = np.cos(phi), np.sin(phi)
    least, most = np.empty(DESIGNS), [np.empty(DESIGNS) for _ in range(3)]
    poses = float(DESIGNS * SAMPLES)

    def dense(order: int) -> Callable[[slice], object]:
        def run(part: slice) -> None:
            out = [values[part] if k < order else None for k, values in enumerate(most)]
            rssr.dense_maxima(designs[part], cos, sin, least[part], out[0], out[1], out[2])

        return run

    def position() -> None:
        range_of_sine(designs, cos, sin, most[0], most[1])

    runs: dict[str, tuple[Run, float]] = {
        "discriminant only": (in_threads(dense(0), 1), poses),
        "position (range of sin psi)": (position, poses),
        "+ velocity": (in_threads(dense(1), 1), poses),
        "+ acceleration": (in_threads(dense(2), 1), poses),
        "+ jerk": (in_threads(dense(3), 1), poses),
        "+ acceleration, two threads": (in_threads(dense(2), 2), poses),
    }
    k_and_a = np.random.default_rng(1).uniform((2.0, 0.1), (6.0, 1.5), (DESIGNS, 2))
    status, table = np.empty(DESIGNS, np.uint8), half_turn(SAMPLES)
    runs["geared dwell, acceleration"] = (
        lambda: geared_dwell.dense_maxima(k_and_a, table[0], table[1], status, None, most[0], None),
        poses,
    )
    few = designs[:256]
    runs["numpy, to acceleration"] = (lambda: numpy_maxima(few, cos, sin), float(len(few) * SAMPLES))
    library = compiled_rival()
    if library is not None:
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (designs, cos, sin, least, most[0], most[1])]
        for name, function in (
            ("C, to acceleration, our algebra", library.ours),
            ("C, sheet's formulas", library.sheet),
        ):
            runs[name] = (
                lambda function=function: function(DESIGNS, SAMPLES, *pointers),  # type: ignore[misc]
                poses,
            )
    return runs | _per_design(designs, status)


def _per_design(designs: np.ndarray, status: np.ndarray) -> dict[str, tuple[Run, float]]:  # type: ignore[type-arg]
    n = float(len(designs))
    out = [np.empty(len(designs)) for _ in range(3)]
    limits, tables = np.empty((len(designs), 7)), rssr.sampling_tables()
    # Whether a crank turns is asked of everything; ten times the designs, for a run long enough to be timed.
    mixed = random_designs(10 * len(designs), 2)
    verdict, margin, turns, angle = np.empty(len(mixed), np.uint8), *(np.empty(len(mixed)) for _ in range(3))

    def true(order: int) -> Run:
        wanted = [out[0] if k == order else None for k in (1, 2, 3)]
        return lambda: rssr.true_maxima(designs, *tables, 1e-8, status, out[1], out[2], None, *wanted)

    return {
        "margin, rotatable": (lambda: rssr.margin(mixed, verdict, margin, turns, None, None, None), 10.0 * n),
        "+ largest pressure angle": (lambda: rssr.margin(mixed, verdict, margin, turns, angle, None, None), 10.0 * n),
        "limit positions": (lambda: rssr.limits(designs, status, limits, None), n),
        "true max |psi'|": (true(1), n),
        "true max |psi''|": (true(2), n),
        "true max |psi'''|": (true(3), n),
    }


def measure(runs: dict[str, tuple[Run, float]], rounds: int) -> dict[str, float]:
    """Least ns per unit of every variant over interleaved rounds; the first, which compiles, does not count."""
    for run, _ in runs.values():
        run()
    best = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, (run, units) in runs.items():
            start = time.perf_counter()
            run()
            best[name] = min(best[name], (time.perf_counter() - start) / units * 1e9)
    return best


def table(best: dict[str, float]) -> str:
    """The measured figures with the ratios that matter."""
    dense, grid = best["+ acceleration"], best["+ acceleration"] * SAMPLES
    lines = [f"{'':36}{'ns':>9}   ratio"]
    for name, ns in best.items():
        if name.startswith(("numpy", "C,")):
            note = f"{ns / dense:6.2f} x the house"
        elif "threads" in name:
            note = f"{dense / ns:6.2f} x one thread"
        elif name.startswith("true"):
            order = name.count("'")
            own = best[("+ velocity", "+ acceleration", "+ jerk")[order - 1]] * SAMPLES
            note = f"{ns / own:6.2f} x dense {SAMPLES} of that order, {ns / grid:.2f} x of acceleration; per design"
        elif name.startswith(("margin", "+ largest", "limit")):
            note = f"{ns / grid:6.3f} x dense {SAMPLES}; per design"
        else:
            note = "        per (design, angle)"
        lines.append(f"{name:36}{ns:9.2f}   {note}")
    return "\n".join(lines)


def main(rounds: int = ROUNDS) -> None:
    """Print the table and where it was made."""
    print(f"{platform.processor() or platform.machine()}, numba {numba.__version__}, numpy {np.__version__}")
    print(f"{DESIGNS} rotatable designs x {SAMPLES} angles, fastest of {rounds} interleaved rounds\n")
    print(table(measure(variants(), rounds)))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
