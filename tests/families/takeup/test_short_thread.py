"""Cam with a guided follower whose thread is hardly longer than the way between the guides."""

from __future__ import annotations

import math

import numpy as np
from mpmath import mp

import sweep
from kernels import status as st


def test_errors_of_a_cam_whose_thread_is_hardly_long_enough_grow_as_its_least_displacement_vanishes():
    """Roundings of the thread change S by L/(4 S) times as much: err_ was 3e-13 where the value was off by 8e-11."""
    rng = np.random.default_rng(8)
    for gap in 10.0 ** rng.uniform(-9.0, -4.0, 40):
        one, two = rng.uniform(1.0, 4.0), rng.uniform(0.01, 0.2)
        store = 2.0 * math.hypot(12.7, 1.8) + one - two + gap
        tight = {"X1": 3.3, "Z1": 12.7, "e": 5.1, "A1": one, "A2": two, "P_h": store}
        with mp.workdps(40):
            x1, z1, e, a1, a2, store = (mp.mpf(tight[name]) for name in ("X1", "Z1", "e", "A1", "A2", "P_h"))
            square = ((store - a1 + a2) / 2) ** 2 - z1**2 - (e - x1) ** 2  # the least thread is that at phi = pi
            least = float(mp.sqrt(square))
        found = sweep.summarise("guided_cam", tight, ["least_displacement"], accuracy=1e-8).iloc[0]
        assert found.status == st.OK
        assert abs(found.least_displacement - least) <= found.err_least_displacement <= 1e-8
