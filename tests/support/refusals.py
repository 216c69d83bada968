"""Limits that a design violates, in words."""

from collections.abc import Iterable, Mapping

import numpy as np

from sweep.quantities.limits import Limit, compared, meets


def refusals(limits: Iterable[Limit], values: Mapping[str, float]) -> list[str]:
    """Describe the limits that a design violates, each with its value and bound; a missing value violates any."""
    found = []
    for limit in limits:
        value = values[limit.output]
        if meets(limit, np.array([value]))[0]:
            continue
        bounds = (("at least", limit.minimum), ("at most", limit.maximum))
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
        found.append(f"{limit.output} = {compared(limit.output, value):.4g}, {words} is asked")
    return found
