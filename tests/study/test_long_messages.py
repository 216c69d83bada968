"""A message stays short: consequences of a fault are no faults, and of very many the first are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.errors import MOST_FAULTS, MOST_NAMES, InputError, choices
from sweep.study import load_study
from tests.study.test_faults import RIGHT, faults_of
from tests.support.selection import mostly_long

TAKEUP = (Path(__file__).parents[1] / "studies" / "earlier" / "takeup" / "study.toml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            '"-13.43 mm", "0 mm"]]',
            '"-13.43 mm", "0 kg"]]',
            "thread.upper.path[3][2] = '0 kg'; allowed: a length, in mm",
        ),
        ('tension = "20 gf"', 'tensoin = "20 gf"', "thread.upper.tensoin: unknown key"),
    ],
)
def test_a_faulty_thread_does_not_take_the_names_of_its_outputs_for_faults(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    assert TAKEUP.count(old) == 1
    (message,) = faults_of(TAKEUP.replace(old, new), tmp_path)
    assert words in message


@pytest.mark.parametrize("table", mostly_long(["study", "design", "limits"], ["design"]))
def test_of_thousands_of_faults_the_first_are_told(table: str, tmp_path: Path) -> None:
    keys = "\n".join(f"k{k} = 1" for k in range(3000))
    with pytest.raises(sweep.StudyError) as caught:
        (tmp_path / "study.toml").write_text(RIGHT.replace(f"[{table}]", f"[{table}]\n{keys}", 1))
        load_study(tmp_path)
    message = str(caught.value)
    assert len(caught.value.faults) == 3000 and len(message) < 15_000
    assert len(message.splitlines()) == MOST_FAULTS + 2
    assert message.endswith(f"  and {3000 - MOST_FAULTS} more; mend these first")


def test_of_a_long_list_the_first_names_and_the_nearest_are_told() -> None:
    names = [f"output{k}" for k in range(MOST_NAMES + 5)]
    assert choices("outpt44", names) == f"{', '.join(names[:MOST_NAMES])} and 5 more, did you mean 'output44'?"


def test_a_name_without_its_member_means_that_of_every_member() -> None:
    engine = sweep.machine({f"c{k}": "slider_crank" for k in (1, 2, 3)}, {"shaking": {"shaking": ["c1", "c2", "c3"]}})
    with pytest.raises(InputError, match=r"more, did you mean c1\.speed, c2\.speed, c3\.speed\?$") as caught:
        sweep.evaluate(engine, {"speed": 300.0}, "shaking", phi=0.0)
    assert str(caught.value).count(",") < MOST_NAMES + 5


def test_a_hexadecimal_number_of_thousands_of_digits_is_a_fault(tmp_path: Path) -> None:
    (message,) = faults_of(RIGHT.replace("starts = 10", f"starts = 0x{'f' * 4500}"), tmp_path)
    assert "optimise.starts = something of type int that cannot be printed; allowed: a whole number" in message


@pytest.mark.parametrize("kind", ["LazyFrame", "Styler"])
def test_tables_of_other_programs_are_refused_with_what_to_do(kind: str) -> None:
    """They have columns, as a DataFrame has, and cannot be iterated over."""
    table = type(kind, (), {"columns": ["a", "b"]})()
    with pytest.raises(InputError, match=rf"table = '{kind}'; allowed: a DataFrame of pandas.*\.to_pandas\(\)"):
        sweep.summarise("rssr", table, "swing")


def test_what_is_missing_is_said_to_be_missing() -> None:
    with pytest.raises(InputError, match="points: axis_A is missing; needed: a direction"):
        sweep.from_points("rssr", A=[0, 0, 0])
    with pytest.raises(InputError, match="table of rssr: b is missing; needed: a column with the coupler; found a"):
        sweep.summarise("rssr", {"a": 1.0}, "swing")
    with pytest.raises(InputError, match="allowed: a finite number; an empty cell is read as nan"):
        sweep.summarise("geared_dwell", {"k": [1.0, float("nan")], "a": 1.0}, "dwell_angle")
    masked = np.ma.array([1.0, 2.0], mask=[False, True])  # numpy would take the 2
    with pytest.raises(InputError, match="column k, row 1: k = nan"):
        sweep.summarise("geared_dwell", {"k": masked, "a": 1.0}, "dwell_angle")
