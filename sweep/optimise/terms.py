"""Sums of atoms that stand for outputs made of plain numbers: sizes, lengths, and boxes with what stands still."""

from __future__ import annotations

import math

from sweep.families.base import Array
from sweep.reductions.measures import Measure

Term = dict[int, float]
ENDS = 4  # foremost and rearmost joints that are followed: a step rarely brings a further one to the end


def numbers(
    m: Measure, design: Array, parameters: tuple[str, ...], scalars: tuple[str, ...], first: int, above: bool
) -> list[tuple[Term, float]]:
    """Return a plain number, every piece of a size, or every length with both signs.

    Where only one of them has to stay on its side of a bound, it is the one that makes the output.

    Parameters
    ----------
    m : the measure;  design : (P,);  parameters : names of its columns
    scalars : names of all plain numbers; ``first`` is the place of the first among the atoms
    above : whether the sums have to stay below a bound for the inner value to do so
    """
    if m.kind == "scalar":
        return [({first + scalars.index(m.name): m.sign}, 0.0)]
    if m.kind in ("least", "most"):
        each = [float(piece(design[None, :])[0]) for piece in m.pieces]
        order = sorted(range(len(each)), key=each.__getitem__, reverse=m.kind == "most")
        asked = order if above == (m.kind == "most") else order[:1]
        return [({first + scalars.index(m.numbers[k]): 1.0}, 0.0) for k in asked]
    sizes = {name: float(design[parameters.index(name)]) for name in m.numbers}
    if above:
        return [({first + scalars.index(name): sign}, 0.0) for name in sizes for sign in (1.0, -1.0)]
    name = max(sizes, key=lambda name: abs(sizes[name]))
    return [({first + scalars.index(name): math.copysign(1.0, sizes[name])}, 0.0)]


def box(
    m: Measure,
    maxima: list[tuple[float, int]],
    minima: list[tuple[float, int]],
    design: Array,
    scalars: tuple[str, ...],
    first: int,
    above: bool,
) -> list[tuple[Term, float]]:
    """Return the foremost ends of the joints less the rearmost ones, joints that stand still among them.

    ``maxima`` and ``minima`` are the values of the joints' coordinates at their extrema, and their places among the
    atoms; none where the design has none of them.
    """
    if not maxima or not minima:
        return []
    still = [
        (float(piece(design[None, :])[0]), first + scalars.index(name))
        for name, piece in zip(m.numbers, m.pieces, strict=True)
    ]
    tops, ends = sorted([*maxima, *still], reverse=True)[:ENDS], sorted([*minima, *still])[:ENDS]
    pairs = [(i, j) for _, i in tops for _, j in ends if i != j]
    return [({i: 1.0, j: -1.0}, 0.0) for i, j in (pairs if above else pairs[:1])]
