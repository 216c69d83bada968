"""The proof that a study asks for: question, rounds over the cores, certificate beside the dataset."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from kernels.cache_folder import source_hash
from sweep.dataset import store
from sweep.dataset.files import metadata
from sweep.errors import InputError
from sweep.proof.certificate import Proof, concluded, read_proof, write
from sweep.proof.question import Question, described, question_of
from sweep.proof.rounds import SHARES, UNITS, Cores, Tell, explored

if TYPE_CHECKING:
    from sweep.study import ProveSettings, Study

NEVER = 1e300  # the target where no feasible design is known: then only emptiness can be proven
PARTS = "_proof"  # folder of finished work units; it goes when the proof has ended
EVENT = "proof"  # in ``_runs.jsonl``


def prove_study(study: Study, folder: str | Path, cores: Cores, tell: Tell = lambda _, __: None) -> Proof:
    """Prove that no design of the study's space is better than its optimum by more than the gap it asks for.

    Parameters
    ----------
    study : with ``optimise.prove``
    folder : its dataset, with the optimum beside it
    cores : where the boxes are judged; the certificate does not depend on it.  A stopped proof goes on in the next run
    tell : called with the boxes judged so far and those expected in all

    Returns
    -------
    What is proven; the certificate is ``_proof.parquet`` beside the dataset, and ``_runs.jsonl`` says what it took.

    Raises
    ------
    InputError
        if the study asks for what cannot be proven
    KeyboardInterrupt
        if it was stopped; finished work units are kept.
    """
    known = known_proof(study, folder)
    if known is not None:
        return known
    asked, question, target, key = _asked(study, Path(folder))
    side = store.beside(Path(folder))
    found = explored(question, target, asked, side / PARTS / key, cores, tell)
    proof = concluded(question, found, _best(side / store.OPTIMUM, question), asked.gap)
    write(side / store.PROOF, question, found.leaves, proof, target, key)
    if cores.stop:
        raise KeyboardInterrupt
    store.append_run(Path(folder), {"event": EVENT, "boxes": proof.boxes, "processor_seconds": round(found.seconds, 3)})
    if not proof.cut_short:
        shutil.rmtree(side / PARTS, ignore_errors=True)
    return proof


def known_proof(study: Study, folder: str | Path) -> Proof | None:
    """Return what the certificate beside a dataset says, if it answers what the study asks and no time cut it short.

    Raises
    ------
    InputError
        if the study asks for what cannot be proven.
    """
    path = store.beside(Path(folder)) / store.PROOF
    found = read_proof(path)
    if found is None or found.cut_short:
        return None
    *_, key = _asked(study, Path(folder))
    return found if metadata(path).get(b"key") == key.encode() else None


def _asked(study: Study, folder: Path) -> tuple[ProveSettings, Question, float, str]:
    """Return settings, question, target in the unit of the proof's rows, and what the certificate depends on."""
    if study.optimise is None or study.optimise.prove is None:
        raise InputError("optimise.prove", None, '{ gap = "1 %", boxes = 1000000 }', str(study.path))
    asked, question = study.optimise.prove, question_of(study)
    best = _best(store.beside(folder) / store.OPTIMUM, question)
    target = question.in_kernel(best / (1.0 + asked.gap)) if np.isfinite(best) else NEVER
    what = [described(question), target, asked.gap, asked.boxes, asked.smallest, UNITS, SHARES, source_hash()]
    key = hashlib.sha256(json.dumps(what, default=str, sort_keys=True).encode()).hexdigest()[:16]
    return asked, question, target, key


def _best(path: Path, question: Question) -> float:
    """Return the objective of the study's optimum; nan where no feasible design was found."""
    import pyarrow.parquet as pq

    table = pq.read_table(path, columns=["role", "status", question.objective]).to_pylist()
    first = next(row for row in table if row["role"] == "optimum")
    return float(first[question.objective]) if first["status"] != st.LIMIT_EXCEEDED else float("nan")
