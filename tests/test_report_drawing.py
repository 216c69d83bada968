"""The drawing finds pivots, sliders and coupler points from joint paths alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sweep.report.drawing import mechanism_caption, mechanism_figure, stages
from sweep.report.figures import house_style
from tests.report_dataset import curve

PHI = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)


def joint(letter: str, path: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(path, columns=[f"{axis}_{letter}" for axis in "xyz"[: path.shape[1]]])


def test_pivots_of_known_links_are_found() -> None:
    first, second = stages(curve("optimum", 12.0))
    assert (first.number, second.number) == ("1", "2")
    assert first.spatial
    assert not second.spatial
    b, c = first.held
    np.testing.assert_allclose(b.pivot, [0.0, 0.0, 5.0], atol=1e-9)
    np.testing.assert_allclose(c.pivot, [100.0, 0.0, 0.0], atol=1e-9)
    assert [j.letter for j in second.held] == ["b"]
    assert [j.letter for j in second.free] == ["m"]


@pytest.mark.parametrize("arc", [2.0 * np.pi, 1.0, 0.05])
def test_pivot_of_a_tilted_circle_in_space(arc: float) -> None:
    rng = np.random.default_rng(3)
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    centre = rng.normal(size=3) * 50.0
    angle = np.linspace(0.3, 0.3 + arc, 72)
    path = centre + 30.0 * (np.outer(np.cos(angle), frame[0]) + np.outer(np.sin(angle), frame[1]))
    (stage,) = stages(joint("b", path))
    # The centre of a short arc is ill-defined: its error grows with 1/arc^2.
    np.testing.assert_allclose(stage.held[0].pivot, centre, atol=1e-11 / min(arc, 1.0) ** 3)


def test_slider_is_straight_and_ellipse_is_neither() -> None:
    line = np.outer(np.sin(PHI), [0.6, 0.8]) + 5.0
    (stage,) = stages(joint("c", line))
    assert stage.held[0].straight
    assert stage.held[0].pivot is None
    ellipse = np.column_stack([np.cos(PHI), 1.001 * np.sin(PHI)])
    (stage,) = stages(joint("m", ellipse))
    assert not stage.held
    assert stage.free[0].pivot is None


def test_unassembled_poses_are_left_out() -> None:
    path = np.column_stack([3.0 + np.cos(PHI), np.sin(PHI)])
    path[10:20] = np.nan
    (stage,) = stages(joint("b", path))
    np.testing.assert_allclose(stage.held[0].pivot, [3.0, 0.0, 0.0], atol=1e-12)


def test_same_joints_offered_unnumbered_are_drawn_once() -> None:
    table = curve("optimum", 12.0)
    table["x_b"], table["y_b"] = table["x_b2"], table["y_b2"]
    assert [stage.number for stage in stages(table)] == ["1", "2"]


def test_figure_has_a_row_for_each_mechanism_and_two_views_of_a_spatial_stage() -> None:
    curves = pd.concat([curve("optimum", 12.0), curve("reference", 15.0)])
    with house_style():
        figure = mechanism_figure(curves, "mm")
        assert figure is not None
        titles = [axes.get_title(loc="left") for axes in figure.axes]
        assert mechanism_figure(curves[["role", "phi", "s"]], "mm") is None
    assert titles == [
        f"{role}\nstage {k}" for role in ("optimum", "reference") for k in ("1, front", "1, side", "2, front")
    ]
    upper, lower = figure.axes[0], figure.axes[3]
    assert (upper.get_xlim(), upper.get_ylim()) == (lower.get_xlim(), lower.get_ylim())


def test_caption_says_only_what_is_drawn() -> None:
    several = mechanism_caption(curve("optimum", 12.0))
    assert "frame of its own" in several and "Front" in several and "Triangles" in several
    path = pd.DataFrame({"role": "optimum", "x_m": np.cos(PHI), "y_m": 1.1 * np.sin(PHI)})
    alone = mechanism_caption(path)
    assert not any(word in alone for word in ("frame", "Front", "Triangles", "Grey"))


def test_shafts_are_numbered_through_the_chain() -> None:
    with house_style():
        figure = mechanism_figure(curve("optimum", 12.0), "mm")
    assert figure is not None
    front, _, second = ([text.get_text() for text in axes.texts] for axes in figure.axes)
    assert front == ["1", "2"] and second == ["2"]
