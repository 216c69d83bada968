"""A study that takes dimensions from another one: the same numbers, what is written wins, faults name their place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import sweep
from sweep.errors import StudyError
from sweep.study import load_study, study_from_data
from sweep.study.design import fingerprint
from tests.support.studies import beside_needle208

STUDIES = Path(sweep.__file__).parents[1] / "studies"
NEEDLE = json.loads((STUDIES / "needle208" / "expected.json").read_text())["optimum"]["design"]
ALONE = """
[study]
name = "near"
[mechanism]
chain = ["rssr", "guide"]
[scene]
want = ["stroke"]
[design]
from = "needle208"
a1 = "11.5 mm"
{more}
"""


def near(folder, text=ALONE, more="", accepted=NEEDLE):
    for name in ("near", "needle208"):
        (folder / name).mkdir()
    (folder / "near" / "study.toml").write_text(text.replace("{more}", more))
    (folder / "needle208" / "expected.json").write_text(json.dumps({"optimum": {"design": accepted}}))
    return load_study(folder / "near")


def test_dimensions_are_those_of_the_other_study_to_the_bit_and_what_is_written_wins(tmp_path):
    study = near(tmp_path)
    assert dict(study.space.fixed) == NEEDLE | {"a1": 11.5}
    assert study.data["study"]["taken"] == [f"design: needle208 {fingerprint(NEEDLE)}"]


def test_what_a_dataset_keeps_needs_the_other_study_no_more(tmp_path):
    study = near(tmp_path)
    (tmp_path / "needle208" / "expected.json").unlink()
    again = study_from_data(study.data, study.path)
    assert again.space.fixed == study.space.fixed and again.data == study.data


def test_members_and_the_reference_of_a_machine_take_theirs(tmp_path):
    study = beside_needle208("takeup", tmp_path)
    own = {name.removeprefix("needle."): x for name, x in study.reference.items() if name.startswith("needle.")}
    assert own.items() >= NEEDLE.items()
    assert {name.removeprefix("needle."): x for name, x in study.space.fixed.items()}.items() >= NEEDLE.items()


def test_a_hash_that_is_not_the_accepted_one_is_refused_with_the_one_that_is(tmp_path):
    with pytest.raises(StudyError, match=f"""design.hash = '123'; allowed: "{fingerprint(NEEDLE)}\""""):
        near(tmp_path, more='hash = "123"')


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("needle209", "needle209/expected.json; .*did you mean 'needle208'"),
        ("../needle208", "beside this one"),
        ("", "beside this one"),
    ],
)
def test_a_study_that_is_not_there_is_named(tmp_path, source, words):
    with pytest.raises(StudyError, match=rf"1 fault\n.*design.from = .*{words}"):
        near(tmp_path, ALONE.replace("needle208", source))


def test_a_design_of_another_mechanism_is_refused(tmp_path):
    with pytest.raises(StudyError, match=r"design.from = 'k9'; allowed: a study of the same mechanism"):
        near(tmp_path, accepted=NEEDLE | {"k9": 1.0})


def test_the_hash_is_that_of_the_values():
    assert fingerprint(NEEDLE) == fingerprint(dict(reversed(NEEDLE.items())))
    assert fingerprint(NEEDLE) != fingerprint(NEEDLE | {"a1": 12.000000000000002})
