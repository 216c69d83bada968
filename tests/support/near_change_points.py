"""Crank-rockers very close to a change point, some with long couplers, and their maxima by brute force."""

from __future__ import annotations

import numpy as np

from sweep.families import family
from sweep.families.base import Angles
from tests.support.climbing import climbed
from tests.support.rssr_designs import margins

RSSR = family("rssr")
LONG = (
    0.306593034235277, 26770.817643573933, 1.3485941974052034, 26769.775308645705, -2.1707643412937463,
    2.2710051078992244, 0.6173511623060142, -1.0,
)  # fmt: skip


def placed(n, r, longest):
    """Return designs whose coupler connects joints placed first; ``longest`` is the largest offset in cranks."""
    designs = np.column_stack(
        [
            r.uniform(0.1, 1.0, n), np.ones(n), r.uniform(0.5, 4.0, n), r.uniform(-3.0, 3.0, n),
            r.uniform(-3.0, 3.0, n), r.uniform(-3.0, 3.0, n), r.uniform(0.0, np.pi, n), r.choice([-1.0, 1.0], n),
        ]
    )  # fmt: skip
    if longest > 1.0:
        which = r.integers(3, 6, n)
        rows = np.arange(n)
        designs[rows, which] = np.copysign(10.0 ** r.uniform(2.0, np.log10(longest), n), designs[rows, which])
    a, _, c, e, f, g, alpha, _ = designs.T
    phi, psi = r.uniform(0.0, 2.0 * np.pi, (2, n))
    x = e + c * np.cos(psi) - a * np.cos(phi)
    y = c * np.sin(psi) - f * np.sin(alpha) - a * np.cos(alpha) * np.sin(phi)
    z = g - f * np.cos(alpha) + a * np.sin(alpha) * np.sin(phi)
    designs[:, 1] = np.sqrt(x * x + y * y + z * z)
    return designs


def near_change_points(n, seed, longest=1e5, lowest=1e-10, highest=1e-4):
    """Return (n, 8) designs whose margin lies between two small numbers: rockers just long enough to turn."""
    r, found = np.random.default_rng(seed), []
    while sum(map(len, found)) < n:
        designs = placed(8 * n, r, longest)
        designs = designs[margins(designs)["rotatable"] == 1.0]
        turning, not_turning = designs[:, 2].copy(), np.zeros(len(designs))
        for _ in range(80):
            designs[:, 2] = 0.5 * (turning + not_turning)
            turns = margins(designs)["margin"] > 0.0
            turning, not_turning = np.where(turns, designs[:, 2], turning), np.where(turns, not_turning, designs[:, 2])
        designs[:, 2] = turning * (1.0 + 10.0 ** r.uniform(-12.0, -3.0, len(designs)))
        margin = margins(designs)["margin"]
        found.append(designs[(margin > lowest) & (margin < highest)])
    return np.ascontiguousarray(np.concatenate(found)[:n])


def tiny_cranks(n, seed):
    """Return designs with cranks of 1e-12 to 1e-5 of the other links, couplers just longer than necessary to turn."""
    r, found = np.random.default_rng(seed), []
    while sum(map(len, found)) < n:
        designs = placed(8 * n, r, 1.0)
        a, _, c, e, f, g, alpha, _ = designs.T
        a[:] = 10.0 ** r.uniform(-12.0, -5.0, len(designs))
        across, along = np.hypot(e, f * np.sin(alpha)), g - f * np.cos(alpha)
        turning = np.hypot(across - c, along) * (1.0 + a * r.uniform(0.0, 3.0, len(designs)))
        designs[:, 1] = turning
        keep = margins(designs)["rotatable"] == 1.0
        designs, turning = designs[keep], turning[keep]
        not_turning = np.zeros(len(designs))
        for _ in range(80):
            designs[:, 1] = 0.5 * (turning + not_turning)
            turns = margins(designs)["margin"] > 0.0
            turning, not_turning = np.where(turns, designs[:, 1], turning), np.where(turns, not_turning, designs[:, 1])
        designs[:, 1] = turning * (1.0 + 10.0 ** r.uniform(-10.0, -2.0, len(designs)))
        found.append(designs[margins(designs)["margin"] > 1e-11])
    return np.ascontiguousarray(np.concatenate(found)[:n])


def crowded_angles(designs):
    """Return some 2000 crank angles per design, dense near the least discriminant, found by its own kernel."""
    deepest = margins(designs)["phi_min"]
    away = np.concatenate([[0.0], np.geomspace(1e-9, np.pi, 600)])
    fine = np.concatenate([-away[::-1], away])
    return np.concatenate(
        [np.tile(np.arange(1024) * (2.0 * np.pi / 1024), (len(designs), 1)), deepest[:, None] + fine], axis=1
    )


def brute_maxima(designs, pose):
    """Return the largest magnitude by brute force: the four highest of all crowded poses, climbed."""
    precise = RSSR.precise()
    phi = np.sort(np.mod(crowded_angles(designs), 2.0 * np.pi), axis=1)
    values = np.abs(precise.poses(designs, Angles.of(phi), frozenset([pose]))[pose])
    values = np.where(np.isnan(values), -np.inf, values)
    top = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    columns = np.argsort(np.where(top, values, -np.inf), axis=1)[:, -4:]
    best = values.max(axis=1)
    for k in range(4):
        start = np.take_along_axis(phi, columns[:, k : k + 1], axis=1)[:, 0]
        for width in (3e-3, 1e-5, 1e-7):
            best = np.maximum(best, climbed(RSSR, designs, pose, 0, start, width))
    return best


def brute_range(designs):
    """Return the largest minus the smallest rocker angle, both climbed from the best of the crowded poses."""
    precise, rows = RSSR.precise(), np.arange(len(designs))
    phi = np.sort(np.mod(crowded_angles(designs), 2.0 * np.pi), axis=1)
    psi = np.unwrap(precise.poses(designs, Angles.of(phi), frozenset(["psi"]))["psi"], axis=1)
    ends = []
    for sign in (1.0, -1.0):
        column = (sign * psi).argmax(axis=1)
        at, start = phi[rows, column], psi[rows, column]
        best, width = sign * start, 3e-3
        while width > 1e-12:
            angles = at[:, None] + width * np.arange(-4.0, 5.0) / 4.0
            values = precise.poses(designs, Angles.of(angles), frozenset(["psi"]))["psi"]
            values = sign * (values + 2.0 * np.pi * np.rint((start[:, None] - values) / (2.0 * np.pi)))
            which = values.argmax(axis=1)
            better = values[rows, which] >= best
            at = np.where(better, angles[rows, which], at)
            best = np.maximum(best, values[rows, which])
            width *= 0.5
        ends.append(best)
    return ends[0] + ends[1]
