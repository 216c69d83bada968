"""Faults of tools, relations and threads of a stitch name the key of the file, what stands there and what may."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import sweep
from sweep.errors import InputError, StudyError
from sweep.study import study_from_data

STUDY = Path(__file__).parents[2] / "studies" / "overlock208" / "study.toml"
LEVEL = 'what it passes, in its unit, as "1 mm"; 0 if left out'


@pytest.mark.parametrize(
    ("place", "value", "line"),
    [
        ("relations.cast.level", {}, f"relations.cast.level = {{}}; allowed: {LEVEL}"),
        ("relations.cast.level", [1], f"relations.cast.level = [1]; allowed: {LEVEL}"),
        ("relations.a.take", ["thin", "lo"], "relations.a.take = 'lo'; allowed: tools: thin, low"),
        (
            "relations.foot.press",
            "needle2",
            "relations.foot.press = 'needle2'; allowed: a member of the family feed: feed",
        ),
        ("relations.apart.gap", ["low", "hig"], "relations.apart.gap = 'hig'; allowed: bodies: thin, low"),
        (
            "relations.a.fields",
            {"x": ["-1 mm", "2 mm"]},
            "relations.a.fields = {'x': ['-1 mm', '2 mm']}; allowed: a length",
        ),
        ("relations.a.fields", {}, "relations.a.fields = {}; allowed: at least one field with the least and the most"),
        ("relations.b.settings", "juki-mo-104d", "relations.b.settings = 'juki-mo-104d'; allowed: nothing here"),
        (
            "relations.sews.speeds",
            ["-5 rpm", "4 rpm"],
            "relations.sews.speeds = ['-5 rpm', '4 rpm']; allowed: a speed that",
        ),
        ("tools.low.eye", "-5 mm", "tools.low.eye = '-5 mm'; allowed: three finite numbers [x, y, z]"),
        ("tools.thin.diameter", "-5 mm", "tools.thin.diameter = '-5 mm'; allowed: a length that is not negative"),
        ("tools.thin.scarf", [0, 0, 0], "tools.thin.scarf = [0, 0, 0]; allowed: a direction"),
        ("thread.top.tension", "-5 gf", "thread.top.tension = '-5 gf'; allowed: a force that is not negative"),
        ("thread.top.feeding", ["a", "x"], "thread.top.feeding = ['a', 'x']; allowed: events and moments: a, b, c"),
        ("thread.top.feeding", ["a", "a"], "thread.top.feeding = ['a', 'a']; allowed: two events or moments"),
        ("thread.top.allowed.unit", "", "thread.top.allowed.unit = ''; allowed: a length, in mm"),
    ],
)
def test_a_fault_names_its_key_its_value_and_what_is_allowed(place, value, line):
    data = tomllib.loads(STUDY.read_text())
    *tables, key = place.split(".")
    table = data
    for name in tables:
        table = table[name]
    table[key] = value
    with pytest.raises(StudyError) as error:
        study_from_data(data, STUDY)
    (fault,) = error.value.faults
    assert fault.partition(": ")[2].startswith(line)


@pytest.mark.parametrize(
    ("relation", "allowed"),
    [
        ({"take": ["thin", "blade"]}, "tools: this machine has none"),
        ({"press": "feed"}, "a member of the family feed: this machine has none"),
        ({"gap": 5}, "two bodies"),
        ({"above": 5}, "two tools and points"),
        ({"take": ["needle", 5]}, "tools: this machine has none"),
        ({"enter": 5}, "a list of tools"),
        (
            {"thread": 5},
            "points and take-ups in order, two points at least in a row; each row begins and ends with a point over "
            "which it always runs, as between blades",
        ),
        ({"enter": []}, "three tools: what passes, a blade, the seam"),
        ({"gap": ["needle.rocker", "looper.rocker"], "radii": 0.1}, "the radius of each body"),
        ({"gap": ["needle.rocker", "looper.rocker"], "radii": [0.1, 0.2, 0.3]}, "the radius of each body"),
    ],
)
def test_what_a_relation_is_about_may_be_missing_from_the_machine(relation, allowed):
    with pytest.raises(InputError) as error:
        sweep.machine({"needle": "guide", "looper": "rssr"}, {"one": relation})
    assert str(error.value).endswith(f"; allowed: {allowed}")
