"""Every fault of a study file gives one message with file, key, value and what is allowed; all come at once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sweep.errors import StudyError
from sweep.study import load_study

RIGHT = """
[study]
name = "press"
title = "Press drive"

[mechanism]
family = "rssr"

[scene]
speed = "7000 rpm"
want = ["margin", "swing"]

[design]
a = "10 mm"
b = { value = 4.0, unit = "cm" }
c = { from = 20, to = 40, count = 5, unit = "mm" }
e = { values = [35.0, 40.0], unit = "mm" }
f = "0 mm"
g = "0 mm"
alpha = { from = 0, to = 90, count = 4, unit = "deg" }
branch = { values = [-1, 1] }

[limits]
rotatable = true
max_pressure_angle = { max = 45, unit = "deg" }
margin = { min = 0.1 }

[objective]
minimise = "max_abs_d2psi"

[accuracy]
target = 1e-8

[optimise]
starts = 10
seed = 1
time_budget = "60 s"

[reference.design]
a = "10 mm"
b = "40 mm"
c = "30 mm"
e = "40 mm"
f = "0 mm"
g = "0 mm"
alpha = "90 deg"

[output]
keep = "all"

[budget]
disk = "1 GB"
"""

A_AXIS = 'c = { from = 20, to = 40, count = 5, unit = "mm" }'

# What is replaced, what replaces it, and the pieces the one message must have.
FAULTS = {
    "name that leaves the folder": ('"press"', '"../press"', ["study.name = '../press'", "a-z"]),
    "name with a capital": ('"press"', '"Press"', ["study.name = 'Press'", "a-z"]),
    "name with a line end": ('"press"', '"press\\n"', ["study.name", "a-z"]),
    "name of 65 letters": ('"press"', f'"{"p" * 65}"', ["study.name = 'ppp", "64 letters at most"]),
    "name missing": ('name = "press"', "", ["study.name is missing", "a plain word"]),
    "name that is a number": ('"press"', "7", ["study.name = 7"]),
    "title that is a list": ('"Press drive"', "[1]", ["study.title = [1]", "a text"]),
    "unknown table": ("[limits]", "[limit]", ["limit: unknown table", "did you mean 'limits'?"]),
    "unknown key": ("title =", "titel =", ["study.titel", "did you mean 'title'?"]),
    "unknown family": ('"rssr"', '"rsrs"', ["mechanism.family = 'rsrs'", "did you mean 'rssr'?"]),
    "family and chain": ('"rssr"', '"rssr"\nchain = ["rssr", "guide"]', ["mechanism.chain", "not both"]),
    "no family": ('family = "rssr"', "", ["mechanism.family is missing", "rssr"]),
    "chain as a family": ('"rssr"', '"rssr+guide"', ['chain = ["rssr", "guide"]']),
    "empty chain": ('family = "rssr"', "chain = []", ["mechanism.chain = []", "a list of names"]),
    "misspelt chain": ('family = "rssr"', 'chian = ["rssr"]', ["mechanism.chian", "did you mean 'chain'?"]),
    "speed without unit": ('"7000 rpm"', "7000", ["scene.speed = 7000", "7000 rpm"]),
    "speed in strokes": ('"7000 rpm"', '"7000 spm"', ["scene.speed = '7000 spm'", "rpm"]),
    "speed misspelt": ('"7000 rpm"', '"7000 rpmm"', ["scene.speed", "did you mean 'rpm'?"]),
    "speed of zero": ('"7000 rpm"', '"0 rpm"', ["scene.speed = '0 rpm'", "non-zero"]),
    "wanted output unknown": ('"swing"', '"swign"', ["scene.want[1] = 'swign'", "did you mean 'swing'?"]),
    "wanted output no text": ('"swing"', "3", ["scene.want[1] = 3", "names of design outputs"]),
    "window over one": ('speed = "7000 rpm"', "window = { from = 0, to = 1.5 }", ["scene.window.to = 1.5", "fraction"]),
    "window upside down": (
        'speed = "7000 rpm"',
        "window = { from = 0.6, to = 0.2 }",
        ["scene.window.to", "from = 0.6"],
    ),
    "window half": ('speed = "7000 rpm"', "window = { from = 0.6 }", ["scene.window.to is missing"]),
    "share without its unit": (
        "[limits]",
        '[tolerance]\nlengths = "0.02 mm"\nrobust = "95"\n[limits]',
        ["tolerance.robust = '95'", '"50 %"'],
    ),
    "want in another table": ('"Press drive"', '"Press drive"\nwant = []', ["study.want", "want is a key of [scene]"]),
    "table in another": ("branch = {", "scene = {}\nbranch = {", ["scene is a table of its own, [scene]"]),
    "number in quotes": ("starts = 10", 'starts = "10"', ["optimise.starts = '10'", "without quotes"]),
    "truth in quotes": ("rotatable = true", 'rotatable = "true"', ["limits.rotatable", "without quotes"]),
    "limit that is false": ("rotatable = true", "rotatable = false", ["to drop this limit, delete the line"]),
    "ends of a limit as of a range": ("{ max = 45", "{ to = 45", ["did you mean 'max'?"]),
    "steps of a range": ("to = 40, count", "to = 40, step", ["did you mean 'count'?"]),
    "family in capitals": ('"rssr"', '"RSRR"', ["mechanism.family = 'RSRR'", "did you mean 'rssr'?"]),
    "parameter unknown": ("e = {", "x = 3\ne = {", ["design.x: unknown parameter of rssr"]),
    "parameter misspelt": ("e = {", "E = {", ["design.E: unknown parameter of rssr", "did you mean 'e'?"]),
    "parameter missing": ('f = "0 mm"\ng = "0 mm"\nalpha = {', 'f = "0 mm"\nalpha = {', ["design.g is missing", "mm"]),
    "bare length": ('b = { value = 4.0, unit = "cm" }', "b = 40.0", ["design.b = 40.0", '"40.0 mm"', "value = 40.0"]),
    "bare angle": (
        'alpha = { from = 0, to = 90, count = 4, unit = "deg" }',
        "alpha = 90",
        ["design.alpha = 90", "90 deg"],
    ),
    "length in degrees": ('a = "10 mm"\nb = {', 'a = "10 deg"\nb = {', ["design.a = '10 deg'", "a length"]),
    "number without unit in a text": ('a = "10 mm"\nb = {', 'a = "10"\nb = {', ["design.a = '10'", "its unit"]),
    "length of zero": ('a = "10 mm"\nb = {', 'a = "0 mm"\nb = {', ["design.a = 0.0", "positive length (crank)"]),
    "negative length in a table": ("value = 4.0", "value = -4.0", ["design.b = -4.0", "positive length (coupler)"]),
    "negative length on an axis": ("from = 20", "from = -20", ["design.c.from = -20.0", "positive length (rocker)"]),
    "nan for a length": ('a = "10 mm"\nb = {', "a = nan\nb = {", ["design.a = nan", 'as "40.0 mm"']),
    "list for a length": (
        'a = "10 mm"\nb = {',
        "a = [1, 2]\nb = {",
        ["design.a = [1, 2]", '{ values = [...], unit = "mm" }'],
    ),
    "decimal comma": (
        'a = "10 mm"\nb = {',
        'a = "10,5 mm"\nb = {',
        ["design.a = '10,5 mm'", "a decimal point, no comma"],
    ),
    "true for a length": ('a = "10 mm"\nb = {', "a = true\nb = {", ["design.a = true", "a length with its unit"]),
    "axis without unit": (A_AXIS, "c = { from = 20, to = 40, count = 5 }", ["design.c.unit is missing", 'unit = "mm"']),
    "axis with unknown unit": (A_AXIS, A_AXIS.replace("mm", "mmm"), ["design.c.unit = 'mmm'", "did you mean 'mm'?"]),
    "axis with unit of an angle": (A_AXIS, A_AXIS.replace("mm", "deg"), ["design.c.unit = 'deg'", "a length"]),
    "axis without count": (A_AXIS, A_AXIS.replace("count = 5, ", ""), ["design.c.count is missing"]),
    "axis with misspelt count": (A_AXIS, A_AXIS.replace("count", "coutn"), ["design.c.coutn", "did you mean 'count'?"]),
    "axis without to": (A_AXIS, A_AXIS.replace("to = 40, ", ""), ["design.c.to is missing"]),
    "many samples": ("[output]", '[tolerance]\nangles = "1 deg"\nsamples = 8388608\n[output]', ["2 to 4194304"]),
    "count of zero": (A_AXIS, A_AXIS.replace("= 5", "= 0"), ["design.c.count = 0", "1 to 1000000"]),
    "count with a fraction": (A_AXIS, A_AXIS.replace("= 5", "= 5.0"), ["design.c.count = 5.0", "whole number"]),
    "count over a million": (A_AXIS, A_AXIS.replace("= 5", "= 1000001"), ["design.c.count = 1000001"]),
    "axis upside down": (A_AXIS, A_AXIS.replace("to = 40", "to = 10"), ["design.c.to = 10.0", "from = 20"]),
    "axis of no length": (A_AXIS, A_AXIS.replace("to = 40", "to = 20"), ["design.c.to = 20.0", "from = 20"]),
    "axis end no number": (A_AXIS, A_AXIS.replace("40", "'40'"), ["design.c.to = '40'", "a finite number"]),
    "axis end infinite": (A_AXIS, A_AXIS.replace("40", "inf"), ["design.c.to = inf", "a finite number"]),
    "axis end nan": (A_AXIS, A_AXIS.replace("40", "nan"), ["design.c.to = nan", "a finite number"]),
    "axis end beyond float64": (
        A_AXIS,
        A_AXIS.replace("40", "1" + "0" * 400),
        ["design.c.to = 1000", "a finite number"],
    ),
    "axis scale unknown": (A_AXIS, A_AXIS.replace("}", ", scale = 'lin' }"), ["design.c.scale = 'lin'", '"linear"']),
    "log scale from zero": (
        "alpha = { from = 0, to = 90, count = 4,",
        "alpha = { from = 0, to = 90, count = 4, scale = 'log',",
        ["design.alpha.from = 0.0", "positive"],
    ),
    "list with a text": ("[35.0, 40.0]", '[35.0, "x"]', ["design.e.values[1] = 'x'", "finite numbers"]),
    "list empty": ("[35.0, 40.0]", "[]", ["design.e.values = []"]),
    "list with a repetition": ("[35.0, 40.0]", "[35.0, 35]", ["design.e.values[1] = 35.0", "every value once"]),
    "list and range": ("[35.0, 40.0]", "[35.0, 40.0], from = 3", ["design.e.from: unknown key", "values, unit"]),
    "branch of two": ("branch = { values = [-1, 1] }", "branch = 2", ["design.branch = 2", "-1 or +1"]),
    "branch of zero in a list": ("values = [-1, 1]", "values = [0, 1]", ["design.branch.values[0] = 0.0", "-1 or +1"]),
    "branch as a range": ("values = [-1, 1]", "from = -1, to = 1, count = 2", ["design.branch", "values = [-1, 1]"]),
    "limit on an unknown output": ("margin = {", "margn = {", ["limits.margn: unknown design output", "'margin'?"]),
    "limit that is no table": ("{ min = 0.1 }", "0.1", ["limits.margin = 0.1", "{ min = ..., max = ... }"]),
    "limit without bound": ("{ min = 0.1 }", "{ }", ["limits.margin.max is missing", "min, max or both"]),
    "limit upside down": ("{ min = 0.1 }", "{ min = 0.1, max = 0 }", ["limits.margin.max = 0.0", "min = 0.1"]),
    "limit with a needless unit": (
        "{ min = 0.1 }",
        '{ min = 0.1, unit = "mm" }',
        ["limits.margin.unit", "pure number"],
    ),
    "limit without unit": ('max = 45, unit = "deg"', "max = 45", ["limits.max_pressure_angle.unit is missing", "deg"]),
    "limit in a wrong unit": ('max = 45, unit = "deg"', 'max = 45, unit = "mm"', ["max_pressure_angle.unit = 'mm'"]),
    "limit with a misspelt bound": ("{ min = 0.1 }", "{ mni = 0.1 }", ["limits.margin.mni", "did you mean 'min'?"]),
    "rotatable false": ("rotatable = true", "rotatable = false", ["limits.rotatable = false", "true"]),
    "objective unknown": ('"max_abs_d2psi"', '"max_abs_d2ps"', ["objective.minimise", "'max_abs_d2psi'?"]),
    "objective missing": ('[objective]\nminimise = "max_abs_d2psi"', "", ["objective is missing", "[optimise]"]),
    "target and samples": ("target = 1e-8", "target = 1e-8\nsamples = 720", ["accuracy.samples = 720", "not both"]),
    "target of zero": ("target = 1e-8", "target = 0", ["accuracy.target = 0", "relative error"]),
    "samples with a fraction": ("target = 1e-8", "samples = 7.5", ["accuracy.samples = 7.5", "whole number"]),
    "too few samples": ("target = 1e-8", "samples = 7", ["accuracy.samples = 7", "8 to 1048576"]),
    "no starts": ("starts = 10", "starts = 0", ["optimise.starts = 0", "whole number"]),
    "negative seed": ("seed = 1", "seed = -1", ["optimise.seed = -1", "0 or greater"]),
    "time budget as a number": ('"60 s"', "60", ["optimise.time_budget = 60", "60 s"]),
    "time budget as a length": ('"60 s"', '"60 mm"', ["optimise.time_budget = '60 mm'", "a time"]),
    "reference parameter missing": ('c = "30 mm"', "", ["reference.design.c is missing", "rocker"]),
    "reference parameter as an axis": (
        'c = "30 mm"',
        'c = { values = [1], unit = "mm" }',
        ["reference.design.c = {", "one value"],
    ),
    "reference parameter unknown": ('c = "30 mm"', 'c = "30 mm"\nk = 1', ["reference.design.k: unknown parameter"]),
    "output path": ('keep = "all"', 'path = "../.."', ["output.path: unknown key", "keep, dtype, curves"]),
    "keep unknown": ('keep = "all"', 'keep = "some"', ["output.keep = 'some'", '"feasible" or "all"']),
    "dtype unknown": ('keep = "all"', 'dtype = "float16"', ["output.dtype = 'float16'", '"float32"']),
    "curves unknown": ('keep = "all"', 'curves = "best"', ["output.curves = 'best'", '"optimum"']),
    "disk in metres": ('"1 GB"', '"1 m"', ["budget.disk = '1 m'", "a size"]),
    "report curve of an unknown axis": (
        "[budget]",
        '[report]\ncurves = [{ label = "x", x = "c", y = "k", points = [[1, 2], [3, 4]] }]\n[budget]',
        ["report.curves[0].y = 'k'", "one of"],
    ),
    "report curve of one point": (
        "[budget]",
        '[report]\ncurves = [{ label = "x", x = "c", y = "e", points = [[1, 2]] }]\n[budget]',
        ["report.curves[0].points = [[1, 2]]", "two or more points"],
    ),
    "report figure in another folder": (
        "[budget]",
        '[report]\nfigures = [{ file = "../atlas.svg", title = "x", caption = "y" }]\n[budget]',
        ["report.figures[0].file = '../atlas.svg'", "ending in .svg"],
    ),
    "report figure without a caption": (
        "[budget]",
        '[report]\nfigures = [{ file = "atlas.svg", title = "x" }]\n[budget]',
        ["report.figures[0].caption", "a text"],
    ),
}


def faults_of(text: str, folder: Path) -> list[str]:
    (folder / "study.toml").write_text(text)
    with pytest.raises(StudyError) as caught:
        load_study(folder)
    assert caught.value.exit_code == 2
    assert str(caught.value).startswith(f"{folder / 'study.toml'}: {len(caught.value.faults)} fault")
    assert all(fault.startswith(f"{folder}/") for fault in caught.value.faults)  # which of several studies it is
    return [fault.removeprefix(f"{folder}/") for fault in caught.value.faults]


def test_the_file_that_all_faults_are_put_into_has_none(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(RIGHT)
    assert load_study(tmp_path).space.count == 5 * 2 * 4 * 2


@pytest.mark.parametrize("name", FAULTS)
def test_one_fault_gives_one_message_with_file_key_value_and_what_is_allowed(name: str, tmp_path: Path) -> None:
    old, new, pieces = FAULTS[name]
    assert RIGHT.count(old) >= 1
    (message,) = faults_of(RIGHT.replace(old, new, 1), tmp_path)
    at = RIGHT.index(old)
    first = RIGHT.count("\n", 0, at) + 1
    heading = RIGHT.count("\n", 0, RIGHT.rfind("\n[", 0, at) + 1) + 1
    if name == "objective missing":  # a table that is missing stands nowhere
        first = number = 0
        assert message.startswith("study.toml: ")
    else:
        number = int(re.match(r"study\.toml:(\d+): ", message)[1])
    assert number == heading or first <= number <= first + new.count("\n")
    assert number == first or "missing" in message or "\n" in new or new == ""
    assert "allowed: " in message or "needed: " in message
    for piece in pieces:
        assert piece in message


def test_ten_faults_give_ten_messages(tmp_path: Path) -> None:
    ten = [
        "name with a capital",
        "unknown key",
        "speed misspelt",
        "wanted output unknown",
        "bare length",
        "axis upside down",
        "list with a repetition",
        "branch of zero in a list",
        "limit on an unknown output",
        "keep unknown",
    ]
    text = RIGHT
    for name in ten:
        text = text.replace(*FAULTS[name][:2], 1)
    messages = faults_of(text, tmp_path)
    assert len(messages) == 10
    for name in ten:
        pieces = FAULTS[name][2]
        assert any(all(piece in message for piece in pieces) for message in messages), name


def test_several_faults_in_one_axis_are_told_at_once(tmp_path: Path) -> None:
    axis = "c = { from = -20, to = -40, count = 0, unit = 'deg', scale = 'lin', by = 3 }"
    messages = faults_of(RIGHT.replace(A_AXIS, axis), tmp_path)
    keys = [message.split()[1].rstrip(":") for message in messages]
    assert sorted(keys) == [f"design.c.{key}" for key in ("by", "count", "from", "scale", "to", "unit")]


def test_a_misspelt_family_does_not_hide_the_other_faults(tmp_path: Path) -> None:
    messages = faults_of(RIGHT.replace('"rssr"', '"rsrs"').replace("count = 5", "count = 0"), tmp_path)
    assert [message.split()[1] for message in messages] == ["mechanism.family", "design.c.count"]


@pytest.mark.parametrize(
    "table", ["study", "mechanism", "scene", "design", "limits", "accuracy", "output", "reference"]
)
def test_a_table_that_is_a_number(table: str, tmp_path: Path) -> None:
    blocks = [block for block in RIGHT.split("\n[") if not block.startswith((f"{table}]", f"{table}."))]
    messages = faults_of(f"{table} = 3\n" + "\n[".join(blocks), tmp_path)
    assert any(message.startswith(f"study.toml:1: {table} = 3; allowed: a table") for message in messages)


@pytest.mark.parametrize("table", ["study", "mechanism", "design"])
def test_a_table_that_must_be_there(table: str, tmp_path: Path) -> None:
    blocks = [block for block in RIGHT.split("\n[") if not block.startswith(f"{table}]")]
    assert f"study.toml: {table} is missing; needed: a table [{table}]" in faults_of("\n[".join(blocks), tmp_path)


def test_an_optimiser_needs_something_to_vary(tmp_path: Path) -> None:
    axes = {A_AXIS: 'c = "20 mm"', "[35.0, 40.0]": "[35.0]", "from = 0, to = 90, count = 4": "value = 0"}
    text = RIGHT
    for axis, fixed in axes.items():
        text = text.replace(axis, fixed)
    (message,) = faults_of(text, tmp_path)  # the branch, which takes two values, does not change steadily
    assert "optimise = 'no swept parameter'" in message
    # Nor do listed values: they are a catalogue, which the sweep tries from end to end.
    assert "optimise = 'no swept parameter'" in faults_of(text.replace("[35.0]", "[35.0, 36.0]"), tmp_path)[0]
    (tmp_path / "study.toml").write_text(text.replace("values = [35.0]", "from = 35.0, to = 36.0, count = 2"))
    assert load_study(tmp_path).space.count == 4


def test_too_many_designs(tmp_path: Path) -> None:
    text = RIGHT.replace("count = 5", "count = 1000000").replace("count = 4", "count = 1000000")
    (message,) = faults_of(text, tmp_path)
    assert "design = 4000000000000; allowed: at most 1e+12 designs" in message
