"""Five-links on the locus of a crank-rocker keep its limit positions."""

from __future__ import annotations

import numpy as np

import sweep
from kernels import status as st
from sweep.synthesis.mechanisms import five_links_with_limits
from tests.support.rssr_designs import random_designs


def test_five_links_with_limits_keep_the_limit_positions_of_the_crank_rocker():
    # of 300 there are two whose places with h = -1.5 lie on two assembly modes; they had status 0 and another swing
    designs = random_designs(300, 21, rotatable=True)
    table = dict(zip(("a", "b", "c", "e", "f", "g", "alpha", "branch"), designs.T, strict=True))
    wanted = ["psi_ext", "psi_fold", "phi_ext", "phi0", "swing"]
    theirs = sweep.summarise("rssr", table, wanted, accuracy=1e-10)
    for h in (0.5, -1.5):
        found = five_links_with_limits(table, h)
        good = (found.status == st.OK) & (theirs.status == st.OK)
        assert good.sum() >= 270 and (found.status == st.NOT_ADMISSIBLE).any()
        ours = sweep.summarise("five_link", found[good].drop(columns="status"), wanted, accuracy=1e-10)
        assert (ours.status == st.OK).all()
        for name in wanted:
            apart = np.exp(1j * ours[name].to_numpy()) - np.exp(1j * theirs.loc[good, name].to_numpy())
            assert np.abs(apart).max() < 1e-8, name  # phi at an extremum is known to the root of its target


def test_five_links_with_limits_do_not_exist_for_a_joint_longer_than_the_reach():
    designs = random_designs(6, 21, rotatable=True)
    table = dict(zip(("a", "b", "c", "e", "f", "g", "alpha", "branch"), designs.T, strict=True))
    found = five_links_with_limits(table, 1e4)
    assert (found.status != st.OK).all() and (found.status == st.NOT_ADMISSIBLE).any()
    assert found.loc[found.status == st.NOT_ADMISSIBLE, ["a", "b"]].isna().all().all()
