"""Samples of a curve in two loops: the stages before the last one, then the last one.

A loop over whole poses is some 240 vector instructions long, and in it one root waits for another.  The processor looks
ahead by less than two rounds of that loop; with loops half as long several rounds overlap.
"""

from __future__ import annotations

from typing import Any, TypeAlias

from kernels.chains.curves import Sampling
from kernels.chains.form import Helper
from kernels.jit import generated_inline, inline
from kernels.types import Array

Rows: TypeAlias = tuple[Array, ...]

TOGETHER = 256  # poses whose input to the last stage is kept
HANDED = 5 * TOGETHER


@inline
def handed_rows(memory: Array, begin: int, end: int) -> Rows:
    """Places begin, ..., end - 1 of the five rows of inputs in a memory of `HANDED` numbers."""
    return (
        memory[begin:end], memory[TOGETHER + begin : TOGETHER + end],
        memory[2 * TOGETHER + begin : 2 * TOGETHER + end], memory[3 * TOGETHER + begin : 3 * TOGETHER + end],
        memory[4 * TOGETHER + begin : 4 * TOGETHER + end],
    )  # fmt: skip


@inline
def _row_of_one(values: Array, gap: int, begin: int, end: int) -> Rows:
    return (values[begin:end],)


@inline
def _write_one(rows: Rows, i: int, y: Any) -> None:
    rows[0][i] = y[0]


@inline
def _rows_of_two(values: Array, gap: int, begin: int, end: int) -> Rows:
    return values[begin:end], values[gap + begin : gap + end]


@inline
def _write_two(rows: Rows, i: int, y: Any) -> None:
    rows[0][i], rows[1][i] = y


def writers(of: Sampling) -> tuple[Helper, Helper]:
    """Choose the functions that store samples.

    ``rows(values, gap, begin, end)`` gives the places begin, ..., end - 1 of each curve's samples, which are ``gap``
    apart; ``write(rows, i, y)`` writes the curves to place i.
    """
    return (_row_of_one, _write_one) if of.curves == 1 else (_rows_of_two, _write_two)


def keepers(of: Sampling) -> tuple[Helper, Helper, Helper]:
    """Make the functions that store the discriminants of the stages which a curve needs to be positive.

    ``rows(guards, gap, begin, end)`` gives the places begin, ..., end - 1 of each stage's row, the rows ``gap`` apart;
    ``keep(rows, deltas, i)`` writes the discriminants of the stages before the last to place i, and
    ``keep_last(rows, delta, i)`` the discriminant of the last.
    """
    rows, keep, last = _no_rows, _keep_none, of.guarded if of.ends else 0
    for stage in range(1, of.guarded + 1):
        rows = _one_more_row(rows, stage, of.name)
        keep = keep if stage == last else _one_more_kept(keep, stage, of.name)

    # Written out stage by stage: a loop over the stages keeps the loop over the samples from vectorising.
    def keep_last(here: Rows, delta: Any, i: int) -> None:
        if last > 0:
            here[last][i] = delta

    return rows, keep, generated_inline(f"keep_last_{of.name}", keep_last)


@inline
def _no_rows(guards: Array, gap: int, begin: int, end: int) -> Rows:
    return (guards,)  # stands for the first stage, whose discriminant is known beforehand


@inline
def _keep_none(rows: Rows, deltas: Any, i: int) -> None:
    pass


def _one_more_row(before: Helper, stage: int, name: str) -> Helper:
    def rows(guards: Array, gap: int, begin: int, end: int) -> Rows:
        first = (stage - 1) * gap
        return (*before(guards, gap, begin, end), guards[first + begin : first + end])

    return generated_inline(f"rows{stage}_{name}", rows)


def _one_more_kept(before: Helper, stage: int, name: str) -> Helper:
    def keep(here: Rows, deltas: Any, i: int) -> None:
        before(here, deltas, i)
        here[stage][i] = deltas[stage]

    return generated_inline(f"keep{stage}_{name}", keep)
