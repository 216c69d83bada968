"""The first minutes: a study for every family that runs as it is, the schema of study files, completion, types."""

from __future__ import annotations

import errno
import json
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.cli.families import family_names, main_outputs
from sweep.cli.first_study import start_of
from sweep.cli.init import schema_text
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.names import parts
from sweep.study import load_study
from sweep.study.schema import study_schema
from sweep.study.tables import TABLES
from tests.support.selection import mostly_long

ROOT = Path(__file__).parents[2]
CHAINS = ("rssr+guide", "rssr+rssr")
STUDIES = sorted((ROOT / "studies").glob("*/study.toml"))
CHECKER = jsonschema.Draft7Validator(study_schema())


def call(*arguments: object):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def written(folder: Path, family: str) -> Path:
    done = call("init", "first", "--family", family, "--into", folder)
    assert done.exit_code == 0, done.output
    return folder / "first"


QUICK = ("rssr", "guide", "geared_dwell", "cam", "backrest", "feed_foot", "swivel", "rssr+guide")


@pytest.mark.parametrize("family", mostly_long([*NAMES, *CHAINS], QUICK))
def test_first_study_of_every_family_is_sound_and_runs(family, tmp_path):
    folder = written(tmp_path, family)
    text = (folder / "study.toml").read_text(encoding="utf-8")
    assert text.startswith("#:schema study.schema.json\n")
    assert not list(CHECKER.iter_errors(tomllib.loads(text)))
    study = load_study(folder)
    assert study.space.count == 25 and study.objective is not None
    assert load_study(folder, smoke=True).space.count == 4
    # Every parameter of the design stands in the file, at least as a comment, with its meaning.
    for parameter in study.bare.parameters:
        (line,) = [x for x in text.splitlines() if x.removeprefix("# ").startswith(f"{parameter.name} = ")]
        assert parameter.text in line
    done = call("run", folder, "--smoke", "--jobs", 1, "--out", tmp_path / "out" / "designs")
    assert done.exit_code == 0, done.output
    rows = sweep.load(tmp_path / "out" / "designs")
    assert len(rows) >= 1 and rows[study.objective.output].notna().all()


@pytest.mark.parametrize("family", [*NAMES, *CHAINS])
def test_first_study_has_sizes_of_a_machine(family, tmp_path):
    """The tolerance that the file proposes, 0.02 mm, is a small part of every length that is swept."""
    study = load_study(written(tmp_path, family))
    lengths = {p.name for p in study.bare.parameters if p.unit == "length"}
    sizes = [abs(x) for name, x in study.space.fixed.items() if name in lengths]
    swept = [axis for axis in study.space.axes if axis.name in lengths]
    in_si = any(p.unit in ("force", "mass") for p in study.bare.parameters)
    if lengths and not in_si:  # those with forces are of a size that their forces ask for
        assert max([*sizes, *(axis.high for axis in swept)]) >= 20.0
        assert all(min(abs(axis.low), abs(axis.high)) > 50 * 0.02 for axis in swept)


TRANSMITTING = (
    "rssr", "rssp", "guide", "five_link", "kim_dison", "slotted", "spherical_looper", "cylindrical_looper",
    "slider_crank", "four_bar", "inverted_slider_crank", "heddle", "rssr+guide", "rssr+rssp",
)  # fmt: skip


@pytest.mark.parametrize("family", mostly_long(TRANSMITTING, ("rssr", "guide", "spherical_looper", "rssr+guide")))
def test_first_study_begins_with_a_mechanism_that_turns_moves_and_transmits_well(family):
    mechanism = find_family(family_names(family))
    offered = main_outputs(mechanism)
    angles = [name for name in offered if parts(name).stem == "max_pressure_angle"]
    size = "swing" if "swing" in offered else "stroke"
    found = sweep.summarise(
        family_names(family), start_of(mechanism), [*angles, size, "rotatable"], accuracy=1e-6
    ).iloc[0]
    assert found["rotatable"] and found[angles].max() < math.radians(45.0)
    assert abs(found[size]) > (math.radians(20.0) if size == "swing" else 10.0)


