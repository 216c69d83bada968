"""A study whose limits change: what is said of it, and how kept designs are sorted anew."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

import sweep
import sweep.chunks.plan
from sweep.chunks.chunk import compute_chunk
from sweep.dataset import chunk_files, files
from sweep.dataset.files import OLD, PLAN, beside
from sweep.dataset.store import differences
from sweep.errors import InputError
from sweep.study import load_study
from tests.support.engine_study import SMALL_CHUNKS, chunk_bytes, write_study

STRICT, LOOSE = 'margin = { min = 0.3, unit = "1" }', 'margin = { min = 0.1, unit = "1" }'


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ({"limits": {"swing": {"min": 170, "unit": "deg"}}}, {"limits": {"swing": {"min": 50, "unit": "deg"}}},
         ["limits.swing.min 170 -> 50 deg"]),
        ({"limits": {"swing": {"min": 3.0, "unit": "rad"}}}, {"limits": {"swing": {"min": 50, "unit": "deg"}}},
         ["limits.swing.min 3 rad -> 50 deg"]),
        ({"limits": {"rotatable": True}}, {"limits": {}}, ["limits.rotatable true -> none"]),
        ({}, {"limits": {"swing": {"max": 9.5, "unit": "deg"}}}, ["limits none -> swing = max = 9.5 deg"]),
        ({"design": {"a": {"values": [1, 2], "unit": "mm"}}}, {"design": {"a": {"values": [1, 3], "unit": "mm"}}},
         ["design.a.values 1, 2 -> 1, 3 mm"]),
        ({"scene": {"want": list("abcdefgh")}}, {"scene": {"want": list("abxdefgy")}}, ["scene.want c, h -> x, y"]),
        ({"design": {"a": {"value": 2, "unit": "mm"}}}, {"design": {"a": {"value": 2, "unit": "in"}}},
         ["design.a.unit mm -> in"]),
        ({"design": {"a": {"from": 1, "to": 9, "count": 3, "unit": "mm"}}},
         {"design": {"a": {"from": 1, "to": 8, "count": 5, "unit": "mm"}}},
         ["design.a.to 9 -> 8 mm", "design.a.count 3 -> 5"]),
        ({"design": {}}, {"design": {"a": {"from": 1, "to": 8, "count": 5, "unit": "mm"}}},
         ["design.a none -> from = 1 mm, to = 8 mm, count = 5"]),
        ({"x": {str(k): k for k in range(9)}}, {"x": {str(k): k + 1 for k in range(9)}},
         [*(f"x.{k} {k} -> {k + 1}" for k in range(6)), "and 3 more"]),
    ],
)  # fmt: skip
def test_differences_are_said_as_the_author_wrote_them(old: object, new: object, said: list[str]) -> None:
    assert differences(old, new) == said  # type: ignore[arg-type]


def test_the_conflict_of_a_changed_study_is_said_in_its_own_words(tmp_path: Path) -> None:
    old = write_study(tmp_path / "old", keep="feasible", count=10, limits='swing = { min = 170, unit = "deg" }')
    new = write_study(tmp_path / "new", keep="feasible", count=10, limits='swing = { min = 50, unit = "deg" }')
    out = sweep.run(old, tmp_path / "designs", jobs=1)
    with pytest.raises(InputError, match=r"limits\.swing\.min 170 -> 50 deg"):
        sweep.run(new, out, jobs=1)
    other = load_study(new)
    noted = json.loads((beside(out) / PLAN).read_text())
    files.write_plan(out, noted | {"code": "0" * 16, "identity": "0" * 12})
    with pytest.raises(InputError, match="other sources or libraries"):
        sweep.run(other, out, jobs=1)


@pytest.mark.parametrize(("before", "after"), [(LOOSE, STRICT), (STRICT, LOOSE)])
def test_designs_kept_are_sorted_by_other_limits_as_if_computed_anew(
    tmp_path: Path, before: str, after: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = load_study(write_study(tmp_path / "old", count=40, limits=before))
    new = load_study(write_study(tmp_path / "new", count=40, limits=after))
    fresh = sweep.run(new, tmp_path / "fresh" / "designs", jobs=1)
    out = sweep.run(old, tmp_path / "out" / "designs", jobs=1)
    kept = chunk_bytes(out)
    recalled: list[int] = []

    def counted(study: object, start: int, stop: int, should_stop: object, known: object) -> object:
        assert known is not None
        recalled.append(int((known["status"] == 0).sum()))  # type: ignore[index]
        return compute_chunk(study, start, stop, should_stop, known)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr("sweep.engine.worker.compute_chunk", counted)
        sweep.run(new, out, jobs=1)
    assert sum(recalled) > 100, "nothing was taken from the designs kept"
    assert chunk_bytes(out) == chunk_bytes(fresh) and sweep.is_complete(out)
    (aside,) = (beside(out) / OLD).iterdir()
    assert chunk_bytes(aside) == kept, "what was there before is lost"
    sweep.run(new, out, jobs=1)
    assert files.read_runs(out)[-1]["text"] == "0 chunks computed"


def test_a_damaged_chunk_is_not_recalled_but_computed(tmp_path: Path) -> None:
    old = load_study(write_study(tmp_path / "old", count=20, limits=LOOSE))
    new = load_study(write_study(tmp_path / "new", count=20, limits=STRICT))
    out = sweep.run(old, tmp_path / "out" / "designs", jobs=1)
    victim = chunk_files.parts(out)[1].path
    victim.write_bytes(victim.read_bytes()[:-9])
    sweep.run(new, out, jobs=1)
    pd.testing.assert_frame_equal(sweep.load(out), sweep.load(sweep.run(new, tmp_path / "fresh", jobs=1)))


def test_rows_that_were_rounded_or_left_out_are_not_sorted_anew(tmp_path: Path) -> None:
    for kind in ({"keep": "feasible"}, {"dtype": "float32"}):
        name = "-".join(kind.values())
        old = write_study(tmp_path / f"old-{name}", count=10, limits=LOOSE, **kind)
        new = write_study(tmp_path / f"new-{name}", count=10, limits=STRICT, **kind)
        out = sweep.run(old, tmp_path / name / "designs", jobs=1)
        with pytest.raises(InputError, match=r"limits\.margin\.min 0\.1 -> 0\.3"):
            sweep.run(new, out, jobs=1)
