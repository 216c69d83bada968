"""A finger in the ball joint of the crank turns the coupler at once where it comes next to the crank axis.

There joint forces have a peak that is a thousandth of a radian wide, between all even samples that the rest of the
curve asks for.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st

NEAR = 2.1975  # crank angle of the peak [rad]
DRIVE = {"a": 30.31834, "b": 80.61159, "e": -17.77903, "f": -18.80345, "alpha": 1.1926785, "branch": 1.0}
LOADS = {
    "speed": 2200.0, "finger": 1.0, "m_coupler": 8e-3, "com_coupler_x": 17.4, "j_coupler_xx": 0.06,
    "j_coupler_yy": 0.12, "j_coupler_zz": 0.06, "m_crank": 0.02, "rod_crank": 1.0, "line_mass_crank": 0.034,
    "m_slider": 0.04,
}  # fmt: skip


def highest():
    """The largest force along x by poses closer to each other than the peak is wide."""
    phi = NEAR + np.linspace(-2e-3, 2e-3, 40_001)
    return sweep.evaluate("rssp", DRIVE | LOADS, ["force_a_x"], phi=phi).force_a_x.max()


@pytest.mark.parametrize("target", [1e-3, 1e-6])
def test_a_peak_between_samples_is_found(target):
    found = sweep.summarise("rssp", DRIVE | LOADS, ["max_force_a_x"], accuracy=target).loc[0]
    rest = sweep.evaluate("rssp", DRIVE | LOADS, ["force_a_x"], phi=np.linspace(3.0, 7.0, 400)).force_a_x.max()
    assert highest() > 1e6 * rest
    assert found.status == st.OK
    above = found.max_force_a_x / highest() - 1.0
    assert -target <= above <= target + 1e-6  # the dense grid is up to (1e-7/2e-4)^2 too low


def test_a_member_of_a_machine_has_the_same_peak():
    table = {f"drive.{name}": value for name, value in (DRIVE | LOADS).items()}
    machine = sweep.machine({"drive": {"family": "rssp", "ratio": 2}})
    found = sweep.summarise(machine, table, ["drive.max_force_a_x"], accuracy=1e-3).loc[0]
    assert found.status == st.OK
    np.testing.assert_allclose(found["drive.max_force_a_x"], highest(), rtol=1e-3)


def test_without_a_finger_at_the_crank_there_is_no_peak():
    found = sweep.summarise("rssp", DRIVE | LOADS | {"finger": 0.0}, ["max_force_a_x"], accuracy=1e-6).loc[0]
    poses = sweep.evaluate("rssp", DRIVE | LOADS | {"finger": 0.0}, ["force_a_x"], phi=np.linspace(0.0, 6.3, 20_001))
    assert found.status == st.OK
    assert 0.0 <= found.max_force_a_x - poses.force_a_x.max() <= 1e-6 * found.max_force_a_x
