"""A study of a machine written as studies of its members, each with those before it fixed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import sweep
from sweep.cli.main import main
from sweep.study.load import load_study

FOLDER = Path(sweep.__file__).parents[1] / "studies" / "overlock208"
ORDER = ("needle", "lower", "upper", "feed")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    into = tmp_path_factory.mktemp("members")
    found = CliRunner().invoke(main, ["init", "head", "--from-cyclogram", str(FOLDER), "--into", str(into)])
    assert found.exit_code == 0, found.output
    return into


def test_members_come_in_the_order_of_design_each_on_the_accepted_ones_before(written):
    names = [f"head-{member}" for member in ORDER]
    assert {path.name for path in written.iterdir()} >= set(names)
    accepted = json.loads((FOLDER / "expected.json").read_text())["optimum"]["design"]
    asked = set()
    for k, name in enumerate(names):
        study = load_study(written / name)  # the folder before has its accepted optimum by now
        assert {m.name for m in study.bare.members} == set(ORDER[: k + 1])
        own = {p: accepted[p] for p in study.bare.parameter_names if p in accepted}
        (written / name / "expected.json").write_text(json.dumps({"optimum": {"design": own}}))
        if k:
            assert study.data["study"]["taken"][0].startswith(f"design: {names[k - 1]} ")
        limits = {limit.output for limit in study.limits}
        assert not limits & asked
        asked |= limits
    assert {"phi_a", "phi_b", "phi_c", "a_rise", "b_margin", "min_apart", "lower.rotatable"} <= asked


def test_lower_looper_alone_has_the_moment_a_and_the_objective_of_the_study(written):
    data = load_study(written / "head-lower").data
    assert data["objective"] == {"minimise": "lower.max_abs_d2psi"} and list(data["cyclogram"]) == ["a"]
    assert {"a", "pierces"} <= set(data["relations"]) and not {"b", "c", "feeds"} & set(data["relations"])


def test_study_without_a_cyclogram_is_refused(tmp_path):
    found = CliRunner().invoke(
        main, ["init", "x", "--from-cyclogram", str(FOLDER.parent / "head208"), "--into", str(tmp_path)]
    )
    assert found.exit_code == 2 and "[cyclogram]" in found.output
    assert list(tmp_path.iterdir()) == []
