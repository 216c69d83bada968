"""A dataset as a workbook, read back by openpyxl and pandas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.cli.workbook import write_workbook
from sweep.dataset.reading import best
from sweep.errors import InputError
from sweep.study import study_from_data
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


def test_what_is_made_large_stays_negative_under_its_name_and_its_error_positive(tmp_path: Path) -> None:
    study = study_from_data(
        {
            "study": {"name": "bars", "title": "Four-bars"},
            "mechanism": {"family": "four_bar"},
            "scene": {"want": ["least_transmission_angle"]},
            "design": {
                "a": {"from": 8.0, "to": 12.0, "count": 5, "unit": "mm"},
                "b": "35 mm",
                "c": "30 mm",
                "e": "32 mm",
            },
            "objective": {"maximise": "least_transmission_angle"},
            "accuracy": {"target": 1e-8},
        },
        "study.toml",
    )
    stored = sweep.load(sweep.run(study, out=tmp_path / "designs", jobs=1))
    found = pd.read_excel(write_workbook(tmp_path / "designs", tmp_path / "bars.xlsx")).sort_values("design")
    for name in ("minus_least_transmission_angle", "err_minus_least_transmission_angle"):
        np.testing.assert_allclose(found[f"{name} [°]"], np.degrees(stored[name]), rtol=1e-6)  # err_ is float32


def test_command_writes_it_beside_the_designs(folder: Path) -> None:
    done = CliRunner().invoke(main, ["export", str(folder), "--format", "xlsx"])
    assert done.exit_code == 0, done.output
    assert (folder.parent / "export" / "results.xlsx").is_file()


@pytest.mark.parametrize("name", ["needle.xls", "needle"])
def test_another_ending_is_refused_and_nothing_is_written(folder: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"\.xlsx"):
        write_workbook(folder, tmp_path / name)
    assert not list(tmp_path.iterdir())
