"""What is proven, in words."""

from __future__ import annotations

import math
from collections.abc import Callable

from sweep.proof.certificate import Proof


def proof_words(proof: Proof, name: str, show: Callable[[float], str], seconds: float | None = None) -> str:
    """Return one sentence or two for a report or a terminal, without the full stop at their end.

    Parameters
    ----------
    proof : what is proven
    name : the objective in words
    show : a value of the objective with its unit
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
    """Return how far the boxes have come and what would help."""
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
