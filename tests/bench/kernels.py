"""Speed of the sweep kernels on this machine: ``python -m tests.bench.kernels``.

One table: ns per (design, crank angle) of the dense loops, reductions included, next to numpy and, where gcc exists, C
with -O3 -march=native -ffast-math on the same designs in the same run; two threads against one; ns per design of the
exact margin, the limit positions and the true maxima, and their ratio to the dense loop of 360 angles.  All variants
take turns, and each counts with its fastest round, so that a busy machine disturbs all of them alike.
"""

from __future__ import annotations

import ctypes
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import joblib
import numba
import numpy as np

from kernels.families import geared_dwell, rssr
from sweep.families.geared_dwell import half_turn
from tests.bench.position import range_of_sine
from tests.bench.rivals import C_SOURCE, LEVELS, geared_in_numpy, in_numpy
from tests.support.rssr_designs import random_designs

DESIGNS, SAMPLES, ROUNDS = 4096, 360, 25
TILES = 256  # how many times the designs the race of threads takes: a call of joblib alone costs 10 ms
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


def threaded(designs: np.ndarray, cos: np.ndarray, sin: np.ndarray, workers: int) -> Run:  # type: ignore[type-arg]
    """Accelerations of many designs by joblib's threads, as the engine spreads its chunks: tasks of about 10 ms."""
    parts = np.array_split(np.concatenate([designs] * TILES), TILES // 8)

    def task(part: np.ndarray) -> None:  # type: ignore[type-arg]
        rssr.dense_maxima(part, cos, sin, np.empty(len(part)), None, np.empty(len(part)), None)

    def run() -> None:
        joblib.Parallel(workers, prefer="threads")(joblib.delayed(task)(part) for part in parts)

    return run


def variants() -> dict[str, tuple[Run, float]]:
    """What is timed: name -> (run, how many units one run makes); "level: rival" beside each level."""
    designs = random_designs(DESIGNS, 1, rotatable=True)
    phi = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    cos, sin = np.cos(phi), np.sin(phi)
    least, most = np.empty(DESIGNS), [np.empty(DESIGNS) for _ in range(3)]
    poses = float(DESIGNS * SAMPLES)

    def dense(order: int) -> Callable[[slice], object]:
        def run(part: slice) -> np.ndarray:  # type: ignore[type-arg]
            out = [values[part] if k == order - 1 else None for k, values in enumerate(most)]
            rssr.dense_maxima(designs[part], cos, sin, least[part], out[0], out[1], out[2])
            return most[order - 1] if order else least * (designs[:, 1] / designs[:, 0]) ** 2 * designs[:, 0] ** 2

        return run

    def position() -> np.ndarray:  # type: ignore[type-arg]
        range_of_sine(designs, cos, sin, most[0], most[1])
        return np.where(designs[:, 7] > 0.0, most[1], -most[0])

    library = compiled_rival()
    few = designs[:256]
    runs: dict[str, tuple[Run, float]] = {}
    for level in LEVELS:
        own = position if level == "position" else partial(dense(max(LEVELS.index(level) - 1, 0)), slice(None))
        runs[level] = (own, poses)
        runs[f"{level}: numpy"] = (partial(in_numpy, level, few, cos, sin), float(len(few) * SAMPLES))
        if library is not None:
            runs[f"{level}: C"] = (_in_c(library, level, designs, cos, sin), poses)
    if library is not None:
        runs["acceleration: C, our algebra"] = (_in_c(library, "ours", designs, cos, sin), poses)
    for workers in ("one", "two"):
        runs[f"acceleration: {workers} in threads"] = (
            threaded(designs, cos, sin, 1 if workers == "one" else 2),
            poses * TILES,
        )

    k_and_a = np.random.default_rng(1).uniform((1.05, 0.1), (1.8, 2.0), (DESIGNS, 2))
    status, front_back, half = np.empty(DESIGNS, np.uint8), half_turn(SAMPLES), SAMPLES // 2 + 1
    c, s = np.ascontiguousarray(cos[:half]), np.ascontiguousarray(sin[:half])

    def geared() -> np.ndarray:  # type: ignore[type-arg]
        geared_dwell.dense_maxima(k_and_a, *front_back, status, None, most[2], None)
        return most[2]

    runs["geared dwell"] = (geared, float(DESIGNS * half))
    runs["geared dwell: numpy"] = (partial(geared_in_numpy, k_and_a[:256], c, s), 256.0 * half)
    if library is not None:
        runs["geared dwell: C"] = (_in_c(library, "geared", k_and_a, c, s), float(DESIGNS * half))
    _agree(runs)
    return runs | _per_design(designs, status)


def _in_c(library: ctypes.CDLL, name: str, designs: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> Run:  # type: ignore[type-arg]
    out = np.empty(len(designs))
    pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (designs, cos, sin, out)]
    sizes = ctypes.c_long(len(designs)), ctypes.c_long(cos.size)

    def run() -> np.ndarray:  # type: ignore[type-arg]
        getattr(library, name)(*sizes, *pointers)
        return out

    return run


def _agree(runs: dict[str, tuple[Run, float]]) -> None:
    """All rivals of a level must find the same numbers, or the race means nothing."""
    for name, (run, _) in runs.items():
        level, _, rival = name.partition(": ")
        if rival and "in threads" not in rival:
            theirs, own = np.asarray(run()), np.asarray(runs[level][0]())
            np.testing.assert_allclose(theirs, own[: len(theirs)], rtol=1e-6, atol=1e-9, err_msg=name)


def _per_design(designs: np.ndarray, status: np.ndarray) -> dict[str, tuple[Run, float]]:  # type: ignore[type-arg]
    n = float(len(designs))
    most, places, errors = np.empty(len(designs)), np.empty((3, len(designs))), np.empty((3, len(designs)))
    limits, table = np.empty((len(designs), 7)), rssr.sampling_tables()
    # Whether a crank turns is asked of everything; ten times the designs, for a run long enough to be timed.
    mixed = random_designs(10 * len(designs), 2)
    verdict, margin, turns, angle = np.empty(len(mixed), np.uint8), *(np.empty(len(mixed)) for _ in range(3))

    def true(order: int) -> Run:
        wanted = [most if k == order else None for k in (1, 2, 3)]
        return lambda: rssr.true_maxima(designs, table, 1e-8, status, places, errors, None, *wanted)

    return {
        "margin, rotatable": (lambda: rssr.margin(mixed, verdict, margin, turns, None, None, None), 10.0 * n),
        "+ largest pressure angle": (lambda: rssr.margin(mixed, verdict, margin, turns, angle, None, None), 10.0 * n),
        "limit positions": (lambda: rssr.limits(designs, status, limits, None), n),
        "true max |psi'|": (true(1), n),
        "true max |psi''|": (true(2), n),
        "true max |psi'''|": (true(3), n),
    }


def measure(runs: dict[str, tuple[Run, float]], rounds: int) -> dict[str, float]:
    """Least ns per unit of every variant over interleaved rounds; the first, which compiles, does not count.

    Processor time, which other work on the machine disturbs least; wall time where two threads run.
    """
    for run, _ in runs.values():
        run()
    best = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, (run, units) in runs.items():
            clock = time.perf_counter if "in threads" in name else time.process_time
            start = clock()
            run()
            best[name] = min(best[name], (clock() - start) / units * 1e9)
    return best


def table(best: dict[str, float]) -> str:
    """The measured figures with the ratios that matter: how many times longer the rivals take."""
    lines = [
        f"{'ns per (design, angle)':24}{'linksweep':>10}{'numpy':>9}{'C':>9}{'C, our algebra':>16}   times as long"
    ]
    for level in (*LEVELS, "geared dwell"):
        own = best[level]
        cells = [best.get(f"{level}: {rival}", np.nan) / own for rival in ("numpy", "C", "C, our algebra")]
        shown = ["-" if np.isnan(x) else f"{x:.2f}" for x in cells]
        lines.append(f"{level:24}{own:10.2f}{shown[0]:>9}{shown[1]:>9}{shown[2]:>16}")
    grid = best["acceleration"] * SAMPLES
    gain = best["acceleration: one in threads"] / best["acceleration: two in threads"]
    lines += ["", f"two threads, acceleration: {gain:.2f} times as fast as one", ""]
    lines.append(f"{'per design':24}{'ns':>10}   of the grid of {SAMPLES} (acceleration)")
    for name, ns in best.items():
        if name.startswith(("margin", "+ largest", "limit", "true")):
            lines.append(f"{name:24}{ns:10.1f}   {ns / grid:.3f}")
    return "\n".join(lines)


def main(rounds: int = ROUNDS) -> None:
    """Print the table and where it was made."""
    print(f"{platform.processor() or platform.machine()}, numba {numba.__version__}, numpy {np.__version__}")
    print(f"{DESIGNS} rotatable designs x {SAMPLES} angles, fastest of {rounds} interleaved rounds\n")
    print(table(measure(variants(), rounds)))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
