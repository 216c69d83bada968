"""Maxima of crank-rockers near change points, long couplers above all, against brute force in precise poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.types import EPS
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.numerics import singularities
from sweep.numerics.singularities import Singularities, crowded
from sweep.reductions import resolution
from sweep.reductions.rounding import nearest
from tests.reference import feed
from tests.support.near_change_points import LONG, RSSR, brute_maxima, brute_range, near_change_points, tiny_cranks
from tests.support.rssr_designs import margins
from tests.support.selection import mostly_long

ALONE = replace(RSSR, steps=())


@pytest.mark.parametrize("accuracy", [1e-6, 1e-8, 1e-10, 1e-12, 1e-14])
def test_higher_of_two_peaks_beside_a_sharp_zero_is_found_at_any_accuracy(accuracy: float) -> None:
    table = dict(zip(RSSR.parameter_names, LONG, strict=True))
    found = sweep.summarise("rssr", table, ["max_abs_dpsi", "phi_max_abs_dpsi"], accuracy=accuracy).iloc[0]
    exact = brute_maxima(np.array([LONG]), "dpsi")[0]
    # The other peak is 0.14 rad away and 4e-5 lower.
    assert abs(found["max_abs_dpsi"] - exact) <= found["err_max_abs_dpsi"] <= 0.1 * max(accuracy, 1e-7)
    assert abs(found["phi_max_abs_dpsi"] - 6.2127) < 1e-4


def test_singularities_of_the_last_designs_are_kept_for_all_outputs_and_for_no_other_designs(monkeypatch):
    family, searched = replace(RSSR), []
    monkeypatch.setattr(resolution, "dips", lambda *given: searched.append(given) or singularities.dips(*given))
    designs = near_change_points(60, 5, 1.0)
    first = nearest(family, designs[:30], ("dpsi",))
    again = nearest(family, designs[:30].copy(), ("d2psi",))
    np.testing.assert_array_equal(again, first)
    assert len(searched) == 1
    other = nearest(family, designs[30:], ("dpsi",))
    assert len(searched) == 2
    for found, rows in ((first, slice(30)), (other, slice(30, 60)), (nearest(family, designs, ("dpsi",)), slice(60))):
        alone = nearest(replace(RSSR), designs[rows], ("dpsi",))
        np.testing.assert_array_equal(found, alone)


@pytest.mark.parametrize("longest", [1.0, 1e5])
@pytest.mark.parametrize("pose", mostly_long(["dpsi", "d2psi", "d3psi"], ["d2psi"]))
def test_maxima_near_change_points_are_those_of_brute_force_within_their_errors(pose: str, longest: float) -> None:
    designs = near_change_points(1500, 5, longest)
    exact = brute_maxima(designs, pose)
    for target in (1e-8, 1e-12):
        for family, rows in ((RSSR, slice(None)), (ALONE, slice(200))):
            found = design_outputs(family, designs[rows], [f"max_abs_{pose}"], Accuracy(target=target))
            good = found["status"] == st.OK
            off = np.abs(found[f"max_abs_{pose}"] - exact[rows])
            # Brute force itself is a value at a pose next to the top: 1e-15 of a rounding or two.
            assert (off <= found[f"err_max_abs_{pose}"] + 1e-14 * exact[rows])[good].all()
            assert good.mean() > (0.98 if family is RSSR else 0.4)


def test_singularities_are_where_the_margin_is_least() -> None:
    designs = near_change_points(500, 3)
    near, exact = nearest(RSSR, designs, ("psi",)), margins(designs)
    closest = np.argmin(near.rho, axis=1)[:, None]
    places = np.take_along_axis(near.phi, closest, axis=1)[:, 0]
    rho = np.take_along_axis(near.rho, closest, axis=1)[:, 0]
    away = np.abs(np.angle(np.exp(1j * (places - exact["phi_min"]))))
    # Two dips may be as near as each other; the place is known to a share of the distance.
    assert (away < 0.05 * rho + 1e-7).mean() > 0.9
    assert rho.min() < 1e-4


def test_crowded_angles_stand_no_wider_than_a_share_of_the_distance() -> None:
    designs = near_change_points(200, 4)
    near = nearest(RSSR, designs, ("psi",))
    angles = crowded(near, 0.25)
    gaps = np.diff(np.concatenate([angles, angles[:, :1] + 2.0 * np.pi], axis=1), axis=1)
    middle = angles + 0.5 * gaps
    assert (gaps <= 0.26 * near.distance(middle)).all()
    wide = crowded(Singularities(near.phi, 30.0 * near.rho), 0.25)  # negative control: a distance too large
    gaps = np.diff(np.concatenate([wide, wide[:, :1] + 2.0 * np.pi], axis=1), axis=1)
    assert not (gaps <= 0.26 * near.distance(wide + 0.5 * gaps)).all()


@pytest.mark.parametrize("seed", [4, 6, 20, 23])
@pytest.mark.parametrize("target", [1e-6, 1e-8, 1e-12])
def test_range_of_the_rocker_angle_of_tiny_cranks_holds_its_error(target: float, seed: int) -> None:
    designs = tiny_cranks(1000, seed)
    exact = brute_range(designs)
    found = design_outputs(RSSR, designs, ["range_psi", "swing"], Accuracy(target=target))
    assert (found["status"] == st.OK).all()
    for value, err in ((found["range_psi"], found["err_range_psi"]), (np.abs(found["swing"]), found["err_swing"])):
        off = np.abs(value - exact)
        # Brute force rounds two angles of up to pi.
        limit = err + 8.0 * 2.0**-53 * np.pi
        assert (off <= limit).all()


def test_acceleration_of_a_feed_rocker_beside_a_lock_is_within_its_error() -> None:
    """The terms of the rocker's discriminant are larger than it is anywhere in the turn.

    Its least value is 2e-7 of them, and more of its largest value: the error was half of the deviation of 1e-7.
    """
    p = {
        "h_a": 0.21631880404495102, "h_b": 5.595822787690468, "h_c": 1.8420648102218469, "h_e": 3.970077068875845,
        "h_f": 0.0, "h_g": 0.0, "h_alpha": 0.0, "rh": -1.8501020818922518, "dh": 2.6656788264576354, "xE": 0.315,
        "yE": -2.246, "rE": 0.656, "dE": -0.402, "q": 3.652, "fx": 1.963, "fy": 0.152, "tx": -3.6, "ty": 1.29,
        "tooth": 0.0, "pitch": 0.0, "y_plate": 0.0, "h_sigma": 1.0, "bar_branch": -1.0,
    }  # fmt: skip
    found = sweep.summarise("feed", p, ["min_d2psi", "phi_min_d2psi"], accuracy=1e-8).iloc[0]
    with mp.workdps(40):
        design = {name: mpf(value) for name, value in p.items()}
        exact = mp.diff(lambda phi: feed.rocker(design, phi), mpf(found.phi_min_d2psi), 2)
    assert found.status == st.OK
    # Twice the change by two roundings of each input, here 1e-6: four digits more than the value has left.
    assert abs(found.min_d2psi - float(exact)) <= found.err_min_d2psi <= 5e-6


@pytest.mark.parametrize("tight", [1e-6, 1e-8, 1e-10])
def test_profile_of_a_guided_cam_carries_the_rounding_of_its_least_displacement(tight: float) -> None:
    """All poses have it in common: no pose shows it, and the error was ten times too small at the highest."""
    off = np.hypot(14.281723596726062, 8.972988942744877 - 0.23643249400513433)
    p = dict.fromkeys([f"{letter}{k}" for letter in "AB" for k in range(1, 7)], 0.0) | {
        "X1": 0.23643249400513433, "Z1": -14.281723596726062, "e": 8.972988942744877, "R0": 13.161426628408933,
        "mu1": 0.25, "mu2": 0.5, "A1": 2.3244724167854125, "B1": 1.458289584744303,
        "P_h": 2.0 * off * (1.0 + tight) + np.hypot(2.3244724167854125, 1.458289584744303),
    }  # fmt: skip
    found = sweep.summarise("guided_cam", p, ["max_X_P", "phi_max_X_P"], accuracy=1e-12).iloc[0]
    with mp.workdps(40):
        x = {name: mpf(value) for name, value in p.items()}
        square = x["Z1"] ** 2 + (x["e"] - x["X1"]) ** 2
        phi = mpf(found.phi_max_X_P)
        law = x["P_h"] + x["A1"] * mp.cos(phi) + x["B1"] * mp.sin(phi)
        least = x["P_h"] - mp.hypot(x["A1"], x["B1"])
        radius = x["R0"] + mp.sqrt(law**2 / 4 - square) - mp.sqrt(least**2 / 4 - square)
        deviation = abs(found.max_X_P - radius * mp.cos(phi))
    # Rounding moves a difference of lengths, ``tight`` of them, by some EPS, and its root by this over the root.
    assert deviation <= found.err_max_X_P <= 10.0 * EPS / np.sqrt(tight) * off
