"""Of two tops the one that is known less well may be the higher one: the error says so."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.numerics.panel_search import hill

# A slider-crank a thousand times as long as its offsets: the force on the slider has three valleys, two of them a
# millionth as high as its largest value, the lower one with sides so steep that little is known of its bottom.
LONG = {
    "a": 153757.58907568056, "b": 153836.52005348672, "e": 75.24036998567996, "f": 11.034240273400183,
    "alpha": 1.2793253154431636, "branch": -1.0, "m_crank": 1.9347935638090697e-4, "j_crank_zz": 0.1365832070150665,
    "m_coupler": 8.168840593831631e-5, "com_coupler_x": 23.547646903091273, "com_coupler_y": 3.621866020220774,
    "j_coupler_xx": 0.0040056771028752014, "j_coupler_yy": 0.06325564855752806, "j_coupler_zz": 0.041627163347531186,
    "m_slider": 3.0028782052338057e-4, "gravity_z": -6299.3038928571295, "rod_crank": 1.0, "rod_coupler": 1.0,
    "load_force": -77.50318045113387, "speed": 370.37130019343647,
}  # fmt: skip


@pytest.mark.parametrize("target", [1e-2, 1e-4, 1e-6, 1e-8])
def test_the_error_counts_what_the_other_valley_may_be_lower_by(target):
    found = sweep.summarise("rssp", LONG, ["min_force_c"], accuracy=target).loc[0]
    poses = sweep.evaluate("rssp", LONG, ["force_c"], phi=3.2693492183387436 + np.linspace(-1e-9, 1e-9, 2001))
    assert found.status == st.OK
    assert found.min_force_c - found.err_min_force_c <= poses.force_c.min() <= 19447.0
    assert found.err_min_force_c <= target * 1.3e10  # of the largest force


def test_a_top_a_hair_before_the_end_of_the_turn_is_its_beginning_behind_one_that_is_there():
    """Panels on both sides of angle 0 have one top twice: a distance of head208 was least at 2 pi - 1e-11."""
    end, err = 2.0 * np.pi - 1e-11, np.full(3, 1.1e-11)
    for phi, expected in (([2.8e-12, end, 1.0], 2.8e-12), ([1.0, 2.0, end], end), ([1.0, 2.0, end - 1e-9], 1.0)):
        place, _ = hill(np.zeros(3, np.int64), np.array(phi), err, np.ones(3), err, np.array([1]), np.zeros(3))
        assert place[0] == expected
