"""One small study from its file to its optimum: time and error at every accuracy."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import sweep
from studies.accuracy.timing import REPEATS, Spread
from studies.accuracy.witness import reference
from sweep.dataset.files import OPTIMUM
from sweep.families import family
from sweep.families.base import Array

if TYPE_CHECKING:
    import pandas as pd

SETTINGS = ("samples = 360", "target = 1e-3", "target = 1e-6", "target = 1e-9")  # of the table [accuracy]
JUDGED = 200  # number of kept designs whose error is evaluated
FAMILY, OBJECTIVE = "rssr", "max_abs_d2psi"
STUDY = (Path(__file__).parent / "whole.toml").read_text(encoding="utf-8")
DESIGNS, FINEST = "n = 20000", SETTINGS[-1]  # as written in whole.toml


def whole_study(designs: int, repeats: int = REPEATS, smoke: bool = False) -> pd.DataFrame:
    """Return one row per setting: time of the whole run, error of kept designs, optimum, difference from the finest.

    Wall time and processor time of one worker, as median and quartiles; the first run, which may compile, is not
    counted.
    """
    import pandas as pd

    rows = []
    with tempfile.TemporaryDirectory() as name:
        for setting in SETTINGS[::2] if smoke else SETTINGS:
            if not smoke:
                _run(Path(name) / f"{setting}, warm", setting, designs)
            times = [_run(Path(name) / f"{setting}, {k}", setting, designs) for k in range(repeats)]
            wall, work = (Spread.of([pair[k] for pair in times]) for k in (0, 1))
            rows.append(
                {"setting": setting, "designs": designs}
                | _judged(Path(name) / f"{setting}, 0")
                | {"seconds": wall.median, "seconds_lower": wall.lower, "seconds_upper": wall.upper}
                | {"processor_seconds": work.median}
            )
    finest = float(str(rows[-1]["optimum"]))
    for row in rows:
        row["optimum_difference"] = abs(float(str(row["optimum"])) / finest - 1.0)
    return pd.DataFrame(rows)


def _run(folder: Path, setting: str, designs: int) -> tuple[float, float]:
    folder.mkdir()
    text = STUDY.replace(DESIGNS, f"n = {designs}").replace(FINEST, setting)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    start = time.perf_counter(), time.process_time()
    sweep.run(folder, out=folder / "designs", jobs=1)
    return time.perf_counter() - start[0], time.process_time() - start[1]


def _judged(folder: Path) -> dict[str, object]:
    """Return the number of kept rows, the largest relative error of the objective in a subset, and the optimum."""
    import pandas as pd

    kept, best = sweep.load(folder / "designs"), pd.read_parquet(folder / OPTIMUM).iloc[:1]
    few = kept.iloc[:: max(1, len(kept) // JUDGED)]
    error, of_optimum = _error(few), _error(best)
    return {
        "kept": len(kept),
        "largest_error": float(error.max()),
        "optimum": float(best[OBJECTIVE].iloc[0]),
        "optimum_error": float(of_optimum.max()),
    }


def _error(rows: pd.DataFrame) -> Array:
    mechanism = family(FAMILY)
    parameters = [p.name for p in mechanism.parameters]
    matrix = rows.reindex(columns=parameters).fillna({p.name: p.default for p in mechanism.parameters if p.default})
    known = reference(mechanism, np.ascontiguousarray(matrix.to_numpy(np.float64)))
    return np.abs(rows[OBJECTIVE].to_numpy(np.float64) / known.value - 1.0)
