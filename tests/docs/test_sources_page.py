"""docs/sources.md cannot rot: its functions can be imported, its tests exist, no number of the sources is left out."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "sources.md"
COMPUTED = ["item", "function", "erratum", "test"]
OTHERWISE = ["item", "printed", "what comes out", "test"]
PARTLY = ["item", "what is here", "what is missing"]
NOT = ["item", "reason"]


def tables() -> list[tuple[list[str], list[dict[str, str]]]]:
    """Every table of the page: its heading and its rows."""
    found: list[tuple[list[str], list[dict[str, str]]]] = []
    heading: list[str] | None = None
    for line in PAGE.read_text().splitlines():
        if not line.startswith("|"):
            heading = None
            continue
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        cells = [cell.strip("| ").strip() for cell in cells]
        if heading is None:
            heading = cells
            found.append((cells, []))
        elif not set("".join(cells)) <= set("-|"):
            assert len(cells) == len(heading), line
            found[-1][1].append(dict(zip(heading, cells, strict=True)))
    return found


def rows(heading: list[str]) -> list[dict[str, str]]:
    return [row for head, body in tables() if head == heading for row in body]


def quoted(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_page_has_no_table_of_another_kind() -> None:
    assert [head for head, _ in tables() if head not in (COMPUTED, OTHERWISE, PARTLY, NOT)] == [["mark", "source"]]


@pytest.mark.parametrize("row", rows(COMPUTED), ids=lambda row: row["item"])
def test_function_of_the_row_can_be_imported_and_its_erratum_is_said(row: dict[str, str]) -> None:
    names = quoted(row["function"])
    assert names and row["erratum"]
    for name in names:
        module, _, attribute = name.partition(":")
        assert callable(getattr(importlib.import_module(module), attribute)), name


@pytest.mark.parametrize("row", [*rows(COMPUTED), *rows(OTHERWISE)], ids=lambda row: row["item"])
def test_test_of_the_row_exists(row: dict[str, str]) -> None:
    names = quoted(row["test"])
    assert names
    for name in names:
        file, _, function = name.partition("::")
        assert re.search(rf"^def {function}\(", (TESTS / file).read_text(), re.MULTILINE), name


def test_what_is_partly_there_says_what_is_missing() -> None:
    assert len(rows(PARTLY)) > 5
    assert all(all(row.values()) for row in rows(PARTLY))


def test_what_is_not_computed_says_why() -> None:
    assert rows(NOT)
    for row in rows(NOT):
        assert row["reason"], row["item"]


def numbers(mark: str) -> set[int]:
    """Numbers of equations that the rows of a source are about; "(5) to (8)" is four of them."""
    found: set[int] = set()
    for row in rows(COMPUTED):
        source, _, rest = row["item"].partition(" ")
        match = re.match(r"\((\d+)\)(?: to \((\d+)\))?", rest)
        if source == mark and match:
            found |= set(range(int(match[1]), int(match[2] or match[1]) + 1))
    return found


@pytest.mark.parametrize(("mark", "last"), [("P", 30), ("H", 4), ("B", 12)])
def test_every_numbered_equation_has_a_row(mark: str, last: int) -> None:
    assert numbers(mark) == set(range(1, last + 1))


def test_every_task_has_a_row() -> None:
    items = [row["item"] for row in rows(COMPUTED)]
    assert all(f"P task {number}" in items for number in range(1, 9)) and any(
        item.startswith("P engineering method") for item in items
    )


def test_every_source_has_rows() -> None:
    marks = {row["mark"] for head, body in tables() if head == ["mark", "source"] for row in body}
    assert marks == {row["item"].split()[0] for row in rows(COMPUTED)} == {"P", "G", "K", "H", "B"}


def test_both_pages_say_where_the_limit_positions_of_kim_and_dison_are() -> None:
    (row,) = (row for row in rows(COMPUTED) if row["item"] == "K limit positions")
    assert "they are at phi = 0 and 180 deg" in row["erratum"]
    assert "limits at phi = 0 and phi = pi" in (PAGE.parent / "kim_dison.md").read_text()
