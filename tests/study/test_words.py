"""Words of study files: bounds as a designer writes them, what is made large, the ratio of times, other unit names."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.dataset.files import PARETO, beside
from sweep.engine.run import run
from sweep.errors import StudyError
from sweep.families.names import negative
from sweep.optimise import Problem, minimise
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.quantities.units import UnitFault, factor, read
from sweep.report.quantities import quantity
from sweep.study import Limit, OptimiseSettings, load_study

STUDY = """
[study]
name = "words"
[mechanism]
family = "rssr"
[design]
a = { from = 0.3, to = 0.6, count = 4, unit = "inch" }
b = "1.2 inch"
c = { from = 0.8, to = 1.2, count = 5, unit = "in" }
e = "35 mm"
f = "0 mm"
g = "0 mm"
alpha = "20°"
[limits]
max_pressure_angle = "<= 50°"
swing = ">= 20 deg"
[objective]
maximise = "least_link"
[accuracy]
target = 1e-8
[optimise]
starts = 3
seed = 1
[pareto]
output = "size"
at_most = { values = [36, 40], unit = "mm" }
starts = 0
"""

LOCUS = """
[study]
name = "ratio"
[mechanism]
family = "rssr"
[locus]
swing = "45 deg"
time_ratio = 1.1
phi_ext = { from = 0, to = 360, count = 61, unit = "deg" }
[design]
e = "100 mm"
f = "30 mm"
g = "15 mm"
alpha = "70 deg"
[limits]
rotatable = true
"""


def study_of(folder, text):
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return load_study(folder)


def faults_of(folder, text):
    with pytest.raises(StudyError) as caught:
        study_of(folder, text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ('"<= 45 deg"', Limit("swing", None, math.radians(45.0))),
        ('"<=45°"', Limit("swing", None, math.radians(45.0))),
        ('">= 0.1 rad"', Limit("swing", 0.1, None)),
        ('"≥ 100 mrad"', Limit("swing", 0.1, None)),
        ('"≤ 45 deg"', Limit("swing", None, math.radians(45.0))),
        ('"40 +- 0.2 deg"', Limit("swing", math.radians(39.8), math.radians(40.2))),
        ('"40 ± 0.2°"', Limit("swing", math.radians(39.8), math.radians(40.2))),
    ],
)
def test_bound_is_read_as_it_is_written(tmp_path, text, limit) -> None:
    (found,) = [one for one in study_of(tmp_path, STUDY.replace('">= 20 deg"', text)).limits if one.output == "swing"]
    for side in ("minimum", "maximum"):
        written, wanted = getattr(found, side), getattr(limit, side)
        assert (written is None) == (wanted is None)
        if wanted is not None:
            assert written == pytest.approx(wanted, rel=4e-16)  # a product by the factor of the unit


@pytest.mark.parametrize(
    ("text", "ends"), [(">= 0.25", (0.25, None)), (">= 25 %", (0.25, None)), ("50 +- 25 %", (0.25, 0.75))]
)
def test_bound_of_a_pure_number_has_no_unit_or_is_a_percentage(text, ends, tmp_path) -> None:
    found = study_of(tmp_path, STUDY.replace('swing = ">= 20 deg"', f'link_ratio = "{text}"'))
    assert Limit("link_ratio", *ends) in found.limits  # of these percentages the factor makes exact numbers


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ('"< 45 deg"', '"<=" or ">=", or "+-" for a band, as "<= 45 deg" or "40 +- 0.2 deg"'),
        ('"= 45 deg"', '"<=" or ">=", or "+-" for a band'),
        ('"<= 45"', 'a number and its unit; an angle, in deg, rad, mrad or rev: "<= 45 deg"'),
        ('"<= 45 mm"', 'an angle, in deg, rad, mrad or rev: "<= 45 deg"'),
        ('"<= 4,5 deg"', "a decimal point, no comma"),
        ('"<= deg"', "a number and its unit"),
        ('"<="', "a number and its unit"),
        ('"45 deg"', '{ min = ..., max = ..., unit = "deg" }, or "<= 45 deg", or "40 +- 0.2 deg"'),
        ("45", '{ min = ..., max = ..., unit = "deg" }, or "<= 45 deg", or "40 +- 0.2 deg"'),
        ('"40 +- deg"', "a number and its unit"),
        ('"40 +- 0 deg"', "a finite value and a positive band"),
    ],
)
def test_fault_of_a_bound_names_the_remedy(tmp_path, text, remedy) -> None:
    message = faults_of(tmp_path, STUDY.replace('">= 20 deg"', text))
    assert "limits.swing = " in message and remedy in message


def test_other_names_of_units_are_those_units(tmp_path) -> None:
    assert factor("inch", "mm") == factor("in", "mm") == pytest.approx(25.4, rel=1e-15)
    assert factor("°", "rad") == factor("deg", "rad") and factor("°/s", "rad/s") == factor("deg/s", "rad/s")
    assert factor("µm", "mm") == factor("μm", "mm") == factor("um", "mm")
    with pytest.raises(UnitFault, match="in mm, um, cm, m or inch"):
        factor("°", "mm")
    with pytest.raises(UnitFault, match="did you mean 'inch'"):
        factor("inc", "mm")
    written = study_of(tmp_path, STUDY)
    other = study_of(tmp_path, STUDY.replace('"1.2 inch"', '"1.2 in"').replace("20°", "20 deg"))
    assert written.space.fixed == other.space.fixed


def test_time_ratio_prescribes_the_angle_between_the_limits(tmp_path) -> None:
    found = study_of(tmp_path, LOCUS)
    assert found.space.fixed["phi0"] == pytest.approx(2.0 * math.pi * 1.1 / 2.1, rel=4e-16)
    same = study_of(
        tmp_path, LOCUS.replace("time_ratio = 1.1", f'phi0 = "{math.degrees(found.space.fixed["phi0"])!r} deg"')
    )
    assert same.space.fixed["phi0"] == pytest.approx(found.space.fixed["phi0"], rel=4e-16)
    listed = study_of(tmp_path, LOCUS.replace("time_ratio = 1.1", "time_ratio = { values = [0.9, 1.0, 1.25] }"))
    (axis,) = [one for one in listed.space.axes if one.name == "phi0"]
    assert np.asarray(axis.values) == pytest.approx(
        2.0 * np.pi * np.array([0.9, 1.0, 1.25]) / [1.9, 2.0, 2.25], rel=4e-16
    )
    spaced = study_of(tmp_path, LOCUS.replace("time_ratio = 1.1", "time_ratio = { from = 1, to = 1.2, count = 3 }"))
    (axis,) = [one for one in spaced.space.axes if one.name == "phi0"]
    assert axis.values[1] == pytest.approx(2.0 * math.pi * 1.1 / 2.1, rel=4e-16)  # even in the ratio as written


def test_the_ratio_is_answered_by_the_name_that_was_written(tmp_path) -> None:
    one, other = LOCUS, LOCUS.replace("time_ratio", "stroke_ratio")
    for number, (text, name) in enumerate([(one, "time_ratio"), (other, "stroke_ratio")]):
        study = study_of(tmp_path, text)
        assert study.space.fixed["phi0"] == pytest.approx(2.0 * math.pi * 1.1 / 2.1, rel=4e-16)
        found = sweep.load(run(study, out=tmp_path / str(number), jobs=1))
        assert found.loc[found["status"] == st.OK, name].to_numpy() == pytest.approx(1.1, abs=1e-9)
    bound = STUDY.replace('swing = ">= 20 deg"', 'time_ratio = ">= 0.9"')
    assert Limit("time_ratio", 0.9, None) in study_of(tmp_path, bound).limits


def test_designs_of_a_time_ratio_have_it(tmp_path) -> None:
    folder = run(study_of(tmp_path, LOCUS), out=tmp_path / "out", jobs=1)
    found = sweep.load(folder)
    found = found[found["status"] == st.OK]
    assert len(found) > 5
    ratio = sweep.summarise("rssr", found[["a", "b", "c", "e", "f", "g", "alpha", "branch"]], ["stroke_ratio"])
    assert ratio["stroke_ratio"].to_numpy() == pytest.approx(1.1, abs=1e-9)


def test_a_minus_as_reports_print_it_is_one() -> None:
    assert read("\u22124 mm", "mm") == -4.0


@pytest.mark.parametrize(
    ("change", "remedy"),
    [
        (("time_ratio = 1.1", 'time_ratio = 1.1\nphi0 = "180 deg"'), "phi0 or time_ratio, not both: they say the same"),
        (("time_ratio = 1.1", "time_ratio = -1.1"), "a positive ratio (time from the extended to the folded position"),
        (("time_ratio = 1.1", 'time_ratio = "1.1 deg"'), "locus.time_ratio = '1.1 deg'; allowed: a number"),
        (("time_ratio = 1.1\n", ""), "or time_ratio, the time there over the time back, as 1.1"),
        (("time_ratio", "time_ration"), "did you mean 'time_ratio'?"),
    ],
)
def test_fault_of_a_time_ratio_names_the_remedy(tmp_path, change, remedy) -> None:
    message = faults_of(tmp_path, LOCUS.replace(*change))
    assert remedy in message and "1 fault\n" in message


@pytest.mark.parametrize(
    ("table", "remedy"),
    [
        ('maximise = "least_lnk"', "objective.maximise = 'least_lnk'"),
        ('maximise = "least_link"\nminimise = "size"', "minimise or maximise, not both: bound the other output"),
        ("", "or maximise, the name of one to be made large"),
        ('maximize = "least_link"', "did you mean 'maximise'?"),
        ('maximise = "size"', "another output than the objective"),
        ("maximise = 3", "objective.maximise = 3; allowed: the name of a design output"),
    ],
)
def test_fault_of_what_is_to_be_made_large_names_the_remedy(tmp_path, table, remedy) -> None:
    assert remedy in faults_of(tmp_path, STUDY.replace('maximise = "least_link"', table))


def test_study_that_makes_an_output_large_ends_at_its_largest(tmp_path) -> None:
    """Within the same limits no design of the sweep, and none of the front's roomier ones, has a longer least link."""
    folder = run(study_of(tmp_path, STUDY), out=tmp_path / "out", jobs=1)
    swept = sweep.load(folder)
    best = -swept["minus_least_link"].min()
    top, front = (pd.read_parquet(beside(folder) / name) for name in ("_optimum.parquet", PARETO))
    found = sweep.summarise(
        "rssr", top[["a", "b", "c", "e", "f", "g", "alpha", "branch"]], ["least_link", "max_pressure_angle"]
    )
    assert found["least_link"].iloc[0] == pytest.approx(-top["minus_least_link"].iloc[0], rel=1e-12)
    assert found["least_link"].iloc[0] >= best > 0.0 and found["max_pressure_angle"].iloc[0] <= math.radians(50.0) * (
        1 + 1e-8
    )
    assert (-front["minus_least_link"]).is_monotonic_increasing  # more room, longer links


