"""What the study's proof says, for the page and for the terminal."""

from __future__ import annotations

from sweep.dataset import store
from sweep.proof import read_proof
from sweep.proof.certificate import PROOF
from sweep.proof.words import proof_words
from sweep.report.dataset import Dataset
from sweep.report.quantities import quantity


def proof_sentence(data: Dataset) -> str:
    """Return one sentence; empty where the study asked for no proof."""
    found = read_proof(store.beside(data.folder) / PROOF)
    if found is None:
        return ""
    shown = quantity(found.objective, data.units.get(found.objective, found.unit))
    return proof_words(found, shown.words, shown.show)
