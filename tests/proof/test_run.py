"""A proof as a part of a run: what the terminal says, stopping and going on, a certificate that was damaged."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from studies import proof_space
from sweep.cli import main
from sweep.dataset import files
from sweep.engine import searches
from sweep.jobs import progress
from sweep.jobs.executors import Here
from sweep.jobs.signals import Stop
from sweep.nights.carry import carry, searched
from sweep.proof import known_proof, prove_study, read_proof
from sweep.proof.question import question_of
from sweep.proof.rounds import Cores
from sweep.report.page import write_report
from sweep.study import load_study

# A rocker that swings 60 degrees, the crank angle of the extended position and phi0 free.
STUDY = """
[study]
name = "small"
[mechanism]
family = "rssr"
[scene]
want = ["max_abs_d2psi"]
[locus]
swing = {{ value = 60, unit = "deg" }}
phi0 = {{ from = 170, to = 182, unit = "deg" }}
phi_ext = {{ from = 0, to = 75, unit = "deg" }}
[design]
sample = {{ kind = "sobol", n = 256, seed = 1 }}
alpha = {alpha}
e = "100 mm"
f = "0 mm"
g = {g}
[limits]
rotatable = true
max_pressure_angle = {{ max = {angle}, unit = "deg" }}
c = {{ min = 20, max = 500, unit = "mm" }}
{limits}
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 1
prove = {{ gap = "{gap}", boxes = {boxes}{time} }}
"""
PLAIN = {"alpha": '"0 deg"', "g": '"0 mm"', "angle": 45, "limits": "", "gap": "1 %", "boxes": 4000, "time": ""}


def written(folder: Path, **changes: Any) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(STUDY.format(**PLAIN | changes))
    return folder


def ran(folder: Path, verb: str = "run") -> tuple[int, str]:
    words = [verb, str(folder), *(["--out", str(folder / "designs")] if verb == "run" else []), "--jobs", "1"]
    found = CliRunner().invoke(main, words)
    return found.exit_code, found.output


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study with its dataset and certificate."""
    folder = written(tmp_path_factory.mktemp("proof") / "small")
    code, text = ran(folder)
    assert code == 0 and "proven: no design of this space has a largest acceleration below" in text
    assert "unseen" not in text
    assert (
        "the optimum is within" in text
        and " boxes, " in text
        and " of processor time)" in text.replace("below 0.1 s)", "0.1 s of processor time)")
    )
    return folder


@pytest.fixture
def again(done: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(done, tmp_path / "small"))


class StopAfter:
    """A signal after so many work units."""

    def __init__(self, units: int) -> None:
        self.stop, self.left = Stop(), units

    def outcomes(self, task: Any, numbers: Any, jobs: int, stop: Stop) -> Any:
        for number in numbers:
            yield task(number, lambda: False)
            self.left -= 1
            if self.left == 0:
                stop.set()
                return


def test_stopped_proof_goes_on_and_ends_with_the_same_bytes(again: Path) -> None:
    certificate, study = again / "_proof.parquet", load_study(again)
    whole = certificate.read_bytes()
    certificate.unlink()
    cut = StopAfter(70)
    with pytest.raises(KeyboardInterrupt):
        prove_study(study, again / "designs", Cores(cut, 1, cut.stop))
    assert read_proof(certificate).cut_short and certificate.read_bytes() != whole
    units = sorted((again / "_proof").rglob("*.npz"))
    assert len(units) == 70
    before = [path.stat().st_mtime_ns for path in units]
    prove_study(study, again / "designs", Cores(KeepFor(units, before), 1, Stop()))
    assert certificate.read_bytes() == whole and not (again / "_proof").exists()


class KeepFor(Here):
    """Work units that were finished before are not made again."""

    def __init__(self, paths: list[Path], times: list[int]) -> None:
        self.paths, self.times = paths, times

    def outcomes(self, task: Any, numbers: Any, jobs: int, stop: Stop) -> Any:
        yield from super().outcomes(task, numbers, jobs, stop)
        assert [path.stat().st_mtime_ns for path in self.paths] == self.times


def test_run_again_keeps_the_certificate_and_its_bytes(again: Path) -> None:
    before = (again / "_proof.parquet").stat().st_mtime_ns
    code, text = ran(again)
    assert code == 0 and "proven: no design" in text
    assert (again / "_proof.parquet").stat().st_mtime_ns == before


@pytest.mark.parametrize("damage", [b"", b"PAR1 and no more", None])
def test_damaged_certificate_is_named_and_made_anew(again: Path, damage: bytes | None) -> None:
    certificate = again / "_proof.parquet"
    whole = certificate.read_bytes()
    # one bit of a bound, which no reader of the metadata would see
    certificate.write_bytes(whole[:200] + bytes([whole[200] ^ 1]) + whole[201:] if damage is None else damage)
    found = CliRunner().invoke(main, ["verify", str(again / "designs")])
    assert found.exit_code == 74 and "_proof.parquet" in found.output
    assert ran(again)[0] == 0
    assert certificate.read_bytes() == whole


