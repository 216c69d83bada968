"""``python -m studies.accuracy``: measure, keep the tables as Parquet, draw, and write the page."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from studies.accuracy import costs, digits, oracle
from studies.accuracy.diagrams import position_table, work_table
from studies.accuracy.exact import exact_table
from studies.accuracy.figures import draw
from studies.accuracy.machine import description
from studies.accuracy.marks import marks, smoke_mark, study_mark, tables_mark
from studies.accuracy.page import Measured, html, markdown
from studies.accuracy.publish import publish
from studies.accuracy.regions import regions

ROOT = Path(__file__).resolve().parents[2]
TABLES = ROOT / "tests" / "oracle"
SEED = 1


def main() -> None:
    """Measure everything; the smoke version takes few designs and writes no page into docs."""
    parser = argparse.ArgumentParser(prog="python -m studies.accuracy", description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="few designs, no page in docs")
    parser.add_argument("--out", type=Path, default=None, help="folder of the results")
    arguments = parser.parse_args()
    smoke: bool = arguments.smoke
    out: Path = arguments.out or ROOT / "results" / ("smoke/accuracy" if smoke else "accuracy")
    start = time.perf_counter()

    def done(what: str) -> None:
        print(f"{time.perf_counter() - start:6.1f} s  {what}", flush=True)  # noqa: T201

    import pandas as pd

    areas = regions(16 if smoke else 500, SEED)
    done("regions")
    work = work_table(areas, smoke)
    done("work and precision")
    positions, exact = position_table(areas, 10 if smoke else 400), exact_table(areas, 10 if smoke else 400)
    factors = oracle.frame(oracle.factors(TABLES, few=smoke))
    done("errors against 60 digits and the 25-digit tables")
    outputs, storage = costs.output_costs(areas[0].designs, smoke), costs.storage_costs(20_000 if smoke else 200_000)
    optimiser = (
        digits.optimiser_digits(1 if smoke else 4, 40 if smoke else 1),
        digits.optimiser_targets(1 if smoke else 8),
    )
    done("outputs, storage, optimiser")
    reached = [*marks(*((500, 50) if smoke else (100_000, 2000))), tables_mark(factors)]
    if not smoke:
        reached += [smoke_mark(), study_mark(time.perf_counter() - start)]
    done("marks")
    found = Measured(
        machine=description(),
        smoke=smoke,
        regions=tuple((area.name, area.text) for area in areas),
        marks=pd.DataFrame([mark.__dict__ for mark in reached]),
        positions=positions,
        exact=exact,
        work=work,
        outputs=outputs,
        storage=storage,
        digits=optimiser[0],
        targets=optimiser[1],
        oracle=factors,
        worst=pd.DataFrame(json.loads((TABLES / "worst_found.json").read_text())["rows"])[
            ["poses", "region", "output", "factor"]
        ],
        peers=pd.read_parquet(out / "peers.parquet") if (out / "peers.parquet").exists() else None,
    )
    out.mkdir(parents=True, exist_ok=True)
    for name, table in found.tables():
        table.to_parquet(out / f"{name}.parquet", index=False)
    figures = draw(found.work, found.outputs, found.regions, out / "figures")
    page = markdown(found)
    (out / "accuracy.md").write_text(page, encoding="utf-8")
    (out / "report.html").write_text(html(page, figures), encoding="utf-8")
    if not smoke:
        publish(page, figures, ROOT)
    done(f"{out.relative_to(ROOT) if out.is_relative_to(ROOT) else out}/report.html")


if __name__ == "__main__":
    main()
