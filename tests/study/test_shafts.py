"""Shafts in a study file: read with their units, and every fault named where it stands."""

from __future__ import annotations

import math

import pytest

import sweep
from sweep.errors import StudyError
from sweep.study.load import load_study

TEXT = """
[study]
name = "turning"

[shafts]
main = { at = ["1 mm", "2 mm", "3 mm"], axis = [0, 1, 0], zero = [1, 0, 0] }
upper = { ratio = -2, phase = "30 deg" }

[machine.left]
family = "rssr"
shaft = "main"
shift = "1.2 cm"
key = "15 deg"

[machine.right]
family = "four_bar"
shaft = "upper"
sense = -1
turn = "90 deg"

[design.left]
a = "1 mm"
b = "4.1 mm"
c = "3.2 mm"
e = "2.9 mm"
f = "0.6 mm"
g = "-0.4 mm"
alpha = "40 deg"
key = { from = 0, to = 90, count = 3, unit = "deg" }

[design.right]
a = "1 mm"
b = "3 mm"
c = "3 mm"
e = "3 mm"

[scene]
want = ["left.swing"]
"""


def loaded(tmp_path, text):
    (tmp_path / "study.toml").write_text(text)
    return load_study(tmp_path)


def test_a_shaft_that_is_missing_is_said_to_be(tmp_path):
    words = r"machine\.right\.shaft is missing; needed: the shaft that drives it: main, upper"
    with pytest.raises(StudyError, match=words):
        loaded(tmp_path, TEXT.replace('shaft = "upper"\nsense = -1\nturn = "90 deg"\n', ""))


@pytest.mark.parametrize("table", ["design", "limits", "bodies", "reference.design"])
def test_a_table_of_a_misspelt_member_is_one_fault(tmp_path, table):
    """Its entries were told as missing ones of the member, and the table as a parameter."""
    text = TEXT.replace("[scene]", f'[{table}.rihgt]\na = "1 mm"\n[scene]')
    with pytest.raises(StudyError, match=rf"{table}\.rihgt: unknown member.*did you mean 'right'") as caught:
        loaded(tmp_path, text)
    assert len(caught.value.faults) == 1


def test_a_relation_of_two_kinds_is_told_both(tmp_path):
    near = '[relations]\nnear = { distance = ["left.c", "right.c"], speed = ["left.c"] }\n'
    with pytest.raises(StudyError, match="one kind of relation, not distance and speed"):
        loaded(tmp_path, near + TEXT)


def test_shafts_of_a_file_are_read_with_their_units(tmp_path):
    left, right = loaded(tmp_path, TEXT).bare.members
    assert left.mount.shaft.at == (1.0, 2.0, 3.0)
    assert (left.mount.shift, right.ratio) == (12.0, 2)
    assert left.mount.key == pytest.approx(math.radians(15.0))
    assert right.mount.shaft.phase == pytest.approx(math.radians(30.0))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('shaft = "upper"', 'shaft = "uper"', r"machine\.right\.shaft.*did you mean 'upper'"),
        ("ratio = -2", "ratios = -2", r"shafts\.upper\.ratios"),
        ("sense = -1", "sense = 2", r"machine\.right\.sense.*1 or -1"),
        ('key = "15 deg"', 'offset = "15 deg"', r"machine\.left\.offset.*nothing beside shaft"),
        ("axis = [0, 1, 0]", "axis = [1, 0, 0]", r"shafts\.main.*not along axis"),
    ],
)
def test_a_fault_of_a_shaft_is_named_where_it_stands(tmp_path, old, new, message):
    assert old in TEXT
    with pytest.raises(sweep.StudyError, match=message):
        loaded(tmp_path, TEXT.replace(old, new, 1))
