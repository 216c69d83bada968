"""Random crank-rockers by region: easy and hard ones for float64 and for a grid of crank angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels import status as st
from kernels.families import rssr
from sweep.families.base import Array

ALPHA = 6
# Regions by the largest pressure angle [deg]: name, text, from, up to.
PRESSURE = (
    ("ordinary", "below 60", 0.0, 60.0),
    ("pressure angle 60-75", "60 to 75", 60.0, 75.0),
    ("pressure angle 75-84", "75 to 84", 75.0, 84.0),
    ("pressure angle beyond 84", "84 to 89.4", 84.0, 89.4),
)


@dataclass(frozen=True)
class Region:
    """Name as in the tables, and the common property of the region's designs."""

    name: str
    text: str
    designs: Array


def drawn(n: int, generator: np.random.Generator) -> Array:
    """Return n designs of general proportions: crank up to 1, other lengths up to 5, any angle between the axes."""
    r = generator
    lengths = [r.uniform(0.1, 1.0, n), r.uniform(0.5, 5.0, n), r.uniform(0.5, 4.0, n)]
    offsets = [r.uniform(-3.0, 3.0, n), r.uniform(-2.0, 2.0, n), r.uniform(-2.0, 2.0, n)]
    return np.column_stack([*lengths, *offsets, r.uniform(0.0, np.pi, n), r.choice([-1.0, 1.0], n)])


def margins(designs: Array) -> Array:
    """Return the least cos^2 of the pressure angle over the turn; nan for a crank that does not turn fully."""
    status, margin = np.empty(len(designs), np.uint8), np.empty(len(designs))
    rssr.margin(designs, status, margin, None, None, None, None)
    return np.where(status == st.OK, margin, np.nan)


def rotatable(n: int, seed: int) -> Array:
    """Return the first n designs of :func:`drawn` whose crank turns fully."""
    generator = np.random.default_rng(seed)
    found: list[Array] = []
    while sum(map(len, found)) < n:
        designs = drawn(4 * n, generator)
        found.append(designs[margins(designs) > 0.0])
    return np.ascontiguousarray(np.concatenate(found)[:n])


def regions(n: int, seed: int) -> tuple[Region, ...]:
    """Return seven regions of n rotatable designs each."""
    plain = rotatable(40 * n, seed)
    angle = np.degrees(np.arccos(np.sqrt(margins(plain))))
    found = [
        Region(name, f"largest pressure angle {text} degrees", plain[(angle >= low) & (angle < high)])
        for name, text, low, high in PRESSURE
    ]
    found += [
        Region("change point", "coupler within 1e-9 to 1e-5 of one with a dead point", _change_points(plain, n, seed)),
        Region("parallel axes", "alpha 1e-8 to 1e-3, offsets f and g about 100 cranks", _parallel(n, seed)),
        Region("long coupler", "one of e, f, g and the coupler 1e2 to 1e5 cranks long", _long(n, seed)),
    ]
    for region in found:
        assert len(region.designs) >= n, region.name
    return tuple(Region(r.name, r.text, np.ascontiguousarray(r.designs[:n])) for r in found)


def shortest_couplers(designs: Array) -> Array:
    """Return the shortest coupler with which each crank still turns, to the resolution of float64."""
    low, high, trial = np.zeros(len(designs)), designs[:, 1].copy(), designs.copy()
    for _ in range(60):
        trial[:, 1] = 0.5 * (low + high)
        turns = margins(trial) > 0.0
        high, low = np.where(turns, trial[:, 1], high), np.where(turns, low, trial[:, 1])
    return high


def _change_points(plain: Array, n: int, seed: int) -> Array:
    """Return designs whose coupler is just above the shortest that lets the crank turn."""
    generator = np.random.default_rng(seed + 1)
    designs = plain[: 4 * n].copy()
    designs[:, 1] = shortest_couplers(designs) * (1.0 + 10.0 ** generator.uniform(-9.0, -5.0, len(designs)))
    return designs[margins(designs) > 0.0]


def _parallel(n: int, seed: int) -> Array:
    generator = np.random.default_rng(seed + 2)
    designs = drawn(40 * n, generator)
    designs[:, ALPHA] = 10.0 ** generator.uniform(-8.0, -3.0, len(designs))
    designs[:, 5] += generator.uniform(-100.0, 100.0, len(designs))
    designs[:, 4] = designs[:, 5] + generator.uniform(-0.5, 0.5, len(designs))
    return designs[margins(designs) > 0.0]


def _long(n: int, seed: int) -> Array:
    """Return designs with one long offset, whose coupler is the distance of joints placed first."""
    generator = np.random.default_rng(seed + 3)
    designs = drawn(60 * n, generator)
    rows, which = np.arange(len(designs)), generator.integers(3, 6, len(designs))
    designs[rows, which] = np.copysign(10.0 ** generator.uniform(2.0, 5.0, len(designs)), designs[rows, which])
    a, _, c, e, f, g, alpha, _ = designs.T
    phi, psi = generator.uniform(0.0, 2.0 * np.pi, (2, len(designs)))
    x = e + c * np.cos(psi) - a * np.cos(phi)
    y = c * np.sin(psi) - f * np.sin(alpha) - a * np.cos(alpha) * np.sin(phi)
    z = g - f * np.cos(alpha) + a * np.sin(alpha) * np.sin(phi)
    designs[:, 1] = np.sqrt(x * x + y * y + z * z)
    return designs[margins(designs) > 1e-12]
