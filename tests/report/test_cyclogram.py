"""The cyclogram of a report: events of what is made lie in the bands that the page and the file show."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli.main import main
from sweep.report.page import write_report
from sweep.study import study_from_data

LENGTHS = 0.05  # mm, three standard deviations
LEVEL = 35.0  # mm, of the slider
COUNT = 20_000  # machines drawn by hand
SLIDER = {"family": "slider_crank", "driver": "shaft"}
STUDY = {
    "study": {"name": "pair"},
    "machine": {"left": SLIDER, "right": SLIDER},
    "relations": {"passes": {"event": "left.s", "level": f"{LEVEL} mm"}},
    "scene": {"want": ["phi_passes", "left.max_abs_d2s"]},
    "design": {
        "left": {"a": {"from": 10.0, "to": 12.0, "count": 2, "unit": "mm"}, "b": "40 mm", "e": "2 mm"},
        "right": {"a": "11 mm", "b": "40 mm", "e": "2 mm"},
    },
    "limits": {"left": {"stroke": {"min": 20.0, "unit": "mm"}}},
    "objective": {"minimise": "left.max_abs_d2s"},
    "optimise": {"starts": 1, "seed": 1},
    "tolerance": {"lengths": f"{LENGTHS} mm"},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return sweep.run(study_from_data(STUDY, "study.toml"), out=tmp_path_factory.mktemp("pair") / "designs", jobs=1)


def passing(a, b, e):
    """Crank angle at which a slider rises through the level, by the law of cosines; rad."""
    far = np.hypot(LEVEL, e)
    return (np.arctan2(e, LEVEL) - np.arccos((a**2 + far**2 - b**2) / (2.0 * a * far))) % (2.0 * np.pi)


def test_events_of_what_is_made_lie_in_the_band_of_the_cyclogram(folder):
    page = write_report(folder)
    rows = pd.read_csv(page.parent / "cyclogram.csv")
    (event,) = rows[rows["kind"] == "event"].to_dict("records")
    low, high = event["made from [deg]"], event["made to [deg]"]
    assert low < event["from [deg]"] < high
    assert rows.loc[rows["kind"] != "event", "made from [deg]"].isna().all()
    # Machines drawn by hand; 2.5 % lie beyond each end, give or take four times the scatter of both samples' shares.
    best = pd.read_parquet(page.parent / "optimum.parquet").query("role == 'optimum'").iloc[0]
    draws = np.random.default_rng(7).normal(0.0, LENGTHS / 3.0, (3, COUNT))
    a, b, e = (best[f"left.{name}"] + draws[k] for k, name in enumerate(("a", "b", "e")))
    phi = np.degrees(passing(a, b, e))
    for beyond in (phi < low, phi > high):
        assert abs(beyond.mean() - 0.025) < 4.0 * math.sqrt(0.025 / COUNT + 0.025 / 2048)
    assert f"{low:.2f} to {high:.2f}°" in page.read_text(encoding="utf-8")


def test_command_draws_the_bands_of_the_page(folder, tmp_path):
    page = write_report(folder)
    for name in ("table.csv", "chart.svg"):
        drawn = CliRunner().invoke(main, ["draw", "cyclogram", str(folder), "--out", str(tmp_path / name)])
        assert drawn.exit_code == 0, drawn.output
    assert (tmp_path / "table.csv").read_bytes() == (page.parent / "cyclogram.csv").read_bytes()
    (event,) = pd.read_csv(tmp_path / "table.csv").query("kind == 'event'").to_dict("records")
    low, high = event["made from [deg]"], event["made to [deg]"]
    best = pd.read_parquet(page.parent / "optimum.parquet").query("role == 'optimum'").iloc[0]
    family = study_from_data(STUDY, "study.toml").family
    design = {name: best[name] for name in family.parameter_names}
    axes = sweep.plot.cyclogram(family, design, angles="rad", made={"passes": (low, high)})
    assert f"passes {event['from [deg]']:.1f}° ({low:.2f} to {high:.2f}°)" in [text.get_text() for text in axes.texts]
    key = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert sorted(key) == ["dwell", "event", "event of 95 % of what is made", "falling stroke", "rising stroke"]
    (band,) = (one for one in axes.collections if one.get_alpha() == 0.3)
    ends = band.get_paths()[0].vertices[:, 0]
    assert (ends.min(), ends.max()) == (low, high)
    # Of a design that was not made there is no band.
    other = ["draw", "cyclogram", str(folder), "--design", "0", "--out", str(tmp_path / "row.csv")]
    assert CliRunner().invoke(main, other).exit_code == 0
    assert "made from" not in (tmp_path / "row.csv").read_text()
