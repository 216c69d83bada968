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


@pytest.mark.parametrize("abrupt", ["coupler", "slot"])
def test_speed_over_the_turn_counts_a_link_that_turns_between_two_samples_or_is_refused(abrupt):
    """Light links that turn by 180 degrees within 2e-4 rad: unevenness was 0.009 for 0.21, 1e-9 for 0.25, error 1e-8.

    Without loads the speed is proportional to 1/sqrt(J); its largest inertia lies within the narrow peak.
    """
    light = {f"j_coupler_{k}": 1e-4 * LOADS[f"j_coupler_{k}"] for k in ("xx", "yy", "zz")}
    family, row, at, flywheel = "rssp", DRIVE | LOADS | light, NEAR, 50.0
    if abrupt == "slot":  # the ball passes the driven axis at a distance of 1e-4 cranks
        at = np.arcsin(-0.3 * np.tan(0.5))
        family, row, flywheel = "slotted", {"a": 1.0, "e": np.cos(at) + 1e-4, "f": 0.3, "alpha": 0.5, "s": 0.0}, 5.0
        row |= {"speed": 20.0, "m_link": 0.0, "j_link_zz": 5e-8, "m_crank": 0.0, "j_crank_zz": 0.2}
    phi = at + np.linspace(-2e-3, 2e-3, 4001)
    peak = sweep.evaluate(family, row, ["reduced_inertia"], phi=phi).reduced_inertia.max()
    rest = sweep.evaluate(family, row, ["reduced_inertia"], phi=at + np.linspace(0.1, 6.1, 400)).reduced_inertia
    least = 1.0 - np.sqrt((rest.max() + flywheel) / (peak + flywheel))  # of the unevenness
    assert least > 0.15
    machine = sweep.machine({"d": family}, {"shaft": {"torque": ["d"]}})
    of_machine = {f"d.{name}": value for name, value in row.items()} | {"shaft_flywheel": flywheel}
    for mechanism, given, name in (
        (family, row | {"flywheel": flywheel}, "unevenness"),
        (machine, of_machine, "shaft_unevenness"),
    ):
        found = sweep.summarise(mechanism, given, [name], accuracy=1e-6).loc[0]
        assert found[name] > least if found.status == st.OK else found.status == st.NOT_CONVERGED
