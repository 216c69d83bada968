"""Which arithmetic encloses a formula of the proofs best in the least time: ``make bench-enclosures``, docs/proof.md.

Taylor models (kernels/boxes/taylor.py), intervals with slopes, and balls of python-flint go over the same boxes at the
same crank angles, by the same operations.  Printed for each: time of a box; width of its enclosures over the spread of
the function; parts into which a box has to be halved until the least psi'' on it is known closely, and their time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np

from studies.accuracy.machine import description
from sweep.proof.question import question_of
from sweep.study.load import load_study
from tests.bench import balls, libflint
from tests.bench.boxes import WANTED, Array, Boxes, Formula, forms_of, mechanisms, taylor
from tests.bench.slopes import slopes

STUDIES = Path(__file__).parents[2] / "studies"
NAMES = ("crank-rocker-proof", "crank-rocker-proof-right-angle", "crank-rocker-proof-spatial")
BOXES, TIMED = 40, 2000  # for the widths, and of compiled arithmetics for the time
SHARES = (64, 256, 1024)  # sides of the boxes: the ranges of the study divided by these
HALVED, CLOSE, MOST = 9, 0.05, 4096  # boxes that are halved, from the widest on; how close; parts at most
SAMPLES = 64  # places at random in a box
Arithmetic: TypeAlias = Callable[[Formula, Boxes], tuple[Array, Array]]
COMPILED: dict[str, Arithmetic] = {
    "Taylor models of second order": taylor,
    "intervals with slopes": slopes,
    "balls, mean value form, compiled": libflint.first_order,
}
SECOND = "balls, second order"
IN_PYTHON: dict[str, Arithmetic] = {
    "balls alone": balls.plain,
    "balls, mean value form": balls.first_order,
    SECOND: balls.second_order,
}


def spread(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Least and largest values of the wanted numbers at the corners of every box and at places at random in it."""
    rng, n = np.random.default_rng(5), boxes.centre.shape[1]
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
    found = [
        forms_of(formula, boxes.at(xi))[:, formula.wanted, 0]
        for xi in (*corners, *rng.uniform(-1.0, 1.0, (SAMPLES, n)))
    ]
    return np.nanmin(found, axis=0), np.nanmax(found, axis=0)


def microseconds(way: Arithmetic, formula: Formula, boxes: Boxes) -> float:
    """Processor time of one box, the least of three runs."""
    taken = []
    for _ in range(3):
        begin = time.process_time()
        way(formula, boxes)
        taken.append(time.process_time() - begin)
    return 1e6 * min(taken) / len(boxes)


def parts_needed(way: Arithmetic, formula: Formula, box: Boxes, aim: float) -> float:
    """How many parts of a box were enclosed until psi'' was at least ``aim`` on all; infinite above MOST."""
    looked, todo, k = 0, box, 0
    while True:
        looked += len(todo)
        if looked > MOST:
            return np.inf
        low, _ = way(formula, todo)
        todo = todo.taken(~(low[:, 0] >= aim))
        if not len(todo):
            return float(looked)
        todo = todo.halved(k % box.centre.shape[1])
        k += 1


def widths(way: Arithmetic, formula: Formula, boxes: Boxes, spreads: tuple[Array, Array]) -> Array:
    """Width of the enclosures over the spread of the wanted numbers, median; infinite without an enclosure."""
    low, high = way(formula, boxes)
    over = (high - low) / (spreads[1] - spreads[0])
    return np.asarray(np.median(np.where(np.isnan(over), np.inf, over), axis=0))


def measured(name: str) -> list[tuple[str, float, list[Array], float | None]]:
    """Per arithmetic its name, us per box, widths by share, and parts for a close bound; of the space of one study.

    Parts are not counted for what encloses no better than the mean value form of compiled balls.
    """
    question = question_of(load_study(STUDIES / name))
    formula, drawn = mechanisms(question, TIMED)
    by_share = [drawn.sized((question.high - question.low) / share) for share in SHARES]
    some = [boxes.taken(slice(BOXES)) for boxes in by_share]
    spreads = [spread(formula, boxes) for boxes in some]
    least, most = (ends[:HALVED, 0] for ends in spreads[0])
    aims = least - CLOSE * (most - least)
    rows = []
    for label, way in (COMPILED | IN_PYTHON).items():
        wide = [widths(way, formula, boxes, ends) for boxes, ends in zip(some, spreads, strict=True)]
        each = microseconds(way, formula, by_share[-1] if label in COMPILED else some[-1])
        counted = range(HALVED if label in COMPILED or label == SECOND else 0)
        parts = [parts_needed(way, formula, some[0].taken([i]), aims[i]) for i in counted]
        rows.append((label, each, wide, float(np.median(parts)) if parts else None))
    return rows


def main() -> None:
    """Print the table."""
    print(f"{description()}; widths over spreads for sides of 1/{', 1/'.join(map(str, SHARES))} of the ranges\n")
    heads = ["free", "enclosure", "us per box", *(f"width of {w}" for w in WANTED), "parts", "us for a close bound"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for free, name in enumerate(NAMES, 2):
        for label, each, wide, parts in measured(name):
            shown = [", ".join(f"{w[k]:.3g}".replace("inf", "none") for w in wide) for k in range(len(WANTED))]
            ends = ["", ""] if parts is None else [f"{parts:.0f}", f"{parts * each:.3g}"]
            ends = [f"above {MOST}", ""] if parts == np.inf else ends
            print(f"| {' | '.join([str(free), label, f'{each:.3g}', *shown, *ends])} |", flush=True)


if __name__ == "__main__":
    main()
