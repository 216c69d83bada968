"""Still pictures of mechanisms: what is drawn of which design."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.exchange.scene import first_pose, over
from sweep.families import family
from sweep.plot.drawing import mechanism_figure
from sweep.report.figures import house_style

RSSR = dict(family("rssr").example)
TURN = 180


@pytest.fixture(autouse=True)
def style():
    with house_style():
        yield


def couplers(axes):
    """The coupler in its positions, the one in full first: lines from B to C."""
    return [line.get_xydata() for line in axes.lines if len(line.get_xydata()) == 2 and line.get_alpha() == 0.35]


def test_positions_are_those_of_equal_steps_of_the_crank() -> None:
    figure = mechanism_figure(over("rssr", RSSR, 0.0, TURN), "mm", "xy", positions=4)
    (axes,) = figure.axes
    joints = sweep.joints("rssr", RSSR, np.radians([90.0, 180.0, 270.0])).set_index(["phi", "joint"])
    drawn = couplers(axes)
    for phi, each in joints.groupby(level="phi"):
        ends = each.loc[[(phi, "b"), (phi, "c")], ["x", "y"]].to_numpy()
        assert any(np.allclose(ends, line, atol=1e-12) for line in drawn)
    assert len(drawn) == 3 * 3  # crank, coupler and rocker in three further positions
    assert axes.get_xlabel() == "x [mm]"


def test_first_position_in_full_is_one_that_exists() -> None:
    short = over("four_bar", {"a": 2.0, "b": 2.0, "c": 2.0, "e": 5.0}, np.pi, TURN)  # does not turn fully
    first = first_pose(short)
    assert first > 0 and not np.isfinite(short[0].joints["c"][0]).all()
    (axes,) = mechanism_figure(short, "mm").axes
    crank = next(line for line in axes.lines if line.get_label() == "crank")
    np.testing.assert_allclose(crank.get_xydata()[1], short[0].joints["b"][first, :2], atol=1e-14)


def test_design_without_a_pose_is_refused() -> None:
    with pytest.raises(sweep.InputError, match="all its joints exist"):
        sweep.plot.mechanism("four_bar", {"a": 1.0, "b": 1.0, "c": 1.0, "e": 9.0})


def test_members_of_a_machine_share_a_frame_and_a_legend() -> None:
    machine = {"one": "four_bar", "other": {"family": "four_bar", "place": {"at": [0.0, 0.0, 2.0]}}}
    bars = {"a": 1.0, "b": 3.0, "c": 3.0, "e": 3.0}
    found = over(machine, {f"{m}.{k}": v for m in machine for k, v in bars.items()}, 0.0, TURN)
    (axes,) = mechanism_figure(found, "mm").axes
    assert axes.get_title(loc="left") == "one, other"
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert len(labels) == len(set(labels)) == 3


@pytest.mark.parametrize("view", ["space", "xy", "zy", "xz"])
def test_names_of_joints_cover_neither_each_other_nor_joints(view: str) -> None:
    """Square to the plane of a needle drive all joints stand in one line, some of them close together."""
    drive = {f"{name}1": value for name, value in family("rssr").example.items()}
    drive |= {f"{name}2": value for name, value in family("guide").example.items()}
    with house_style():
        figure = mechanism_figure(over(["rssr", "guide"], drive, 0.0, 12), "mm", view)
        figure.draw_without_rendering()
    axes = figure.axes[0]
    words = [text for text in axes.texts if len(text.get_text()) > 1]
    assert len(words) > 4
    boxes = [text.get_window_extent() for text in words]
    joints = [axes.transData.transform(text.xy) for text in words]
    for k, box in enumerate(boxes):
        assert box.count_overlaps(boxes[:k]) == 0, words[k]
        assert not any(box.contains(*at) for at in joints), words[k]
