"""Certificates of spaces with four free parameters: a second program confirms every box and refutes false claims."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sweep.jobs.executors import Here
from sweep.jobs.signals import Stop
from sweep.proof.certificate import Proof, concluded, write
from sweep.proof.question import Question, question_of
from sweep.proof.rounds import Cores, explored
from sweep.proof.study import proof_words
from sweep.study import ProveSettings
from sweep.study.load import load_study
from tests.reference.proof import covers, refuted

UNITS = np.array([np.pi / 180.0, np.pi / 180.0, 1.0, np.pi / 180.0])  # phi_ext, psi_ext, f, alpha
BEST = 0.54455  # the study's optimum, at phi_ext = 339.17, psi_ext = -4.81, f = 200, alpha = 90
NEAR_OPTIMUM = ((338.5, -5.5, 198.0, 89.5), (340.0, -4.0, 200.0, 90.0))
ABOUT_IT = ((339.0, -5.0, 199.5, 89.9), (339.4, -4.6, 200.0, 90.0))
# The ball is on the crank axis at both limits at psi_ext = 150, f = 0, alpha = 90, whatever phi_ext is.
SINGULAR = ((64.0, 149.0, -2.0, 89.0), (67.0, 151.0, 2.0, 90.0))
AHEAD, BEHIND, FREE = 18, 19, (20, 21)


def part(ends: tuple[tuple[float, ...], tuple[float, ...]]) -> Question:
    """A part of the spatial study's space."""
    study = load_study(Path(__file__).parents[2] / "studies" / "crank-rocker-proof-spatial")
    return replace(question_of(study), low=np.array(ends[0]) * UNITS, high=np.array(ends[1]) * UNITS)


def proven(question: Question, folder: Path, target: float, boxes: int = 20_000) -> Proof:
    """The certificate of a question, written into a folder."""
    settings, cores = ProveSettings(0.1, boxes), Cores(Here(), 1, Stop())
    found = explored(question, target, settings, folder / "parts", cores, lambda *_: None)
    proof = concluded(question, found, BEST, settings.gap)
    write(folder / "_proof.parquet", question, found.leaves, proof, target, "key")
    return proof


@pytest.mark.parametrize(
    ("ends", "target", "kinds"),
    [(ABOUT_IT, BEST / 1.002, {16, 17}), (NEAR_OPTIMUM, BEST / 1.1, {AHEAD}), (SINGULAR, BEST / 1.1, set(FREE))],
    ids=["acceleration at crank angles", "rocker cannot be there in time", "crank of any length"],
)
def test_second_program_confirms_every_box_in_four_dimensions(ends, target, kinds, tmp_path):
    proof = proven(part(ends), tmp_path, target)
    assert proof.open == proof.exceptions == 0 and proof.bound >= target
    path = tmp_path / "_proof.parquet"
    leaves = pq.read_table(path).to_pylist()
    assert kinds & {kind for leaf in leaves for kind in leaf["kinds"]}
    assert covers(path)
    assert refuted(path) == (proof.leaves, 0)


def test_second_program_confirms_rows_of_time_for_given_axes(tmp_path):
    planar = question_of(load_study(Path(__file__).parents[2] / "studies" / "crank-rocker-proof"))
    given = planar.given.copy()
    given[1] = np.radians(178.0)
    links = np.array([-np.inf, 500.0, 20.0, 200.0, 120.0, 500.0])  # crank, rocker, coupler
    question = replace(
        planar, names=("phi_ext",), low=np.array([0.0]), high=np.radians([75.0]), given=given, links=links
    )
    proof = proven(question, tmp_path, 0.58)
    path = tmp_path / "_proof.parquet"
    assert {AHEAD, BEHIND} & {kind for leaf in pq.read_table(path).to_pylist() for kind in leaf["kinds"]}
    assert proof.open == 0 and covers(path) and refuted(path) == (proof.leaves, 0)


def _rewritten(path: Path, leaves: list[dict[str, object]], **question: object) -> None:
    """Put other leaves or another question into a certificate."""
    import pyarrow as pa

    table = pq.read_table(path)
    asked = json.loads(table.schema.metadata[b"question"]) | question
    metadata = dict(table.schema.metadata) | {b"question": json.dumps(asked).encode()}
    pq.write_table(pa.Table.from_pylist(leaves, table.schema).replace_schema_metadata(metadata), path)


def test_claim_above_the_optimum_is_refuted(tmp_path):
    path = tmp_path / "_proof.parquet"
    proven(part(ABOUT_IT), tmp_path, BEST / 1.002)
    _rewritten(path, pq.read_table(path).to_pylist(), target=BEST * 1.002)
    _, wrong = refuted(path, deepest=4)
    assert wrong > 0


def test_wrong_side_of_the_tube_is_refuted(tmp_path):
    path = tmp_path / "_proof.parquet"
    proven(part(NEAR_OPTIMUM), tmp_path, BEST / 1.1)
    leaves = [x for x in pq.read_table(path).to_pylist() if x["kinds"] == [AHEAD]][:10]
    _rewritten(path, [leaf | {"kinds": [BEHIND]} for leaf in leaves])
    assert refuted(path, deepest=4) == (10, 10)


@pytest.mark.parametrize("above", [1.0005, 10.0, 40.0, 1e3])
def test_a_bound_above_the_optimum_is_not_proven(above, tmp_path):
    """With ten times the acceleration the tube is wider than half a turn: it tells nothing of any rocker."""
    proof = proven(part(ABOUT_IT), tmp_path, BEST * above, boxes=2000)
    assert proof.open > 0 and proof.bound <= BEST


def test_bound_of_any_motion_is_stated_where_the_boxes_do_not_suffice(tmp_path):
    study = load_study(Path(__file__).parents[2] / "studies" / "crank-rocker-proof-spatial")
    proof = proven(question_of(study), tmp_path, BEST / 1.001, boxes=64)
    # 60 degrees in 170 degrees of the crank: half of the way at full acceleration, half at full deceleration
    assert proof.bound == pytest.approx(4.0 * np.radians(60.0) / np.radians(170.0) ** 2)
    words = proof_words(proof, "acceleration", lambda x: f"{x:.4f}")
    assert proof.open > 0 and "what any motion from rest to rest needs" in words
