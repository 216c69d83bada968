"""The proof of a study: question, rounds over the cores, certificate beside the dataset, and its statement in words."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from kernels import status as st
from kernels.cache_folder import source_hash
from sweep.dataset import files
from sweep.dataset.files import metadata
from sweep.errors import MissingInput
from sweep.proof.certificate import Proof, concluded, read_proof, write
from sweep.proof.question import Question, described, question_of
from sweep.proof.rounds import SHARES, UNITS, Cores, TellBoxes, explored
from sweep.study import ProveSettings, Study

NEVER = 1e300  # target without a known feasible design: then only emptiness can be proven
PARTS = "_proof"  # folder of finished work units; removed when the proof has ended
EVENT = "proof"  # event in ``_runs.jsonl``


def prove_study(study: Study, folder: str | Path, cores: Cores, tell: TellBoxes = lambda _, __: None) -> Proof:
    """Prove that no design of the study's space is better than its optimum by more than the wanted gap.

    Parameters
    ----------
    study : study with ``optimise.prove``
    folder : folder of its dataset, with the optimum beside it
    cores : executor of the boxes; the certificate does not depend on it.  A stopped proof continues in the next run
    tell : called with the numbers of boxes evaluated so far and expected in all

    Returns
    -------
    The proof; the certificate is ``_proof.parquet`` beside the dataset, and ``_runs.jsonl`` records its cost.

    Raises
    ------
    InputError
        if the study asks for a proof that is not supported
    KeyboardInterrupt
        if it was stopped; finished work units are kept.
    """
    known = known_proof(study, folder)
    if known is not None:
        return known
    settings, question, target, key = _statement(study, Path(folder))
    side = files.beside(Path(folder))
    tree = explored(question, target, settings, side / PARTS / key, cores, tell)
    proof = concluded(question, tree, _best(side / files.OPTIMUM, question), settings.gap)
    write(side / files.PROOF, question, tree.leaves, proof, target, key)
    if cores.stop:
        raise KeyboardInterrupt
    files.append_run(Path(folder), {"event": EVENT, "boxes": proof.boxes, "processor_seconds": round(tree.seconds, 3)})
    if not proof.cut_short:
        shutil.rmtree(side / PARTS, ignore_errors=True)
    return proof


def known_proof(study: Study, folder: str | Path) -> Proof | None:
    """Return the proof of the certificate beside a dataset, if it answers the study's question and was not cut short.

    Raises
    ------
    InputError
        if the study asks for a proof that is not supported.
    """
    path = files.beside(Path(folder)) / files.PROOF
    proof = read_proof(path)
    if proof is None or proof.cut_short:
        return None
    *_, key = _statement(study, Path(folder))
    return proof if metadata(path).get(b"key") == key.encode() else None


def _statement(study: Study, folder: Path) -> tuple[ProveSettings, Question, float, str]:
    """Return the settings, the question, the target in the unit of the proof's rows, and the key of the certificate."""
    if study.optimise is None or study.optimise.prove is None:
        raise MissingInput("optimise.prove", '{ gap = "1 %", boxes = 1000000 }', str(study.path))
    prove, question = study.optimise.prove, question_of(study)
    best = _best(files.beside(folder) / files.OPTIMUM, question)
    target = question.in_kernel(best / (1.0 + prove.gap)) if np.isfinite(best) else NEVER
    data = [described(question), target, prove.gap, prove.boxes, prove.smallest, UNITS, SHARES, source_hash()]
    key = hashlib.sha256(json.dumps(data, default=str, sort_keys=True).encode()).hexdigest()[:16]
    return prove, question, target, key


def _best(path: Path, question: Question) -> float:
    """Return the objective of the study's optimum; nan if no feasible design was found."""
    table = files.read_table(path)
    first = table[table["role"] == "optimum"].iloc[0]
    return float(first[question.objective]) if first["status"] != st.LIMIT_EXCEEDED else float("nan")


def proof_words(proof: Proof, name: str, show: Callable[[float], str], seconds: float | None = None) -> str:
    """Return the proof in one or two sentences for a report or a terminal, without the final full stop.

    Parameters
    ----------
    proof : the proof
    name : the objective in words
    show : formats a value of the objective with its unit
    seconds : processor time of the boxes, if it is known
    """
    took = "" if seconds is None else f", {seconds:.2g} s of processor time" if seconds >= 0.1 else ", below 0.1 s"
    if not math.isfinite(proof.bound):
        text = f"proven{_outside(proof)}: no design of this space keeps all limits ({proof.boxes} boxes{took})"
    elif not math.isfinite(proof.best):
        text = (
            f"no design that keeps all limits was found, and it is not proven that there is none{_outside(proof)}: "
            f"{_percent(proof.empty_share)} of the space are proven to hold none{_unfinished(proof, took)}"
        )
    elif not proof.bound > 0.0:
        text = f"nothing is proven so far{_unfinished(proof, took)}"
    else:
        text = _bounded(proof, name, show, took)
    return text + _left_out(proof)


def _bounded(proof: Proof, name: str, show: Callable[[float], str], took: str) -> str:
    so_far = "" if proof.settled else " so far"
    text = f"proven{so_far}{_outside(proof)}: no design of this space has a {name} below {show(proof.bound)}"
    if not proof.settled and proof.bound <= proof.floor:
        text += ", which is what any motion from rest to rest needs for that swing in that time"
    text += f"; the optimum is within {_percent(proof.gap)} of that"
    if proof.settled:
        return f"{text} ({proof.boxes} boxes{took})"
    return f"{text} ({_percent(proof.wanted_gap)} asked){_unfinished(proof, took)}"


def _unfinished(proof: Proof, took: str) -> str:
    """Return the number of open boxes and the remedy, as text."""
    if proof.settled:
        return f" ({proof.boxes} boxes{took})"
    head = f". After {proof.boxes} boxes{took}, {proof.open} are still open: "
    if proof.cut_short:
        return f"{head}optimise.prove.time ran out, and the next run goes on"
    return f"{head}more boxes (optimise.prove.boxes) or narrower ranges bring it further"


def _left_out(proof: Proof) -> str:
    if not proof.left_out:
        return ""
    return (
        f". The proof makes no use of the limits on {', '.join(proof.left_out)}: it holds for more designs than asked"
    )


def _outside(proof: Proof) -> str:
    if not proof.exceptions:
        return ""
    return f" but for {_percent(proof.exceptional)} of the space, next to singular places"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
