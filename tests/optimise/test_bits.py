"""The search: the same bits in every process of one machine, the same optimum with any kernel of the BLAS library."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.support.selection import mostly_long

SEARCH = """
from pathlib import Path
import numpy as np
from sweep.families import family
from sweep.optimise import Problem, optimum
from sweep.optimise.starts.populations import population
from sweep.optimise.starts.proportions import Proportions, PopulationSize
from sweep.optimise.starts.linear import elimination
from sweep.optimise.starts.dataset import random_designs
from sweep.optimise.starts.posing import problem_of
from sweep.study import Limit, OptimiseSettings, load_study

names = ("a", "b", "c", "e", "f", "g", "alpha")
low, high = np.array([0.2, 1, 0.8, 0, -2, -2, 0]), np.array([1.5, 5, 3, 3, 2, 2, 1.5])
limits = (Limit("swing", 0.8, 0.9), Limit("max_pressure_angle", None, 0.8))
problem = Problem(family("rssr"), names, low, high, {"branch": 1.0}, "max_abs_d2psi", limits)
for r in optimum(problem, [{}], OptimiseSettings(starts=3, seed=5)):
    print(r.ended, repr(r.objective), r.design.tobytes().hex(), r.looks, r.kkt_residual.hex(), r.active)
study = load_study(Path("studies/needle208"))
signs = [{"branch1": 1.0, "branch2": 1.0, "kappa2": 1.0}]
size = PopulationSize(sampled=1 << 13, first=6, later=4, generations=1)
for tolerance in (None, study.tolerance):
    linear = elimination(problem_of(study, random_designs(study, 1, 208)), tolerance)
    print(population(Proportions(linear, signs, size=size), (7, 0)).designs.tobytes().hex())
"""
# What numpy and OpenBLAS would choose on other processors: sums in another order, so other last bits on the way.
OTHERS = [
    {"OPENBLAS_CORETYPE": "Haswell"},
    {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"},
    {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
]
LONE_PROCESSOR = {"OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "OPENBLAS_NUM_THREADS"}


def answer(choice: dict[str, str]) -> str:
    env = {name: value for name, value in os.environ.items() if name not in LONE_PROCESSOR} | choice
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SEARCH], env=env, cwd=Path(__file__).parents[2], check=True,
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    return run.stdout


@cache
def usual() -> str:
    return answer({})


def best_converged(text: str) -> float:
    found = [line.split() for line in text.splitlines()]
    return min(float(words[1]) for words in found if words[0] == "converged")


def test_search_ends_at_the_same_bits_in_every_process() -> None:
    assert len(usual().splitlines()) == 5
    assert answer({}) == usual()


@pytest.mark.parametrize("choice", mostly_long(OTHERS, OTHERS[:1]), ids=lambda choice: "-".join(choice.values()))
def test_best_converged_objective_is_the_same_with_any_kernel_of_the_library(choice: dict[str, str]) -> None:
    assert best_converged(answer(choice)) == pytest.approx(best_converged(usual()), rel=1e-9)
