"""A dataset as a workbook, read back by openpyxl and pandas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from click.testing import CliRunner

from sweep.cli import main
from sweep.dataset.reading import best
from sweep.errors import InputError
from sweep.report.workbook import write_workbook
from tests.support.report_dataset import write_dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("workbook") / "designs", optimum={})


def test_sheets_hold_the_best_designs_first_in_shown_units(folder: Path, tmp_path: Path) -> None:
    file = write_workbook(folder, tmp_path / "needle.xlsx")
    sheets = pd.read_excel(file, sheet_name=None)
    assert list(sheets) == ["designs", "optimum", "curves", "definitions"]
    found, stored = sheets["designs"], best(folder, "max_abs_d2s", 100_000)
    np.testing.assert_array_equal(found["max_abs_d2s [mm/rad²]"], stored["max_abs_d2s"])
    # A sheet holds what repr prints of a float64, 17 digits; degrees are one multiplication away.
    np.testing.assert_allclose(found["alpha1 [°]"], np.degrees(stored["alpha1"]), rtol=4 * 2.0**-53)
    book = openpyxl.load_workbook(file)
    assert book["designs"].freeze_panes == "B2"


def test_definitions_name_every_column_once_with_its_unit(folder: Path, tmp_path: Path) -> None:
    sheets = pd.read_excel(write_workbook(folder, tmp_path / "needle.xlsx"), sheet_name=None)
    about = sheets.pop("definitions").set_index("column")
    assert about.index.is_unique
    assert {name.split(" [")[0] for sheet in sheets.values() for name in sheet} == set(about.index)
    assert about.loc["max_abs_d2s", "unit"] == "mm/rad²" and "d2s" in about.loc["max_abs_d2s", "definition"]


def test_command_writes_it_beside_the_designs(folder: Path) -> None:
    done = CliRunner().invoke(main, ["export", str(folder), "--format", "xlsx"])
    assert done.exit_code == 0, done.output
    assert (folder.parent / "export" / "results.xlsx").is_file()


@pytest.mark.parametrize("name", ["needle.xls", "needle"])
def test_another_ending_is_refused_and_nothing_is_written(folder: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"\.xlsx"):
        write_workbook(folder, tmp_path / name)
    assert not list(tmp_path.iterdir())
