"""The bench of basins without its searches: the study's own rule ends a seed, and the page says what was found."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.bench.basins import Row, best_known, fewest, hit, kept, most, page, told
from tests.support.needle208_record import record

BEST = best_known("record_8mm")


def row(number: int, value: float, seed: int = 1) -> Row:
    return Row("record_8mm", seed, number, value, 1e-12, value, 10.0, 1.0)


def test_seed_ends_by_the_rule_of_the_study_which_knows_no_optimum() -> None:
    study = record(8.0)
    assert (fewest(study), most(study)) == (3, 40)
    # Three that agree are enough, whatever they agree on; two of the best among others ask for more, up to forty.
    for value in (BEST, 1.01 * BEST):
        assert told(study, [row(k, value) for k in range(3)]) and not told(study, [row(k, value) for k in range(2)])
    mixed = [row(k, BEST if k < 2 else 1.01 * BEST) for k in range(40)]
    assert not any(told(study, mixed[:n]) for n in range(2, 40)) and told(study, mixed)
    assert not told(study, [row(k, float("nan")) for k in range(12)])
    two = [row(k, BEST if k % 3 == 0 else 1.01 * BEST) for k in range(9)]
    assert not told(study, two[:6]) and told(study, two[:7])


def test_page_says_which_seeds_find_the_best_known() -> None:
    found = [row(k, BEST if k == 4 else 1.01 * BEST) for k in range(12)]
    missed = [row(k, 1.01 * BEST, seed=2) for k in range(12)]
    late = [row(k, 1.01 * BEST, seed=3) for k in range(2)]  # not at its end yet
    text = page([*found, *missed, *late])
    lines = [line for line in text.splitlines() if line.startswith("| links of stage 2")]
    assert [line.split(" | ")[5] for line in lines] == ["yes", "**no**", "not yet"]
    assert [line.split(" | ")[4] for line in lines] == ["5", "none", "none"]
    assert "at least 3 populations" in text


def test_value_a_ten_thousandth_above_is_the_same_basin_and_more_is_not() -> None:
    assert hit(row(0, BEST * (1.0 + 5e-5))) and hit(row(0, 0.99 * BEST))
    assert not hit(row(0, BEST * 1.001)) and not hit(row(0, float("nan")))


@pytest.mark.parametrize("count", [0, 3])
def test_rows_of_an_earlier_run_are_read_again(tmp_path: Path, count: int) -> None:
    rows = [row(k, BEST + k) for k in range(count)]
    path = tmp_path / "kept.jsonl"
    if count:
        path.write_text("".join(json.dumps(asdict(r)) + "\n" for r in rows))
    assert kept(path) == rows
