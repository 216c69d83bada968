"""needle208 as it is made: the yield of the search's own sample against mechanisms that share no code with it."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.evaluation.summaries import design_outputs
from sweep.optimise.manufacture.margins import inequalities
from sweep.optimise.manufacture.sample import Sampler
from sweep.optimise.starts.posing import problem_of
from sweep.study import load_study
from tests.reference.made import normal, outputs

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
STUDY = load_study(FOLDER)
DESIGN = {"shift2": 0.0, "turn2": 0.0} | EXPECTED["optimum"]["design"]
UNITS = {p.name: p.unit for p in STUDY.family.parameters}


def made(design, n):
    of = {kind: {name for name, unit in UNITS.items() if unit == kind} for kind in ("length", "angle")}
    tolerance = STUDY.tolerance
    return normal(design, of["length"], of["angle"], (tolerance.lengths, tolerance.angles), n)


def kept(found, limits):
    good = np.ones(len(found["stroke"]), dtype=bool)
    for limit in limits:
        if limit.output.startswith("rotatable"):
            good &= np.isfinite(found["max_pressure_angle1"])
            continue
        values = np.abs(found[limit.output])
        values = found[limit.output] if limit.output.startswith(("min_", "max_x", "max_y")) else values
        good &= np.isfinite(values)
        good &= (values >= (-math.inf if limit.minimum is None else limit.minimum)) & (
            values <= (math.inf if limit.maximum is None else limit.maximum)
        )
    return float(good.mean())


def limits_that_some_miss(found):
    """Limits that three fifths of these mechanisms keep, give or take: a share of 0 or 1 would confirm nothing."""
    like = STUDY.output_limits[0]
    deviation, stroke = float(np.nanquantile(found["max_abs_dev"], 0.7)), np.nanquantile(found["stroke"], [0.05, 0.95])
    return [
        replace(like, output="rotatable1", minimum=1.0, maximum=None),
        replace(like, output="max_abs_dev", minimum=None, maximum=deviation),
        replace(like, output="stroke", minimum=float(stroke[0]), maximum=float(stroke[1])),
    ]


def test_reference_of_what_is_made_agrees_with_the_kernels():
    """Dense grids of 720 poses miss an extremum by (pi/720)^2/2 of the second derivative, 1e-5 of the amplitude."""
    designs = made(DESIGN, 50)
    found = outputs(designs)
    matrix = np.column_stack([designs[name] for name in STUDY.family.parameter_names])
    names = [name for name in found if name not in ("least_link2", "arm_ratio2")]
    exact = design_outputs(STUDY.family, matrix, [*names, "least_link2", "arm_ratio2"], STUDY.accuracy, None)
    for name in found:
        atol = 1e-3 if "dev" in name or "_m2" in name else 1e-4
        np.testing.assert_allclose(found[name], np.abs(exact[name]) if name == "swing1" else exact[name], atol=atol)


def tolerated(count):
    """Three standard errors of both samples, and what a grid of 720 poses misses of the deviation."""
    return 3.0 * 0.5 * (1.0 / math.sqrt(count) + 1.0 / math.sqrt(STUDY.tolerance.samples)) + 0.002


@pytest.mark.parametrize("count", [2000, pytest.param(100_000, marks=pytest.mark.long)])
def test_yield_is_confirmed_by_mechanisms_that_share_no_code(count):
    design = DESIGN
    found = outputs(made(design, count))
    limits = limits_that_some_miss(found)
    matrix = np.array([[design[name] for name in STUDY.family.parameter_names]])
    problem = replace(problem_of(STUDY, matrix), limits=tuple(limits))
    ours = Sampler(problem, STUDY.tolerance, 5).share(matrix[0], inequalities(problem))
    theirs = kept(found, limits)
    assert 0.3 < theirs < 0.9 and ours == pytest.approx(theirs, abs=tolerated(count))


@pytest.mark.long
def test_yield_within_the_limits_of_the_study_is_confirmed_by_100000_mechanisms():
    """Whatever the study asks of its accepted optimum, and whatever share keeps it."""
    design = DESIGN
    matrix = np.array([[design[name] for name in STUDY.family.parameter_names]])
    limits = [limit for limit in STUDY.output_limits if limit.minimum is None or limit.minimum != limit.maximum]
    problem = problem_of(STUDY, matrix)
    ours = Sampler(problem, STUDY.tolerance, 5).share(matrix[0], inequalities(problem))
    theirs = kept(outputs(made(design, 100_000)), limits)
    assert ours == pytest.approx(theirs, abs=tolerated(100_000))


def test_yield_of_other_tolerances_is_another_one():
    """Negative control: mechanisms made half as exactly keep the limits far less often."""
    design = DESIGN
    found = outputs(made(design, 2000))
    limits = limits_that_some_miss(found)
    lengths, angles = ({name for name, unit in UNITS.items() if unit == kind} for kind in ("length", "angle"))
    rough = normal(design, lengths, angles, (2.0 * STUDY.tolerance.lengths, 2.0 * STUDY.tolerance.angles), 2000)
    assert kept(outputs(rough), limits) < kept(found, limits) - 2.0 * tolerated(2000)


def script(name, monkeypatch):
    spec = importlib.util.spec_from_file_location(f"needle208_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # where dataclasses look for their types
    spec.loader.exec_module(module)
    return module


def array(design):
    return np.array([({"shift2": 0.0, "turn2": 0.0} | design)[name] for name in STUDY.family.parameter_names])


def test_price_of_a_mechanism_is_that_of_its_accepted_figures(monkeypatch):
    figure, told = script("figure", monkeypatch), []
    monkeypatch.setattr(figure, "SAMPLES", 2048)
    designs = {"record on paper": array(EXPECTED["record"]["design"]), "optimum": array(EXPECTED["better"]["design"])}
    table = figure.price(STUDY, designs, lambda *said: told.append(said)).set_index("mechanism")
    assert told == [("figure", k, 2, "mechanisms") for k in range(3)]
    for row, accepted in (("record on paper", EXPECTED["record"]), ("optimum", EXPECTED["better"])):
        assert table.loc[row, "acceleration"] == pytest.approx(accepted["outputs"]["max_abs_d2s"], rel=1e-6)
        assert table.loc[row, "deviation drawn"] == pytest.approx(accepted["outputs"]["max_abs_dev"], rel=1e-6)
        # Three standard errors of 2048 mechanisms, at a share of a half.
        assert table.loc[row, "made within every limit [%]"] == pytest.approx(100.0 * accepted["share"], abs=3.4)
    assert (table["deviation of 95 % made"] <= 0.05).tolist() == [False, True]
    picture = figure.chart(table.reset_index(), 0.05)
    assert [text.get_text() for text in picture.axes[0].get_yticklabels()] == ["record on paper", "to be built"]


@pytest.mark.long
def test_front_gives_acceleration_for_deviation_and_keeps_the_share(monkeypatch):
    front = script("front", monkeypatch)
    monkeypatch.setattr(front, "ROUNDS", ((0.07,),))
    own = dict(zip(STUDY.family.parameter_names, array(EXPECTED["better"]["design"]), strict=True))
    row = pd.Series(own | {"max_abs_d2s": EXPECTED["better"]["outputs"]["max_abs_d2s"], "yield": 0.952})
    points = front.front(STUDY, row, jobs=1)
    assert points["deviation"].tolist() == [0.05, 0.07] and points["kept"].all()
    gain = points["acceleration"][1] / points["acceleration"][0]
    # docs: 0.4 % less; no drive of this stroke has less than constant acceleration.
    assert 0.99 < gain < 0.998
    assert points["share"][1] >= STUDY.tolerance.robust
