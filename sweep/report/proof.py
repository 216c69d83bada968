"""What the study's proof says, for the page and for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sweep.dataset import store
from sweep.optimise.confirmed import DIFFERS
from sweep.proof import read_proof
from sweep.proof.study import EVENT
from sweep.proof.words import proof_words
from sweep.report.dataset import Dataset
from sweep.report.quantities import quantity

if TYPE_CHECKING:
    from sweep.optimise.survey import Survey


def proof_sentence(data: Dataset) -> str:
    """Return one sentence; empty where the study asked for no proof."""
    found = read_proof(store.beside(data.folder) / store.PROOF)
    if found is None:
        return ""
    shown = quantity(found.objective, data.units.get(found.objective, found.unit))
    took = [run["processor_seconds"] for run in data.runs if run.get("event") == EVENT]
    return proof_words(found, shown.words, shown.show, took[-1] if took else None)


def search_warnings(data: Dataset, found: Survey) -> tuple[str, ...]:
    """Return what a reader has to know of a search; a proof of the whole space leaves no doubt of something better."""
    proof = read_proof(store.beside(data.folder) / store.PROOF)
    without_doubt = proof is not None and proof.settled and not proof.exceptions
    return (*_unconfirmed(data), *(found.shortcomings if without_doubt else found.warnings))


def _unconfirmed(data: Dataset) -> tuple[str, ...]:
    """Return that the search followed other extrema than the true ones, where it did."""
    best = data.optimum
    if best is None or best.get("ended") != DIFFERS:
        return ()
    apart = f"{100.0 * float(best['gap']):.2g} %"
    return (f"the search took values that are up to {apart} beside the true ones, which are shown: better may be near",)
