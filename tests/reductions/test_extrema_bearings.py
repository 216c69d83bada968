"""What bearings permit has narrow peaks and dips: the turn is cut where the force of the coupler eases a bearing.

Each of these was once missed with status OK, a reserve of 0.87 rad where there is none among them.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs
from sweep.effects import extended
from sweep.families import family
from sweep.numerics.events import near_zeros, sign_changes

TURN = 2.0 * np.pi
TARGET = 1e-6
GRID = np.linspace(0.0, TURN, 2001)

ROLLING = (
    {
        "a": 29.7353, "b": 68.9855, "c": 57.1262, "e": -82.5616, "f": -17.5355, "g": -7.87168, "alpha": 0.937171,
        "branch": -1.0, "resisting_torque": 512.595, "support_d1": -37.2956, "support_d2": 31.1427,
        "rotation_factor": 1.19397, "radial_factor": 1.04043, "axial_factor": 2.30783, "e_limit": 0.552564,
        "life_exponent": 5.05846, "dynamic_capacity": 57639.6, "shock_factor": 0.64339, "axial_support": 1.0,
        "required_life": 12679800.0, "speed": 868.333,
    },
    {
        "a": 22.6403, "b": 72.8507, "c": 49.3845, "e": 75.4935, "f": 12.1354, "g": -7.03921, "alpha": 1.15001,
        "branch": 1.0, "resisting_torque": 413.076, "support_d1": -11.6516, "support_d2": 30.2866,
        "rotation_factor": 0.713144, "radial_factor": 0.30351, "axial_factor": 0.949169, "e_limit": 0.259551,
        "life_exponent": 5.53865, "dynamic_capacity": 158871.0, "shock_factor": 0.535478, "axial_support": 1.0,
        "required_life": 13254400.0, "speed": 921.298,
    },
)  # fmt: skip
SLIDING = (
    {
        "a": 15.2973, "b": 101.344, "c": 50.0775, "e": -79.8764, "f": 8.29972, "g": -7.05388, "alpha": 0.962248,
        "branch": 1.0, "resisting_torque": 266.278, "support_d1": -11.9465, "support_d2": 37.5901,
        "journal_diameter": 12.6929, "journal_length1": 18.4242, "journal_length2": 17.1147,
        "collar_diameter": 12.6988, "journal_factor": 1.12725, "thrust_radius_d": 0.0, "mu_d": 0.0969141,
        "permissible_pressure1": 0.18653, "permissible_pressure2": 1.52589, "permissible_pressure3": 0.00201941,
    },
    {
        "a": 29.3449, "b": 100.845, "c": 56.8549, "e": -90.6301, "f": 16.8213, "g": -9.39449, "alpha": 1.20574,
        "branch": 1.0, "resisting_torque": 340.275, "support_d1": -19.137, "support_d2": 41.3338,
        "journal_diameter": 15.8894, "journal_length1": 12.3333, "journal_length2": 29.8564,
        "collar_diameter": 19.6398, "journal_factor": 0.573144, "thrust_radius_d": 0.0, "mu_d": 0.0898382,
        "permissible_pressure1": 6.16752, "permissible_pressure2": 2.32536, "permissible_pressure3": 0.000388928,
    },
)  # fmt: skip


EASED = {
    "a": 28.884019, "b": 97.070012, "c": 72.990025, "e": 47.589861, "f": 16.40729, "g": -7.6110695, "alpha": 0.95565604,
    "branch": 1.0, "m_crank": 0.00033922375, "j_crank_zz": 0.36890804, "m_coupler": 5.4801258e-05,
    "com_coupler_x": 41.597115, "com_coupler_y": 3.0426877, "j_coupler_xx": 0.0054656534, "j_coupler_yy": 0.15049925,
    "j_coupler_zz": 0.049527371, "m_rocker": 0.00017268615, "com_rocker_x": 15.932171, "j_rocker_xx": 0.41140865,
    "j_rocker_yy": 0.053787474, "j_rocker_zz": 0.21005117, "gravity_z": -14565.555, "load_torque": -929.61316,
    "speed": 434.00784, "support_d1": -10.163255, "support_d2": 53.450536, "rotation_factor": 0.879645,
    "radial_factor": 0.30694756, "axial_factor": 1.2999678, "e_limit": 0.2256111, "life_exponent": 3.7309541,
    "dynamic_capacity": 3337.3613, "shock_factor": 1.2075804, "axial_support": 2.0, "finger": 1.0,
}  # fmt: skip


def zeros(row, output):
    """Crank angles at which a pose output vanishes."""

    def value(phi):
        return float(sweep.evaluate("rssr", row, [output], phi=[phi])[output].iloc[0])

    values = sweep.evaluate("rssr", row, [output], phi=GRID)[output].to_numpy()
    return [brentq(value, GRID[k], GRID[k + 1], xtol=1e-15) for k in np.flatnonzero(np.diff(np.sign(values)))]


@pytest.mark.parametrize("row", ROLLING)
def test_the_least_reserve_of_rolling_bearings_is_none_where_no_force_acts_along_the_follower(row):
    """Any axial force permits no radial angle there, and the radial angle is zero: the reserve dips to zero."""
    found = sweep.summarise("rssr", row, ["min_theta1_reserve_rolling"], accuracy=TARGET).iloc[0]
    assert zeros(row, "t_rho")
    assert found["status"] == st.OK
    assert abs(found["min_theta1_reserve_rolling"]) <= found["err_min_theta1_reserve_rolling"] + 1e-9


@pytest.mark.parametrize("output", ["permissible_theta1", "theta1_reserve"])
@pytest.mark.parametrize("row", SLIDING)
def test_the_largest_angle_that_sliding_bearings_permit_stands_where_nothing_loads_the_collar(row, output):
    """A collar that bears little leaves a spike there, as narrow as it bears little."""
    found = sweep.summarise("rssr", row, [f"max_{output}"], accuracy=TARGET).iloc[0]
    about = np.concatenate([at + 1e-2 * np.linspace(-1.0, 1.0, 2001) ** 5 for at in zeros(row, "t_k")])
    spike = sweep.evaluate("rssr", row, [output], phi=about)[output].max()
    grid = sweep.evaluate("rssr", row, [output], phi=GRID)[output].max()
    value, err = found[f"max_{output}"], found[f"err_max_{output}"]
    assert found["status"] == st.OK
    assert spike > grid + 0.01  # an even grid does not see it
    assert spike - err <= value <= spike + err + 1e-4  # poses about it are as close as that


@pytest.mark.parametrize("target", [1e-4, 1e-8])
def test_the_least_load_of_a_bearing_stands_where_its_support_is_nearly_free(target):
    """The load across a shaft is a magnitude: it dips to 2.1 of thousands between two poses; 3.1 once passed for it."""
    found = sweep.summarise("rssr", EASED, ["min_equivalent_load_d1"], accuracy=target).iloc[0]
    about = 6.261367648 + 1e-4 * np.linspace(-1.0, 1.0, 2001) ** 3
    least = sweep.evaluate("rssr", EASED, ["equivalent_load_d1"], phi=about)["equivalent_load_d1"].min()
    assert found["status"] == st.OK
    assert abs(found["min_equivalent_load_d1"] - least) <= found["err_min_equivalent_load_d1"] + 1e-2


def test_the_mean_of_a_load_that_changes_its_formula_is_that_of_its_pieces():
    """Gauss rules of 30 points on 400 panels cut at the places where the axial load passes its share."""
    full = extended(family("rssr"), ["equivalent_load_d1"])
    row = dict(zip(full.parameter_names, map(float, designs(full, 1)[0]), strict=True))
    row |= {"e_limit": 0.28, "axial_support": 1.0, "radial_factor": 0.56, "axial_factor": 1.5}
    names = ["radial_load_d1", "axial_load_d"]

    def excess(phi):
        found = sweep.evaluate("rssr", row, names, phi=np.atleast_1d(phi))
        axial, radial = np.abs(found["axial_load_d"].to_numpy()), found["radial_load_d1"].to_numpy()
        return axial - row["e_limit"] * row["rotation_factor"] * radial

    values = excess(GRID)
    cuts = [
        brentq(lambda x: excess(x)[0], GRID[k], GRID[k + 1], xtol=1e-15)
        for k in np.flatnonzero(np.diff(np.sign(values)))
    ]
    assert cuts
    ends = np.sort(np.concatenate([np.linspace(0.0, TURN, 401), cuts]))
    nodes, weights = np.polynomial.legendre.leggauss(30)
    half = 0.5 * np.diff(ends)
    phi = (ends[:-1] + half)[:, None] + half[:, None] * nodes
    loads = sweep.evaluate("rssr", row, ["equivalent_load_d1"], phi=phi.ravel())["equivalent_load_d1"].to_numpy()
    exact = np.sqrt(((half[:, None] * weights).ravel() * loads**2).sum() / TURN)
    for target in (1e-3, 1e-6, 1e-9):
        found = sweep.summarise("rssr", row, ["rms_equivalent_load_d1"], accuracy=target).iloc[0]
        assert found["status"] == st.OK
        assert abs(found["rms_equivalent_load_d1"] - exact) <= found["err_rms_equivalent_load_d1"] + 1e-12 * exact
        assert found["err_rms_equivalent_load_d1"] <= target * exact


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_two_zeros_between_samples_are_found_however_close(depth):
    turn = np.arange(128)[None] * (TURN / 128)
    row, phi = sign_changes(lambda rows, x: (np.sin(x - 0.02) - 1.0 + depth)[:, :, None], turn)
    exact = 0.5 * np.pi + 0.02 + np.arccos(1.0 - depth) * np.array([-1.0, 1.0])
    assert row.tolist() == [0, 0]
    # A sine near its top tells angles to the root of its rounding over the depth.
    np.testing.assert_allclose(np.sort(phi), exact, rtol=0.0, atol=4.0 * 2.0**-53 / np.sqrt(depth) + 1e-15 * TURN)


def test_jumps_at_known_angles_are_left_out_and_zeros_beside_them_found():
    turn, calls = np.arange(128)[None] * (TURN / 128), []

    def functions(rows, phi):
        calls.append(phi.size)
        x = np.mod(phi, TURN)  # jumps through zero at 1 and 4, and passes it soon after
        first = np.where(x < 1.0, 1.0, x - 1.003)
        return np.where(x < 4.0, first, x - 4.01)[:, :, None]

    every = sign_changes(functions, turn)[1]
    np.testing.assert_allclose(np.sort(every), [1.0, 1.003, 4.0, 4.01], rtol=0.0, atol=1e-15 * TURN)
    slow = len(calls)
    row, phi = sign_changes(functions, turn, np.array([[1.0, 4.0]]))
    assert row.tolist() == [0, 0] and len(calls) - slow < slow / 2  # a jump takes a call for each bit
    np.testing.assert_allclose(np.sort(phi), [1.003, 4.01], rtol=0.0, atol=1e-15 * TURN)


@pytest.mark.parametrize("least", [1e-3, 1e-8, 0.0])
def test_a_square_that_nearly_vanishes_is_cut_at_its_bottom_and_ever_farther_beside_it(least):
    """No panel beside the bottom is longer than seven times the distance of its end from there."""
    turn = np.arange(128)[None] * (TURN / 128)
    row, phi = near_zeros(lambda rows, x: (np.sin(x - 0.02) ** 2 + least**2)[:, :, None], turn, 0.1)
    assert set(row.tolist()) == {0}
    at = np.sort(np.mod(phi - 0.02 + 0.1, np.pi))  # both bottoms together
    beside = least * 8.0 ** np.arange(20.0) if least else np.zeros(1)
    exact = 0.1 + np.repeat([0.0, *(-beside[beside < 0.1]), *beside[beside < 0.1]], 2)
    np.testing.assert_allclose(at, np.sort(exact), rtol=1e-3, atol=1e-4 * least + 1e-12)
    none, _ = near_zeros(lambda rows, x: (np.sin(x) ** 2 + 0.5)[:, :, None], turn, 0.1)
    assert none.size == 0
