"""What a right study file becomes: internal units, defaults, the smoke version, fingerprint and round trip."""

from __future__ import annotations

import contextlib
import json
import math
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.chunks.plan import _output_column as output_column
from sweep.errors import StudyError
from sweep.families.base import Accuracy
from sweep.quantities import units
from sweep.study import Limit, Study, load_study, study_from_data
from sweep.study.load import merged, with_accuracy

NEEDLE = """
[study]
name = "needle-208"
title = "Class-208 needle"
question = "How small can the acceleration be?"

[mechanism]
chain = ["rssr", "guide"]

[scene]
speed = "7000 rpm"
want = ["max_abs_dev", "stroke", "max_abs_d2s"]
window = { from = 0.0, to = 0.6 }

[design]
alpha1 = { from = 0, to = 90, count = 10, unit = "deg" }
a1 = "1 cm"
b1 = { value = 1.5, unit = "in" }
c1 = { from = 10, to = 1000, count = 3, unit = "mm", scale = "log" }
e1 = { values = [35.0, 40.0], unit = "mm" }
f1 = "0 mm"
g1 = "-3 mm"
branch1 = -1
a2 = "10 mm"
b2 = "40 mm"
c2 = "30 mm"
e2 = "40 mm"
xi2 = "20 mm"
eta2 = "0 mm"
lam2 = "90 deg"
h2 = "0 mm"

[limits]
rotatable1 = true
max_pressure_angle1 = { max = 45, unit = "deg" }
stroke = { min = 2.44, max = 2.46, unit = "cm" }
margin2 = { min = 0.1 }

[objective]
minimise = "max_abs_d2s"
"""


def load(folder: Path, text: str, smoke: str | None = None) -> Study:
    (folder / "study.toml").write_text(text)
    if smoke is not None:
        (folder / "smoke.toml").write_text(smoke)
    return load_study(folder, smoke=smoke is not None)


@pytest.fixture
def needle(tmp_path: Path) -> Study:
    return load(tmp_path, NEEDLE)


def test_quantities_are_in_mm_rad_and_rad_per_second(needle: Study) -> None:
    assert needle.speed == pytest.approx(7000 * 2 * math.pi / 60, rel=1e-15)
    assert needle.space.fixed["a1"] == 10.0
    assert needle.space.fixed["b1"] == pytest.approx(38.1, rel=1e-15)
    assert needle.space.fixed["lam2"] == math.pi / 2
    assert needle.window == (0.0, 0.6)
    assert needle.limits == (
        Limit("rotatable1", minimum=1.0),
        Limit("max_pressure_angle1", maximum=math.pi / 4),
        Limit("stroke", minimum=pytest.approx(24.4, rel=1e-15), maximum=pytest.approx(24.6, rel=1e-15)),
        Limit("margin2", minimum=0.1),
    )


def test_a_column_of_the_window_says_so(needle: Study) -> None:
    deviation = output_column(needle, "max_abs_dev", "float64").text
    assert deviation.endswith("to its left, in the window from 0 to 0.6 of the stroke")
    assert "window" not in output_column(replace(needle, window=None), "max_abs_dev", "float64").text
    assert "window" not in output_column(needle, "max_abs_d2s", "float64").text


def test_axes_run_in_the_order_of_the_file_and_columns_in_that_of_the_family(needle: Study) -> None:
    space = needle.space
    assert [axis.name for axis in space.axes] == ["alpha1", "c1", "e1"]
    assert [axis.unit for axis in space.axes] == ["deg", "mm", "mm"]
    assert space.count == 60
    columns = space.columns(0, 60)
    assert tuple(columns) == needle.family.parameter_names
    assert columns["e1"][:3].tolist() == [35.0, 40.0, 35.0]
    assert columns["c1"][:6:2] == pytest.approx([10.0, 100.0, 1000.0], rel=1e-15)
    assert columns["alpha1"][::6].tolist() == [math.radians(10.0 * k) for k in range(10)]
    assert space.bounds == {"alpha1": (0.0, math.pi / 2), "c1": (10.0, 1000.0), "e1": (35.0, 40.0)}


