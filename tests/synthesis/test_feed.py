"""Refinement of a feed's lift chain: the dimensions that made a motion are found again, faults are named."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.errors import InputError
from sweep.synthesis import feed as refinement

ROWS = [r for r in json.loads((Path(__file__).parents[1] / "oracle" / "feed_open.json").read_text())["rows"]
        if r["kind"] == "rack"]  # fmt: skip


def test_lift_chain_recovers_the_dimensions_that_made_the_motion():
    p = ROWS[4]["inputs"]
    phi = np.linspace(0.0, 6.0, 9)
    motion = sweep.evaluate("feed", {k: v for k, v in p.items() if k != "phi"}, ["chi", "y_t"], phi=phi)
    for norm in ("squares", "largest"):
        found = refinement.lift_chain(p, phi, motion.chi, norm=norm)
        # nearly dependent columns: the rack turns by a few hundredths of a radian
        np.testing.assert_allclose([found.fx, found.fy, found.q], [p["fx"], p["fy"], p["q"]], rtol=1e-10)
        assert found.bar_branch == p["bar_branch"]
        assert np.abs(found.difference).max() < 1e-13
    sides = [refinement.rack_angles(p, phi, motion.y_t, side) for side in (1, -1)]
    assert min(np.abs(side - motion.chi).max() for side in sides) < 1e-13


def test_lift_chain_minimax_levels_the_largest_difference_and_squares_their_sum():
    p = ROWS[4]["inputs"]
    phi = np.linspace(0.0, 6.0, 12)
    chi = sweep.evaluate("feed", {k: v for k, v in p.items() if k != "phi"}, "chi", phi=phi).chi
    wanted = chi + 1e-3 * np.sin(3.0 * phi)
    level, least = (refinement.lift_chain(p, phi, wanted, norm=norm) for norm in ("largest", "squares"))
    weighted = np.sort(np.abs(level.difference * level.q))
    # three unknowns: the largest weighted difference is met at four poses
    np.testing.assert_allclose(weighted[-4:], weighted[-1], rtol=1e-6)
    assert weighted[-1] < np.abs(least.difference * least.q).max()
    assert np.sum((least.difference * least.q) ** 2) < np.sum((level.difference * level.q) ** 2)


def test_lift_chain_refuses_what_does_not_fix_the_dimensions():
    p = ROWS[4]["inputs"]
    with pytest.raises(InputError, match="at least 3"):
        refinement.lift_chain(p, [0.0, 1.0], [0.0, 0.1])
    with pytest.raises(InputError, match="three poses"):
        refinement.lift_chain(p, [0.0, 0.0, 0.0], [0.1, 0.1, 0.1])
    with pytest.raises(InputError, match="phi"):
        refinement.lift_chain(p | {"h_a": 9.0}, [0.0, 1.0, 2.0], [0.1, 0.2, 0.1])
    for name, phi, chi, weights in (
        ("phi", [0.0, np.inf, 2.0], [0.1, 0.2, 0.1], None),
        ("chi", [0.0, 1.0, 2.0], [0.1, np.nan, 0.1], None),
        ("weights", [0.0, 1.0, 2.0], [0.1, 0.2, 0.1], [1.0, np.nan, 1.0]),
    ):
        with pytest.raises(InputError, match=f"column {name}, row 1"):
            refinement.lift_chain(p, phi, chi, weights=weights)
    assert np.isnan(refinement.rack_angles(p, [0.0], [1e3])).all()
