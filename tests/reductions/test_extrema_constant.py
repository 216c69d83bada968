"""Signed extrema of curves that are constant but for rounding: the value is simple, its range is noise."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.families import family
from sweep.numerics.chebyshev import NODES
from sweep.numerics.panel_search import climbed, fitted
from sweep.reductions.panels import STEADY

N = 60
PHI = np.linspace(0.0, 2.0 * np.pi, 257)
TARGET = 1e-8


def standing_sliders(alpha):
    """The crank turns about the line of the slider: where alpha is a right angle, the slider stands still."""
    random = np.random.default_rng(5)
    a, along = 10.0 ** random.uniform(-1.0, 1.0, N), random.uniform(-1.0, 1.0, N)
    b = a * (1.0 + np.abs(along) + 10.0 ** random.uniform(-1.0, 2.0, N))
    return {"a": a, "b": b, "e": np.zeros(N), "f": along * a, "alpha": np.full(N, alpha), "branch": np.ones(N)}


def poses(table):
    rows = {name: np.repeat(values, PHI.size) for name, values in table.items()} | {"phi": np.tile(PHI, N)}
    return sweep.evaluate("rssp", rows, ["s"]).s.to_numpy().reshape(N, PHI.size)


@pytest.mark.parametrize(("name", "reduced"), [("max_s", np.max), ("min_s", np.min), ("range_s", np.ptp)])
def test_extrema_of_a_slider_that_stands_still_are_its_place(name, reduced):
    table = standing_sliders(0.5 * np.pi)
    found = sweep.summarise("rssp", table, [name], accuracy=TARGET)
    assert (found.status == st.OK).all()
    places, err = poses(table), found[f"err_{name}"]
    assert (np.abs(found[name] - reduced(places, axis=1)) <= err).all()
    assert (err <= 1e-13 * np.abs(places).max(axis=1)).all()  # some hundred roundings of the place


def test_range_of_a_slider_that_moves_by_little_is_still_resolved():
    table = standing_sliders(0.5 * np.pi + 1e-9)
    found = sweep.summarise("rssp", table, ["range_s"], accuracy=1e-4)
    true, size = np.ptp(poses(table), axis=1), np.abs(poses(table)).max(axis=1)
    assert (true > 1e-13 * size).all()
    # 257 poses miss a sine's range by 2e-4 of it.
    assert (np.abs(found.range_s - true) <= found.err_range_s + 2e-4 * true + 4e-16 * size).all()


def test_tension_that_a_back_rest_holds_is_found_to_its_rounding():
    table = dict(family("backrest_tension").example) | {"K0": np.linspace(1400.0, 1550.0, 5)}
    names = ["max_K_couple", "min_K_couple", "range_K_couple"]
    found = sweep.summarise("backrest_tension", table, names, accuracy=TARGET)
    assert (found.status == st.OK).all()
    for name in names[:2]:
        assert (np.abs(found[name] - table["K0"]) <= found[f"err_{name}"] + 1e-13 * table["K0"]).all()
    assert (found.range_K_couple <= 1e-13 * table["K0"]).all()


def balanced_four_bar(beside):
    """Counterweights after Berkof and Lowen on crank and rocker; the crank's stands ``beside`` its place [mm]."""
    a, b, c, m_crank, m_coupler, m_rocker = 20.0, 60.0, 50.0, 4e-4, 3e-4, 5e-4
    coupler = 28.0 * np.exp(0.35j)
    crank, rocker = -m_coupler * a * (1.0 - coupler / b) / m_crank, -m_coupler * c * (coupler / b) / m_rocker
    masses = {"m_crank": m_crank, "m_coupler": m_coupler, "m_rocker": m_rocker, "speed": 300.0}
    centres = {"com_crank_x": crank.real + beside, "com_crank_y": crank.imag, "com_coupler_x": coupler.real}
    centres |= {"com_coupler_y": coupler.imag, "com_rocker_x": rocker.real, "com_rocker_y": rocker.imag}
    return {"a": a, "b": b, "c": c, "e": 55.0} | masses | centres


@pytest.mark.parametrize("beside", [0.0, 1e-9, 1e-3, 1.0])
def test_shaking_force_of_a_balanced_four_bar_is_that_of_its_crank_alone(beside):
    """What is left turns with the crank: its size is the same all over the turn, its components are not."""
    names = ["max_shaking_force", "min_shaking_force", "max_abs_shaking_force", "range_shaking_force"]
    found = sweep.summarise("four_bar", balanced_four_bar(beside), names, accuracy=TARGET)
    assert (found.status == st.OK).all()
    for name, true in zip(names, [36.0 * beside] * 3 + [0.0], strict=True):
        # Some hundred roundings of the inertia force that the pin of the coupler has, 540 N.
        assert abs(found[name][0] - true) <= found[f"err_{name}"][0] + 1e-13 * 540.0
        assert found[f"err_{name}"][0] <= 1e-12 * 540.0