def test_what_is_left_out_takes_its_default(needle: Study) -> None:
    fixed = needle.space.fixed
    assert (fixed["branch1"], fixed["branch2"], fixed["kappa2"], fixed["offset2"]) == (-1.0, 1.0, 1.0, 0.0)
    assert needle.accuracy == Accuracy(target=1e-8)
    assert (needle.output.keep, needle.output.dtype, needle.output.curves) == ("feasible", "float64", "optimum")
    assert (needle.budget.disk_bytes, needle.budget.seconds) == (20e9, 3600.0)
    assert needle.optimise is None
    assert needle.reference is None


def test_want_holds_wanted_outputs_then_limits_then_objective_once(needle: Study) -> None:
    wanted = ("max_abs_dev", "stroke", "max_abs_d2s", "rotatable1", "max_pressure_angle1", "margin2")
    assert needle.want == wanted


def test_optimise_and_reference(tmp_path: Path) -> None:
    design = "".join(f'{name}1 = "{k} mm"\n' for k, name in enumerate("abcefg", start=1))
    design += 'alpha1 = "90 deg"\na2="1 mm"\nb2="1 mm"\nc2="1 mm"\ne2="1 mm"\nxi2="0 mm"\neta2="0 mm"\n'
    design += 'lam2 = "0 deg"\nh2 = "0 mm"\n'
    text = NEEDLE + f'[optimise]\nstarts = 7\nseed = 3\ntime_budget = "1.5 min"\n[reference.design]\n{design}'
    study = load(tmp_path, text)
    assert study.optimise is not None
    assert (study.optimise.starts, study.optimise.seed, study.optimise.time_budget) == (7, 3, 90.0)
    assert study.reference is not None
    assert tuple(study.reference) == study.family.parameter_names
    assert (study.reference["g1"], study.reference["alpha1"], study.reference["branch2"]) == (6.0, math.pi / 2, 1.0)


def test_sample(tmp_path: Path) -> None:
    text = NEEDLE.replace("[design]", '[design]\nsample = { kind = "sobol", n = 1000, seed = 4 }')
    study = load(tmp_path, text.replace(", count = 10", "").replace(", count = 3", ""))
    space = study.space
    assert (space.kind, space.count, space.seed) == ("sobol", 1000, 4)
    columns = space.columns(0, 1000)
    assert set(columns["e1"]) == {35.0, 40.0}
    assert np.mean(np.log10(columns["c1"]) < 2.0) == pytest.approx(0.5, abs=0.01)
    assert space.bounds["alpha1"] == (0.0, math.pi / 2)


def test_smoke_file_holds_only_what_differs(tmp_path: Path) -> None:
    smoke = '[design]\nalpha1 = { count = 2 }\nc1 = "30 mm"\ne1 = { values = [36.0], unit = "mm" }\n'
    smoke += "[accuracy]\nsamples = 64\n"
    study = load(tmp_path, NEEDLE + "[accuracy]\ntarget = 1e-6\n", smoke)
    assert study.space.count == 2
    assert study.space.columns(0, 2)["alpha1"].tolist() == [0.0, math.pi / 2]
    assert study.space.fixed["c1"] == 30.0
    assert study.accuracy == Accuracy(samples=64)
    assert load_study(tmp_path).accuracy == Accuracy(target=1e-6)


TABLES = st.recursive(
    st.integers(0, 9), lambda inner: st.dictionaries(st.sampled_from(["a", "b", "c"]), inner, max_size=3), max_leaves=8
)


@settings(deadline=None, max_examples=50)
@given(st.dictionaries(st.sampled_from("abc"), TABLES), st.dictionaries(st.sampled_from("abc"), TABLES))
def test_laying_a_file_over_another_keeps_every_key_and_the_upper_value(base: dict, over: dict) -> None:  # type: ignore[type-arg]
    both = merged(base, over)
    assert both.keys() == base.keys() | over.keys()
    assert merged(both, over) == both
    assert merged(base, {}) == base
    assert all(both[key] == base[key] for key in base.keys() - over.keys())