@pytest.mark.parametrize("output", ["max_pressure_angle", "swing", "least_link", "max_abs_dpsi", "arm_ratio"])
def test_negative_of_an_output_is_minus_its_magnitude(output) -> None:
    table = {"a": [1.0], "b": [3.3], "c": [3.1], "e": [3.0], "xi": [4.2], "eta": [0.8], "branch": [1.0]}
    found = sweep.summarise("four_bar", table, [output, negative(output)])
    wanted = abs(found[output].iloc[0]) if output == "swing" else found[output].iloc[0]
    assert found[negative(output)].iloc[0] == -wanted
    assert found[f"err_{negative(output)}"].iloc[0] == found[f"err_{output}"].iloc[0]


@pytest.mark.parametrize("output", ["least_transmission_angle", "swing", "stroke_ratio", "least_link", "size"])
def test_gradients_of_a_negative_are_minus_those_of_the_output(output) -> None:
    from sweep.families import family

    design = np.array([1.0, 4.0, 2.5, 3.1, 0.7, -0.6, 0.9, -1.0])
    one, other = (sensitivities(family("rssr"), design, [name]) for name in (output, negative(output)))
    assert other["value"] == pytest.approx([-x for x in one["value"]], rel=1e-12)
    # a shared end grows by one gradient and shrinks by the other; the scale of rows differs
    assert other["growing"] == pytest.approx([-x for x in one["shrinking"]], rel=1e-9, abs=1e-12) or other[
        "growing"
    ] == pytest.approx([-x for x in one["growing"]], rel=1e-9, abs=1e-12)


