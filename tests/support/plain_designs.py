"""Designs of the plain linkages away from dead points, and their outputs at one angle."""

from __future__ import annotations

import numpy as np

import sweep

RANDOM = np.random.default_rng(12)
PHASES = {"rise": 1.1, "dwell": 0.6, "fall": 1.7, "start": 0.3}
WAVES = {f"{letter}{k}": 0.3 / k * (1 if letter == "c" else -1) for letter in "cs" for k in range(1, 7)}


def spread(count, /, **ranges):
    """Return random designs: a pair is an interval, a list the choices, a number itself."""
    columns = {}
    for name, values in ranges.items():
        if isinstance(values, tuple):
            columns[name] = RANDOM.uniform(*values, count)
        else:
            columns[name] = RANDOM.choice(np.atleast_1d(values).astype(float), count)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


# Proportions away from dead points, where no number of digits of the input fixes the output.
DESIGNS = {
    "slider_crank": spread(12, a=(0.2, 1.0), b=(2.0, 4.0), e=(-0.8, 0.8), branch=[1, -1]),
    "four_bar": spread(
        12, a=(0.5, 1.0), b=(2.6, 3.0), c=(2.3, 2.6), e=(2.7, 3.0), xi=(-2, 2), eta=(-2, 2), branch=[1, -1]
    ),
    "inverted_slider_crank": [
        *spread(8, a=(0.5, 1.0), e=(1.5, 3.0), h=(-0.4, 0.4), branch=[1, -1]),
        *spread(8, a=(1.5, 2.0), e=(-1.0, 1.0), h=(-0.4, 0.4), branch=[1, -1]),
    ],
    "epicyclic_dwell": spread(16, k=(0.5, 1.5), a=(-0.4, 0.4), n=[2, 3, 4, 7], mesh=[1, -1]),
    "cam": [
        *spread(12, lift=(5, 15), r0=(20, 40), e=(-8, 8), law=[1, 2, 3], **PHASES),
        *spread(4, lift=(5, 15), r0=(20, 40), e=(-8, 8), law=[4], **WAVES),
    ],
    "cam_lever": [
        *spread(12, lift=(0.1, 0.5), r0=(25, 40), c=(45, 60), e=(55, 70), law=[1, 2, 3], branch=[1, -1], **PHASES),
        *spread(4, lift=(0.05, 0.2), r0=(25, 40), c=(45, 60), e=(55, 70), law=[4], branch=[1, -1], **WAVES),
    ],
}
MOST = {"inverted_slider_crank": ("psi", "dpsi", "d2psi", "d3psi", "s", "ds", "d2s")}
PHI = (0.13, 0.9, 1.55, 2.4, 3.3, 4.1, 5.7)


def evaluated(name, design, want, phi):
    return sweep.evaluate(name, design, list(want), phi=[phi]).iloc[0]