def test_first_study_of_a_feed_on_three_leads_has_room_on_either_side(tmp_path):
    """Ten of its 25 designs jammed."""
    study = load_study(written(tmp_path, "feed_triad"))
    ends = [axis.values[[0, 0, -1, -1] if k else [0, -1, 0, -1]] for k, axis in enumerate(study.space.axes)]
    table = dict(study.space.fixed) | {axis.name: end for axis, end in zip(study.space.axes, ends, strict=True)}
    assert (sweep.summarise("feed_triad", table, ["stroke"], accuracy=1e-6)["status"] == 0).all()


@pytest.mark.parametrize("family", ["foot", "feed_foot"])
def test_first_study_of_a_presser_foot_is_of_its_size_and_asks_for_soft_impacts(family, tmp_path):
    study = load_study(written(tmp_path, family))
    lengths = {p.name for p in study.bare.parameters if p.unit == "length"}
    assert max(axis.high for axis in study.space.axes if axis.name in lengths) < 100.0
    assert max(abs(x) for name, x in study.space.fixed.items() if name in lengths) < 100.0
    assert study.objective.output == "impact_speed"


@pytest.mark.parametrize("family", [*NAMES, *CHAINS])
def test_first_study_makes_small_what_a_designer_would(family, tmp_path):
    """A stroke is what a mechanism is for: made small, the best design does not move."""
    study = load_study(written(tmp_path, family))
    assert parts(study.objective.output).stem not in ("stroke", "swing", "size")


@pytest.mark.parametrize("members", mostly_long([
    ("needle=rssr+guide", "looper=rssr"),
    ("cam=cam", "bar=slider_crank"),
    ("feed=feed", "takeup=eyelet", "dwell=geared_dwell"),
], [("needle=rssr+guide", "looper=rssr")]))  # fmt: skip
def test_first_study_of_a_machine_is_sound_and_runs(members, tmp_path):
    options = [x for member in members for x in ("--member", member)]
    done = call("init", "first", *options, "--into", tmp_path)
    assert done.exit_code == 0, done.output
    folder = tmp_path / "first"
    text = (folder / "study.toml").read_text(encoding="utf-8")
    assert not list(CHECKER.iter_errors(tomllib.loads(text)))
    study = load_study(folder)
    assert study.space.count == 25 and study.objective is not None
    assert load_study(folder, smoke=True).space.count == 4
    assert len(study.family.members) == len(members)
    assert sum(line.startswith("lag_") for line in text.splitlines()) == len(members) - 1
    done = call("run", folder, "--smoke", "--jobs", 1, "--out", tmp_path / "out" / "designs")
    assert done.exit_code == 0, done.output
    rows = sweep.load(tmp_path / "out" / "designs")
    assert len(rows) >= 1 and rows[study.objective.output].notna().all()
    for line in ("offset = ", "ratio = "):
        text = text.replace(f"# {line}", line, 1)
    (folder / "study.toml").write_text(text)
    load_study(folder)


@pytest.mark.parametrize("options", [
    (), ("--member", "a=rssr"), ("--member", "rssr"), ("--member", "a=rssr", "--member", "a=rssp"),
    ("--family", "rssr", "--member", "a=rssr", "--member", "b=rssp"), ("--member", "a=rssr", "--member", "b=backrest"),
    ("--member", "a=rssr", "--member", "b=rsrs"), ("--member", "a.b=rssr", "--member", "b=rssp"),
])  # fmt: skip
def test_init_says_what_a_machine_needs(options, tmp_path):
    done = call("init", "first", *options, "--into", tmp_path)
    assert done.exit_code == 2 and not (tmp_path / "first").exists()
    assert "Traceback" not in done.output
    assert ("allowed" if options else "--family is missing; needed") in done.output


