"""``python -m studies.accuracy``: measure, keep the tables as Parquet, draw, and write the pages."""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from studies.accuracy import costs, digits, oracle
from studies.accuracy.diagrams import position_table, work_table
from studies.accuracy.effect_prices import PRICED, effect_prices
from studies.accuracy.exact import exact_table
from studies.accuracy.figures import draw
from studies.accuracy.machine import description
from studies.accuracy.marks import marks, smoke_mark, study_mark, tables_mark
from studies.accuracy.measured import Measured, others
from studies.accuracy.page import html, pages, write
from studies.accuracy.price_figures import draw_prices
from studies.accuracy.prices import family_prices
from studies.accuracy.regions import regions
from studies.accuracy.whole import whole_study
from sweep.effects import NAMES

ROOT = Path(__file__).resolve().parents[2]
TABLES = ROOT / "tests" / "oracle"
SEED = 1


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
        if arguments.effects is not None:
            for name in arguments.effects or missing(found):
                found = with_effect(found, name)
                found.write(out)
    else:
        found = measured(smoke, out)
        found.write(out)
    publish(found, out)
    print(f"{out.relative_to(ROOT) if out.is_relative_to(ROOT) else out}/report.html")  # noqa: T201


def measured(smoke: bool, out: Path) -> Measured:
    """Return all tables, measured now."""
    start = time.perf_counter()

    def done(what: str) -> None:
        print(f"{time.perf_counter() - start:6.1f} s  {what}", flush=True)  # noqa: T201

    import pandas as pd

    machine, areas = description(), regions(16 if smoke else 500, SEED)
    done("regions")
    families = family_prices(smoke)
    done("every family")
    effects = effect_prices(smoke)
    done("every effect")
    whole = whole_study(500, 1, smoke) if smoke else whole_study(20_000)
    done("one whole study")
    work = work_table(areas, smoke)
    done("work and precision")
    positions, exact = position_table(areas, 10 if smoke else 400), exact_table(areas, 10 if smoke else 400)
    factors = oracle.frame(oracle.factors(TABLES, few=smoke))
    done("errors against 60 digits and the 25-digit tables")
    outputs, storage = costs.output_costs(areas[0].designs, smoke), costs.storage_costs(20_000 if smoke else 200_000)
    optimiser = digits.optimiser_digits(1 if smoke else 4, 40 if smoke else 1)
    targets = digits.optimiser_targets(1 if smoke else 8)
    done("outputs, storage, optimiser")
    reached = [*marks(*((500, 50) if smoke else (100_000, 2000))), tables_mark(factors)]
    if not smoke:
        reached += [smoke_mark(), study_mark(time.perf_counter() - start)]
    done("marks")
    return Measured(
        machine=machine,
        smoke=smoke,
        regions=tuple((area.name, area.text) for area in areas),
        families=families,
        effects=effects,
        whole=whole,
        marks=pd.DataFrame([mark.__dict__ for mark in reached]),
        positions=positions,
        exact=exact,
        work=work,
        outputs=outputs,
        storage=storage,
        digits=optimiser,
        targets=targets,
        oracle=factors,
        worst=pd.DataFrame(json.loads((TABLES / "worst_found.json").read_text())["rows"])[
            ["poses", "region", "output", "factor"]
        ],
        **others(out),
    )


def missing(found: Measured) -> list[str]:
    """Return what the price list of effects has no row of yet."""
    return [name for name in PRICED if name not in set(found.effects["effect"])]


def with_effect(found: Measured, name: str) -> Measured:
    """Return the tables with one row of the price list measured now; its times alone are those of sweep/costs.toml."""
    import pandas as pd

    kept = found.effects[found.effects["effect"].isin(set(PRICED) - {name})]
    effects = pd.concat([kept, effect_prices(found.smoke, [name])], ignore_index=True)
    effects = effects.iloc[np.argsort([PRICED.index(one) for one in effects["effect"]], kind="stable")]
    outputs = costs.with_effects(found.outputs, [name] if name in NAMES else [])
    return replace(found, effects=effects.reset_index(drop=True), outputs=outputs)


def publish(found: Measured, out: Path) -> None:
    """Draw and write into the folder of the results, and into docs unless it is the smoke version."""
    figures = draw_prices(found, out / "figures")
    figures += draw(found.work, found.outputs, found.regions, out / "figures")
    written = pages(found)
    write(written, figures, out)
    (out / "report.html").write_text(html(written, figures), encoding="utf-8")
    if not found.smoke:
        write(written, figures, ROOT / "docs")


if __name__ == "__main__":
    main()
