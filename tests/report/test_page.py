"""The report from a dataset's folder to its page: what it says, what it leaves, what it refuses."""

from __future__ import annotations

import base64
import html
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep import run
from sweep.dataset import files
from sweep.errors import InputError, StoreError
from sweep.plot.mechanisms import aligned_turn
from sweep.report.answer import answer, searched
from sweep.report.dataset import gather, marked
from sweep.report.figures import design_map, house_style, map_figure, overlays
from sweep.report.live import in_window, lowest, without_jumps
from sweep.report.page import write_report
from sweep.report.quantities import quantity
from sweep.report.scan import Cells, Grid, divided_axes
from sweep.report.tables import parameter_rows
from sweep.study import Tolerance, study_from_data
from tests.support.report_dataset import curve, designs, study_data, write_dataset

SECTIONS = ["answer", "motion", "result", "limits", "lines", "map", "trade-off", "fates", "accuracy", "provenance"]
NAMESPACES = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xhtml"}


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_dataset(tmp_path_factory.mktemp("full") / "designs", optimum={})
    write_report(folder)
    return folder


def text_of(page: Path) -> str:
    """The words of the page without markup; entities and no-break spaces resolved."""
    words = re.sub(r"<(style|script)\b.*?</\1>|<[^>]+>", " ", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return plain(html.unescape(words))


def plain(words: str) -> str:
    """No-break and thin spaces as plain ones."""
    return re.sub(r"\s+", " ", words)


def test_every_section_is_there(full: Path) -> None:
    page = (full.parent / "report.html").read_text(encoding="utf-8")
    assert re.findall(r'<section id="([a-z-]+)"', page) == SECTIONS


def test_page_needs_no_network(full: Path) -> None:
    page = (full.parent / "report.html").read_text(encoding="utf-8")
    markup = re.sub(r"<(style|script)\b[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
    assert all(target.startswith("data:") for target in re.findall(r'(?:src|href)="([^"]*)"', markup))
    assert not re.search(r"<link|<script[^>]* src|@import|url\((?!#)", markup)
    # The browser itself is told to load nothing; addresses are names of vocabularies only.
    assert "content=\"default-src 'none'; img-src data:;" in page
    assert set(re.findall(r"https?://[^\s\"'`)]*", page)) == NAMESPACES
    assert len(page) < 3_000_000


def test_library_of_the_moving_picture_travels_with_its_licence(full: Path) -> None:
    page = (full.parent / "report.html").read_text(encoding="utf-8")
    licence = (Path(sweep.__file__).parent / "templates" / "live" / "three.LICENSE").read_text(encoding="utf-8")
    assert "Permission is hereby granted" in licence
    assert licence in page


def test_title_is_escaped(full: Path) -> None:
    page = (full.parent / "report.html").read_text(encoding="utf-8")
    assert "<h1>A needle &amp; its &lt;drive&gt;</h1>" in page


def test_answer_states_optimum_against_reference(full: Path) -> None:
    words = text_of(full.parent / "report.html")
    # 8 mm/rad^2 at 7000 rpm: 8e-3 m (2 pi 7000/60)^2 = 4299 m/s^2; 8 is 20 % less than 10
    assert "8 mm/rad² (4299 m/s² at 7000 rpm), 20 % less than the reference design with 10 mm/rad² (5373 m/s²" in words
    assert "0.05 mm, 50 % less than the 0.1 mm of the reference." in words
    assert "Held back by the active limit: largest deviation from the line in the window (at most 0.05 mm)" in words
    assert "largest pressure angle of stage 1 (40°, at most 45°)" in words
    assert (
        "the reference itself misses: largest deviation from the line in the window (0.1 mm, at most 0.05 mm)" in words
    )
    assert "no proof of a global optimum: the optimiser started from 3 designs of the sweep" in words
    assert "Not achieved" not in words


def test_a_robust_answer_says_why_its_drawing_is_not_at_the_limits(full: Path) -> None:
    data_set, found, _ = gather(full)
    study = replace(data_set.study, tolerance=Tolerance(0.02, 0.001, robust=0.95))
    data_set = replace(data_set, study=study)
    words = plain(" ".join(answer(data_set, found)))
    assert (
        "Held back by the active limit, from which the drawing keeps the distance that what is made needs: largest dev"
    ) in words


def test_counts_agree_with_the_designs(full: Path) -> None:
    survivors = pd.read_parquet(full.parent / "survivors.parquet")
    _, status = designs(study_from_data(study_data(), "study.toml"), 0, 8610)
    assert len(survivors) == (status == 0).sum()
    words = text_of(full.parent / "report.html")
    for code in (0, 3, 5):
        assert f" {f'{(status == code).sum():,}'.replace(',', ' ')} {100 * (status == code).mean():.3g} %" in words


def test_tables_and_figures_stand_beside_the_page(full: Path) -> None:
    out = full.parent
    for name in ("optimum", "curves"):
        assert (out / f"{name}.parquet").read_bytes() == (out / f"_{name}.parquet").read_bytes()
    assert {f.name for f in (out / "figures").iterdir()} == {"map.svg", "trade-off.svg"}
    assert pd.read_parquet(full).shape[0] == len(pd.read_parquet(out / "survivors.parquet"))


def test_figures_depend_on_the_data_only(full: Path, tmp_path: Path) -> None:
    write_report(full, tmp_path)
    for figure in (full.parent / "figures").iterdir():
        assert figure.read_bytes() == (tmp_path / "figures" / figure.name).read_bytes()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kkt_residual": 1e-3}, "Not achieved: the optimiser did not settle."),
        ({"kkt_residual": 1e-3}, "KKT residual 0.001 where 1·10⁻⁶ is wanted"),
        ({"kkt_residual": 1.0, "ended": "time"}, "the optimiser had no time left to settle."),
        ({"kkt_residual": 1.0, "ended": "time"}, "KKT residual 1 where 1·10⁻⁶ is wanted"),
        ({"kkt_residual": np.nan}, "Its KKT residual does not exist where 1·10⁻⁶ is wanted"),
        ({"max_abs_d2s": 9.0}, "Not achieved: the optimiser ended behind the best design of the sweep, 8.5 mm/rad²"),
        ({"stroke": 24.0, "status": 5}, "No design was found that keeps all limits"),
        ({"stroke": 24.0, "status": 5}, "Not achieved: stroke: 24 mm instead of 24.4 to 24.6 mm"),
        ({"max_abs_d2s": 11.0}, "10 % more than the reference design"),
        ({"max_abs_d2s": 11.0}, "Worse than in the reference: largest acceleration"),
        ({"a1": 30.0}, "On the edge of the space that was searched: a1 (upper edge, 30 mm)"),
        ({"a1": 0.01}, "The shortest link of the optimum has 0.00011 of the length of its longest"),
    ],
)
def test_answer_admits_what_was_not_reached(tmp_path: Path, changes: dict[str, float], words: str) -> None:
    folder = write_dataset(tmp_path / "designs", optimum=changes)
    data, found, _ = gather(folder)
    told, folded = (plain(" ".join(of(data, found))) for of in (answer, searched))
    assert words in told + folded
    assert "KKT" not in told and "basin" not in told  # the optimiser's own words are folded