def test_tables_left_as_comments_are_sound_too(tmp_path):
    folder = written(tmp_path, "rssr")
    text = (folder / "study.toml").read_text(encoding="utf-8")
    for line in ("speed = ", "max_pressure_angle = ", "[optimise]", "starts = ", "[tolerance]", "lengths = "):
        assert text.count(f"# {line}") == 1
        text = text.replace(f"# {line}", line)
    (folder / "study.toml").write_text(text)
    study = load_study(folder)
    assert study.optimise.starts == 12 and study.tolerance.lengths == 0.02 and study.speed > 300.0


@pytest.mark.parametrize("family", ["slider_crank", "backrest", "foot", "free_cam_friction", "rssr+guide"])
def test_check_takes_a_first_study_over_every_domain(family, tmp_path):
    done = call("check", written(tmp_path, family))
    assert done.exit_code == 0 and "25 designs" in done.output


def test_check_takes_a_first_study_of_a_machine(tmp_path):
    call("init", "first", "--member", "needle=rssr+guide", "--member", "looper=rssr", "--into", tmp_path)
    done = call("check", tmp_path / "first")
    assert done.exit_code == 0 and "25 designs" in done.output


def test_run_without_limits_says_why_no_design_is_left(tmp_path):
    folder = written(tmp_path, "geared_dwell")
    file = folder / "study.toml"
    file.write_text(file.read_text().replace("want = [", 'want = ["swing", '))  # it turns on and on
    done = call("run", folder, "--smoke", "--jobs", 1, "--out", tmp_path / "out" / "designs")
    assert done.exit_code == 4
    assert "no design has all that is wanted; 4 of 4: " in done.output


def test_init_refuses_what_it_cannot_write(tmp_path):
    written(tmp_path, "rssr")
    assert call("init", "first", "--family", "rssr", "--into", tmp_path).exit_code == 2  # it is there already
    assert call("init", "My Study", "--family", "rssr", "--into", tmp_path).exit_code == 2
    wrong = call("init", "second", "--family", "rsrs", "--into", tmp_path)
    assert wrong.exit_code == 2 and "did you mean 'rssr'" in wrong.output
    assert not (tmp_path / "second").exists()


def test_init_on_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    """A folder with half of the schema was left, so that the name was taken."""

    def full(path, text, encoding):
        path.write_bytes(text[:9].encode())
        if path.name == "study.schema.json":
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    result = CliRunner().invoke(main, ["init", "press", "--family", "rssr", "--into", str(tmp_path)])
    assert result.exit_code == 74 and "No space left on device" in result.output
    assert list(tmp_path.iterdir()) == []


def test_init_in_a_project_names_the_schema_that_all_its_studies_share(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "study.schema.json").write_text("{}")
    (tmp_path / "studies").mkdir()
    folder = written(tmp_path / "studies", "cam")
    assert (folder / "study.toml").read_text().startswith("#:schema ../../docs/study.schema.json\n")
    assert sorted(file.name for file in folder.iterdir()) == ["smoke.toml", "study.toml"]


def test_schema_in_docs_is_current():
    kept = (ROOT / "docs" / "study.schema.json").read_text(encoding="utf-8")
    assert kept == schema_text(), "make docs"
    assert json.loads(kept) == study_schema()
    done = call("schema")
    assert done.exit_code == 0 and done.output == kept
    jsonschema.Draft7Validator.check_schema(study_schema())


def test_schema_has_every_table_and_every_key_of_its_model():
    assert tuple(study_schema()["properties"]) == tuple(TABLES)
    assert all(table.about[0].isupper() and table.about.endswith(".") for table in TABLES.values())
    found = {name: table.model for name, table in TABLES.items() if table.model is not None}
    assert {"study", "mechanism", "scene", "accuracy", "optimise", "pareto", "report"} <= set(found) <= set(TABLES)
    for name, model in found.items():
        keys = {field.alias or key for key, field in model.model_fields.items()}
        assert set(study_schema()["properties"][name]["properties"]) == keys


