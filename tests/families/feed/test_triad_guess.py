"""Which assembly of the rack on three leads a guess chooses: the same one in every unit of length."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.families import family
from tests.families.feed.test_reference import TRIAD
from tests.reference import feed as naive

LENGTHS = tuple(p.name for p in family("feed_triad").parameters if p.unit == "length")


@pytest.mark.parametrize("unit", [1000.0, 25.4, 0.1])
def test_triad_of_a_poor_guess_lies_on_the_same_assembly_in_every_unit(unit):
    """Newton's method alone wandered through several turns of the rack before it happened on some assembly or none:
    10 of 300 such designs depended on the rounding of their lengths.
    """
    random = np.random.default_rng(1)
    rows = {name: value * np.exp(random.uniform(-0.15, 0.15, 200)) for name, value in TRIAD.items()}
    rows |= {"h_sigma": np.full(200, TRIAD["h_sigma"])}
    names = ["x_t", "y_t", "chi"]
    small = sweep.evaluate("feed_triad", rows, names, phi=[0.0])
    grown = {name: values * (unit if name in LENGTHS else 1.0) for name, values in rows.items()}
    large = sweep.evaluate("feed_triad", grown, names, phi=[0.0])
    assert small["status"].tolist() == large["status"].tolist()
    good = small["status"].to_numpy() == st.OK
    assert good.sum() > 100
    for name in names:
        size = unit if name in LENGTHS or name in ("x_t", "y_t") else 1.0
        # Lengths are rounded once more; leads that nearly lock amplify that.
        np.testing.assert_allclose(large[name][good], size * small[name][good], rtol=1e-8, atol=1e-8 * size)


def test_triad_starts_on_the_assembly_whose_links_grow_from_those_of_the_guess():
    """The lengths that fit the guess become those of the links in 2000 small steps, each followed by plain Newton."""
    random = np.random.default_rng(1)
    compared = 0
    for _ in range(40):
        row = {name: value * math.exp(random.uniform(-0.15, 0.15)) for name, value in TRIAD.items()}
        row |= {"h_sigma": TRIAD["h_sigma"]}
        got = sweep.evaluate("feed_triad", row, ["x_t", "y_t", "chi"], phi=[0.0]).iloc[0]
        followed = naive.triad_from_guess({k: float(v) for k, v in row.items()}, 2000)
        assert (followed is not None) == (got["status"] == st.OK)
        if followed is not None:
            compared += 1
            np.testing.assert_allclose([got["x_t"], got["y_t"], got["chi"]], followed, rtol=1e-9, atol=1e-9)
    assert 20 <= compared < 40  # some have no assembly near the guess


def test_triad_of_which_two_leads_cannot_reach_each_other_is_not_assembled():
    """It was NOT_CONVERGED, as a design of which only another guess would find an assembly."""
    random = np.random.default_rng(5)
    varied = {key: value * np.exp(random.uniform(-0.6, 0.6, 400)) for key, value in TRIAD.items() if key[0] in "xyrfq"}
    rows = {name: np.full(400, value) for name, value in TRIAD.items()} | varied
    status = sweep.evaluate("feed_triad", rows, ["x_t"], phi=[0.0])["status"].to_numpy()
    closes = np.array([naive.triad_closes({k: float(v[i]) for k, v in rows.items()}) for i in range(400)])
    assert set(status[~closes]) == {st.NOT_ASSEMBLED, st.NOT_CONVERGED}
    assert set(status[closes]) == {st.OK, st.NOT_CONVERGED}
    assert np.mean(status[~closes] == st.NOT_ASSEMBLED) > 0.75