def test_mean_shaking_force_of_a_balanced_four_bar_is_rounding_with_an_error_as_large():
    """It was NOT_CONVERGED, so that a limit on it dropped the balanced ones."""
    names = ["rms_shaking_force", "rms_shaking_force_x", "rms_shaking_force_y"]
    found = sweep.summarise("four_bar", balanced_four_bar(0.0), names, accuracy=TARGET)
    assert (found.status == st.OK).all()
    for name in names:
        assert found[name][0] <= found[f"err_{name}"][0] <= 1e-12 * 540.0


@pytest.mark.parametrize("start", [1.0000001e-11, 1.2e-11, 2e-11, 1.2e-11 - 1.7])
def test_a_constant_beside_a_phase_that_ends_just_after_the_angle_0_is_found(start):
    """The follower's line stands still; the panel between the angle 0 and the end of a phase is 1e-11 rad wide."""
    cam = {"lift": 1.0, "r0": 3.0, "e": 0.4, "law": 2.0, "rise": 1.0, "dwell": 0.7, "fall": 1.3, "start": start}
    found = sweep.summarise("cam", cam, ["max_y_r", "min_y_r"], accuracy=TARGET).iloc[0]
    assert found.status == st.OK
    assert found.max_y_r == found.min_y_r == -0.4
    assert max(found.err_max_y_r, found.err_min_y_r) <= 1e-14
    places = ["phi_max_y_r", "phi_min_y_r", "phi_max_abs_y_r"]
    found = sweep.summarise("cam", cam, places, accuracy=TARGET).iloc[0]
    assert found.status == st.OK
    for name in places:  # any angle would do: panels know no seam of the turn, and span it from end to end
        far = max(found[name], 2.0 * np.pi - found[name])
        assert far - 1e-9 <= found[f"err_{name}"] <= 2.0 * np.pi + 1e-9


@pytest.mark.parametrize("accuracy", [1e-3, 1e-9])
def test_the_place_on_a_constant_may_be_any_angle(accuracy):
    """A slot through the driven axis has no pressure angle; `phi_min_discriminant` erred by 1e-3 rad or less."""
    names = ["phi_max_discriminant", "phi_min_discriminant", "phi_max_abs_discriminant"]
    slots = {"a": [1.0, 0.7, 1.3], "e": [2.2, 0.4, 1.0], "h": [0.0, 0.0, 0.0], "branch": [1.0, -1.0, -1.0]}
    found = sweep.summarise("inverted_slider_crank", slots, names, accuracy=accuracy)
    assert (found.status == st.OK).all()
    assert (found[[f"err_{name}" for name in names]] == np.pi).all(axis=None)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-12])
def test_places_on_curves_that_hardly_vary_are_within_their_errors(accuracy):
    """Windows that show noise alone claimed their own width: places erred by 5e-5 rad for errors of 2e-7."""
    random = np.random.default_rng(3)
    n, side = 40, np.tile([-1.0, 1.0], 20)
    e, f, alpha = random.uniform(-3.0, 3.0, n), random.uniform(-3.0, 3.0, n), random.uniform(-3.0, 3.0, n)
    a, b = 10.0 ** random.uniform(-10.0, -7.0, n), random.uniform(1.2, 3.0, n) * np.hypot(e, f * np.cos(alpha))
    table = {"a": a, "b": b, "e": e, "f": f, "alpha": alpha, "branch": side}
    along = ["phi_min_s", "phi_max_s"]  # the slider's travel, whose derivative is an output
    alone = ["phi_min_y_c", "phi_max_y_c"]  # the same curve without one
    found = sweep.summarise("rssp", table, along + alone, accuracy=accuracy)
    assert (found.status == st.OK).all()
    # ds/a without the terms that have the factor a; they move its zero by 10 a here.
    root = side * np.sqrt(b**2 - e**2 - (f * np.cos(alpha)) ** 2)
    exact = np.arctan2(np.cos(alpha) * (1.0 + f * np.sin(alpha) / root), e / root)
    for name in along + alone:
        off = np.abs(np.angle(np.exp(2j * (found[name] - exact)))) / 2.0
        assert (off <= found[f"err_{name}"] + 100.0 * a).all(), name
    assert (found[[f"err_{name}" for name in along]] < 1e-6).all(axis=None)  # the derivative knows them better


@pytest.mark.parametrize("mode", [0, 1, -1])
def test_a_level_curve_is_halved_once(mode):
    """Polynomials through equal poses are off by their rounding: panels were halved until 48 of them were small."""
    value, edges, asked = 1.0 / 3.0, np.linspace(0.0, 2.0 * np.pi, 65), []

    def curves(row, phi, middle):
        asked.append(phi.size)
        return np.full(phi.shape, value)

    row = np.zeros(64, np.int64)
    panels = fitted(row, edges[:-1], edges[1:], np.full((64, NODES), value), mode)
    top, _ = climbed(curves, panels, 1, mode, 1e-8, False)
    assert top.value[0] == (-value if mode == -1 else value)
    assert 0.0 < top.err[0] <= STEADY * 2.0**-53 * value  # what a constant may claim without being NOT_CONVERGED
    assert sum(asked) == 2 * 64 * (NODES + 1)  # both halves, and a pose at each one's top