def test_largest_output_of_the_optimiser_is_where_its_limit_is() -> None:
    """The other way round: at the largest swing for a pressure angle, that angle is the least for that swing."""
    from sweep.families import family

    fixed = {"f": -0.3, "g": 0.2, "alpha": 0.5, "branch": 1.0}
    low, high = np.array([0.1, 0.5, 0.5, 0.5]), np.array([0.9, 3.0, 3.0, 3.0])
    names = ("a", "b", "c", "e")

    def solved(objective, *limits):
        found = Problem(family("rssr"), names, low, high, fixed, objective, limits)
        starts = found.rows(np.array([[0.4, 1.2, 1.0, 1.2], [0.3, 0.9, 0.8, 1.5]]))
        return minimise(found, starts, OptimiseSettings())[0]

    widest = solved(negative("swing"), Limit("max_pressure_angle", None, 0.8))
    assert widest.status == st.OK and widest.kkt_residual <= 1e-6
    back = solved("max_pressure_angle", Limit("swing", -widest.objective, None))
    assert back.objective == pytest.approx(0.8, rel=1e-6)


def test_what_is_made_large_is_shown_as_itself() -> None:
    shown = quantity(negative("least_transmission_angle"), "rad")
    assert shown.words == "least transmission angle" and shown.show(-math.radians(50.0)) == "50°"
    assert quantity(negative("needle.least_link2"), "mm").show(-8.0) == "8\u00a0mm"