def test_opens_without_optimum_and_reference(tmp_path: Path) -> None:
    data = study_data(optimise=None, output={"curves": "none"})
    page = write_report(write_dataset(tmp_path / "designs", data))
    words = text_of(page)
    assert "The best design of the sweep has a largest acceleration of 8.5 mm/rad²" in words
    assert "no optimiser was run" in words
    assert not (page.parent / "optimum.parquet").exists()
    found = re.findall(r'<section id="([a-z-]+)"', page.read_text(encoding="utf-8"))
    assert found == [name for name in SECTIONS if name != "motion"]


def test_says_so_when_no_design_is_feasible(tmp_path: Path) -> None:
    design = study_data()["design"] | {"a1": {"from": 26.0, "to": 30.0, "count": 5, "unit": "mm"}}
    words = text_of(write_report(write_dataset(tmp_path / "designs", study_data(optimise=None, design=design))))
    assert "No design of the 2 050 in the sweep meets all limits." in words
    assert "What stops most of them, 2 050: the crank does not turn fully" in words


def test_signed_objective_is_best_where_it_is_least(tmp_path: Path) -> None:
    """A slider behind the shaft: the farther back, the smaller the largest s."""
    data: dict[str, Any] = {
        "study": {"name": "behind"},
        "mechanism": {"family": "rssp"},
        "scene": {"want": ["stroke"]},
        "design": {"b": {"values": [40, 60, 80], "unit": "mm"}, "a": "8 mm", "branch": -1}
        | dict.fromkeys(("e", "f"), "0 mm") | {"alpha": "0 deg"},
        "objective": {"minimise": "max_s"},
    }  # fmt: skip
    data_set, found, _ = gather(run(study_from_data(data, "study.toml"), tmp_path / "designs", jobs=1))
    assert found.best_row["b"] == 80.0
    assert "largest displacement of −72 mm" in plain(answer(data_set, found)[0])


def test_a_run_killed_before_its_totals_were_noted_is_reported_in_full(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path / "designs", study_data(optimise=None))
    whole, _, _ = gather(folder)
    files.write_plan(folder, whole.plan | {"counts": None, "missed": None, "complete": False})
    again, _, _ = gather(folder)
    assert again.counts == whole.counts
    assert again.missed == whole.missed


