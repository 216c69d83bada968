"""Different optima and yield in the report: what is one optimum, what is kept, which dimension costs most."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import sweep
from kernels import status as codes
from sweep.evaluation.summaries import design_outputs
from sweep.families.names import negative
from sweep.optimise.manufacture.sample import sampled_designs
from sweep.pages import rendered
from sweep.plot.datasets import draw_histogram
from sweep.report.answer import not_achieved
from sweep.report.dataset import without_rows
from sweep.report.figures import LIMIT
from sweep.report.made import TELLING_GAIN, histogram, made, made_sentence
from sweep.report.optima import groups, optima, optima_sentence, shown_designs
from sweep.report.quantities import number
from sweep.study import study_from_data

DATA = {
    "study": {"name": "chosen"},
    "mechanism": {"family": "rssr"},
    "design": {
        "a": {"from": 8.0, "to": 20.0, "count": 2, "unit": "mm"},
        "b": "36.6 mm", "c": "12 mm", "e": "1 mm", "f": "-30 mm", "g": "0 mm", "alpha": "90 deg",
    },
    "limits": {"least_link": ">= 11.99 mm", "max_pressure_angle": "<= 60 deg"},
    "objective": {"minimise": "max_abs_d2psi"},
    "optimise": {"starts": 3, "seed": 5},
    "tolerance": {"lengths": "0.05 mm", "angles": "0.1 deg"},
}  # fmt: skip
BEST = {"a": 15.88, "b": 36.64, "c": 12.0, "e": 0.89, "f": -30.0, "g": 0.0, "alpha": 0.5 * math.pi, "branch": 1.0}


def row(role="start", value=0.5, status=codes.OK, **changes):
    return BEST | {"role": role, "status": status, "max_abs_d2psi": value, "yield": math.nan} | changes


def data_of(*rows, **tables):
    study = study_from_data(DATA | tables, "study.toml")
    frame = pd.DataFrame(rows)
    if study.objective.output not in frame:
        frame[study.objective.output] = -frame["max_abs_d2psi"]
    return replace(without_rows(study), folder=Path("nowhere"), optima=frame, units={"least_link": "mm"})


def test_starts_that_ended_alike_or_in_a_mirror_are_one_optimum() -> None:
    found = groups(
        data_of(
            row("optimum", 0.5),
            row(value=0.5 + 1e-9, a=15.9),  # other digits
            row(value=0.5, e=-0.89, f=30.0, branch=-1.0),  # seen in a mirror
            row(value=0.7, b=60.0),  # another mechanism
            row(value=0.4, b=20.0, status=codes.LIMIT_EXCEEDED),  # none
            row("reference", 0.1, b=25.0),
        )
    )
    assert [(group.row["max_abs_d2psi"], group.starts, group.mirrored) for group in found] == [(0.5, 3, 1), (0.7, 1, 0)]


def test_answer_stands_first_even_where_another_is_better_on_paper() -> None:
    found = groups(data_of(row("optimum", 0.5), row("nominal", 0.4, b=60.0), row(value=0.45, c=25.0)))
    assert [group.row["role"] for group in found] == ["optimum", "nominal", "start"]
    assert [group.starts for group in found] == [1, 0, 1]


def test_what_is_made_is_not_called_behind_the_best_drawing_of_the_sweep() -> None:
    scanned = SimpleNamespace(best_row={"max_abs_d2psi": 0.45})
    behind, drawn = data_of(row("optimum", 0.5)), data_of(row("optimum", 0.5), row("nominal", 0.45))
    told = [" ".join(not_achieved(data, scanned)) for data in (behind, drawn)]
    assert ["ended behind" in words for words in told] == [True, False]


def test_optima_of_what_is_made_large_come_largest_first() -> None:
    large = DATA | {"objective": {"maximise": "max_abs_d2psi"}}
    found = groups(data_of(row("optimum", 0.9), row(value=0.5, b=60.0), row(value=0.7, c=25.0), **large))
    assert [-group.row[negative("max_abs_d2psi")] for group in found] == [0.9, 0.7, 0.5]


def test_designs_to_look_at_are_the_cards_in_the_same_order() -> None:
    large = DATA | {"objective": {"maximise": "max_abs_d2psi"}}
    data = data_of(row("optimum", 0.9), row(value=0.5, b=60.0), row(value=0.7, c=25.0), row(value=0.5, b=60.1), **large)
    found = groups(data)
    shown = shown_designs(data, found)
    assert [one.name for one in shown] == [group.title(k) for k, group in enumerate(found)]
    assert [one.row["max_abs_d2psi"] for one in shown] == [0.9, 0.7, 0.5]
    assert "= 0.7" in shown[1].note


def test_same_objective_alone_is_no_mirror() -> None:
    assert len(groups(data_of(row("optimum", 0.5), row(value=0.5, b=60.0)))) == 2


def test_cards_have_picture_sizes_and_yield() -> None:
    data = data_of(row("optimum", 0.5), row(value=0.7, c=17.0, g=1e-15))
    found = groups(data)
    first, second = optima(data, found)
    assert str(first.picture).startswith("<svg") and str(second.picture).startswith("<svg")
    assert (
        ("a", "15.88\u00a0mm") in first.sizes and ("g", "0\u00a0mm") in second.sizes and ("branch", "+1") in first.sizes
    )
    assert ("least link", "12\u00a0mm") in first.extras and "of what is made keeps all limits" in second.made
    assert second.against == "40\u00a0% more"
    assert "2 structurally different optima; the next has 0.7" in optima_sentence(data, found)
    sentence = optima_sentence(data, groups(data_of(row("optimum", 0.7), row("nominal", 0.5, c=17.0))))
    assert "the best on paper has 0.5" in sentence and "% less), but" in sentence and "keeps all limits" in sentence
    alike = groups(data_of(row("optimum", 0.7), row(value=0.5, c=18.0), row("nominal", 0.5, c=17.0)))
    assert "the best on paper has 0.5" in optima_sentence(data, alike)
    robust = replace(data, study=replace(data.study, tolerance=replace(data.study.tolerance, robust=0.95)))
    sentence = optima_sentence(robust, groups(data_of(row("optimum", 0.7), row(value=0.5, c=17.0))))
    assert "the next on paper has 0.5" in sentence and "keeps all limits" in sentence
    assert optima(data, found[:1]) == [] and optima_sentence(data, found[:1]) == ""


def test_yield_of_a_bound_on_one_length_is_that_of_its_normal_distribution() -> None:
    """c = 12 +- 0.05 at three standard deviations, at least 11.99 asked: 0.6 standard deviations below."""
    found = made(data_of(row("optimum", 0.5)))
    exact = 0.5 * (1.0 + math.erf(0.6 / math.sqrt(2.0)))
    assert found.share == pytest.approx(exact, abs=1e-3)  # a Sobol sample of 8192
    assert found.histogram.shown.name == "least_link" and found.histogram.within == pytest.approx(exact, abs=1e-3)
    assert found.histogram.shares.sum() == pytest.approx(1.0, abs=1e-12)
    below = found.histogram.edges[1:] <= 11.99
    assert found.histogram.shares[below].sum() == pytest.approx(1.0 - exact, abs=1e-3)


def test_dimension_that_costs_most_is_the_one_that_the_limit_is_about() -> None:
    data = data_of(row("optimum", 0.5))
    found = made(data)
    first, *others = found.costs
    assert first.name == "c" and first.spread == pytest.approx(1.0, abs=1e-9)
    assert first.gain == pytest.approx(1.0 - found.share, abs=0.02) and first.gain > TELLING_GAIN
    assert all(cost.spread < 1e-9 and abs(cost.gain) < 1e-9 for cost in others)
    assert "the dimension that costs most is c: were it exact, 28" in made_sentence(found, "x")


def test_dimensions_are_tried_although_the_limit_that_is_shown_is_far_and_another_is_near() -> None:
    """All mechanisms keep both limits, so the first one is shown; the second is as near as its output scatters."""
    far = {"swing": {"max": 3.0, "unit": "rad"}}
    data = data_of(row("optimum", 0.5), limits=far)
    study, design = data.study, np.array([data.optimum[name] for name in data.study.family.parameter_names], float)
    about = sampled_designs(study.family, design, study.tolerance, study.optimise.seed, study.tolerance.samples)
    values = design_outputs(study.family, about, ["max_abs_d2psi"], study.accuracy)["max_abs_d2psi"]
    near = {"max_abs_d2psi": {"max": float(values.max() + 0.05 * values.std()), "unit": "1"}}
    found = made(data_of(row("optimum", 0.5), limits=far | near))
    assert found.share == 1.0 and found.histogram.shown.name == "swing" and found.costs


def test_page_of_an_output_that_nothing_made_has_shows_empty_bins() -> None:
    data = data_of(row("optimum", 0.5))
    seen = made(data).histogram
    nothing = replace(seen, shares=np.zeros_like(seen.shares), within=0.0)
    empty = {"made_words": "", "tolerance": "", "costs": (), "sewn": None}
    with np.errstate(all="raise"):
        text = rendered("made.html", made={"histogram": nothing}, study=data.study, number=lambda *x: x[0], **empty)
    assert text.count('height="0.0"') == len(nothing.shares)


def test_histogram_marks_what_misses_the_limit() -> None:
    found = made(data_of(row("optimum", 0.5))).histogram
    axes = draw_histogram(Figure().subplots(), found)
    red = to_rgba(LIMIT, 0.75)
    below = [bar.get_facecolor() == red for bar in axes.patches]
    middle = [bar.get_x() + 0.5 * bar.get_width() for bar in axes.patches]
    assert below == [x < 11.99 for x in middle] == found.missing.tolist() and 5 < sum(below) < len(below) - 5
    assert sum(bar.get_height() for bar in axes.patches) == pytest.approx(100.0, abs=1e-9)
    assert [line.get_xdata()[0] for line in axes.lines] == [pytest.approx(11.99)]
    ends = [float(number(end, found.digits)) for end in found.edges[[0, -1]]]
    assert ends == pytest.approx(found.edges[[0, -1]], abs=0.01 * np.ptp(found.edges)), "11.9 would stand at 11.94"


def test_histogram_of_a_mechanism_that_only_has_to_turn_is_that_of_its_margin() -> None:
    """A yes or no has no scatter: what decides it is shown."""
    found = made(data_of(row("optimum", 0.5), limits={"rotatable": True}))
    margin = sweep.summarise("rssr", BEST, "margin")["margin"][0]
    assert found.histogram.shown.name == "margin"
    assert found.histogram.low is None, "too far away to be drawn"
    assert found.share == found.histogram.within == 1.0
    assert found.histogram.edges[0] < margin < found.histogram.edges[-1] and (found.histogram.shares > 0.0).sum() > 10
    assert sum(cost.spread for cost in found.costs) == pytest.approx(1.0, abs=0.1)  # near enough linear


def test_histogram_of_any_output_is_to_be_had() -> None:
    data = data_of(row("optimum", 0.5))
    np.testing.assert_array_equal(histogram(data, "least_link").shares, made(data).histogram.shares)
    free = histogram(data, "swing")
    assert free.low is None and free.high is None and free.shown.unit == "°"
    assert free.edges[0] < abs(math.degrees(sweep.summarise("rssr", BEST, "swing")["swing"][0])) < free.edges[-1]


@pytest.mark.parametrize("missing", ["tolerance", "limits"])
def test_no_yield_without_tolerances_or_limits(missing) -> None:
    data = DATA | {missing: {}} if missing == "limits" else {k: v for k, v in DATA.items() if k != missing}
    study = study_from_data(data, "study.toml")
    assert made(replace(without_rows(study), folder=Path("nowhere"), optima=pd.DataFrame([row("optimum")]))) is None
    assert made_sentence(None, "x") == ""
    assert np.isnan(row()["yield"])


@pytest.mark.parametrize(("share", "reached"), [(0.9312, False), (0.9512, True)])
def test_a_share_that_was_asked_and_not_reached_is_told(share, reached) -> None:
    best = row("optimum", ended="looks", kkt_residual=1e-9, least_link=12.0, max_pressure_angle=1.0) | {"yield": share}
    data = data_of(best, tolerance=DATA["tolerance"] | {"robust": "95 %"})
    missed = "93.12 % within all limits, 95 % asked: not reached, its search used up its evaluations before"
    told = [] if reached else [f"Not achieved: as it is made: {missed}."]
    assert not_achieved(data, SimpleNamespace(best_row=None)) == told
