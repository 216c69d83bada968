"""Tasks of the engineering method from a file: the same answer as from Python, and every fault named at once."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from sweep.cli import main
from sweep.errors import StudyError
from sweep.study.task import KINDS, load_task
from sweep.synthesis.tasks import EngineeringMethod, Position, Setting, SlotPosition, Task1, Task6, solve

PAGE = Path(__file__).parents[2] / "docs" / "tasks.md"
LENGTHS = 'a = "10 mm", b = "35 mm", c = "25 mm", e = "30 mm", f = "0 mm", g = "0 mm"'
DRIVE = f'drive = {{ {LENGTHS}, alpha = "0 deg", branch = 1 }}\n'
GIVEN = 'swing = "46 deg"\nphi0 = "183 deg"\ne = "10 mm"\n'
AXES = 'g = "10 mm"\nalpha = "75 deg"\n'
F = 'f_range = { from = -3, to = 3, unit = "cm" }\n'
FILES = {
    "engineering": GIVEN + AXES + F + 'objective = "pressure_angle"',
    "task1": GIVEN + AXES + 'positions = [{ dphi = "1 rad", dpsi = "0.25 rad" }]',
    "task2": 'e = "10 mm"\n' + AXES + 'swing_range = { from = 30, to = 70, unit = "deg" }\n'
    'phi0_range = { from = 2.9, to = 3.5, unit = "rad" }\n'
    'positions = [{ dphi = "1 rad", dpsi = "0.2 rad" }, { dphi = "2 rad", dpsi = "0.6 rad" }]',
    "task3": GIVEN + AXES + F + 'adjusted = "f"\nadjusted_range = { from = -3, to = 3, unit = "cm" }\n'
    'settings = [{ swing = "0.6 rad", phi0 = "3.2 rad" }]',
    "task4": GIVEN,
    "task5": GIVEN + AXES + F + 'rho0 = "0.5 mm"\npositions = [{ dphi = "1 rad", drho = "0.1 mm" }]\n'
    'ratio_range = { from = 1.5, to = 4 }',
    "task6": DRIVE + 'start = ["0 mm", "0 mm"]\nend = ["1 mm", "0.2 mm"]\n'
    'start_direction = "0.5 rad"\nend_direction = "-0.1 rad"',
    "task7": DRIVE + 'stroke = "1 mm"\nstart_acceleration = "0.6 mm/rad^2"\nend_acceleration = "-0.5 mm"',
    "task8": GIVEN + AXES + F + 'stroke = "1 mm"\ndwell = "57 deg"\ntolerance = "4 um"\nlimit = "folded"',
}  # fmt: skip


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "question.toml"
    file.write_text(text)
    return file


def test_every_kind_has_a_file_here() -> None:
    assert list(FILES) == list(KINDS)


@pytest.mark.parametrize("kind", list(FILES))
def test_file_of_every_kind_becomes_its_problem(kind: str, tmp_path: Path) -> None:
    problem = load_task(written(tmp_path, f'[task]\nkind = "{kind}"\n{FILES[kind]}\n'))
    assert isinstance(problem, KINDS[kind])


def test_second_stage_of_task6_is_named_in_the_file(tmp_path: Path) -> None:
    problem = load_task(written(tmp_path, f'[task]\nkind = "task6"\n{FILES["task6"]}\nsecond = "swivel"\n'))
    assert isinstance(problem, Task6) and problem.second == "swivel"
    assert [unknown.name for unknown in problem.unknowns] == ["frame", "rod", "theta1"]


def test_units_are_those_of_the_project(tmp_path: Path) -> None:
    problem = load_task(written(tmp_path, f'[task]\nkind = "engineering"\n{FILES["engineering"]}'))
    assert isinstance(problem, EngineeringMethod)
    assert problem.f_range == (-30.0, 30.0) and problem.swing == pytest.approx(math.radians(46.0), rel=1e-15)
    third = load_task(written(tmp_path, f'[task]\nkind = "task3"\n{FILES["task3"]}'))
    assert third.settings == (Setting(0.6, 3.2),)
    fifth = load_task(written(tmp_path, f'[task]\nkind = "task5"\n{FILES["task5"]}'))
    assert fifth.positions == (SlotPosition(1.0, 0.1),) and fifth.ratio_range == (1.5, 4.0)


def test_verb_gives_what_python_gives_for_the_example_of_the_page(tmp_path: Path) -> None:
    text = PAGE.read_text().split("```toml\n")[1].split("```")[0]
    assert tomllib.loads(text)["task"]["kind"] == "task1"
    out = tmp_path / "found.csv"
    shown = CliRunner().invoke(
        main, ["task", str(written(tmp_path, text)), "--candidates", "256", "--starts", "2", "--out", str(out)]
    )
    assert shown.exit_code == 0, shown.output
    for place, words in (("found.txt", "ending in .parquet or .csv"), ("none/found.csv", "a folder that exists")):
        refused = CliRunner().invoke(main, ["task", str(tmp_path / "question.toml"), "--out", str(tmp_path / place)])
        assert refused.exit_code == 2 and words in refused.output  # before the search
    deg = math.pi / 180.0
    same = Task1(
        swing=51 * deg, phi0=189 * deg, e=10.0, g=10.0, alpha=75 * deg, positions=(Position(57 * deg, 14 * deg),),
        max_pressure_angle=60 * deg, bounds={"a": (1.0, 20.0), "f": (-40.0, 40.0)},
    )  # fmt: skip
    best = solve(same, candidates=256, starts=2)[0]
    assert best.feasible
    table = pd.read_csv(out)
    for name, value in best.mechanism.items():
        # Degrees become radians once here and once in the reader: a rounding, and the search goes on from there.
        assert table[name][0] == pytest.approx(value, rel=1e-6, abs=1e-9), name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["task is missing"]),
        ('[task]\nkind = "task9"', ["task.kind", "did you mean 'task"]),
        ('[task]\nkind = "task4"\nswing = "46 mm"\nphi0 = 3.2',
         ["task.swing", "an angle", "task.phi0", "task.e is missing"]),
        ('[task]\nkind = "task4"\nswng = "46 deg"\nphi0 = "3 rad"\ne = "1 mm"', ["task.swng", "did you mean 'swing'"]),
        ('[task]\nkind = "task4"\nswing = "500 deg"\nphi0 = "3 rad"\ne = "1 mm"', ["task.swing"]),
        ('[task]\nkind = "engineering"\n' + GIVEN + AXES + "f_range = { from = 1 }", ["task.f_range", "from"]),
        ('[task]\nkind = "task1"\n' + GIVEN + AXES + 'positions = [{ dphi = "1 rad" }]',
         ["positions[0].dpsi is missing"]),
        ('[task]\nkind = "task5"\n' + GIVEN + AXES + F + 'rho0 = "1 mm"\nratio_range = { from = nan, to = 4 }',
         ["task.ratio_range"]),
        ('[task]\nkind = "engineering"\n' + GIVEN + AXES + F
         + 'bounds = { swing = { from = 1, to = 2, unit = "rad" } }',
         ["task.bounds.swing", "lengths of the result"]),
        ('[tusk]\nkind = "task1"', ["tusk", "did you mean 'task'"]),
    ],
)  # fmt: skip
def test_faults_are_named_with_their_place(text: str, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(StudyError) as caught:
        load_task(written(tmp_path, text))
    for word in words:
        assert word in str(caught.value)


STUDY = """
[study]
name = "from-a-task"
[mechanism]
family = "rssr"
[task]
kind = "task1"
swing = "46 deg"
phi0 = "183 deg"
e = "10 mm"
g = "10 mm"
alpha = "75 deg"
positions = [{ dphi = "1 rad", dpsi = "0.25 rad" }]
bounds = { a = { from = 1, to = 30, unit = "mm" }, f = { from = -60, to = 60, unit = "mm" } }
[design]
sample = { kind = "sobol", n = 256 }
a = { from = 1, to = 30, unit = "mm" }
b = { from = 5, to = 90, unit = "mm" }
c = { from = 5, to = 60, unit = "mm" }
e = "10 mm"
f = { from = -60, to = 60, unit = "mm" }
g = "10 mm"
alpha = "75 deg"
branch = { values = [-1, 1] }
[limits]
rotatable = true
swing = { min = 45, max = 47, unit = "deg" }
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 2
"""


def study(tmp_path: Path, text: str = STUDY) -> Path:
    (tmp_path / "study.toml").write_text(text)
    return tmp_path


def test_search_of_a_study_begins_at_the_mechanisms_that_do_its_task(tmp_path: Path) -> None:
    import sweep
    from sweep.optimise.starts.dataset import task_designs
    from sweep.study import load_study

    place = study(tmp_path)
    loaded = load_study(place)
    names = loaded.family.parameter_names
    starts = task_designs(loaded, 2, 0)
    best = solve(load_task(place), starts=2, samples=4, seed=0)[0]
    assert best.feasible and 1 <= len(starts) <= 2
    for name, value in zip(names, starts[0], strict=True):
        assert value == loaded.space.fixed.get(name, best.mechanism[name])
    folder = sweep.run(place, out=tmp_path / "out" / "designs")
    import pandas as pd

    found = pd.read_parquet(Path(folder).parent / "_optimum.parquet")
    at = dict(zip(names, starts[0], strict=True))
    begun = sweep.summarise("rssr", at, ["max_abs_d2psi"], accuracy=1e-8).max_abs_d2psi[0]
    # the search never ends above the best of its feasible starts
    assert found.max_abs_d2psi[0] <= begun * (1.0 + 1e-9)


def test_task_whose_second_stage_is_no_family_starts_no_study(tmp_path: Path) -> None:
    from sweep.study import load_study

    five = f'[task]\nkind = "task5"\n{FILES["task5"]}\n'
    text = STUDY[: STUDY.index("[task]")] + five + STUDY[STUDY.index("[design]") :]
    with pytest.raises(StudyError, match="answered by `sweep task` alone"):
        load_study(study(tmp_path, text))


def test_study_without_its_task_has_another_fingerprint_and_no_task(tmp_path: Path) -> None:
    from sweep.study import load_study

    with_task = load_study(study(tmp_path))
    plain = STUDY[: STUDY.index("[task]")] + STUDY[STUDY.index("[design]") :]
    without = load_study(study(tmp_path, plain))
    other = load_study(study(tmp_path, STUDY.replace("46 deg", "40 deg")))
    assert without.task is None and with_task.task is not None
    assert len({x.fingerprint for x in (with_task, without, other)}) == 3


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("[optimise]\nstarts = 2\n", "", "optimise is missing"),
        ('family = "rssr"', 'family = "rssp"', "task1 is about family = \"rssr\""),
        ('kind = "task1"', 'kind = "task5"\nrho0 = "1 mm"', "task.positions[0].drho"),
        ('swing = "46 deg"\n', 'swing = "46 mm"\n', "task.swing"),
    ],
)  # fmt: skip
def test_study_whose_task_does_not_fit_is_refused(old: str, new: str, word: str, tmp_path: Path) -> None:
    from sweep.study import load_study

    with pytest.raises(StudyError) as caught:
        load_study(study(tmp_path, STUDY.replace(old, new, 1)))
    assert word in str(caught.value)
