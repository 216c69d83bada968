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
# One design of each family that turns; parameters that are not named have their defaults.
ORDINARY: dict[str, dict[str, float]] = {
    "rssr": {"a": 1.0, "b": 4.1, "c": 3.2, "e": 2.9, "f": 0.6, "g": -0.4, "alpha": 0.7},
    "rssp": {"a": 1.3, "b": 5.2, "e": 0.7, "f": 0.4, "alpha": 0.3},
    "guide": {"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "lam": 1.1, "h": -0.6},
    "geared_dwell": {"k": 1.4, "a": 0.3},
    "five_link": {"a": 1.0, "b": 3.9, "c": 3.2, "e": 2.9, "f": 0.6, "g": -0.4, "alpha": 0.7, "h": 0.3},
    "kim_dison": {"r": 1.0, "l": 6.0, "h": 3.2, "a": 2.9, "b": 4.0},
    "slider_crank": {"a": 1.0, "b": 3.0, "e": 0.4},
    "four_bar": {"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8},
    "inverted_slider_crank": {"a": 1.0, "e": 2.2, "h": 0.3},
    "epicyclic_dwell": {"k": 1.3, "a": 0.2, "n": 3.0},
    "cam": {"lift": 1.0, "r0": 3.0, "law": 2.0},
    "cam_lever": {"lift": 0.4, "r0": 3.0, "c": 5.0, "e": 6.0, "law": 2.0},
}


def designs_of(mechanism: Family) -> np.ndarray:  # type: ignore[type-arg]
    """Designs within 2 % of the ordinary one in every parameter that has no choices."""
    given, random = ORDINARY[mechanism.name], np.random.default_rng(1)
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
    """Least ns per pose of every family over a turn that has an ordinary design here."""
    angles = Angles.of(np.arange(SAMPLES)[None, :] * (2.0 * np.pi / SAMPLES))
    ready = [mechanism for name in NAMES if isinstance((mechanism := family(name)).domain, Turn) and name in ORDINARY]
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