def test_night_takes_the_certificate_over(again: Path, tmp_path: Path) -> None:
    night, target = tmp_path / "night", tmp_path / "next" / "small"
    shutil.copytree(again, night / "small")
    study = load_study(again)
    carried = carry(study, [night], target)
    assert carried is not None and carried.whole
    assert known_proof(study, target / files.DESIGNS) == read_proof(again / "_proof.parquet")
    (target / "_proof.parquet").unlink()
    assert not searched(study, target)


def test_what_cannot_be_proven_is_refused_before_anything_is_computed(tmp_path: Path) -> None:
    free = '{ from = 1, to = 50, unit = "mm" }'
    many = written(tmp_path, g=free, alpha='{ from = 1, to = 90, unit = "deg" }')
    (many / "study.toml").write_text((many / "study.toml").read_text().replace('f = "0 mm"', f"f = {free}"))
    for verb in ("check", "run"):
        code, text = ran(many, verb)
        assert code == 2 and "phi0, phi_ext, f, g, alpha" in text and "1 to 4 parameters that vary" in text
    assert not (many / "designs").exists()


def test_plan_says_what_is_to_be_proven(tmp_path: Path) -> None:
    code, text = ran(written(tmp_path), "check")
    assert code == 0
    assert "proof: that no design is better than the optimum by more than 1 %, over phi0, phi_ext; at most 4000" in text


def test_first_boxes_are_told_with_what_they_wait_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A first proof stood at 0 boxes for two minutes and did not say that it was compiling."""

    def waits(study: Any, folder: Path, cores: Cores, tell: Any) -> None:
        tell(0, 4000)
        monkeypatch.setattr(progress, "FIRST_SECONDS", -1.0)
        tell(0, 4000)
        monkeypatch.setattr(progress, "LINE_SECONDS", -1.0)
        tell(7, 4000)

    monkeypatch.setattr(searches, "prove_study", waits)
    searches._proven(load_study(written(tmp_path)), tmp_path, 1, "threading", True)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "proof: 0 of 4000 boxes (0%), a first proof compiles before them, 0 s"
    assert all(line == "proof: 7 of 4000 boxes (0%), 0 s" for line in lines[1:]) and len(lines) > 1


def test_space_without_feasible_designs_ends_with_4_and_the_proof_of_it(tmp_path: Path) -> None:
    code, text = ran(written(tmp_path, angle=5))
    assert code == 4
    assert "proven: no design of this space keeps all limits" in text


def test_too_few_boxes_say_what_is_open_and_what_helps(tmp_path: Path) -> None:
    code, text = ran(written(tmp_path, gap="0.001 %", boxes=64))
    assert code == 0
    assert " are still open: more boxes (optimise.prove.boxes) or narrower ranges" in text


def test_brake_ends_with_124_and_the_next_run_goes_on(tmp_path: Path) -> None:
    folder = written(tmp_path, time=', time = "1e-6 s"')
    code, text = ran(folder)
    assert code == 124
    assert "optimise.prove.time ran out, and the next run goes on" in text
    written(tmp_path)
    code, text = ran(folder)
    assert code == 0 and "proven: no design" in text


def test_limits_that_the_proof_does_not_use_are_named(tmp_path: Path) -> None:
    code, text = ran(written(tmp_path, limits="max_abs_dpsi = { max = 5 }"))
    assert code == 0
    assert "makes no use of the limits on max_abs_dpsi" in text


def test_page_states_the_proof_by_itself_and_no_doubt_beside_it(again: Path) -> None:
    page = write_report(again / "designs").read_text(encoding="utf-8")
    assert "<li>Proven: no design of this space has a largest acceleration below" in page
    assert "<li>The optimiser started from" in page and "no proof of a global optimum" not in page


def test_figure_of_the_space_accounts_for_all_of_it_and_shows_the_optimum_in_its_box(done: Path) -> None:
    space = proof_space.read(done / "_proof.parquet")
    assert space.excluded.sum() == pytest.approx(1.0) and space.names == ("phi0", "phi_ext")
    for k in range(2):
        _, by_strip = proof_space.shares(space, k)
        np.testing.assert_allclose(by_strip.sum(axis=1), 1.0, rtol=1e-9)
    inside = ((space.low <= space.optimum) & (space.optimum <= space.high)).all(axis=1)
    # c at its bound: what excludes the boxes about the optimum is the length or the acceleration
    words = {list(proof_space.COLOURS)[k] for k in space.reasons[inside]}
    assert words and words <= {"links outside their limits", "acceleration not below the bound"}
    figure = proof_space.draw(space, 75.0)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-1] == "the optimum" and any(label.startswith("pressure angle above its limit: ") for label in labels)


def test_limits_on_coordinates_narrow_the_space_and_others_are_named(tmp_path: Path) -> None:
    wide = '{ from = 10, to = 90, unit = "deg" }'
    limits = 'alpha = { max = 40, unit = "deg" }\ng = { max = 5, unit = "mm" }\ne = { max = 50, unit = "mm" }'
    question = question_of(load_study(written(tmp_path / "limits", alpha=wide, limits=limits)))
    assert question.names == ("phi0", "phi_ext", "alpha")
    np.testing.assert_allclose(np.degrees([question.low[2], question.high[2]]), [10.0, 40.0])
    assert question.left_out == ("e",)  # no design of the space keeps it: e is 100 mm; g is 0 in all
