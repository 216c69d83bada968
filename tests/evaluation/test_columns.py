"""What `evaluate` and `summarise` keep of a table: index, columns, and the status in words; what they refuse of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from kernels.status import MEANING, NOT_ROTATABLE, OK
from sweep.cli import main
from sweep.cli.tables import read_table
from sweep.errors import InputError
from sweep.evaluation.statuses import meaning, meanings
from sweep.families import family

ROCKER = {"a": 1.0, "b": 4.0, "c": 2.0, "e": 3.0, "f": 0.5, "g": 0.2, "alpha": 0.3}
# The second one's crank is too long to turn.
FRAME = pd.DataFrame(
    {**ROCKER, "a": [1.0, 30.0, 0.9], "name": ["x", "y", "z"], "margin": [5, 6, 7]}, index=["p", "q", "q"]
)


class Unprintable:
    def __repr__(self) -> str:
        raise ValueError("no words")


def refused(words: str, function: Any, *given: Any, **named: Any) -> None:
    with pytest.raises(InputError) as caught:
        function(*given, **named)
    assert words in str(caught.value)


def test_index_of_the_designs_is_kept_at_every_crank_angle() -> None:
    found = sweep.evaluate("rssr", FRAME, "psi", phi=[0.1, 0.2])
    assert list(found.index) == ["p", "p", "q", "q", "q", "q"]
    assert list(found["design"]) == [0, 0, 1, 1, 2, 2]  # the row number, where labels repeat
    assert list(sweep.evaluate("rssr", FRAME.assign(phi=0.3), "psi").index) == ["p", "q", "q"]
    assert list(sweep.evaluate("rssr", ROCKER, "psi", phi=[0.1, 0.2]).index) == [0, 1]


def test_columns_asked_for_are_kept_in_front_as_they_are() -> None:
    some = sweep.summarise("rssr", FRAME, "rotatable", keep=["name", "a"])
    assert list(some.columns) == ["name", "a", "rotatable", "err_rotatable", "status"]
    assert list(some["name"]) == ["x", "y", "z"] and list(some.index) == ["p", "q", "q"]
    turn = sweep.evaluate("rssr", FRAME, "psi", phi=[0.1, 0.2], keep="name")
    assert list(turn.columns) == ["name", "design", "phi", "psi", "status"]
    assert list(turn["name"]) == ["x", "x", "y", "y", "z", "z"]
    posed = sweep.evaluate("rssr", FRAME.assign(phi=[0.1, 0.2, 0.3]), "psi", keep="phi")
    assert list(posed["phi"]) == [0.1, 0.2, 0.3] and list(posed.index) == ["p", "q", "q"]
    single = sweep.summarise("rssr", ROCKER | {"b": [4.0, 4.1], "id": 7}, "rotatable", keep="id")
    assert list(single["id"]) == [7, 7]


def test_keeping_all_leaves_to_the_result_what_it_names_itself() -> None:
    found = sweep.summarise("rssr", FRAME, "margin", keep=True)
    assert list(found.columns) == [*(n for n in FRAME if n != "margin"), "margin", "err_margin", "status"]
    assert found["margin"].iloc[0] < 1.0
    nothing = sweep.summarise("rssr", FRAME, "margin", keep=False)
    assert list(nothing.columns) == ["margin", "err_margin", "status"]


@pytest.mark.parametrize(
    ("keep", "words"),
    [
        (
            "nam",
            "keep = 'nam'; allowed: columns of the table: a, b, c, e, f, g, alpha, name, margin, did you mean 'name'",
        ),
        (["margin"], "keep = 'margin'; allowed: another name: the result has a column of this one itself"),
        ([3], "want = 3; allowed: a name, or a list of names"),
    ],
)
def test_columns_that_cannot_be_kept(keep: Any, words: str) -> None:
    refused(words, sweep.summarise, "rssr", FRAME, "margin", keep=keep)


def test_kept_column_of_another_length_is_refused() -> None:
    refused("id = '3 rows'", sweep.summarise, "rssr", ROCKER | {"a": [1.0, 2.0], "id": [1, 2, 3]}, "margin", keep="id")


def test_every_row_counts_that_only_an_input_of_another_effect_has() -> None:
    masses = np.array([1e-6, 2e-6, 3e-6])
    assert len(sweep.summarise("rssr", {**ROCKER, "m_crank": masses}, "swing")) == 3
    assert len(sweep.evaluate("rssr", {**ROCKER, "m_crank": masses}, "psi", phi=[0.1, 0.2])) == 6
    members = {**{f"x.{name}": x for name, x in ROCKER.items()}, "x.m_crank": masses}
    assert len(sweep.summarise(sweep.machine({"x": "rssr"}), members, "x.swing")) == 3
    refused("3 rows", sweep.summarise, "rssr", {**ROCKER, "a": [1.0, 0.9], "m_crank": masses}, "swing")


def test_status_in_words() -> None:
    found = sweep.summarise("rssr", FRAME, "swing", status_text=True)
    assert list(found["status_text"]) == [MEANING[code] for code in found["status"]]
    assert list(found["status"]) == [OK, NOT_ROTATABLE, OK]
    poses = sweep.evaluate("rssr", FRAME, "psi", phi=[0.0, np.pi], status_text=True)
    assert list(poses["status_text"]) == meanings(poses["status"])
    assert meaning(200) == "status 200: unknown"


@pytest.mark.parametrize(
    ("phi", "words"),
    [
        (np.zeros((2, 3)), "phi = 'shape (2, 3)'; allowed: one angle, or a plain list of angles for every design"),
        ([[0.0], [1.0]], "phi = 'shape (2, 1)'"),
        ([[0.0], [1.0, 2.0]], "phi, position 0: phi = [0.0]; allowed: a number"),
        (np.array([0.0, [1.0]], dtype=object), "phi, position 1: phi = [1.0]; allowed: a number"),
        ({0.1}, "phi: phi = {0.1}; allowed: a number, or a list or array of numbers"),
        (iter([0.1, 0.2]), "iterator object at"),
    ],
)
def test_crank_angles_that_are_no_plain_list_are_refused(phi: Any, words: str) -> None:
    refused(words, sweep.evaluate, "rssr", ROCKER, "psi", phi=phi)


def test_a_march_over_no_angle_is_refused() -> None:
    foot = family("foot")
    words = "phi = 'no angle'; allowed: equal steps of one turn from 0"
    refused(words, sweep.evaluate, "foot", foot.example, foot.position, phi=[], angles="rad")


def test_column_of_crank_angles_beside_the_argument_is_refused() -> None:
    refused(
        "either phi= for every design, or a column phi", sweep.evaluate, "rssr", FRAME.assign(phi=0.1), "psi", phi=0
    )


def objects(*values: Any) -> Any:
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


@pytest.mark.parametrize(
    ("column", "words"),
    [
        ([1.0, [2.0]], "column a, row 1: a = [2.0]; allowed: a number"),
        ([[1.0], [2.0, 3.0]], "column a, row 0: a = [1.0]; allowed: a number"),
        ([1.0, np.ones(2)], "column a, row 1: a = array([1., 1.]); allowed: a number"),
        ([np.ones(2), np.ones((2, 2))], "column a, row 0: a = array([1., 1.]); allowed: a number"),
        (pd.Series([1.0, (2.0, 3.0)]), "column a, row 1: a = (2.0, 3.0); allowed: a number"),
        (objects(1.0, np.ones(1)), "column a, row 1: a = array([1.]); allowed: a number"),
        (objects(1.0, {}), "column a, row 1: a = {}; allowed: a number"),
        (objects(1.0, np.complex128(1j)), "column a, row 1: a = np.complex128(1j); allowed: a number"),
        (objects(1.0, np.timedelta64(1, "s")), "column a, row 1: a = np.timedelta64(1,'s'); allowed: a number"),
        (
            objects(1.0, 10**5000),
            "column a, row 1: a = something of type int that cannot be printed; allowed: a number",
        ),
        (objects(1.0, Unprintable()), "a = something of type Unprintable that cannot be printed; allowed: a number"),
        ([1.0, "x" * 5000], " ...; allowed: a number"),
        ({1.0, 2.0}, "column a: a = {1.0, 2.0}; allowed: a number, or a list or array of numbers"),
    ],
)
@pytest.mark.parametrize("function", [sweep.summarise, sweep.evaluate])
def test_columns_of_sequences_and_other_things_name_column_and_row(function: Any, column: Any, words: str) -> None:
    table = ROCKER | {"a": column, "phi": 1.0}
    refused(words, function, "rssr", table, "margin" if function is sweep.summarise else "psi")


def test_damaged_parquet_metadata_is_an_error_of_ours(tmp_path: Any) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    whole = pa.Table.from_pandas(FRAME[["a", "b"]])
    for number, damage in enumerate(
        (b'{"columns": 3}', b'{"index_columns": [{"kind": "x"}], "columns": [{}]}', b"[1]")
    ):
        path = tmp_path / f"{number}.parquet"
        pq.write_table(whole.replace_schema_metadata({b"pandas": damage}), path)
        refused("readable parquet", read_table, path)
        result = CliRunner().invoke(main, ["summarise", "rssr", str(path), "--want", "margin"])
        assert result.exit_code == 2 and "readable parquet" in result.output


def test_command_line_keeps_columns_and_says_the_status(tmp_path: Any) -> None:
    path = tmp_path / "designs.csv"
    FRAME.to_csv(path, index=False)
    command = ["summarise", "rssr", str(path), "--want", "rotatable", "--status-text"]
    lines = CliRunner().invoke(main, [*command, "--keep", "name"]).output.splitlines()
    assert lines[0] == "name,rotatable,err_rotatable,status,status_text"
    assert lines[1].startswith("x,True,") and MEANING[NOT_ROTATABLE] in lines[2]
    everything = CliRunner().invoke(main, [*command, "--keep", "all"]).output.splitlines()
    assert everything[0].startswith("a,b,c,e,f,g,alpha,name,margin,rotatable")
    both = tmp_path / "both.csv"
    FRAME.assign(phi=0.1).to_csv(both, index=False)
    result = CliRunner().invoke(main, ["eval", "rssr", str(both), "--want", "psi", "--poses", "3"])
    assert result.exit_code == 2 and "either --poses or a column phi" in result.output


def test_chain_may_be_written_in_one_word_as_on_the_command_line() -> None:
    row = {"a1": 1.0, "b1": 4.0, "c1": 2.5, "e1": 3.1, "f1": 0.7, "g1": -0.6, "alpha1": 0.9, "a2": 1.0, "b2": 3.3}
    row |= {"c2": 3.1, "e2": 3.0, "xi2": 4.2, "eta2": 0.8, "lam2": 1.1, "h2": -0.6}
    table = pd.DataFrame([row])
    for word in ("rssr+guide", "rssr, guide"):
        pd.testing.assert_frame_equal(
            sweep.summarise(word, table, ["stroke"]), sweep.summarise(["rssr", "guide"], table, ["stroke"])
        )
        pd.testing.assert_frame_equal(
            sweep.evaluate(word, table, ["s"], phi=[0.0, 1.0]),
            sweep.evaluate(["rssr", "guide"], table, ["s"], phi=[0.0, 1.0]),
        )
    with pytest.raises(InputError, match="did you mean 'guide'"):
        sweep.summarise("rssr+giude", table, ["stroke"])


def test_a_name_given_to_the_labels_of_one_result_stays_there() -> None:
    """Labels of the same names are made once for all results."""
    found = sweep.summarise("rssr", ROCKER, ["margin"])
    found.columns.name = "output"
    assert sweep.summarise("rssr", ROCKER, ["margin"]).columns.name is None
