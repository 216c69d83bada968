"""The search ends at the same bits whatever the BLAS library and numpy choose for the processor."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SEARCH = """
from pathlib import Path
import numpy as np
from sweep.families import family
from sweep.optimise import Problem, optimum
from sweep.optimise import generations, proportions
from sweep.optimise.evolution import evolved
from sweep.optimise.linear import elimination
from sweep.optimise.starts import drawn
from sweep.optimise.posing import problem_of
from sweep.study import Limit, OptimiseSettings, load_study

names = ("a", "b", "c", "e", "f", "g", "alpha")
low, high = np.array([0.2, 1, 0.8, 0, -2, -2, 0]), np.array([1.5, 5, 3, 3, 2, 2, 1.5])
limits = (Limit("swing", 0.8, 0.9), Limit("max_pressure_angle", None, 0.8))
problem = Problem(family("rssr"), names, low, high, {"branch": 1.0}, "max_abs_d2psi", limits)
for r in optimum(problem, [{}], OptimiseSettings(starts=3, seed=5)):
    print(r.design.tobytes().hex(), r.objective.hex(), r.looks, r.kkt_residual.hex(), r.active)
valley = lambda u: ((u - 0.4) ** 2 * np.array([1.0, 10.0, 100.0, 1e3, 1e4])).sum(axis=1)
print(evolved(valley, np.full((3, 5), 0.3), 0.1, 60, np.random.default_rng(1))[0].tobytes().hex())
proportions.SAMPLED, proportions.GENERATIONS = 1 << 13, 5
study = load_study(Path("studies/needle208"))
linear = elimination(problem_of(study, drawn(study, 1, 208)))
signs = [{"branch1": 1.0, "branch2": 1.0, "kappa2": 1.0}]
print(proportions.from_proportions(linear, signs, 2, 7).tobytes().hex())
size = generations.Size(sampled=1 << 13, first=6, later=4, generations=1)
print(generations.bred(linear, signs, 1, 7, size=size)[0].designs.tobytes().hex())
"""
# What numpy and OpenBLAS would choose on other processors: a search that asked them would end at other bits.
OTHERS = [
    {"OPENBLAS_CORETYPE": "Haswell"},
    {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"},
    {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
]
LONE_PROCESSOR = {"OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "OPENBLAS_NUM_THREADS"}


def answer(choice: dict[str, str]) -> str:
    env = {name: value for name, value in os.environ.items() if name not in LONE_PROCESSOR} | choice
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SEARCH], env=env, cwd=Path(__file__).parents[1], check=True,
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    return run.stdout


def test_search_ends_at_the_same_bits_with_any_kernel_of_the_library() -> None:
    known = answer({})
    assert len(known.splitlines()) == 6
    for choice in OTHERS:
        assert answer(choice) == known, choice
