"""Speed of a shaft that drives a planet: its torque has waves, whose multiples too few samples fold onto each other."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st

TURN = 2.0 * np.pi
DRIVES = [
    {"k": 1.389010945, "a": 0.2103022756, "n": 28.0},
    {"k": 0.9272800355, "a": -0.1732188139, "n": 46.0},  # 2.3 times the acceleration that 257 samples show
    {"k": 1.130211348, "a": -0.2393922348, "n": 56.0},
]
MASSES = {
    "m_carrier": 1.0838938772e-05, "m_planet": 1.596138722e-05, "m_link": 1.362176690e-05, "m_tool": 4.651368582e-05,
    "tool_force_y": -2.796352847, "tool_x": 2.437667181, "planet_radius": 0.692382306, "speed": 885.0966732,
}  # fmt: skip


@pytest.mark.parametrize("drive", DRIVES)
def test_acceleration_over_the_turn_is_that_of_the_torques_at_each_pose(drive):
    """From the Fourier series of the energy against the balance of torques at 4096 poses."""
    drive = drive | MASSES
    phi = np.arange(4096) * TURN / 4096
    poses = sweep.evaluate("epicyclic_dwell", drive, ["crank_speed", "crank_acceleration"], phi=phi)
    names = ["max_abs_crank_acceleration", "rms_crank_acceleration", "max_crank_speed", "unevenness"]
    found = sweep.summarise("epicyclic_dwell", drive, names, accuracy=1e-6).iloc[0]
    assert found["status"] == st.OK
    # The mean of the squares of 4096 even samples is exact up to harmonics that 2049 samples do not tell either.
    rms = np.sqrt((poses["crank_acceleration"] ** 2).mean())
    assert abs(found["rms_crank_acceleration"] - rms) <= found["err_rms_crank_acceleration"] + 1e-9 * rms
    # A top between two samples is higher by less than the bend of 64 waves makes of half a spacing: (64 pi/4096)^2/2.
    for name, values in (
        ("crank_acceleration", poses["crank_acceleration"].abs()),
        ("crank_speed", poses["crank_speed"]),
    ):
        prefix = "max_abs" if name == "crank_acceleration" else "max"
        least, err = values.max(), found[f"err_{prefix}_{name}"]
        assert least - err - 1e-9 * least <= found[f"{prefix}_{name}"] <= least * (1.0 + 1.3e-3) + err
