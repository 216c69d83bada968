"""Maxima of crank-rockers near change points, long couplers above all, against brute force in precise poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.numerics import singularities
from sweep.numerics.singularities import Singularities, crowded
from sweep.reductions import resolution
from sweep.reductions.rounding import nearest
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
