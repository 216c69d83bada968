"""What comes back says its units, keeps the labels of the rows, and takes wanted names as one text or a list."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.families import NAMES, family
from tests.report_dataset import write_dataset

TABLE = pd.DataFrame(
    {"a": [10.0, 12.0], "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.0, "id": ["left", "right"]},
    index=pd.Index([7, 3], name="drive"),
)


def test_poses_name_their_units_and_keep_labels_and_ids():
    found = sweep.evaluate("rssr", TABLE, "psi, dpsi,d2psi", phi=[0.0, 1.0], keep="id")
    assert found.attrs["units"] == {"phi": "rad", "psi": "rad", "dpsi": "1", "d2psi": "1"}
    assert list(found.index) == [7, 7, 3, 3] and list(found["id"]) == ["left", "left", "right", "right"]
    pd.testing.assert_frame_equal(
        found, sweep.evaluate("rssr", TABLE, ["psi", "dpsi", "d2psi"], phi=[0.0, 1.0], keep=["id"])
    )


def test_designs_name_their_units_and_keep_labels_and_ids():
    found = sweep.summarise("slider_crank", TABLE[["a", "b", "id"]], "stroke, max_abs_d2s", keep="id")
    units = {"stroke": "length", "max_abs_d2s": "length"}
    assert found.attrs["units"] == units | {f"err_{name}": unit for name, unit in units.items()}
    assert list(found.index) == [7, 3] and found.index.name == "drive" and list(found["id"]) == ["left", "right"]
    assert set(found.columns) == {*found.attrs["units"], "id", "status"}


@pytest.mark.parametrize("name", NAMES)
def test_every_output_of_every_family_has_a_unit(name):
    assert all(output.unit for output in family(name).pose_outputs)


def test_unknown_name_in_one_text_is_said_alone():
    with pytest.raises(sweep.InputError, match=r"want = 'dpsy'; .*did you mean 'dpsi'"):
        sweep.evaluate("rssr", TABLE, "psi, dpsy", phi=0.0)


def test_rows_of_a_dataset_name_their_units(tmp_path):
    rows = sweep.load(write_dataset(tmp_path / "designs"))
    assert rows.attrs["units"]["alpha1"] == "rad" and rows.attrs["units"]["a1"] == "mm"
    assert set(rows.attrs["units"]) <= set(rows.columns)


def test_units_survive_a_parquet_file(tmp_path):
    found = sweep.evaluate("rssr", TABLE, "psi", phi=np.array([0.0]))
    found.to_parquet(tmp_path / "poses.parquet")
    assert pd.read_parquet(tmp_path / "poses.parquet").attrs["units"]["psi"] == "rad"
