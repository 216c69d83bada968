"""Sums over the members of a machine under loads that change within 1e-3 rad, against dense poses there."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.families import family

MEMBERS = {"needle": "slider_crank", "looper": {"family": "four_bar", "offset": 3.9}}
SUMS = {"shaft": {"torque": ["needle", "looper"]}, "f": {"shaking": ["needle", "looper"]}}
MASSES = {"m_crank": 2e-4, "m_coupler": 1e-4}
AT = (0.0, 0.531, 0.532, 0.533, 0.534, 1.468, 1.469, 1.470)
LOADS = {"needle.load_force": (AT, (36.0, 10.0, -49.0, -8.0, -2.0, -41.0, 28.0, -46.0))}


def table():
    given = {f"needle.{k}": v for k, v in (family("slider_crank").example | MASSES | {"m_slider": 3e-4}).items()}
    given |= {f"looper.{k}": v for k, v in (family("four_bar").example | MASSES | {"m_rocker": 1e-4}).items()}
    return given | {"needle.speed": 300.0, "looper.speed": 300.0}


@pytest.mark.parametrize("accuracy", [1e-3, 1e-8])
def test_extremes_of_sums_under_a_steep_table_converge(accuracy):
    """No number of even samples resolves its kinks: sums were not cut at the points of the table, as members are."""
    given, machine = table(), sweep.machine(MEMBERS, SUMS)
    dense = np.concatenate([np.linspace(low, high, 4001) for low, high in ((0.0, 2.0 * np.pi), AT[1:5:3], AT[5:8:2])])
    poses = sweep.evaluate(machine, given, ["shaft"], phi=dense, loads=LOADS)["shaft"]
    for name, brute in (("max_shaft", poses.max()), ("min_shaft", poses.min())):
        found = sweep.summarise(machine, given, [name], accuracy=accuracy, loads=LOADS).iloc[0]
        assert found["status"] == st.OK
        # Poses 2e-3 rad apart miss a smooth top by a millionth, those in the steps by as little.
        assert abs(found[name] - brute) <= found[f"err_{name}"] + 1e-5 * np.ptp(poses)
        assert found[f"err_{name}"] <= accuracy * np.ptp(poses)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-8])
def test_a_moment_that_turns_round_in_a_step_of_a_table_has_the_minimum_zero(accuracy):
    """Its magnitude falls by 1e-6 N mm in 1e-11 rad: it was NOT_CONVERGED, though no magnitude is below 0."""
    machine = sweep.machine(MEMBERS, SUMS)
    around = sweep.evaluate(machine, table(), ["f_moment_z"], phi=[AT[2], AT[3], AT[5], AT[6]], loads=LOADS)
    assert (np.diff(np.sign(around["f_moment_z"])) != 0.0).any()  # it turns round
    found = sweep.summarise(machine, table(), ["min_f_moment", "max_f_moment"], accuracy=accuracy, loads=LOADS).iloc[0]
    assert found["status"] == st.OK
    # the planar moment is 0 somewhere: the value is its own error
    assert 0.0 <= found["min_f_moment"] <= found["err_min_f_moment"] <= accuracy * found["max_f_moment"]
