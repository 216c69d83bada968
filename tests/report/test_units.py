"""What a report prints is in a designer's units, and nothing stands under a heading that it has no right to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from kernels import status as codes
from sweep.engine.run import run
from sweep.optimise.multistart.survey import Survey
from sweep.report.answer import survey_warnings
from sweep.report.dataset import Dataset, gather, without_rows
from sweep.report.figures import trade_off
from sweep.report.front import Front
from sweep.report.page import write_report
from sweep.report.quantities import quantity
from sweep.report.scan import scan
from sweep.report.tables import output_rows
from sweep.study import study_from_data
from tests.support.report_dataset import DATA, study_data, write_dataset


@pytest.mark.parametrize(
    ("name", "unit", "stored", "words"),
    [
        ("m_crank", "mass", 3e-5, "30\u00a0g"),
        ("reduced_inertia", "inertia", 2e-6, "0.002\u00a0kg·mm²"),
        ("max_reduced_inertia", "t*mm^2", 2e-6, "0.002\u00a0kg·mm²"),
        ("life_d1", "time", 7.2e7, "20000\u00a0h"),
        ("required_life", "s", 7.2e7, "20000\u00a0h"),
    ],
)
def test_masses_inertias_and_lives_are_in_g_kg_mm2_and_hours(name, unit, stored, words) -> None:
    assert quantity(name, unit).show(stored) == words


def front_of(side: str, status: int = codes.OK) -> Dataset:
    pareto = {"output": "max_pressure_angle1", side: {"values": [30.0, 40.0], "unit": "deg"}}
    study = study_from_data(DATA | {"pareto": pareto}, "study.toml")
    point = {"bound": np.radians(40.0), "max_abs_d2s": 8.0, "max_pressure_angle1": np.radians(40.0), "status": status}
    relaxed = "max_pressure_angle1 by 0.010098; stroke by 0.2; max_abs_d2s has no value"
    point |= {"relaxation": relaxed, "active": "", "kkt_residual": 0.0}
    units = {"max_pressure_angle1": "rad", "stroke": "mm", "max_abs_d2s": "mm"}
    front = pd.DataFrame([point | {"ended": "converged"}])
    optima = pd.DataFrame([{"role": "optimum", "max_abs_d2s": 8.0}])
    return replace(without_rows(study), front=front, optima=optima, units=units)


def test_what_gives_way_is_said_in_the_unit_of_its_table() -> None:
    front = Front.of(front_of("at_most", codes.LIMIT_EXCEEDED))
    angle = "largest pressure angle of stage 1 by 0.579°"
    assert front.held(front.points[0]) == f"{angle}; stroke by 0.2\u00a0mm; largest acceleration has no value"


def test_bounds_without_a_design_are_said() -> None:
    """The table had them; neither the answer nor the terminal said a word of a front without any design."""
    found = Front.of(front_of("at_most", codes.LIMIT_EXCEEDED))
    angle = "largest pressure angle of stage 1"
    assert (
        found.sentence() == f"No design was found within 1 of 1 bound on the {angle}, the loosest of them at most 40°."
    )
    assert Front.of(front_of("at_most")).sentence() == ""


@pytest.mark.parametrize(("found", "bound", "status", "words"), [
    (7.9, 40.0, codes.OK, "the front has a better design within all limits, 7.9 mm/rad²: run more starts"),
    (8.0, 40.0, codes.OK, ""),
    (7.9, 50.0, codes.OK, ""),  # the study allows 45 degrees
    (7.9, 40.0, codes.LIMIT_EXCEEDED, ""),
])  # fmt: skip
def test_a_front_that_is_better_than_the_optimum_is_told(found, bound, status, words) -> None:
    data = front_of("at_most", status)
    data.front["max_abs_d2s"], data.front["bound"] = found, np.radians(bound)
    said = " ".join(survey_warnings(data, Survey(4, 4, 1, 4, 0.0, 0.02, "enough"))).replace("\u00a0", " ")
    assert said == words


@pytest.mark.parametrize("larger", [False, True])
def test_trade_off_keeps_the_points_of_the_sweep_whichever_is_better(tmp_path, larger) -> None:
    rng = np.random.default_rng(3)
    table = pd.DataFrame({"first": rng.random(400), "other": rng.random(400), "status": np.zeros(400, np.uint8)})
    table.to_parquet(tmp_path / "part.parquet", index=False)
    found = scan([tmp_path / "part.parquet"], [], "first", "other", larger)
    np.testing.assert_array_equal(found.scatter, table[["first", "other"]].to_numpy())
    beaten = [
        not ((table["first"] <= a) & ((table["other"] >= b) if larger else (table["other"] <= b))
             & ((table["first"] < a) | (table["other"] != b))).any()
        for a, b in table[["first", "other"]].to_numpy()
    ]  # fmt: skip
    wanted = table[beaten].sort_values("first")[["first", "other"]].to_numpy()
    np.testing.assert_array_equal(found.front, wanted)


def test_trade_off_of_at_least_has_the_points_of_the_sweep(tmp_path) -> None:
    data, _, _ = gather(write_dataset(tmp_path / "designs", optimum={}))
    pareto = {"output": "stroke", "at_least": {"values": [24.4, 24.5], "unit": "mm"}, "starts": 0}
    data = replace(data, study=study_from_data(study_data(pareto=pareto), "study.toml"))
    assert data.second is None and data.against == "stroke"
    found = scan(data.parts, [], "max_abs_d2s", data.against, larger=True)
    assert len(found.scatter) > 10 and trade_off(data, found) is not None


def test_page_without_tolerances_does_not_speak_of_what_is_made(tmp_path) -> None:
    page = write_report(write_dataset(tmp_path / "designs", optimum={})).read_text(encoding="utf-8")
    assert "As it is made" not in page and "Yield" not in page


def test_place_anywhere_on_a_dwell_says_so_beside_its_definition(tmp_path) -> None:
    """The cam stands still over a quarter turn at full lift: its middle looked like the angle where the rise ends."""
    cam = {
        "study": {"name": "cam"}, "mechanism": {"family": "cam"}, "scene": {"want": ["phi_ext", "phi_max_ds"]},
        "design": {"lift": {"from": 8.0, "to": 9.0, "count": 2, "unit": "mm"}, "r0": "40 mm"},
        "accuracy": {"target": 1e-6},
    }  # fmt: skip
    data, _, _ = gather(run(study_from_data(cam, "study.toml"), tmp_path / "designs", jobs=1))
    rows = {row.name: row.text for row in output_rows(data)}
    assert rows["phi_ext"].endswith("where s is largest; one angle of a dwell, known to ±91°")
    assert rows["phi_max_ds"].startswith("crank angle of the largest value of ds") and ";" not in rows["phi_max_ds"]
