"""Subjects of the price list: every registered family and two chains, each with designs by region."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kernels import status as st
from studies.accuracy.regions import Region
from sweep.evaluation.summaries import design_outputs
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, Array, Family, Turn
from sweep.families.chain import Chain
from sweep.numerics.records import Mask

CHAINS = ("rssr+guide", "rssr+rssr")
NEAR, WIDE, FAR = 0.02, 0.3, 0.9  # largest share by which a parameter differs from the ordinary design's
ORDINARY, VARIED, EDGE = "ordinary", "wide", "near a change point"
TEXTS = {
    ORDINARY: "every parameter within 2 % of the family's ordinary design",
    VARIED: "every parameter within 30 % of the ordinary design's; only designs that move all the way",
    EDGE: "1e-6 to 1e-2 of the way from the end of the range of full motion back to an ordinary design",
}
MOVES = (st.OK, st.NOT_OSCILLATING)  # a follower that turns fully moves all the way
COARSE, CLOSE = Accuracy(samples=90), Accuracy(samples=3600)
HALVINGS = 26


def subjects() -> tuple[str, ...]:
    """Return the names of all families of the register, and of the chains."""
    return (*NAMES, *CHAINS)


def measure(mechanism: Family) -> str:
    """Return the design output of the price list.

    It is the largest second derivative of the position over the turn, if the register names that output; for an
    interval, a march, or a position without derivatives, the range of the position.
    """
    first = mechanism.derivative_of.get(mechanism.position, "")
    second = mechanism.derivative_of.get(first, "")
    return f"max_abs_{second}" if second and isinstance(mechanism.domain, Turn) else f"range_{mechanism.position}"


def example(mechanism: Family) -> Array:
    """Return the ordinary design of a family, or of a chain's stages, as one row of the design matrix."""
    given = dict(mechanism.example)
    if isinstance(mechanism, Chain):
        given = {f"{name}{s.number}": value for s in mechanism.stages for name, value in s.family.example.items()}
    return np.array([given.get(p.name, p.default or 0.0) for p in mechanism.parameters], dtype=np.float64)


def around(mechanism: Family, count: int, share: float, generator: np.random.Generator) -> Array:
    """Return designs that differ from the ordinary one by at most ``share`` in every parameter without choices."""
    fixed = np.array([p.choices is not None for p in mechanism.parameters])
    change = generator.uniform(-share, share, (count, fixed.size))
    return np.ascontiguousarray(example(mechanism) * (1.0 + np.where(fixed, 0.0, change)))


def moves(mechanism: Family, designs: Array, grid: Accuracy = COARSE) -> Mask:
    """Tell whether each design moves all the way, to the resolution of a grid."""
    return np.isin(design_outputs(mechanism, designs, [measure(mechanism)], grid)["status"], MOVES)


def regions_of(name: str, counts: tuple[int, int, int], seed: int = 1) -> Iterator[Region]:
    """Yield the regions of a family, with at most ``counts`` designs each; a cam has no change points."""
    mechanism, generator = family(name), np.random.default_rng(seed)
    for region, share, count in zip((ORDINARY, VARIED), (NEAR, WIDE), counts, strict=False):
        designs = around(mechanism, max(3 * count, 1), share, generator)
        moving = designs[moves(mechanism, designs)][:count]
        if len(moving):
            yield Region(region, TEXTS[region], np.ascontiguousarray(moving))
    edge = _edge(mechanism, counts[2], generator) if counts[2] else np.empty((0, 0))
    if len(edge):
        yield Region(EDGE, TEXTS[EDGE], edge)


def _edge(mechanism: Family, count: int, generator: np.random.Generator) -> Array:
    """Return designs just inside the range of motion, on lines from ordinary ones to ones that get stuck."""
    far = around(mechanism, 12 * count, FAR, generator)
    stuck = far[~moves(mechanism, far)][:count]
    inside = around(mechanism, len(stuck), NEAR, generator)
    pairs = moves(mechanism, inside) if len(stuck) else np.zeros(0, np.bool_)
    start, way = inside[pairs], stuck[pairs] - inside[pairs]
    low, high = np.zeros((len(start), 1)), np.ones((len(start), 1))
    for _ in range(HALVINGS if len(start) else 0):
        middle = 0.5 * (low + high)
        free = moves(mechanism, start + middle * way)[:, None]
        low, high = np.where(free, middle, low), np.where(free, high, middle)
    designs = start + low * (1.0 - 10.0 ** generator.uniform(-6.0, -2.0, low.shape)) * way
    return np.ascontiguousarray(designs[moves(mechanism, designs, CLOSE)] if len(designs) else designs)