def test_data_is_json_and_makes_the_same_study_again(needle: Study) -> None:
    again = study_from_data(json.loads(json.dumps(needle.data)), needle.path)
    assert again.fingerprint == needle.fingerprint
    assert again.data == needle.data
    assert again.space.columns(0, 60).keys() == needle.space.columns(0, 60).keys()
    assert again.data["accuracy"] == {"target": 1e-8}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"needle-208"', '"other"'),
        ('"Class-208 needle"', '""'),
        ("How small", "How great"),
        ('a1 = "1 cm"', 'a1 = "10 mm"'),
        ('max = 45, unit = "deg"', 'max = 0.7853981633974483, unit = "rad"'),
        ("branch1 = -1\n", "branch1 = -1\nbranch2 = 1\n"),
        ("[objective]", '[budget]\ndisk = "1 GB"\n[objective]'),
        ("[objective]", "[accuracy]\ntarget = 1e-8\n[objective]"),
        (
            "[objective]",
            '[report]\ncurves = [{ label = "x", x = "c1", y = "e1", points = [[1, 2], [3, 4]] }]\n[objective]',
        ),
    ],
)
def test_fingerprint_stays_where_no_value_changes(old: str, new: str, needle: Study, tmp_path: Path) -> None:
    assert old in NEEDLE
    assert load(tmp_path, NEEDLE.replace(old, new)).fingerprint == needle.fingerprint


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("count = 10", "count = 11"),
        ('a1 = "1 cm"', 'a1 = "1.0000000000000002 cm"'),
        ("[35.0, 40.0]", "[40.0, 35.0]"),
        ('"max_abs_dev", "stroke"', '"stroke"'),
        ("max = 45", "max = 46"),
        ("to = 0.6", "to = 0.7"),
        ("7000 rpm", "7001 rpm"),
        ('minimise = "max_abs_d2s"', 'minimise = "max_abs_dev"'),
        ("[objective]", "[accuracy]\nsamples = 360\n[objective]"),
        ("[objective]", '[output]\nkeep = "all"\n[objective]'),
        ("[objective]", "[optimise]\n[objective]"),
        ("branch1 = -1", "branch1 = 1"),
    ],
)
def test_fingerprint_changes_with_what_determines_values(old: str, new: str, needle: Study, tmp_path: Path) -> None:
    assert old in NEEDLE
    assert load(tmp_path, NEEDLE.replace(old, new)).fingerprint != needle.fingerprint


def test_a_study_goes_to_another_process(needle: Study) -> None:
    there = pickle.loads(pickle.dumps(needle))
    assert there.fingerprint == needle.fingerprint
    assert there.family is needle.family
    for name, values in there.space.columns(7, 31).items():
        assert values.tobytes() == needle.space.columns(7, 31)[name].tobytes()


def test_the_example_of_the_page_is_right(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "study-files.md").read_text()
    study = load(tmp_path, page.split("```toml\n")[1].split("```")[0])
    assert study.space.count == 41 * 2 * 10 * 2


def test_with_accuracy(needle: Study) -> None:
    finer = with_accuracy(needle, 1e-10)
    assert finer.accuracy == Accuracy(target=1e-10)
    assert finer.data["accuracy"] == {"target": 1e-10}
    assert finer.fingerprint != needle.fingerprint
    with pytest.raises(StudyError, match=r"accuracy.target = 2.0; allowed: a relative error"):
        with_accuracy(needle, 2.0)


def test_a_chain_that_cannot_be_is_a_fault(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"mechanism.chain = \['rssp', 'guide'\]"):
        load(tmp_path, NEEDLE.replace('["rssr", "guide"]', '["rssp", "guide"]'))


