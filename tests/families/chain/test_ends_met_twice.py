"""A last stage that turns back within the swing of its driver stands twice a turn at one end of its way."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st

ROCKER = {"a1": 1.349, "b1": 4.865, "c1": 3.147, "e1": 5.8, "f1": -0.385, "g1": 0.62, "alpha1": 0.017, "branch1": -1.0}
SLOT = {"a2": 0.954, "e2": -5.161, "f2": 0.51, "g2": 0.809, "alpha2": 0.171, "s2": -0.248, "offset2": -0.373}
DRIVE = ROCKER | SLOT


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4, 1e-6, 1e-8, 1e-10])
def test_the_place_is_the_first_of_both_at_every_accuracy(accuracy):
    poses = sweep.evaluate(["rssr", "slotted"], DRIVE, ["psi"], phi=np.arange(36_000) * (2.0 * np.pi / 36_000))
    psi = poses.psi.to_numpy()
    tops = np.flatnonzero((psi > np.roll(psi, 1)) & (psi >= np.roll(psi, -1)) & (psi > psi.max() - 1e-7))
    assert len(tops) == 2  # the same height, as the slot meets its end coming and going
    names = ["phi_max_psi", "max_psi"]
    found = sweep.summarise(["rssr", "slotted"], DRIVE, names, accuracy=accuracy).loc[0]
    assert found.status == st.OK
    assert found.phi_max_psi == pytest.approx(poses.phi[tops[0]], abs=2e-4)  # the spacing of the poses
