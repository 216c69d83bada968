"""How the share that may miss its limits is spent: most of it where room is dear, hardly any where it is cheap."""

from __future__ import annotations

import math

import numpy as np

from sweep.families.base import Array

STEPS = (
    0.2,
    0.1,
    0.05,
)  # of the search for offsets, in standard deviations; finer ones would follow the sample's noise
TURNS = 100  # rounds of each step at most


def risk_allocation(excess: Array, prices: Array, share: float, reach: float = math.inf) -> tuple[Array, float]:
    """Return how much more room each limit gets so that a share of a sample keeps all of them, at the least price.

    More room moves all of the sample away from a limit.  The share holds where the largest excess less its limit's
    shift is negative; the sum of prices times shifts is made small under this condition.

    Parameters
    ----------
    excess : (n, L) by how much each mechanism exceeds each limit, in the limit's unit of room; negative where it keeps
        it, infinite where nothing helps
    prices : (L,) what a unit of room costs, not negative
    share : of the sample that has to keep all limits, between 0 and 1
    reach : distance at most of a limit's shift from that of the dearest one

    Returns
    -------
    shifts (L,), and what they save against one shift for all limits.  Both shifts are infinite where too many
    mechanisms are lost.

    Notes
    -----
    For normally distributed excesses the share is log-concave in the shifts (Prekopa 1971), so there is one least
    price, and a compass search finds it.  Its last step leaves some 0.1 % of the saving.
    """
    number = min(max(math.ceil(share * len(excess)), 1), len(excess)) - 1
    weights = prices if prices.any() else np.ones(len(prices))
    total, dearest = float(weights.sum()), int(np.argmax(weights))

    def common(offsets: Array) -> float:
        return float(np.partition((excess - offsets).max(axis=1), number)[number])

    offsets = np.zeros(len(weights))
    together = best = total * common(offsets)
    if not math.isfinite(best):
        return np.full(len(weights), math.inf), 0.0
    for step in STEPS:
        for _ in range(TURNS):
            before = best
            for k in range(len(weights)):
                for move in (step, -step):
                    trial = offsets.copy()
                    trial[k] += move
                    if k == dearest or abs(trial[k]) > reach:
                        continue
                    value = float((weights * trial).sum()) + total * common(trial)
                    if value < best:
                        offsets, best = trial, value
            if best >= before:
                break
    return offsets + common(offsets), together - best