def test_a_file_with_a_byte_order_mark_and_windows_line_ends(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_bytes(b"\xef\xbb\xbf" + NEEDLE.replace("\n", "\r\n").encode())
    assert load_study(tmp_path / "study.toml").name == "needle-208"


@pytest.mark.parametrize(
    ("unit", "internal", "factor"),
    [
        ("mm", "mm", 1.0),
        ("um", "mm", 1e-3),
        ("m", "mm", 1e3),
        ("in", "mm", 25.4),
        ("deg", "rad", math.pi / 180),
        ("rev", "rad", 2 * math.pi),
        ("mm/rad^2", "mm", 1.0),
        ("mm/deg^2", "mm", (180 / math.pi) ** 2),
        ("deg/s", "rad/s", math.pi / 180),
        ("cm^4", "mm^4", 1e4),
        ("%", "1", 0.01),
        ("1/deg", "1", 180 / math.pi),
        ("h", "s", 3600.0),
        # as drawings, data sheets and the reports of this program write them
        *((unit, "N*mm", 1000.0) for unit in ("N m", "N·m", "N\u22c5m", "Nm", "N * m")),
        *((unit, "mm/s^2", 1000.0) for unit in ("m/s²", "m/s2", "m/s**2", "m s^-2", "m·s⁻²")),
        *((unit, "rad/s", math.pi / 30) for unit in ("rpm", "RPM", "1/min", "1 / min", "min⁻¹", "r/min", "rev/min")),
        *(("mm/rad²", "mm/rad^2", 1.0), ("kg mm²", "t*mm^2", 1e-3), ("cN", "N", 0.01), ("GPa", "MPa", 1000.0)),
    ],
)
def test_unit_factors(unit: str, internal: str, factor: float) -> None:
    assert units.factor(unit, internal) == pytest.approx(factor, rel=4e-16)


@pytest.mark.parametrize(
    ("unit", "internal"),
    [
        ("deg", "1"),
        ("1", "rad"),
        ("mm", "rad"),
        ("deg", "mm"),
        ("1/rad", "rad"),
        ("rad*mm", "mm"),
        ("mm^2", "mm"),
        ("", "mm"),
        ("1/s", "rad/s"),  # turns or radians
        ("1/min", "1"),
        ("N/mm s", "N*s/mm"),  # the second may be above the slash or below
        ("11", "1"),
    ],
)
def test_a_unit_of_another_kind_is_refused(unit: str, internal: str) -> None:
    with pytest.raises(units.UnitFault):
        units.factor(unit, internal)


@settings(deadline=None, max_examples=200)
@given(st.text(alphabet="mrads1/*^ 9-%(_.", max_size=12))
def test_any_text_is_a_unit_or_a_fault(text: str) -> None:
    with contextlib.suppress(units.UnitFault):
        assert units.factor(text, "mm") > 0.0


@pytest.mark.parametrize(
    ("internal", "written"),
    [
        ("mm", "um cm m in inch"), ("rad", "deg mrad rev"), ("rad/s", "rpm deg/s rev/h"), ("s", "ms min h"),
        ("t", "kg g lb"), ("N", "kN gf lbf kg*m/s^2"), ("N*mm", "N*m kN*cm lbf*in"),
        ("t*mm^2", "kg*m^2 g*cm^2"), ("B", "MB GB"), ("MPa", "N/m^2 kN/cm^2"),
        ("N/mm", "N/m gf/in"), ("N*mm*s", "N*m/rpm*rev"), ("mm/s^2", "m/min^2"),
    ],
)  # fmt: skip
def test_factors_are_those_of_pint(internal: str, written: str) -> None:
    registry = pint.UnitRegistry()
    registry.define("gf = 9.80665e-3 newton")
    translated = {"in": "inch", "rev": "revolution", "min": "minute", "h": "hour", "B": "byte", "MB": "megabyte"}
    translated |= {"GB": "gigabyte", "t": "metric_ton", "g": "gram"}

    def of(unit: str) -> pint.Quantity[float]:
        return registry.Quantity(1.0, re.sub(r"[A-Za-z]+", lambda m: translated.get(m[0], m[0]), unit))

    for unit in written.split():
        # A few roundings: factors are products of at most four numbers.
        assert units.factor(unit, internal) == pytest.approx(of(unit).to(of(internal).units).magnitude, rel=1e-15)


def test_a_finished_study_needs_no_pydantic() -> None:
    code = "import sys, sweep.study; print(*({'pydantic'} & sys.modules.keys()))"
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert result.stdout == "\n"
