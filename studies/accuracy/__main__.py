"""``python -m studies.accuracy``: measure, keep the tables as Parquet, draw, and write the pages."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

from studies.accuracy.effect_prices import PRICED, effect_prices
from studies.accuracy.machine import description
from studies.accuracy.marks import marks, smoke_mark, study_mark
from studies.accuracy.measured import Measured, peers_in
from studies.accuracy.pages import publish
from studies.accuracy.prices import crank_rocker_prices, family_prices
from studies.accuracy.whole import whole_study

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Measure everything; the smoke version takes few designs and writes no page into docs."""
    parser = argparse.ArgumentParser(prog="python -m studies.accuracy", description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="few designs, no page in docs")
    parser.add_argument("--out", type=Path, default=None, help="folder of the results")
    parser.add_argument(
        "--pages", action="store_true", help="measure nothing: pages anew from the tables in the folder"
    )
    parser.add_argument("--effects", nargs="*", metavar="NAME", default=None,
                        help="measure these rows of the price list of effects alone, without names those that the "
                        "folder has no row of; everything else is kept")  # fmt: skip
    arguments = parser.parse_args()
    smoke: bool = arguments.smoke
    out: Path = arguments.out or ROOT / "results" / ("smoke/accuracy" if smoke else "accuracy")
    if arguments.pages or arguments.effects is not None:
        found = Measured.read(out)
        missing = [name for name in PRICED if name not in set(found.effects["effect"])]
        for name in () if arguments.effects is None else arguments.effects or missing:
            found = with_effect(found, name)
            found.write(out)
    else:
        found = measured(smoke, out)
        found.write(out)
    publish(found, out)
    if not found.smoke:
        publish(found, ROOT / "docs")
    print(f"{out.relative_to(ROOT) if out.is_relative_to(ROOT) else out}/accuracy.md")  # noqa: T201


def measured(smoke: bool, out: Path) -> Measured:
    """Measure all tables."""
    start = time.perf_counter()

    def done(what: str) -> None:
        print(f"{time.perf_counter() - start:6.1f} s  {what}", flush=True)  # noqa: T201

    import pandas as pd

    machine = description()
    families = family_prices(smoke)
    done("every family")
    regions = crank_rocker_prices(smoke)
    done("the crank-rocker by region")
    effects = effect_prices(smoke)
    done("every effect")
    whole = whole_study(500, 1, smoke) if smoke else whole_study(20_000)
    done("one whole study")
    reached = marks(500 if smoke else 100_000)
    if not smoke:
        reached += [smoke_mark(), study_mark(time.perf_counter() - start)]
    done("marks")
    table = pd.DataFrame([mark.__dict__ for mark in reached])
    return Measured(machine, smoke, families, regions, effects, whole, table, peers_in(out))


def with_effect(found: Measured, name: str) -> Measured:
    """Measure one row of the price list of effects again and keep all others."""
    import pandas as pd

    kept = found.effects[found.effects["effect"].isin(set(PRICED) - {name})]
    effects = pd.concat([kept, effect_prices(found.smoke, [name])], ignore_index=True)
    return replace(found, effects=effects.sort_values("effect", key=lambda x: x.map(PRICED.index), kind="stable"))


if __name__ == "__main__":
    main()
