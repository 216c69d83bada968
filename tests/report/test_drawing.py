"""Still pictures of mechanisms: what is drawn of which design, to which scale, and what the caption says of it."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.exchange.scene import over
from sweep.families import family
from sweep.report.figures import house_style
from sweep.report.mechanisms import POSITIONS, first_pose, mechanism_caption, mechanism_figure, small_figures

RSSR = dict(family("rssr").example)
CHAIN = {f"{k}1": v for k, v in RSSR.items()} | {f"{k}2": v for k, v in family("guide").example.items()}
TURN = 180


@pytest.fixture(autouse=True)
def style():
    with house_style():
        yield


def couplers(axes):
    """The coupler in its positions, the one in full first: lines from B to C."""
    return [line.get_xydata() for line in axes.lines if len(line.get_xydata()) == 2 and line.get_alpha() == 0.35]


def test_positions_are_those_of_equal_steps_of_the_crank() -> None:
    figure = mechanism_figure({"optimum": over("rssr", RSSR, 0.0, TURN)}, "mm", ("xy",), positions=4)
    (axes,) = figure.axes
    joints = sweep.joints("rssr", RSSR, np.radians([90.0, 180.0, 270.0])).set_index(["phi", "joint"])
    drawn = couplers(axes)
    for phi, each in joints.groupby(level="phi"):
        ends = each.loc[[(phi, "b"), (phi, "c")], ["x", "y"]].to_numpy()
        assert any(np.allclose(ends, line, atol=1e-12) for line in drawn)
    assert len(drawn) == 3 * 3  # crank, coupler and rocker in three further positions
    assert axes.get_xlabel() == "x [mm]"


def test_reference_stands_below_the_result_to_the_same_scale() -> None:
    larger = CHAIN | {"xi2": 2.0 * CHAIN["xi2"]}
    designs = {
        "optimum": over(["rssr", "guide"], CHAIN, 0.0, TURN),
        "reference": over(["rssr", "guide"], larger, 0.0, TURN),
    }
    figure = mechanism_figure(designs, "mm", positions=POSITIONS)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [f"{role}\nstage 1, stage 2" for role in designs]
    upper, lower = figure.axes
    assert (upper.get_xlim(), upper.get_ylim()) == (lower.get_xlim(), lower.get_ylim())
    assert figure.axes[0].get_legend() is not None and lower.get_legend() is None


def test_small_pictures_share_one_scale() -> None:
    bars = {"a": 1.0, "b": 3.0, "c": 3.0, "e": 3.0}
    figures = small_figures({str(k): over("four_bar", bars | {"b": 3.0 + k}, 0.0, TURN) for k in range(2)}, "mm")
    (first,), (second,) = (figure.axes for figure in figures.values())
    assert first.get_xlim() == second.get_xlim() and first.get_ylim() == second.get_ylim()
    assert not first.texts or {text.get_text() for text in first.texts} <= {"", "x", "y", "z"}  # no names of joints


def test_first_position_in_full_is_one_that_exists() -> None:
    short = over("four_bar", {"a": 2.0, "b": 2.0, "c": 2.0, "e": 5.0}, np.pi, TURN)  # does not turn fully
    first = first_pose(short)
    assert first > 0 and not np.isfinite(short[0].joints["c"][0]).all()
    (axes,) = mechanism_figure({"": short}, "mm").axes
    crank = next(line for line in axes.lines if line.get_label() == "crank")
    np.testing.assert_allclose(crank.get_xydata()[1], short[0].joints["b"][first, :2], atol=1e-14)


def test_design_without_a_pose_is_refused() -> None:
    with pytest.raises(sweep.InputError, match="all its joints exist"):
        sweep.plot.mechanism("four_bar", {"a": 1.0, "b": 1.0, "c": 1.0, "e": 9.0})


def test_caption_says_only_what_is_drawn() -> None:
    chained = mechanism_caption({"optimum": over(["rssr", "guide"], CHAIN, 0.0, TURN)})
    assert "frame of its own" not in chained and "Triangles" in chained


def test_members_of_a_machine_share_a_frame_and_a_legend() -> None:
    machine = {"one": "four_bar", "other": {"family": "four_bar", "place": {"at": [0.0, 0.0, 2.0]}}}
    bars = {"a": 1.0, "b": 3.0, "c": 3.0, "e": 3.0}
    found = over(machine, {f"{m}.{k}": v for m in machine for k, v in bars.items()}, 0.0, TURN)
    (axes,) = mechanism_figure({"": found}, "mm").axes
    assert axes.get_title(loc="left") == "one, other"
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert len(labels) == len(set(labels)) == 3
    assert "machine's frame" in mechanism_caption({"": found}) and "kappa2" not in mechanism_caption({"": found})
