"""Random mechanisms for the tests of extrema: crank-rockers, slider-cranks, guided four-bars and chains."""

from __future__ import annotations

import numpy as np

from sweep.families import family

RSSR, RSSP, GUIDE = family("rssr"), family("rssp"), family("guide")
NEEDLE, DRIVEN_SLIDER = family(["rssr", "guide"]), family(["rssr", "rssp"])


def crank_rockers(n, seed):
    r = np.random.default_rng(seed)
    lengths = [r.uniform(0.1, 1.0, n), r.uniform(0.5, 5.0, n), r.uniform(0.5, 4.0, n)]
    offsets = [r.uniform(-3.0, 3.0, n), r.uniform(-2.0, 2.0, n), r.uniform(-2.0, 2.0, n)]
    return np.column_stack([*lengths, *offsets, r.uniform(0.0, np.pi, n), r.choice([-1.0, 1.0], n)])


def slider_cranks(n, seed):
    r = np.random.default_rng(seed)
    ranges = [(0.1, 1.0), (1.0, 4.0), (-1.0, 1.0), (-1.0, 1.0), (0.0, 1.2)]
    return np.column_stack([*(r.uniform(*ends, n) for ends in ranges), r.choice([-1.0, 1.0], n)])


def guided_four_bars(n, seed, crank=(0.1, 1.0)):
    r = np.random.default_rng(seed)
    ranges = [crank, (1.0, 4.0), (0.8, 3.0), (0.8, 4.0), (-1.0, 5.0), (-2.0, 2.0), (-3.0, 3.0), (-1.0, 4.0)]
    return np.column_stack([*(r.uniform(*ends, n) for ends in ranges), r.choice([-1.0, 1.0], n)])


def needle_drives(n, seed):
    r = np.random.default_rng(seed + 1000)
    coupling = np.column_stack([r.choice([-1.0, 1.0], n), r.uniform(-3.0, 3.0, n), np.zeros((n, 2))])
    return np.column_stack([crank_rockers(n, seed), guided_four_bars(n, seed + 1, (0.5, 2.0)), coupling])


def driven_sliders(n, seed):
    r = np.random.default_rng(seed + 2)
    coupling = np.column_stack([r.choice([-1.0, 1.0], n), r.uniform(-3.0, 3.0, n), np.zeros((n, 2))])
    return np.column_stack([crank_rockers(n, seed), slider_cranks(n, seed + 1), coupling])


MAKERS = {"rssr": (RSSR, crank_rockers), "rssp": (RSSP, slider_cranks), "guide": (GUIDE, guided_four_bars)}
MAKERS["rssr+guide"] = (NEEDLE, needle_drives)
