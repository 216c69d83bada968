"""What `sweep explore` takes in hand: a family's example, a study, the result of a run."""

from __future__ import annotations

import base64
import builtins
import tomllib
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.cli.explore import in_hand
from sweep.errors import InputError
from sweep.evaluation.joints import parts
from sweep.explore.cells import cells
from sweep.explore.changes import dragged
from sweep.explore.hand import of_study
from sweep.explore.server import Server, page_text
from sweep.report.dataset import chosen
from sweep.study import study_from_data
from tests.support.report_dataset import study_data, write_dataset

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.mark.parametrize("source", ["slider_crank", "rssr+guide", "geared_dwell", "backrest"])
def test_family_is_explored_as_its_example(source):
    hand = in_hand(source)
    found = hand.answer([hand.first], ["in hand"])
    assert found["status"] == [""] and found["motion"]["designs"][0]["name"] == "in hand"
    assert all(one.low < one.high for one in hand.ranges if not one.choices)


@pytest.mark.parametrize(
    "name", ["needle208", "needle208-loads", "head208", "looper-sphere", "overlock208", "joint-loads", "heddle-shafts"]
)
def test_studies_are_taken_as_they_are(name):
    hand = in_hand(str(STUDIES / name))
    found = hand.answer([hand.first], ["in hand"])
    assert [row["name"] for row in found["limits"]] == [limit.output for limit in hand.study.limits]
    text = hand.saved(hand.first, {one.name: (one.low, one.high) for one in hand.ranges if one.swept})
    saved = study_from_data(tomllib.loads(text), "study.toml")
    own = [one.name for one in hand.ranges]  # inputs of effects that are swept, or were moved, among them
    np.testing.assert_array_equal([saved.reference[n] for n in own], [hand.first[n] for n in own])
    moved = hand.first | {own[-1]: hand.first[own[-1]] + 0.1}
    kept = hand.study.data | tomllib.loads(hand.reference(moved))
    assert study_from_data(kept, "study.toml").reference[own[-1]] == moved[own[-1]]


def test_columns_stand_once_and_a_search_that_varies_nothing_is_not_saved(tmp_path):
    hand = in_hand(str(STUDIES / "crank-rocker-atlas"))
    hand.folder = tmp_path  # as if it had been run
    hand.data.plan["counts"] = {"OK": 1}
    assert hand.answer([hand.first], ["in hand"])["motion"]["curves"]  # although its report has none
    columns = hand.page()["columns"]
    assert len(columns) == len(set(columns)) and "swing" in columns
    with pytest.raises(InputError, match="at least one ticked dimension"):
        other = in_hand(str(STUDIES / "needle208"))
        other.saved(other.first, {})


def test_a_run_without_feasible_designs_says_so_and_draws_no_empty_field(tmp_path):
    data = study_data(limits={"stroke": {"min": 500, "unit": "mm"}})
    hand = in_hand(str(sweep.run(study_from_data(data, "study.toml"), out=tmp_path / "designs", jobs=1)))
    assert hand.page()["columns"] == []
    assert "No design of the run keeps all limits." in page_text(hand)


def test_a_run_without_any_design_is_taken_in_hand_as_its_study_is(tmp_path):
    data = study_data(limits={"stroke": {"min": 500, "unit": "mm"}}, optimise=None)
    folder = sweep.run(study_from_data(data, "study.toml"), out=tmp_path / "designs", jobs=1)
    hand = in_hand(str(folder))
    assert hand.first == of_study(hand.study).first and hand.page()["empty"]
    assert [row["states"] for row in hand.answer([hand.first], ["in hand"])["limits"]] == [["missed"]]
    with pytest.raises(InputError, match="designs within all limits = 0; allowed: at least one; or name a design"):
        chosen(folder)


def test_what_is_neither_a_place_nor_a_family_is_told():
    with pytest.raises(
        InputError, match="SOURCE = 'nothing'; allowed: a study, a folder of results, or a family, one of"
    ):
        in_hand("nothing")


def test_dimensions_of_stages_keep_their_names_beside_cells(tmp_path):
    hand = in_hand(str(write_dataset(tmp_path / "designs", optimum={})))
    axes = cells(hand, [["a1", "stroke"]], {}, 4)["axes"]
    assert (axes["a1"]["title"], axes["stroke"]["title"]) == ("a1 [mm]", "stroke [mm]")


def test_result_of_a_run_is_in_hand_and_its_reference_pinned(folder):
    hand = in_hand(str(folder))
    best = sweep.load(folder).query("status == 0").sort_values("max_abs_d2psi").iloc[0]
    assert hand.first["a"] == best["a"] and hand.pins["reference"]["a"] == 10.0
    assert hand.page()["columns"][:1] == ["max_abs_d2psi"]


def test_without_the_packages_the_extra_is_named(monkeypatch, folder):
    real = builtins.__import__

    def missing(name, *rest, **options):
        if name == "starlette":
            raise ImportError(name=name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(InputError, match=r"'linksweep\[explore\]', in a clone .venv/bin/pip install -e '.\[explore\]'"):
        Server(in_hand(str(folder)))


def test_dragging_keeps_what_a_step_would_take_apart_or_make_negative():
    hand = in_hand("heddle")  # its second four-bar has no lengths
    (part,) = parts(hand.family, hand.first, 0.5)
    to = part.joints["c"][0, :2] + 1.0
    moved, phi = dragged(hand, hand.first, 0.5, ("", "C"), to)
    (part,) = parts(hand.family, {**hand.first, **moved}, phi)
    np.testing.assert_allclose(part.joints["c"][0, :2], to, atol=0.1)
    assert moved["O3D"] == 0.0 and next(one for one in hand.ranges if one.name == "O3D").low == 0.0
    hand = in_hand("feed_triad")
    (part,) = parts(hand.family, hand.first, 0.5)
    for name in ("e2", "e3"):  # far towards the eccentric's other side
        to = 3.0 * part.joints[f"l{name[1]}"][0, :2] - 2.0 * part.joints[name][0, :2]
        moved, _ = dragged(hand, hand.first, 0.5, ("", name.upper()), to)
        assert moved["rE2"] >= 0.0 and moved["rE3"] >= 0.0


def test_window_is_shaded_where_the_guided_member_is_in_it():
    rocker = {"a": "10 mm", "b": "40 mm", "c": "25 mm", "e": "35 mm", "f": "0 mm", "g": "0 mm", "alpha": "20 deg"}
    guide = {"a": "10 mm", "b": "25 mm", "c": "25 mm", "e": "20 mm", "xi": "50 mm", "eta": "3 mm", "lam": "80 deg"}
    data = {
        "study": {"name": "shade"},
        "machine": {"looper": {"family": "rssr"}, "needle": {"family": "guide"}},
        "scene": {"want": ["needle.max_abs_dev"], "window": {"from": 0.1, "to": 0.7}},
        "design": {"looper": rocker, "needle": guide | {"h": {"from": 0, "to": 1, "count": 2, "unit": "mm"}}},
    }
    hand = of_study(study_from_data(data, "study.toml"))
    design = hand.answer([hand.first], ["in hand"])["motion"]["designs"][0]
    s = np.frombuffer(base64.b64decode(design["curves"]["needle.s"]), "<f4")
    share = (s - s.min()) / np.ptp(s)
    shaded = np.concatenate([np.arange(first, last + 1) for first, last in design["shaded"]])
    np.testing.assert_array_equal(shaded, np.flatnonzero((share >= 0.1) & (share <= 0.7)))
