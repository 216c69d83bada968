"""What a user may hand to `evaluate` and `summarise` by mistake: always an InputError that says what and where."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.errors import InputError
from sweep.families import NAMES

ROCKER = {"a": 1.0, "b": 4.0, "c": 2.0, "e": 3.0, "f": 0.5, "g": 0.2, "alpha": 0.3}
FRAME = pd.DataFrame(ROCKER, index=[0, 1])


def refused(words: str, function: Any, *given: Any, **named: Any) -> None:
    with pytest.raises(InputError) as caught:
        function(*given, **named)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("phi", "words"),
    [
        ("abc", "phi, position 0: phi = 'abc'; allowed: a number"),
        ([1.0, "x"], "phi, position 1: phi = 'x'; allowed: a number"),
        (1j, "phi, position 0: phi = 1j; allowed: a number"),
        ([0.0, np.inf], "phi, position 1: phi = inf; allowed: a finite number"),
        ([None, 1.0], "phi, position 0: phi = nan; allowed: a finite number"),
    ],
)
def test_crank_angles(phi: Any, words: str) -> None:
    refused(words, sweep.evaluate, "rssr", ROCKER, "psi", phi=phi)


@pytest.mark.parametrize(
    ("column", "words"),
    [
        ([1, "one"], "column a, row 1: a = 'one'; allowed: a number"),
        (1 + 1j, "column a, row 0: a = (1+1j); allowed: a number"),
        (pd.to_datetime(["2020-01-01"]), "column a, row 0: a = Timestamp('2020-01-01 00:00:00'); allowed: a number"),
        (pd.to_timedelta(["1s"]), "column a, row 0: a = Timedelta('0 days 00:00:01'); allowed: a number"),
        ([1, 10**400], "column a, row 1: a = 1000"),
        (np.ones((2, 2)), "column a: a = 'shape (2, 2)'; allowed: a plain column or one number"),
        (pd.array([1, None], dtype="Float64"), "column a, row 1: a = nan; allowed: a finite number"),
    ],
)
def test_columns(column: Any, words: str) -> None:
    refused(words, sweep.summarise, "rssr", ROCKER | {"a": column}, "swing")


def test_columns_of_unequal_length() -> None:
    table = ROCKER | {"a": [1.0, 2.0], "b": [4.0, 4.0, 4.0]}
    refused("column b: b = '3 rows'; allowed: as many rows as column a, 2", sweep.summarise, "rssr", table, "swing")


@pytest.mark.parametrize("table", [None, [1, 2], np.zeros((2, 7)), FRAME["a"], "designs.csv", [ROCKER, ROCKER]])
def test_tables(table: Any) -> None:
    refused("allowed: a DataFrame of pandas, or a dict of columns", sweep.summarise, "rssr", table, "swing")


@pytest.mark.parametrize(
    ("family", "design", "word", "name"),
    [
        ("slider_crank", {"a": 1.0, "b": 3.0}, "offset", "e"),
        ("inverted_slider_crank", {"a": 1.0, "e": 3.0}, "offset", "h"),
        ("slotted", {"a": 1.0, "e": 3.0}, "Offset", "s"),
        ("cam", {"lift": 1.0, "r0": 3.0}, "eccentricity", "e"),
        ("four_bar", {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0}, "assembly mode", "branch"),
    ],
)
def test_a_textbooks_word_for_a_dimension_with_a_default_is_not_passed_over(
    family: str, design: dict[str, float], word: str, name: str
) -> None:
    """It would be computed with the default, for example a slider-crank in line."""
    words = f"table: column = '{word}'; allowed: the columns"
    refused(words, sweep.evaluate, family, design | {word: 0.5}, "status", phi=0.1)
    refused(f"did you mean '{name}'?", sweep.evaluate, family, design | {word: 0.5}, "status", phi=0.1)


def test_what_the_message_of_a_wrong_table_advises_is_taken() -> None:
    refused("a Series with the values of one design by .to_dict()", sweep.summarise, "rssr", FRAME.iloc[0], "swing")
    refused("a list of designs by pandas.DataFrame(list)", sweep.summarise, "rssr", [ROCKER, ROCKER], "swing")
    swing = sweep.summarise("rssr", FRAME, "swing")["swing"][0]
    for table in (FRAME.iloc[0].to_dict(), pd.DataFrame([ROCKER, ROCKER])):
        assert sweep.summarise("rssr", table, "swing")["swing"][0] == swing


def test_a_column_that_stands_twice() -> None:
    table = pd.concat([FRAME, FRAME[["a"]]], axis=1)
    refused("column = 'a'; allowed: each name once; it stands 2 times", sweep.summarise, "rssr", table, "swing")


@pytest.mark.parametrize("family", [None, 3, [], ["rssr", None], [["rssr"]]])
def test_families(family: Any) -> None:
    refused(f"allowed: one of {', '.join(NAMES)}, or a list", sweep.summarise, family, ROCKER, "swing")


@pytest.mark.parametrize("want", [None, 3, ["swing", 3]])
@pytest.mark.parametrize("function", [sweep.summarise, sweep.evaluate])
def test_wants(function: Any, want: Any) -> None:
    refused("allowed: a name, or a list of names", function, "rssr", ROCKER | {"phi": 1.0}, want)


@pytest.mark.parametrize(("word", "name"), [("theta4", "psi"), ("omega4", "dpsi"), ("alpha4", "d2psi")])
def test_an_output_by_the_number_of_its_link(word: str, name: str) -> None:
    design = {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0}
    refused(f"did you mean '{name}'?", sweep.evaluate, "four_bar", design, word, phi=0.1)


def test_an_output_asked_of_the_wrong_function() -> None:
    refused("swing is an output of a whole turn: ask `summarise`", sweep.evaluate, "rssr", ROCKER, "swing", phi=1.0)
    refused("psi is an output of a single pose: ask `evaluate`", sweep.summarise, "rssr", ROCKER, "psi")
    refused("a is a parameter: a dataset has it, and keep= repeats it", sweep.summarise, "rssr", ROCKER, "a, swing")
    refused("phi is a column of the table, keep= repeats it", sweep.evaluate, "rssr", ROCKER | {"phi": 1.0}, "phi")


@pytest.mark.parametrize(
    "settings",
    [
        {"samples": "360"},
        {"samples": np.nan},
        {"samples": [360]},
        {"accuracy": "fine"},
        {"accuracy": [1e-8]},
        {"accuracy": np.nan},
        {"window": 0.5},
        {"window": ("a", "b")},
        {"window": (0.1, 0.2, 0.3)},
    ],
)
def test_settings(settings: dict[str, Any]) -> None:
    name = next(iter(settings))
    refused(f"{name} = {settings[name]!r}; allowed:", sweep.summarise, "rssr", ROCKER, "max_abs_dpsi", **settings)


@pytest.mark.parametrize(
    "column",
    [
        [1, 1],
        [True, True],
        ["1.0", "1.0"],
        np.ones(2, np.float32),
        np.ones(2, np.float16),
        pd.array([1, 1], dtype="Int64"),
        pd.Categorical([1.0, 1.0]),
        pd.Series([1.0, 1.0], index=[9, 3]),
        pd.Series([1.0, 1.0], dtype=object),
        (1.0, 1.0),
        1,
    ],
)
def test_whatever_converts_to_float64_is_the_same(column: Any) -> None:
    expected = sweep.summarise("rssr", FRAME, "swing")
    found = sweep.summarise("rssr", ROCKER | {"a": column, "b": [4.0, 4.0]}, "swing")
    pd.testing.assert_frame_equal(found, expected)
