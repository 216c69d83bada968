"""Certificates: a second program checks them box by box and refutes false ones; any number of cores gives the same."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.jobs.executors import Here, Threads
from sweep.jobs.signals import Stop
from sweep.proof.certificate import concluded, read_proof, write
from sweep.proof.question import question_of
from sweep.proof.rounds import Cores, explored
from sweep.proof.study import proof_words
from sweep.study import ProveSettings, study_from_data
from sweep.study.load import load_study
from tests.reference.proof import covers, refuted

DEGREE = np.pi / 180.0
STUDIES = Path(__file__).parents[2] / "studies"
BEST, TARGET = 0.5882, 0.58


def small(name: str = "crank-rocker-proof"):
    """A part of the planar study's space, about its optimum."""
    question = question_of(load_study(STUDIES / name))
    return replace(question, low=np.array([177.0, 10.0]) * DEGREE, high=np.array([179.0, 14.0]) * DEGREE)


def proven(question, folder, cores=None, settings=None, target=TARGET):
    """The certificate of a question, written into a folder."""
    settings = settings or ProveSettings(0.014, 20_000)
    place = cores or Cores(Here(), 1, Stop())
    found = explored(question, target, settings, folder / "parts", place, lambda *_: None)
    proof = concluded(question, found, BEST, settings.gap)
    write(folder / "_proof.parquet", question, found.leaves, proof, target, "key")
    return proof


def test_second_program_confirms_every_box_and_that_they_cover_the_space(tmp_path):
    proof = proven(small(), tmp_path)
    assert proof.open == proof.exceptions == 0 and TARGET <= proof.bound <= BEST
    assert read_proof(tmp_path / "_proof.parquet") == proof
    assert covers(tmp_path / "_proof.parquet")
    assert refuted(tmp_path / "_proof.parquet") == (proof.leaves, 0)


def test_second_program_refutes_a_certificate_that_claims_too_much(tmp_path):
    proven(small(), tmp_path)
    path = tmp_path / "_proof.parquet"
    table = pq.read_table(path)
    question = json.loads(table.schema.metadata[b"question"])
    question["target"] = 0.6  # there are designs with 0.5882
    metadata = dict(table.schema.metadata) | {b"question": json.dumps(question).encode()}
    pq.write_table(table.slice(0, 30).replace_schema_metadata(metadata), path)
    checked, wrong = refuted(path, deepest=6)
    assert wrong > 0 and checked == 30
    assert not covers(path)  # thirty boxes are not all of them


def test_certificate_does_not_depend_on_the_number_of_cores(tmp_path):
    found = []
    for jobs, place in ((1, Here()), (2, Threads())):
        folder = tmp_path / str(jobs)
        folder.mkdir()
        proven(small(), folder, Cores(place, jobs, Stop()))
        found.append((folder / "_proof.parquet").read_bytes())
    assert found[0] == found[1]


def test_best_bound_is_stated_where_the_boxes_do_not_suffice(tmp_path):
    whole = question_of(load_study(STUDIES / "crank-rocker-proof"))
    proof = proven(whole, tmp_path, settings=ProveSettings(1e-6, 128), target=0.58819)
    assert proof.open > 0 and not proof.settled
    assert 0.0 <= proof.bound < 0.58819
    assert covers(tmp_path / "_proof.parquet")
    words = proof_words(proof, "acceleration", lambda value: f"{value:.3f}")
    assert "open" in words


def test_space_without_feasible_designs_is_proven_empty(tmp_path):
    question = replace(small(), cos2=0.999)  # pressure angle of 1.8 degrees
    proof = proven(question, tmp_path)
    assert proof.bound == np.inf and proof.empty_share == pytest.approx(1.0)
    assert "no design of this space keeps all limits" in proof_words(proof, "acceleration", str)


def _data(**changes):
    data = load_study(STUDIES / "crank-rocker-proof").data
    return {**data, **changes}


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"objective": {"minimise": "max_abs_d3psi"}}, "max_abs_d2psi"),
        ({"design": {"sample": {"kind": "sobol", "n": 64, "seed": 1}, "alpha": {"values": [0, 90], "unit": "deg"},
                     **{k: {"value": 100, "unit": "mm"} for k in "efg"}}}, "without gaps"),
        ({"design": {"sample": {"kind": "sobol", "n": 64, "seed": 1}, "alpha": {"from": 0, "to": 90, "unit": "deg"},
                     **{k: {"from": 1, "to": 100, "unit": "mm"} for k in "efg"}}}, "1 to 4"),
    ],
)  # fmt: skip
def test_what_cannot_be_proven_is_refused_with_what_could_be(changes, named):
    with pytest.raises(InputError, match=named):
        question_of(study_from_data(_data(**changes), STUDIES / "study.toml"))


def test_family_without_a_provable_locus_is_refused():
    study = load_study(STUDIES / "crank-rocker-proof")
    assert isinstance(study.family, Family)
    bare = replace(study, locus=None)
    with pytest.raises(InputError, match="proven optimum"):
        question_of(bare)