def test_rounding_of_zero_and_edges_of_listed_values_are_told(tmp_path: Path) -> None:
    """The sweep takes listed values as they are, the optimiser goes anywhere between them."""
    design = study_data()["design"] | {
        "f1": {"values": [-5, 0, 5], "unit": "mm"},
        "g1": {"values": [-5, 5], "unit": "mm"},
    }
    folder = write_dataset(tmp_path / "designs", study_data(design=design), optimum={"f1": -3.6e-15, "g1": 5.0})
    rows = {row.name: row for row in parameter_rows(gather(folder)[0])}
    assert (plain(rows["f1"].value), plain(rows["f1"].space), rows["f1"].edge) == ("0 mm", "−5 to 5 mm", "")
    assert (plain(rows["g1"].value), rows["g1"].edge) == ("5 mm", "upper edge")
    swept = replace(gather(folder)[0], optima=None)
    assert plain(next(row.space for row in parameter_rows(swept) if row.name == "f1")) == "−5, 0 or 5 mm"


def test_a_range_of_three_values_has_edges_too(tmp_path: Path) -> None:
    design = study_data()["design"] | {"a1": {"from": 18.0, "to": 20.0, "count": 3, "unit": "mm"}}
    data, _, _ = gather(write_dataset(tmp_path / "designs", study_data(optimise=None, design=design)))
    assert next((plain(row.space), row.edge) for row in parameter_rows(data) if row.name == "a1") == (
        "18 to 20 mm",
        "lower edge",
    )


def test_one_axis_gives_a_line(tmp_path: Path) -> None:
    design = study_data()["design"] | {"alpha1": "0 deg", "xi2": "40 mm"}
    data = study_data(optimise=None, design=design, output={"curves": "none"})
    assert "Over a1, the only swept parameter." in text_of(write_report(write_dataset(tmp_path / "designs", data)))


def test_overlay_is_drawn_in_its_plane_in_stored_units(tmp_path: Path) -> None:
    curves = [
        {"label": "known", "x": "alpha1", "y": "a1", "points": [[0.0, 10.0], [90.0, 30.0]]},
        {"label": "elsewhere", "x": "alpha1", "y": "xi2", "points": [[0.0, 20.0], [90.0, 60.0]]},
    ]
    study = study_from_data(study_data(report={"curves": curves}), "study.toml")
    ((label, points),) = overlays(study, "a1", "alpha1")
    assert label == "known"
    np.testing.assert_array_equal(points[:, 0], [10.0, 30.0])
    np.testing.assert_allclose(points[:, 1], [0.0, np.pi / 2.0], rtol=1e-15)
    edges = Cells.of_range("a1", 10.0, 30.0, 2), Cells.of_range("alpha1", 0.0, np.pi / 2.0, 2)
    sides = [(c, quantity(c.name, unit)) for c, unit in zip(edges, ("mm", "rad"), strict=True)]
    grid = Grid(np.ones((2, 2)), np.ones((2, 2)))
    with house_style():
        figure = map_figure(grid, sides[0], sides[1], 16.0, None, {}, [(label, points)])
    (line,) = figure.axes[0].get_lines()
    np.testing.assert_allclose(line.get_xydata(), [[10.0, 0.0], [30.0, 90.0]])


def test_axes_of_the_map_are_what_the_sweep_itself_set() -> None:
    """Not signs, and not the lengths that [fit] makes afterwards out of the sampled proportions."""
    kept = {k: v for k, v in study_data()["design"].items() if k not in ("xi2", "eta2", "h2", "lam2", "b2")}
    design = kept | {
        "sample": {"kind": "sobol", "n": 4096},
        "a1": {"from": 10.0, "to": 30.0, "unit": "mm"},
        "alpha1": {"from": 0.0, "to": 90.0, "unit": "deg"},
        "b2": {"from": 50.0, "to": 80.0, "unit": "mm"},
        "branch2": {"values": [1, -1]},
        "lam2": {"values": [0, 180], "unit": "deg"},
    }
    fit = {"stroke": "24.5 mm", "direction": "free"}
    study = study_from_data(study_data(design=design, fit=fit), "study.toml")
    for feasible, cells in ((0, 4), (200, 8), (10**6, 32)):
        assert [(c.name, len(c.weights)) for c in divided_axes(study, feasible)] == [("a1", cells), ("alpha1", cells)]