@pytest.mark.parametrize("file", STUDIES, ids=lambda file: file.parent.name)
def test_studies_keep_the_schema(file):
    assert not [error.message for error in CHECKER.iter_errors(tomllib.loads(file.read_text(encoding="utf-8")))]


@pytest.mark.parametrize("old, new", [
    ('family = "rssr"', 'family = "rsrs"'),
    ("target = 1e-8", "target = 2"),
    ("minimise = ", "minimize = "),
    ("\nc = ", "\nd = "),
    ("[limits]", "[limit]"),
    ('name = "first"', ""),
    ("[objective]\n", "[objective]\nx = 1\n"),
    ("count = 5", "count = 0"),
    ('c = "26 mm"', "c = [32]"),
])  # fmt: skip
def test_schema_refuses_what_the_reader_refuses(old, new, tmp_path):
    folder = written(tmp_path, "rssr")
    text = (folder / "study.toml").read_text(encoding="utf-8")
    assert old in text
    text = text.replace(old, new, 1)
    assert list(CHECKER.iter_errors(tomllib.loads(text)))
    (folder / "study.toml").write_text(text)
    with pytest.raises(sweep.StudyError):
        load_study(folder)


@pytest.mark.parametrize("arguments, incomplete, found", [
    ([], "su", ["summarise"]),
    (["eval"], "rssr", ["rssr"]),
    (["summarise"], "rssr+gui", ["rssr+guide", "rssr+guided_cam"]),
    (["init", "x", "--family"], "slo", ["slotted"]),
    (["families"], "swi", ["swivel"]),
    (["effects"], "kineto", ["kinetostatics"]),
    (["eval", "rssr", "table.csv", "--want"], "psi,dps", ["psi,dpsi"]),
    (["summarise", "rssr", "--want"], "swi", ["swing"]),
    (["eval", "rsrs", "--want"], "psi", []),
    (["eval", "rssr", "--angles"], "", ["rad", "deg"]),
    (["draw"], "ma", ["map"]),
])  # fmt: skip
def test_shell_completes_verbs_families_effects_and_outputs(arguments, incomplete, found):
    complete = ShellComplete(main, {}, "sweep", "_SWEEP_COMPLETE")
    assert [item.value for item in complete.get_completions(arguments, incomplete)] == found


def test_completion_as_the_page_says_it():
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    for shell in ("bash", "zsh", "fish"):
        assert f"_SWEEP_COMPLETE={shell}_source sweep" in page
    environment = os.environ | {"_SWEEP_COMPLETE": "bash_complete", "COMP_WORDS": "sweep eval rss", "COMP_CWORD": "2"}
    command = [sys.executable, "-c", "from sweep.cli import main; main(prog_name='sweep')"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.split() == ["plain,rssr", "plain,rssp"], done.stderr


def test_types_are_shipped():
    package_data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    for package in ("sweep", "kernels"):
        assert "py.typed" in package_data[package] and (ROOT / package / "py.typed").is_file()


@pytest.mark.long  # mypy reads the whole package, without a cache
def test_a_consumer_is_checked_by_the_types(tmp_path):
    consumer = tmp_path / "consumer.py"
    consumer.write_text(
        "import sweep\n"
        'found = sweep.evaluate("rssr", {"a": 1.0}, "psi", phi=0.0, angles="deg")\n'
        "reveal_type(found)\n"
        'sweep.evaluate("rssr", {"a": 1.0}, 3)\n'
        'sweep.evaluate("rssr", {"a": 1.0}, "psi", angles="grad")\n'
    )
    # Away from the project, so that its own settings do not speak for the consumer.
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--cache-dir", str(tmp_path), str(consumer)]
    environment = os.environ | {"MYPYPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    said = [line for line in done.stdout.splitlines() if line.startswith("consumer.py")]
    assert "DataFrame" in said[0], done.stdout + done.stderr
    assert ["arg-type" in line for line in said[1:]] == [True, True], done.stdout
