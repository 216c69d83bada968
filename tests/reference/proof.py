"""A second, slow program that checks a certificate: ball arithmetic (python-flint), derivatives, nothing from kernels.

Every box of a certificate claims that a combination of rows is above a number for all designs in it.  The rows are
written down anew (``proof_rows``); bounds come from the mean value theorem with exact derivatives over the box, in
balls of 80 bits.  That is coarser than the Taylor models of the first program, so a box that does not yield is halved,
which no claim is hurt by.
"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from flint import arb

from tests.reference.proof_rows import ANY_CRANK, OBJECTIVE, Jet, Rows

DEEPEST = 16  # halvings of a box before it counts as refuted


def _weighted(p: arb, q: arb, length: arb) -> arb:
    """Integral of the magnitude of a straight line from p to q, from above."""
    crossing = length * (p * p + q * q) / (2 * abs(p - q)) if not (p - q).contains(0) else arb(0)
    plain = length * (abs(p) + abs(q)) / 2
    return crossing if p * q < 0 else plain


def farthest(at: arb, stroke: arb, time: arb, most: arb, sign: int) -> arb:
    """What psi(theta) does not pass between rests at 0 and ``stroke`` with abs(psi'') <= most; upwards for sign 1.

    psi(theta) = p stroke + integral of w psi'' for w(t) = max(theta - t, 0) - q - p (T - t), whatever p and q are: the
    second derivative has the mean 0 and the first moment that the stroke asks for.  So abs(w) bounds it.
    """
    switch = time / 4 + sign * stroke / (most * time)
    p = (at - switch) / (time / 2)
    p = arb(0) if p < 0 else arb(1) if p > 1 else arb(float(p))
    q = arb(float(-p * (time / 2 - switch))) if 0 < p < 1 else p * (at - time)
    corner = -q - p * (time - at)
    size = _weighted(at - q - p * time, corner, at) + _weighted(corner, -q, time - at)
    return p * stroke + sign * most * size


def sides(question: dict[str, Any], theta: float) -> tuple[arb, arb]:
    """Least and most rocker angle after the extended position of a design that reaches the target.

    Raises
    ------
    AssertionError
        where the other assembly mode could be between them, so that the sign of a row would tell nothing.
    """
    known = dict(zip(question["coordinates"], question["given"], strict=True))
    assert not {"swing", "phi0"} & set(question["free"]) and question["objective"] == "max_abs_d2psi"
    stroke, phi0, most = abs(arb(known["swing"])), arb(known["phi0"]), arb(question["target"])
    if theta < known["phi0"]:
        ends = [farthest(arb(theta), stroke, phi0, most, sign) for sign in (-1, 1)]
    else:
        back = 2 * arb.pi() - phi0
        ends = [stroke - farthest(arb(theta) - phi0, stroke, back, most, sign) for sign in (1, -1)]
    coupler, rocker = arb(question["links"]["b"][0]), arb(known["c"] if "c" in known else question["links"]["c"][1])
    assert ends[1] - ends[0] < arb.pi()
    assert ((ends[1] - ends[0]) / 2).tan() * (coupler + rocker) < coupler * arb(question["cos2"]).sqrt()
    return (ends[0], ends[1]) if known["swing"] > 0 else (-ends[1], -ends[0])


def _combined(question: dict[str, Any], leaf: dict[str, Any], place: list[Any]) -> Jet:
    rows = Rows(question, place)
    total = Jet(arb(0), rows.zero)
    for kind, theta, factor in zip(leaf["kinds"], leaf["theta"], leaf["factors"], strict=True):
        between = sides(question, theta) if 18 <= kind <= 21 else (None, None)
        total = total + rows.row(kind, theta, between) * arb(factor)
    return total


def _holds(question: dict[str, Any], leaf: dict[str, Any], low: list[float], high: list[float], deep: int) -> bool:
    """Whether the claim of a leaf holds on a part of it."""
    centre = [0.5 * (p + q) for p, q in zip(low, high, strict=True)]
    whole = [arb(p).union(arb(q)) for p, q in zip(low, high, strict=True)]
    over = _combined(question, leaf, whole)
    bound = _combined(question, leaf, [arb(x) for x in centre]).value
    for slope, ball, x in zip(over.slopes, whole, centre, strict=True):
        bound += slope * (ball - arb(x))
    # Limits that contradict each other, or a combination that is at least the target.
    weighty = any(kind in OBJECTIVE for kind in leaf["kinds"])
    least = arb(question["target"]) if weighty else arb(0)
    if any(claim > least or (claim >= least and weighty) for claim in (bound, over.value)):
        return True
    if deep == 0:
        return False
    # The side whose slope is known worst; where the box is too wide for slopes, the widest in terms of the space.
    known = all(slope.is_finite() for slope in over.slopes)
    space = [q - p for p, q in zip(question["low"], question["high"], strict=True)]
    space += [high[-1] - low[-1]] * (len(low) - len(space))
    costs = [float(slope.rad()) if known else 1.0 / width for slope, width in zip(over.slopes, space, strict=True)]
    widest = max(range(len(low)), key=lambda k: (high[k] - low[k]) * costs[k])
    left, right = list(high), list(low)
    left[widest] = right[widest] = centre[widest]
    return _holds(question, leaf, low, left, deep - 1) and _holds(question, leaf, right, high, deep - 1)


def refuted(path: Path, deepest: int = DEEPEST) -> tuple[int, int]:
    """Boxes that were checked, and those whose claim could not be confirmed.

    Parameters
    ----------
    path : a certificate
    deepest : halvings of a box before it counts as refuted
    """
    table = pq.read_table(path)
    question = json.loads(table.schema.metadata[b"question"])
    leaves = table.to_pylist()
    checked = wrong = 0
    for leaf in leaves:
        assert leaf["outcome"] in ("bound", "empty")
        # Weights of the objective may not add up to more than 1, and those of limits are not positive.
        pairs = list(zip(leaf["factors"], leaf["kinds"], strict=True))
        weights = [Fraction(w) for w, kind in pairs if kind in OBJECTIVE]
        rest = [w for w, kind in pairs if kind not in OBJECTIVE]
        fair = sum(weights) <= 1 and all(w >= 0 for w in weights) and all(w <= 0 for w in rest)
        # A box without feasible designs must be one whatever the target is.
        fair = fair and (leaf["outcome"] == "bound" or all(kind < 16 for _, kind in pairs))
        low = [leaf[f"{name}_low"] for name in question["free"]]
        high = [leaf[f"{name}_high"] for name in question["free"]]
        if any(kind in ANY_CRANK for _, kind in pairs):
            least, most = question["links"]["a"]
            low, high = [*low, max(least or 0.0, 0.0)], [*high, most]
        checked += 1
        wrong += not (fair and _holds(question, leaf, low, high, deepest))
    return checked, wrong


def covers(path: Path) -> bool:
    """Whether the boxes of a certificate tile the space: they are what halving it again and again leaves."""
    table = pq.read_table(path)
    question = json.loads(table.schema.metadata[b"question"])
    names = question["free"]
    boxes = [tuple((leaf[f"{n}_low"], leaf[f"{n}_high"]) for n in names) for leaf in table.to_pylist()]
    return _tiled(tuple(zip(question["low"], question["high"], strict=True)), boxes)


def _tiled(whole: tuple[tuple[float, float], ...], boxes: list[tuple[tuple[float, float], ...]]) -> bool:
    if len(boxes) <= 1:
        return boxes == [whole]
    for k, (low, high) in enumerate(whole):
        middle = 0.5 * (low + high)
        left = [box for box in boxes if box[k][1] <= middle]
        right = [box for box in boxes if box[k][0] >= middle]
        if len(left) + len(right) == len(boxes) and left and right:
            halves = ((*whole[:k], end, *whole[k + 1 :]) for end in ((low, middle), (middle, high)))
            return all(_tiled(half, part) for half, part in zip(halves, (left, right), strict=True))
    return False
