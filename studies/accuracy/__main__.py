"""``python -m studies.accuracy``: measure, keep the tables as Parquet, draw, and write the page."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from studies.accuracy import costs, oracle
from studies.accuracy.diagrams import extrema_table, position_table
from studies.accuracy.exact import exact_table
from studies.accuracy.figures import draw
from studies.accuracy.machine import description
from studies.accuracy.marks import marks
from studies.accuracy.page import Measured, html, markdown
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

    areas = regions(60 if smoke else 500, SEED)
    done("regions")
    found = Measured(
        machine=description(),
        smoke=smoke,
        regions=tuple((area.name, area.text) for area in areas),
        marks=pd.DataFrame([mark.__dict__ for mark in marks(*((500, 50) if smoke else (100_000, 2000)))]),
        positions=position_table(areas, 15 if smoke else 400),
        exact=exact_table(areas, 15 if smoke else 400),
        extrema=extrema_table(areas, smoke),
        outputs=costs.output_costs(areas[0].designs, smoke),
        storage=costs.storage_costs(20_000 if smoke else 500_000),
        optimiser=costs.optimiser_costs((1e-4, 1e-8) if smoke else (1e-3, 1e-4, 1e-6, 1e-8, 1e-10), 1 if smoke else 8),
        oracle=oracle.frame(oracle.factors(TABLES)),
        worst=pd.DataFrame(json.loads((TABLES / "worst_found.json").read_text())["rows"])[
            ["region", "output", "factor"]
        ],
        peers=pd.read_parquet(out / "peers.parquet") if (out / "peers.parquet").exists() else None,
    )
    done("measured")
    out.mkdir(parents=True, exist_ok=True)
    for name, table in found.tables():
        table.to_parquet(out / f"{name}.parquet", index=False)
    figures = draw(found.extrema, out / "figures")
    page = markdown(found)
    (out / "accuracy.md").write_text(page, encoding="utf-8")
    (out / "report.html").write_text(html(page, figures), encoding="utf-8")
    if not smoke:
        (ROOT / "docs" / "accuracy.md").write_text(page, encoding="utf-8")
    done(f"{out.relative_to(ROOT) if out.is_relative_to(ROOT) else out}/report.html")


if __name__ == "__main__":
    main()
