"""The certificate of a proof: every box with the rows that prove it, as Parquet, and the conclusion from all boxes."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kernels.boxes.branching import BOUND, EMPTY, OPEN, TOO_SMALL
from sweep.dataset import files
from sweep.dataset.files import metadata
from sweep.families.base import Array
from sweep.proof.question import Question, described
from sweep.proof.rounds import OUTCOMES, Explored, Leaves


@dataclass(frozen=True)
class Proof:
    """Proven statement about a study's space.

    No design of the space outside the ``exceptions`` has less than ``bound``; ``best`` is the study's feasible optimum,
    nan without one.  ``exceptions`` is the number of boxes too small to be halved again; together they are the share
    ``exceptional`` of the space, and lie between ``exception_low`` and ``exception_high``.  ``open`` is the number of
    boxes left when the allowed boxes or the time were used up (``cut_short``: the time, or a signal); the bound holds
    for them too.  ``empty_share`` of the space was proven to hold no feasible design.  ``reasons`` counts the boxes by
    the reason of their proof.  ``floor`` is the lower bound for any motion from rest to rest; without a better bound
    ``bound`` is equal.
    """

    objective: str
    unit: str
    bound: float
    best: float
    wanted_gap: float
    boxes: int
    leaves: int
    open: int
    exceptions: int
    exceptional: float
    exception_low: tuple[float, ...]
    exception_high: tuple[float, ...]
    free: tuple[str, ...]
    empty_share: float
    cut_short: bool
    reasons: tuple[tuple[str, int], ...]
    left_out: tuple[str, ...]
    floor: float = 0.0

    @property
    def gap(self) -> float:
        """Relative excess of the best design over the bound; infinite without either."""
        return self.best / self.bound - 1.0 if self.bound > 0.0 and np.isfinite(self.best) else float("inf")

    @property
    def settled(self) -> bool:
        """Whether the wanted gap was reached."""
        return self.open == 0


def concluded(question: Question, explored: Explored, best: float, wanted_gap: float) -> Proof:
    """Return the conclusion from the leaves of a search."""
    leaves = explored.leaves
    outcome, bounds = leaves.outcome, np.where(leaves.outcome == EMPTY, np.inf, leaves.bound)
    volume = np.prod((leaves.high - leaves.low) / (question.high - question.low), axis=1)
    small = outcome == TOO_SMALL
    counted = bounds[~small]
    least = float(counted.min()) if len(counted) else 0.0
    ends = (leaves.low[small].min(axis=0), leaves.high[small].max(axis=0)) if small.any() else ((), ())
    return Proof(
        objective=question.objective,
        unit="rad" if question.provable.objectives[question.objective] == 0 else "1",
        bound=question.outside(least) if np.isfinite(least) else least,
        best=best,
        wanted_gap=wanted_gap,
        boxes=explored.judged,
        leaves=len(outcome),
        open=int((outcome == OPEN).sum()),
        exceptions=int(small.sum()),
        exceptional=float(volume[small].sum()),
        exception_low=tuple(float(x) for x in ends[0]),
        exception_high=tuple(float(x) for x in ends[1]),
        free=question.names,
        empty_share=float(volume[outcome == EMPTY].sum()),
        cut_short=explored.cut_short,
        reasons=_reasons(question, leaves),
        left_out=question.left_out,
        floor=question.outside(question.floor),
    )


def reason(question: Question, outcome: int, kinds: Array) -> str:
    """Return the reason that proves a box, in words."""
    if outcome == BOUND:
        return f"{question.objective} at least the target"
    if outcome == EMPTY:
        return question.provable.rows[int(kinds[0])] if kinds[1] < 0 else "limits that contradict each other"
    return OUTCOMES[outcome]


def _reasons(question: Question, leaves: Leaves) -> tuple[tuple[str, int], ...]:
    totals: dict[str, int] = {}
    alike, counts = np.unique(
        np.column_stack([leaves.outcome, leaves.kinds[:, :2]]).astype(np.int64), axis=0, return_counts=True
    )
    for (outcome, *kinds), count in zip(alike, counts, strict=True):
        words = reason(question, int(outcome), np.array(kinds))
        totals[words] = totals.get(words, 0) + int(count)
    return tuple(sorted(totals.items(), key=lambda item: -item[1]))


def write(path: Path, question: Question, leaves: Leaves, proof: Proof, target: float, key: str) -> None:
    """Write the certificate: one row per box, question and conclusion in the metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    used = leaves.kinds >= 0
    columns: dict[str, Any] = {}
    for k, name in enumerate(question.names):
        columns[f"{name}_low"], columns[f"{name}_high"] = leaves.low[:, k], leaves.high[:, k]
    columns["outcome"] = pa.array([OUTCOMES[int(k)] for k in leaves.outcome]).dictionary_encode()
    columns["bound"] = np.where(leaves.outcome == EMPTY, np.inf, leaves.bound)
    for name in ("kinds", "theta", "factors"):
        rows = getattr(leaves, name)
        offsets = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.int32)
        columns[name] = pa.ListArray.from_arrays(pa.array(offsets), pa.array(rows[used]))
    content = {**described(question), "target": target, "rows": list(question.provable.rows)}
    table = pa.table(columns).replace_schema_metadata(
        {"question": json.dumps(content), "proof": json.dumps(asdict(proof)), "key": key}
    )
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    files.write_atomically(path, sink.getvalue().to_pybytes())


def read_proof(path: Path) -> Proof | None:
    """Return the proof of a certificate, or None if there is no such file or it is damaged."""
    from pydantic import TypeAdapter

    content = json.loads(metadata(path).get(b"proof", b"null"))
    return TypeAdapter(Proof | None).validate_python(content)  # earlier versions said more
