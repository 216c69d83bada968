"""Lines of keys: every key of every study has the line it stands in, whatever way TOML lets it be written."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.errors import StudyError
from sweep.study import load_study
from sweep.study.task import load_task
from sweep.study.toml import key_lines

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "studies").glob("*/*.toml"))

HARD = '''
# [none] x = 1
title = "a # b [c] = d"  # [e]
path = 'C:\\x'
[a]
b.c = """
[no]
x = 1 \\""" still
"""
"q.r" = [
  1, # [one]
  { s = 2, t = [3,

         4] },
  "]",
]
[a."d e".f]
when = 1979-05-27T07:32:00Z
  [[a.list]]
  x = 1
  [a.list.inner]
  y = \'\'\'
  it''s\'\'\'
  [[a.list]]
  x = 2
  [[a.list.deep]]
  z = { u = {}, v = [] }
[limits]
"clearance(needle.point, looper.tip).least" = { min = 0.05 }
'''


def paths(data, path=""):
    """Every key and every item of a list, spelled as messages spell them."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        here = f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}" if path else key
        yield here, value
        if isinstance(value, (dict, list)):
            yield from paths(value, here)


def test_hard_ways_to_write_keys_have_their_lines():
    found = key_lines(HARD)
    assert set(found) == {path for path, _ in paths(tomllib.loads(HARD))}
    lines = HARD.splitlines()
    for path, number in {
        "title": 3, "a": 5, "a.b": 6, "a.b.c": 6, "a.q.r": 10, "a.q.r[0]": 11, "a.q.r[1].s": 12, "a.q.r[1].t": 12,
        "a.q.r[1].t[1]": 14, "a.q.r[2]": 15, "a.d e.f.when": 18, "a.list[0].x": 20, "a.list[0].inner.y": 22,
        "a.list[1].x": 25, "a.list[1].deep[0].z.u": 27,
    }.items():  # fmt: skip
        assert found[path] == number, path
    assert lines[found["limits.clearance(needle.point, looper.tip).least"] - 1].startswith('"clearance')


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_every_key_of_a_study_stands_in_its_line(file):
    text = file.read_text(encoding="utf-8")
    found, lines = key_lines(text), text.splitlines()
    known = dict(paths(tomllib.loads(text)))
    assert set(found) == set(known)
    for path, number in found.items():
        if not path.endswith("]"):
            assert path.rsplit(".", 1)[-1].strip('"') in lines[number - 1], path


words = st.text("abxyz_-", min_size=1, max_size=4)
plain = st.one_of(st.integers(-99, 99), st.booleans(), st.text("ab[]{}#=,'. ", max_size=6))
values = st.recursive(
    plain,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(words, inner, max_size=3)),
    max_leaves=8,
)


def written(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "[" + ",\n # [x]\n".join(map(written, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {written(inner)}" for key, inner in value.items()) + "}"
    return str(value)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(words, st.dictionaries(words, values, max_size=4), max_size=4))
def test_any_nesting_has_each_key_once_and_in_order(data):
    text = "\n".join(f"[{table}]\n" + "".join(f"{key} = {written(value)}\n" for key, value in entries.items())
                     for table, entries in data.items())  # fmt: skip
    try:
        read = tomllib.loads(text)
    except tomllib.TOMLDecodeError:  # lines within an inline table, which TOML 1.0 has not
        return
    found = key_lines(text)
    spelled = [path for path, _ in paths(read)]
    assert list(found) == spelled
    assert [found[path] for path in spelled] == sorted(found.values())


def test_faults_name_file_and_line_and_a_missing_key_that_of_its_table(tmp_path):
    (tmp_path / "study.toml").write_text(
        '[study]\nname = "x"\n\n[mechanism]\nfamily = "slider_crank"\n[scene]\nwant = ["stroke",\n  "strike"]\n\n'
        "[design]\nb = 40.0\n"
    )
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path)
    faults = sorted(caught.value.faults)
    assert [fault.split(": ")[0] for fault in faults] == [f"{tmp_path}/study.toml:{line}" for line in (10, 11, 8)]
    assert faults[0].startswith(f"{tmp_path}/study.toml:10: design.a is missing")


def test_faults_of_a_member_name_the_line_in_its_table(tmp_path):
    (tmp_path / "study.toml").write_text(
        '[study]\nname = "x"\n[machine.needle]\nfamily = "slider_crank"\n[scene]\nwant = ["needle.stroke"]\n'
        '[design.needle]\na = "10 mm"\nb = "x"\ne = "0 mm"\n[design]\n"needle.offset" = 3\n'
    )
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path)
    assert {fault.split(" = ")[0] for fault in caught.value.faults} == {
        f"{tmp_path}/study.toml:9: design.needle.b",
        f"{tmp_path}/study.toml:12: design.needle.offset",
    }


def test_faults_of_a_task_name_the_line(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text('[task]\nkind = "engineering"\n\nswing = 45\n')
    with pytest.raises(StudyError, match=r"task\.toml:4: task\.swing"):
        load_task(file)
