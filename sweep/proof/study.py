"""The proof that a study asks for: question, rounds over the cores, certificate beside the dataset."""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from kernels._cache import source_hash
from sweep.dataset import store
from sweep.errors import InputError
from sweep.proof.certificate import PROOF, Proof, concluded, read_proof, write
from sweep.proof.question import Question, described, question_of
from sweep.proof.rounds import SHARES, UNITS, Cores, Tell, explored

if TYPE_CHECKING:
    from sweep.study import ProveSettings, Study

NEVER = 1e300  # the target where no feasible design is known: then only emptiness can be proven


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
    What is proven; the certificate is ``_proof.parquet`` beside the dataset.

    Raises
    ------
    InputError
        if the study asks for what cannot be proven
    KeyboardInterrupt
        if it was stopped; finished work units are kept.
    """
    if study.optimise is None or study.optimise.prove is None:
        raise InputError("optimise.prove", None, '{ gap = "1 %", boxes = 1000000 }', str(study.path))
    asked = study.optimise.prove
    question, side = question_of(study), store.beside(Path(folder))
    best = _best(side / store.OPTIMUM, question)
    target = question.in_kernel(best / (1.0 + asked.gap)) if np.isfinite(best) else NEVER
    key = _key(question, target, asked)
    known = read_proof(side / PROOF)
    if known is not None and not known.cut_short and _known_key(side / PROOF) == key:
        return known
    parts = side / "_proof" / key
    begin = time.monotonic()
    leaves, judged, cut_short = explored(question, target, asked, parts, cores, tell)
    proof = concluded(question, leaves, best, asked.gap, judged, time.monotonic() - begin, cut_short)
    write(side / PROOF, question, leaves, proof, target, key)
    if cores.stop:
        raise KeyboardInterrupt
    if not cut_short:
        shutil.rmtree(side / "_proof", ignore_errors=True)
    return proof


def _best(path: Path, question: Question) -> float:
    """Return the objective of the study's optimum; nan where no feasible design was found."""
    import pyarrow.parquet as pq

    table = pq.read_table(path, columns=["role", "status", question.objective]).to_pylist()
    first = next(row for row in table if row["role"] == "optimum")
    return float(first[question.objective]) if first["status"] != st.LIMIT_EXCEEDED else float("nan")


def _key(question: Question, target: float, asked: ProveSettings) -> str:
    """Return what the certificate depends on."""
    what = [described(question), target, asked.gap, asked.boxes, asked.smallest, UNITS, SHARES, source_hash()]
    return hashlib.sha256(json.dumps(what, default=str, sort_keys=True).encode()).hexdigest()[:16]


def _known_key(path: Path) -> str | None:
    import pyarrow.parquet as pq

    found = (pq.read_schema(path).metadata or {}).get(b"key")
    return None if found is None else found.decode()
