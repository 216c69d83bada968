"""Scrambled Sobol points of the searches: those of scipy.stats.qmc, bit for bit, without its import.

That package takes a third of a second to import, as long as half of a small search.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.sobol import BITS
from sweep.families.base import Array
from sweep.study.sobol import DIMENSIONS, direction_numbers

DIGITS = 30  # of a point
_POWERS = 1 << np.arange(DIGITS, dtype=np.int64)


def sobol(dimensions: int, seed: int | np.random.Generator) -> Any:
    """Return a source of points: ``random(n)`` gives the next n, (n, dimensions), in [0, 1).

    The points are those of ``scipy.stats.qmc.Sobol(dimensions, seed=seed)``; more dimensions than the tables of
    `sweep.study.sobol` have are left to scipy.
    """
    if dimensions <= DIMENSIONS:
        return Sobol(dimensions, seed)
    from scipy.stats import qmc

    return qmc.Sobol(dimensions, seed=seed)


class Sobol:
    """A sequence scrambled by a random lower-triangular mixing of the digits and a random digital shift (Matousek)."""

    def __init__(self, dimensions: int, seed: int | np.random.Generator) -> None:
        rng = seed.spawn(1)[0] if isinstance(seed, np.random.Generator) else np.random.default_rng(seed)
        self._shift: NDArray[np.int64] = rng.integers(2, size=(dimensions, DIGITS), dtype=np.uint32) @ _POWERS
        mixing = np.tril(rng.integers(2, size=(dimensions, DIGITS, DIGITS), dtype=np.uint32), -1)
        mixing += np.eye(DIGITS, dtype=np.uint32)
        plain = np.array([direction_numbers(k)[:DIGITS] for k in range(dimensions)], np.int64) >> (BITS - DIGITS)
        # Digits from the highest on: each becomes the sum, modulo 2, of itself and a choice of those above it.
        digits = plain[:, :, None] >> np.arange(DIGITS)[::-1] & 1
        self._directions = (digits @ mixing.transpose(0, 2, 1) & 1) @ _POWERS[::-1]
        self._number = 0

    def random(self, count: int) -> Array:
        """Return the next points, (count, dimensions)."""
        number = np.arange(self._number, self._number + count)
        self._number += count
        gray = number ^ (number >> 1)
        points = np.repeat(self._shift[None, :], count, axis=0)
        for digit in range(int(gray.max(initial=0)).bit_length()):
            points[(gray >> digit & 1) == 1] ^= self._directions[:, digit]
        return np.asarray(points * 2.0**-DIGITS, np.float64)
