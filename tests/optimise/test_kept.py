"""A search that was stopped goes on behind the parts that were over, and ends with the bytes of one never stopped."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep.optimise.study
from sweep.dataset.files import MADE, OF_OPTIMUM, OPTIMUM, TOLERANCE, Kept
from sweep.engine.run import run
from sweep.optimise import optimise_study
from sweep.optimise.local.kkt import Result, noted, result_of
from sweep.study import load_study
from tests.optimise.test_robust import ROBUST

PLAIN = ROBUST.replace('robust = "95 %"\n', "")


def test_search_that_was_stopped_while_designs_were_made_robust_goes_on_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "study.toml").write_text(ROBUST)
    study = load_study(tmp_path)
    out = run(study, tmp_path / "designs", jobs=1)
    whole = {name: (tmp_path / name).read_bytes() for name in OF_OPTIMUM}
    file = tmp_path / "_search.json"
    assert not file.exists()

    def begun() -> bool:
        return file.exists() and any(name.startswith("approach") for name in json.loads(file.read_text())["parts"])

    with pytest.raises(KeyboardInterrupt):
        optimise_study(study, out, begun, key="k")
    assert {"drawing", "insensitive", "approach 0"} <= set(Kept(file, "k").parts)
    assert not Kept(file, "another").parts

    def refused(*_: object) -> None:
        raise AssertionError("the drawing was searched again")

    monkeypatch.setattr(sweep.optimise.study, "explore", refused)
    optimise_study(study, out, key="k")
    assert not file.exists()
    assert {name: (tmp_path / name).read_bytes() for name in OF_OPTIMUM} == whole


def test_run_that_was_stopped_at_what_is_made_keeps_its_optimum_and_repeats_the_sample_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.optimise.manufacture.sample.batch_size", lambda _: 4096)
    (tmp_path / "study.toml").write_text(PLAIN)
    study, told = load_study(tmp_path), list[tuple[int, int]]()

    def say(label: str, done: int, total: int, unit: str) -> None:
        if label == "what is made":
            told.append((done, total))

    out = run(study, tmp_path / "designs", jobs=1)
    whole = {name: (tmp_path / name).read_bytes() for name in OF_OPTIMUM}
    with pytest.raises(KeyboardInterrupt):
        optimise_study(study, out, lambda: len(told) >= 3, say=say, key="k")
    # yields of optimum and reference, their distributions, and the costs of seven dimensions
    total = 2 * 65536 + 2 * 2048 + 7 * 512
    assert told == [(4096, total), (8192, total), (12288, total)]
    table = pd.read_parquet(tmp_path / OPTIMUM)
    known = pd.read_parquet(io.BytesIO(whole[OPTIMUM]))
    assert table["yield"].isna().all() and table.drop(columns="yield").equals(known.drop(columns="yield"))
    # those of an earlier optimum would be taken for this one's
    assert not (tmp_path / MADE).exists() and not (tmp_path / TOLERANCE).exists()

    def refused(*_: object) -> None:
        raise AssertionError("the drawing was searched again")

    monkeypatch.setattr(sweep.optimise.study, "explore", refused)
    told.clear()
    optimise_study(study, out, say=say, key="k")
    assert told[-1] == (total, total)
    assert {name: (tmp_path / name).read_bytes() for name in OF_OPTIMUM} == whole


def test_results_come_back_with_every_bit_and_a_damaged_file_is_forgotten(tmp_path: Path) -> None:
    design = np.array([0.1, 1e-300, math.nan])
    result = Result(3, design, 1.0 / 3.0, math.inf, 0.0, 1e-13, ("a",), {"a": 0.1}, {}, {"b": 0.3}, 0, "looks")
    kept = Kept(tmp_path / "search.json", "k")
    kept.note("one", noted(result))
    again = result_of(Kept(tmp_path / "search.json", "k").parts["one"])
    assert again.design.tobytes() == result.design.tobytes()
    assert {**vars(again), "design": 0} == {**vars(result), "design": 0}
    (tmp_path / "search.json").write_text('{"key": "k"')
    assert not Kept(tmp_path / "search.json", "k").parts