def test_follower_that_turns_is_not_cut_at_its_lowest_position() -> None:
    phi = np.arange(72) * (2.0 * np.pi / 72)
    turning = pd.DataFrame({"phi": phi, "psi": np.angle(np.exp(1j * (phi + 0.3 * np.sin(phi))))})
    assert lowest("psi", turning["psi"].to_numpy())[1]
    angle, psi = aligned_turn(turning, "psi", "psi")
    np.testing.assert_allclose(psi, angle + 0.3 * np.sin(angle), atol=1e-12)
    rocking = pd.DataFrame({"phi": phi, "psi": np.angle(np.exp(1j * (3.0 - np.cos(phi - 1.0))))})
    assert not lowest("psi", rocking["psi"].to_numpy())[1]
    angle, psi = aligned_turn(rocking, "psi", "psi")
    assert psi[0] == psi.min() == 0.0
    np.testing.assert_allclose(np.ptp(psi), 2.0, atol=2e-3)


def test_angle_is_shown_where_it_is_known_and_without_jumps() -> None:
    """A follower whose crank does not turn fully, and one whose angle passes half a turn."""
    phi = np.arange(72) * (2.0 * np.pi / 72)
    path = 3.0 - np.cos(phi - 1.0)
    jumping = np.where(phi > 5.0, np.nan, np.angle(np.exp(1j * path)))
    for name in ("psi", "needle.psi", "alpha"):
        found = without_jumps(name, jumping)
        np.testing.assert_array_equal(np.isnan(found), np.isnan(jumping))
        np.testing.assert_allclose(found[phi <= 5.0], path[phi <= 5.0], atol=1e-12)
    np.testing.assert_array_equal(without_jumps("s", jumping), jumping)


def test_window_is_counted_from_the_lowest_position() -> None:
    path = curve("optimum", 10.0)["s"].to_numpy()
    inside = in_window(path, (0.0, 0.25))
    np.testing.assert_array_equal(inside, path <= path.min() + 0.25 * np.ptp(path))
    assert 0 < inside.sum() < len(path)


def test_folder_that_is_no_complete_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a dataset folder, with a readable _plan\.json"):
        write_report(tmp_path)
    folder = write_dataset(tmp_path / "designs", study_data(optimise=None))
    next(folder.glob("part-*")).unlink()
    with pytest.raises(InputError, match="run the study again to resume"):
        write_report(folder)
    assert not (folder.parent / "report.html").exists()


def test_report_that_cannot_be_written_is_a_store_error(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path / "designs", study_data(optimise=None, output={"curves": "none"}))
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StoreError, match=r"cannot be written: Not a directory \(.*out.*\)$"):
        write_report(folder, tmp_path / "file" / "out")


def test_funnel_names_the_limit_that_designs_miss(full: Path) -> None:
    words = text_of(full.parent / "report.html")
    data, _, _ = gather(full)
    count = data.missed["max_pressure_angle1"]
    assert count == data.counts[5] > 0 == data.missed["max_abs_dev"]
    assert f"largest pressure angle of stage 1: not at most 45° {count:,}".replace(",", " ") in words
    assert "a limit of the study is exceeded" not in words


def test_pictures_the_study_draws_itself_are_shown(tmp_path: Path) -> None:
    own = [{"file": f"{name}.svg", "title": f"The {name}", "caption": f"Of {name}"} for name in ("atlas", "other")]
    folder = write_dataset(tmp_path / "designs", study_data(report={"figures": own}), optimum={})
    drawn = b'<svg xmlns="http://www.w3.org/2000/svg"/>'
    (tmp_path / "out" / "figures").mkdir(parents=True)
    (tmp_path / "out" / "figures" / "atlas.svg").write_bytes(drawn)
    page = write_report(folder, tmp_path / "out")
    assert base64.b64encode(drawn).decode("ascii") in page.read_text(encoding="utf-8")
    words = text_of(page)
    assert "The atlas Of atlas" in words
    assert "The other figures/other.svg has not been drawn" in words


def test_without_an_objective_nothing_is_called_best(tmp_path: Path) -> None:
    """Every design of a plain sweep is within the limits: no edge that could be better, no map of one colour."""
    data: dict[str, Any] = {
        "study": {"name": "plain"},
        "mechanism": {"family": "rssp"},
        "scene": {"want": ["stroke"]},
        "design": {"b": {"values": [40, 60], "unit": "mm"}, "a": {"values": [8, 9], "unit": "mm"}, "branch": -1}
        | dict.fromkeys(("e", "f"), "0 mm") | {"alpha": "0 deg"},
        "output": {"keep": "all"},
    }  # fmt: skip
    folder = run(study_from_data(data, "study.toml"), tmp_path / "designs", jobs=1)
    data_set, found, cells = gather(folder)
    assert data_set.result_name == "first of the sweep" and list(marked(data_set)) == ["reference"]
    assert plain(" ".join(answer(data_set, found))) == "Of 4 designs in the sweep 4 (100 %) meet all limits."
    assert design_map(data_set, found, cells) is None
    words = text_of(write_report(folder))
    assert "best" not in words.lower() and "stroke" in words
