"""What comes back says its units, keeps the labels of the rows, and takes wanted names as one text or a list."""

from __future__ import annotations

import importlib
import inspect
import pkgutil

import numpy as np
import pandas as pd
import pytest

import sweep
import sweep.synthesis
from sweep.dataset import reading
from sweep.families import NAMES, family
from sweep.synthesis import heddle, mechanisms, thread_law
from sweep.synthesis.tasks import task3
from tests.support.report_dataset import write_dataset

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


RSSR = dict(family("rssr").example)
GUIDES = {"X1": 0.0, "Y1": 0.0, "Z1": 0.0, "X2": 4.0, "Y2": 0.0, "Z2": 0.0}
POINT = {"X_E": 2.0, "Y_E": 2.0, "Z_E": 0.0}
LEVER = {"stroke": 60.0, "O4E": 90.0, "O1O2": 100.0, "O1O3": 250.0, "O3C": 120.0, "kappa": 1.6}
CRANK = {"a": 2.0, "e": 3.0, "f": 1.0, "alpha": 0.5, "Z1": -3.0, "Z2": 4.0, "phi_h": 0.0, "P_h": 8.0, "phi": 1.0}
SLOT = {"phi0": 2.8, "e": 10.0, "f": 2.0, "alpha": 0.4}
THREAD = [[0.0, 60.0, 0.0], "drive.eye", [0.0, -30.0, 0.0]]
LAW = thread_law.ThreadLaw(np.array([3.0, 0.4]), np.array([-1.0, 0.2]), 0.0, 0.0, 0.0)
LOCUS = {"swing": 0.785, "phi0": 3.403, "phi1": 0.0, "e": 100.0, "f": 0.0, "g": 10.0, "alpha": 1.047}
TABLES = {
    sweep.evaluate: lambda folder: sweep.evaluate("rssr", RSSR, "psi, dpsi", phi=[0.0]),
    sweep.summarise: lambda folder: sweep.summarise("rssr", RSSR, "swing, margin"),
    sweep.joints: lambda folder: sweep.joints("rssr", RSSR, 0.0),
    sweep.load: sweep.load,
    sweep.cyclogram: lambda folder: sweep.cyclogram("rssr", RSSR),
    reading.best: lambda folder: reading.best(folder, "stroke"),
    reading.of_number: lambda folder: reading.of_number(folder, 0),
    reading.pareto: lambda folder: reading.pareto(folder, "stroke", "max_abs_dev"),
    sweep.synthesise: lambda folder: sweep.synthesise("rssr", LOCUS),
    mechanisms.central_slots: lambda folder: sweep.synthesise(
        "slotted", {"phi0": 2.8, "e": 10.0, "f": 2.0, "alpha": 0.4}
    ),
    mechanisms.five_links_with_limits: lambda folder: mechanisms.five_links_with_limits(RSSR, 0.1),
    task3.adjustments: lambda folder: task3.adjustments(RSSR),
    heddle.extremes: lambda folder: heddle.extremes(LEVER),
    heddle.rods: lambda folder: heddle.rods(LEVER | {"O2B": 80.0, "swing": 0.4}),
    heddle.shed: lambda folder: heddle.shed({"shaft": [1, 2], "d1": 100.0, "t": 12.0, "stroke": 60.0}),
    heddle.arms: lambda folder: heddle.arms({"stroke": 60.0, "O4E": 90.0, "O4F": 80.0, "O3O4": 200.0, "mu_3": 0.3}),
    sweep.thread.wrap: lambda folder: sweep.thread.wrap(GUIDES | POINT),
    sweep.thread.feed: lambda folder: sweep.thread.feed(GUIDES | POINT),
    sweep.thread.eyelet: lambda folder: sweep.thread.eyelet(CRANK),
    sweep.thread.follower: lambda folder: sweep.thread.follower({"L": 11.0, "Z1": 3.0, "e": 4.0, "X1": 0.0}),
    sweep.thread.free_cam: lambda folder: sweep.thread.free_cam(GUIDES | {"a": 0.4, "phi": 5.0, "Z1": -3.0, "Z2": 3.0}),
    sweep.thread.contour: lambda folder: sweep.thread.contour({"T1": 5.0, "R": 1.0, "theta_deg": 90.0}),
    sweep.thread.path: lambda folder: sweep.thread.path(5.0, {"R": [1.0, 0.5], "theta_deg": 90.0}),
    sweep.thread.least_tension_radius: lambda folder: sweep.thread.least_tension_radius({"B": 10.0}),
    sweep.thread.speed: lambda folder: sweep.thread.speed({"v": 1.0}),
    sweep.thread.diagram: lambda folder: sweep.thread.diagram(
        sweep.machine({"drive": {"family": "four_bar", "eye": [12.0, 5.0, 0.0]}}, {"upper": {"thread": THREAD}}),
        {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0},
        samples=4,
    ),
    thread_law.cam_edge: lambda folder: thread_law.cam_edge(LAW, [[60.0, -25.0, -20.0], [60.0, 20.0, 30.0]], 92.0, 90),
    sweep.thread.capstan: lambda folder: sweep.thread.capstan({"T1": 5.0, "wrap": 1.0, "mu": 0.2}),
}
COUNTED = {"design", "status", "failed", "adjusts"}
PLACES = {"member", "stage", "frame", "joint", "kind", "name"}


def public_tables():
    """Every public function that says it returns a DataFrame: of the package, of what it offers, of synthesis."""
    modules = [sweep, sweep.thread, reading]
    modules += [
        importlib.import_module(m.name) for m in pkgutil.walk_packages(sweep.synthesis.__path__, "sweep.synthesis.")
    ]
    found = set()
    for module in modules:
        for name in getattr(module, "__all__", dir(module)):
            value = getattr(module, name)
            if name.startswith("_") or not inspect.isfunction(value) or not value.__module__.startswith("sweep."):
                continue
            if inspect.signature(value).return_annotation == "pd.DataFrame":
                found.add(value)
    return found


def test_every_public_table_is_looked_at():
    assert public_tables() == set(TABLES)


@pytest.mark.parametrize("function", TABLES, ids=lambda f: f"{f.__module__}.{f.__name__}")
def test_every_public_table_names_the_unit_of_every_number(function, tmp_path):
    place = (
        write_dataset(tmp_path / "designs")
        if function in (sweep.load, reading.best, reading.of_number, reading.pareto)
        else None
    )
    found = TABLES[function](place)
    assert len(found)
    assert set(found.attrs["units"]) - COUNTED == set(found.columns) - COUNTED - PLACES
    assert all(found.attrs["units"].values())
