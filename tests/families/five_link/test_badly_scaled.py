"""Extrema of five-links whose closure is a small difference of long lengths: within their errors, which say so."""

from __future__ import annotations

import numpy as np
from mpmath import mpf

import sweep
from kernels import status as st
from tests.families.five_link.test_reference import GEOMETRY, ORDERS, random_five_links
from tests.reference import five_link as naive

# b and e 3000 cranks long: the closure is a small difference of their squares.
FAR = (1.0, 2904.2082808971636, 9.771873732349862, -2912.7866295651665, -3.4758057443520523, -3.3194935607369507,
       -2.860942809846363, 0.0, 0.0)  # fmt: skip


def badly_scaled(n, seed):
    """Links whose coupler and frame are up to ten thousand cranks long and nearly alike; a third crank-rockers."""
    r = np.random.default_rng(seed)
    long, c = 10.0 ** r.uniform(0.0, 4.0, n), 10.0 ** r.uniform(0.2, 1.2, n)
    h = r.choice([-1.0, 0.0, 1.0], n) * 10.0 ** r.uniform(-3.0, 1.0, n)
    f, g, s2 = r.uniform(-2.0, 2.0, (3, n))
    e = (long + r.choice([0.0, 1.0], n) * h) * r.choice([-1.0, 1.0], n)
    b = np.abs(long + 0.9 * r.uniform(-1.0, 1.0, n) * c)
    return np.column_stack([np.ones(n), b, c, e, f, g, r.uniform(-3.0, 3.0, n), h, s2 * (h != 0.0)])


def test_five_link_extrema_of_badly_scaled_links_are_within_their_errors():
    links = np.vstack([FAR, badly_scaled(60, 1)])
    table = dict(zip(GEOMETRY, links.T, strict=True))
    for order in (1, 2, 3):
        pose = list(ORDERS)[order]
        name = f"max_abs_{pose}"
        found = sweep.summarise("five_link", table, [name, f"phi_{name}"], accuracy=1e-12)
        phi = found[f"phi_{name}"].fillna(0.0)
        psi = sweep.evaluate("five_link", table | {"phi": phi}, ["psi"]).psi
        checked = 0
        for k in np.flatnonzero(found.status == st.OK):
            # at a maximum the error of its place enters squared, far below the error claimed
            exact = abs(naive.outputs(tuple(links[k]), phi[k], psi[k])[pose])
            assert abs(exact - mpf(float(found[name][k]))) <= found[f"err_{name}"][k], (pose, k)
            checked += 1
        assert checked > 30
    assert found.status[0] == st.OK
    peak = sweep.summarise("five_link", dict(zip(GEOMETRY, FAR, strict=True)), ["max_abs_d2psi"], accuracy=1e-12)
    assert abs(peak.max_abs_d2psi[0] - 0.52633552638277487) <= peak.err_max_abs_d2psi[0] < 1e-10


def test_five_link_errors_of_ordinary_links_stay_small():
    links, _ = random_five_links(400, 21)
    links[:, 0] *= 0.3
    found = sweep.summarise("five_link", dict(zip(GEOMETRY, links.T, strict=True)), ["max_abs_d2psi"], accuracy=1e-12)
    good = found[found.status == st.OK]
    # half of them within 384 roundings, as many as without a look at the rounding of the inputs
    assert len(good) > 100
    assert (good.err_max_abs_d2psi / good.max_abs_d2psi).median() < 400.0 * 2.0**-53
