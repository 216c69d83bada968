"""What is proven, in words."""

from __future__ import annotations

import math
from collections.abc import Callable

from sweep.proof.certificate import Proof


def proof_words(proof: Proof, name: str, show: Callable[[float], str]) -> str:
    """Return one sentence or two for a report or a terminal.

    Parameters
    ----------
    proof : what is proven
    name : the objective in words
    show : a value of the objective with its unit
    """
    boxes = f"{proof.boxes} boxes"
    outside = _outside(proof)
    if not math.isfinite(proof.bound):
        return f"proven{outside}: no design of this space keeps all limits ({boxes})"
    if not proof.bound > 0.0:
        return f"nothing is proven yet: {proof.open} of {boxes} are open; more boxes or narrower ranges may settle it"
    text = f"proven{outside}: no design of this space has a {name} below {show(proof.bound)}"
    if math.isfinite(proof.gap):
        text += f"; the optimum is within {_percent(proof.gap)} of that"
    if not proof.settled and proof.bound <= proof.floor:
        text += ", which no follower at all gets below that goes so far in that time"
    if not proof.settled:
        text += f" ({_percent(proof.wanted_gap)} were asked for; {proof.open} of {boxes} are open)"
    else:
        text += f" ({boxes})"
    return text


def _outside(proof: Proof) -> str:
    if not proof.exceptions:
        return ""
    return f" but for {_percent(proof.exceptional)} of the space, next to singular places"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
