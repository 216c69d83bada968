"""Speed of every family's poses on this machine: ``python -m tests.bench.families``.

ns per (design, angle) of position and all its derivatives, on random changes of one ordinary design, next to the
crank-rocker's in the same run; families take turns, and each counts with its fastest round.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from sweep.families import NAMES, family
from sweep.families.base import Angles, Family
from sweep.families.domain import Turn

DESIGNS, SAMPLES, ROUNDS = 500, 360, 7


def designs_of(mechanism: Family) -> np.ndarray:  # type: ignore[type-arg]
    """Designs within 2 % of the ordinary one in every parameter that has no choices."""
    given, random = mechanism.example, np.random.default_rng(1)
    columns = []
    for parameter in mechanism.parameters:
        value = given.get(parameter.name, parameter.default if parameter.default is not None else 0.0)
        spread = 0.0 if parameter.choices is not None else 0.02
        columns.append(value * (1.0 + spread * random.uniform(-1.0, 1.0, DESIGNS)))
    return np.column_stack(columns)


def ladder(mechanism: Family) -> list[str]:
    """The position and its derivatives, lowest first."""
    names = [mechanism.position]
    while names[-1] in mechanism.derivative_of:
        names.append(mechanism.derivative_of[names[-1]])
    return names


def measure(rounds: int) -> dict[str, float]:
    """Least ns per pose of every family over a turn."""
    angles = Angles.of(np.arange(SAMPLES)[None, :] * (2.0 * np.pi / SAMPLES))
    ready = [mechanism for name in NAMES if isinstance((mechanism := family(name)).domain, Turn)]
    runs = {m.name: (m, designs_of(m), frozenset(ladder(m))) for m in ready}
    best = dict.fromkeys(runs, np.inf)
    for turn in range(rounds + 1):
        for name, (mechanism, designs, wanted) in runs.items():
            start = time.process_time()
            mechanism.poses(designs, angles, wanted)
            spent = (time.process_time() - start) / (DESIGNS * SAMPLES) * 1e9
            best[name] = min(best[name], spent) if turn else np.inf  # the first round compiles
    return best


def main(rounds: int = ROUNDS) -> None:
    """Print ns per pose and how many times the crank-rocker's that is."""
    best = measure(rounds)
    print(f"{'family':24}{'outputs':>8}{'ns per pose':>13}{'of rssr':>9}")
    for name, ns in best.items():
        print(f"{name:24}{len(ladder(family(name))):8d}{ns:13.1f}{ns / best['rssr']:9.1f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
