"""Outputs that are constant in pieces, and bounds that an optimiser cannot follow: refused beside one, not alone."""

from __future__ import annotations

import pandas as pd
import pytest

from sweep.dataset.files import OPTIMUM, SENSITIVITY, beside
from sweep.engine.run import run
from sweep.errors import InputError, StudyError
from sweep.optimise import Problem
from sweep.optimise.problem.program import Program
from sweep.report.page import write_report
from sweep.study import load_study

STUDY = """
[study]
name = "jumps"
[mechanism]
family = "rssr"
[scene]
want = ["pressure_extrema", "swing"]
[design]
a = { from = 8, to = 12, count = 3, unit = "mm" }
b = "30 mm"
c = { from = 20, to = 30, count = 3, unit = "mm" }
e = "35 mm"
f = "5 mm"
g = "0 mm"
alpha = "20 deg"
[limits]
swing = ">= 20 deg"
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 1
"""


def study_of(folder, text):
    (folder / "study.toml").write_text(text)
    return load_study(folder)


def test_count_that_is_wanted_beside_an_optimiser_is_computed_without_slopes(tmp_path) -> None:
    folder = run(study_of(tmp_path, STUDY), out=tmp_path / "out", jobs=1)
    optimum = pd.read_parquet(beside(folder) / OPTIMUM)
    assert optimum["pressure_extrema"].isin([0, 2, 4]).all()
    slopes = pd.read_parquet(beside(folder) / SENSITIVITY)
    assert set(slopes["output"]) == {"swing", "max_abs_d2psi"} and slopes["growing"].notna().all()
    assert write_report(folder).is_file()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"max_abs_d2psi"', '"pressure_extrema"'), "objective.minimise = 'pressure_extrema'"),
        (('minimise = "max_abs_d2psi"', 'maximise = "pressure_extrema"'), "objective.maximise = 'pressure_extrema'"),
        (('"max_abs_d2psi"', '"rotatable"'), "objective.minimise = 'rotatable'"),
        (('minimise = "max_abs_d2psi"', 'maximise = "rotatable"'), "objective.maximise = 'rotatable'"),
        (('swing = ">= 20 deg"', 'pressure_extrema = "<= 2"'), "limits.pressure_extrema = '<= 2'"),
    ],
)
def test_count_that_is_aimed_at_is_refused_with_the_remedy(tmp_path, change, message) -> None:
    with pytest.raises(StudyError) as caught:
        study_of(tmp_path, STUDY.replace(*change))
    assert message in str(caught.value) and "ask for it in scene.want, or leave out [optimise]" in str(caught.value)


def test_count_limits_a_sweep_alone(tmp_path) -> None:
    alone = STUDY.replace('swing = ">= 20 deg"', 'pressure_extrema = "<= 2"').replace("[optimise]\nstarts = 1\n", "")
    assert study_of(tmp_path, alone).optimise is None


@pytest.mark.parametrize(
    ("limit", "allowed"),
    [
        ("max_pressure_angle = { max = 100, unit = 'deg' }", "angles between 0 and 90 deg"),
        ("max_pressure_angle = { min = 10, max = 100, unit = 'deg' }", "angles between 0 and 90 deg"),
        ("minus_least_transmission_angle = { min = -100, unit = 'deg' }", "angles between 0 and 90 deg"),
        ("stroke_ratio = { min = -1 }", "ratios of 0 or more"),
    ],
)
def test_bound_that_the_optimiser_cannot_follow_is_told_with_its_line(tmp_path, limit, allowed) -> None:
    """What it follows of 100 degrees, -cos^2, is that of 80: such a bound was held as one of 80, or divided by zero."""
    text = STUDY.replace('swing = ">= 20 deg"', limit)
    with pytest.raises(StudyError, match=f"1 fault\n  .*/study.toml:17: limits.{limit.split()[0]} = .*{allowed}"):
        study_of(tmp_path, text)
    study = study_of(tmp_path, text.replace("[optimise]\nstarts = 1\n", ""))
    with pytest.raises(InputError, match=allowed):
        Program(Problem(study.family, ("a",), [8.0], [12.0], {}, "max_abs_d2psi", study.limits))


@pytest.mark.parametrize(
    ("limit", "place", "value"),
    [
        ("max_pressure_angle = { max = -5, unit = 'deg' }", "max_pressure_angle.max", "-5"),
        ("max_abs_psi = '<= -10 deg'", "max_abs_psi", "'<= -10 deg'"),
        ("range_dpsi = '-2 +- 1'", "range_dpsi", "'-2 +- 1'"),
        ("rms_dpsi = { min = -1, max = -0.5 }", "rms_dpsi.max", "-0.5"),
        ("swing = { max = -40, unit = 'deg' }", "swing.max", "-40"),
    ],
)
@pytest.mark.parametrize("optimise", ["[optimise]\nstarts = 1\n", ""])
def test_upper_bound_below_zero_of_what_is_never_negative_is_one_fault(tmp_path, limit, place, value, optimise) -> None:
    """A study with such a bound passed the check and swept its space for nothing; of a swing the magnitude counts."""
    text = STUDY.replace('swing = ">= 20 deg"', limit).replace("[optimise]\nstarts = 1\n", optimise)
    with pytest.raises(StudyError) as caught:
        study_of(tmp_path, text)
    (fault,) = caught.value.faults
    assert f"study.toml:17: limits.{place} = {value}; allowed: a bound of 0 or more" in fault


@pytest.mark.parametrize("limit", ["max_psi = '<= -10 deg'", "min_dpsi = '<= -1'", "margin = '<= -0.1'"])
def test_upper_bound_below_zero_of_what_may_be_negative_is_kept(tmp_path, limit) -> None:
    (kept,) = study_of(tmp_path, STUDY.replace('swing = ">= 20 deg"', limit)).limits
    assert kept.maximum is not None and kept.maximum < 0.0
