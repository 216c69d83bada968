"""Quantities over the turn: mean squares, whole-turn effects against dense grids, extrema of the pressure angle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from kernels import status as st
from kernels.effects import bearings, permissible
from kernels.effects.pressure import pressure_extrema
from studies.accuracy.ordinary import designs as bench_designs
from sweep.effects import extended
from sweep.effects.turn import reductions
from sweep.families import family

DENSE = 4096
PHI = 2.0 * np.pi * np.arange(DENSE) / DENSE


def table(names, n=3):
    full = extended(family("rssr"), names)
    return dict(zip(full.parameter_names, bench_designs(full, n).T, strict=True))


def test_places_beside_the_angle_zero_are_below_a_turn_and_the_first_of_it():
    """A top 1e-17 before 0 rounded to 2 pi, and came behind a bottom as deep half a turn later."""
    phi = 2.0 * np.pi * np.arange(65) / 65
    before = np.array([0.0, 1e-17, 1e-12, 1e-9])[:, None]
    status = np.zeros(4, np.uint8)
    # the known error of the height, 1e-12, leaves the place open by 1e-6
    found = reductions("x", np.cos(phi + before) + 0.2 * np.cos(3.0 * (phi + before)), status, known=1e-12)
    assert (status == st.OK).all()
    for name in ("phi_max_x", "phi_max_abs_x"):
        assert ((found[name] >= 0.0) & (found[name] < 2.0 * np.pi)).all()
        off = np.abs(np.mod(found[name] + np.pi, 2.0 * np.pi) - np.pi)
        assert (off <= found[f"err_{name}"]).all()


@pytest.mark.parametrize("output", ["drive_torque", "d2psi", "pressure_angle", "psi", "force_c"])
def test_root_mean_square_equals_a_dense_sum(output):
    given_table = table([output])
    got = sweep.summarise("rssr", given_table, [f"rms_{output}"], accuracy=1e-12)
    values = sweep.evaluate("rssr", given_table, [output], phi=PHI)[output].to_numpy().reshape(3, DENSE)
    expected = np.sqrt((values**2).mean(axis=1))
    assert (got["status"] == st.OK).all()
    np.testing.assert_allclose(got[f"rms_{output}"], expected, rtol=1e-12)
    # The estimate holds, and is no blanket.
    assert (np.abs(got[f"rms_{output}"] - expected) <= got[f"err_rms_{output}"] + 1e-15 * expected).all()
    assert (got[f"err_rms_{output}"] < 1e-10 * expected).all()
    coarse = sweep.summarise("rssr", given_table, [f"rms_{output}"], samples=8)
    assert (np.abs(coarse[f"rms_{output}"] - expected) > got[f"err_rms_{output}"]).any()


def test_root_mean_square_of_what_does_not_turn_is_nan_with_a_status():
    given_table = table(["drive_torque"]) | {"a": np.array([20.0, 80.0, 20.0])}
    got = sweep.summarise("rssr", given_table, ["rms_drive_torque"])
    assert list(got["status"]) == [st.OK, st.NOT_ROTATABLE, st.OK]
    assert list(np.isnan(got["rms_drive_torque"])) == [False, True, False]


def test_the_place_of_an_acceleration_as_large_as_the_deceleration_is_the_first_of_both():
    """An unbalanced cam rises and falls alike; rounding chose one of both places, half a turn apart."""
    cam = {name: np.full(12, x) for name, x in family("free_cam").example.items()}
    angle = np.linspace(0.1, 6.2, 12)
    cam |= {"m_cam": np.full(12, 1e-3), "com_cam_x": 5.0 * np.cos(angle), "com_cam_y": 5.0 * np.sin(angle)}
    cam |= {"gravity_y": np.full(12, -9810.0), "speed": np.full(12, 50.0), "flywheel": np.full(12, 1e3)}
    found = sweep.summarise("free_cam", cam, ["phi_max_abs_crank_acceleration"])
    assert (found["status"] == st.OK).all()
    # the weight's torque is largest where its centre is level with the axis
    np.testing.assert_allclose(found["phi_max_abs_crank_acceleration"], np.mod(-angle, np.pi), atol=1e-4)


@pytest.mark.parametrize("output", ["lag_dynamic", "elongation_dynamic", "crank_speed", "crank_acceleration"])
def test_reductions_of_whole_turn_effects_equal_dense_grids(output):
    bases = ("max", "min", "max_abs", "range", "rms", "phi_max_abs")
    names = [f"{base}_{output}" for base in bases]
    given_table = table(names)
    got = sweep.summarise("rssr", given_table, names)
    assert (got["status"] == st.OK).all()
    values = sweep.evaluate("rssr", given_table, [output], phi=PHI)[output].to_numpy().reshape(3, DENSE)
    size = np.abs(values).max(axis=1)
    expected = {"max": values.max(axis=1), "min": values.min(axis=1), "max_abs": size}
    expected["range"] = expected["max"] - expected["min"]
    for base, dense in expected.items():
        # A grid of 4096 misses a peak by at most (pi/4096)^2/2 of the second derivative.
        assert (np.abs(got[f"{base}_{output}"] - dense) < 1e-4 * size).all(), base
    np.testing.assert_allclose(got[f"rms_{output}"], np.sqrt((values**2).mean(axis=1)), rtol=1e-9)
    off = np.abs(got[f"phi_max_abs_{output}"] - PHI[np.abs(values).argmax(axis=1)])
    assert (np.minimum(off, 2.0 * np.pi - off) < 1e-3 + 2.0 * np.pi / DENSE).all()


LENGTH = some.floats(0.2, 5.0)
OFFSET = some.floats(-3.0, 3.0)


@settings(deadline=None, max_examples=60)
@given(b=LENGTH, c=LENGTH, e=OFFSET, f=OFFSET, g=OFFSET, alpha=some.floats(-3.0, 3.0))
def test_all_extrema_of_the_pressure_angle_are_found(b, c, e, f, g, alpha):
    """Against the slope's sign changes on a dense grid, for whatever links reach over the turn."""
    given_table = {"a": 0.2, "b": b, "c": c, "e": e, "f": f, "g": g, "alpha": alpha}
    names = ["pressure_extrema", "pressure_max", "pressure_min", "pressure_max2", "pressure_min2", "phi_pressure_max"]
    got = sweep.summarise("rssr", given_table, [*names, "max_pressure_angle"]).iloc[0]
    if got["status"] != st.OK:
        assert np.isnan(got["pressure_max"])
        return
    assert got["pressure_max"] == pytest.approx(got["max_pressure_angle"], abs=1e-9)
    angle = sweep.evaluate("rssr", given_table, ["pressure_angle"], phi=PHI)["pressure_angle"].to_numpy()
    assert got["pressure_max"] >= angle.max() - 1e-9
    assert got["pressure_min"] <= angle.min() + 1e-9
    square = np.sin(angle) ** 2
    change = np.diff(square, append=square[:1])
    clear = change[np.abs(change) > 1e-12]
    turns = int((np.sign(clear) != np.sign(np.roll(clear, 1))).sum())
    # Of a curve that is flat to its rounding the samples show no extremum; it may have some all the same.
    flat = np.ptp(square) < 1e-9
    assert flat or turns in (got["pressure_extrema"], got["pressure_extrema"] - 2) or got["pressure_extrema"] == 0
    assert got["pressure_max"] >= got["pressure_max2"] >= got["pressure_min2"] >= got["pressure_min"]


def test_a_constant_pressure_angle_has_no_extremum():
    """e = 0 with parallel axes: the sheet's degenerate case."""
    got = sweep.summarise("rssr", {"a": 1.0, "b": 3.0, "c": 3.0, "e": 0.0, "f": 0.5, "g": 0.0, "alpha": 0.0}, [
        "pressure_extrema", "pressure_max", "pressure_min"
    ]).iloc[0]  # fmt: skip
    assert got["pressure_extrema"] == 0
    assert got["pressure_max"] == got["pressure_min"]


def test_pressure_extrema_compiled_equals_plain():
    ellipse = np.array([[0.1, 0.3, -0.2, 0.05, 0.1, 0.25, 1.0], [0.6, -0.1, 0.02, 0.2, 0.0, 0.1, 1.0]])
    results = []
    for function in (pressure_extrema, pressure_extrema.py_func):
        status, count = np.empty(2, np.uint8), np.empty(2)
        out = [np.empty((2, 4)) for _ in range(4)]
        function(ellipse, status, count, *out)
        results.append([status, count, *out])
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=1e-14)


def test_rolling_bearings_permit_the_closed_form():
    """While the first branch applies sin^2 theta1 <= (k^2 - z^2)/(k^2 + 2 z c t + c^2 t^2), k = P L c/(M K V)."""
    c, z1, z2, moment, capacity, v, shock = 20.0, -18.0, 22.0, 400.0, 30.0, 1.1, 1.2
    data = np.array([[c, z1, z2, v, 0.56, 1.6, 50.0, 3.0, 4500.0, shock, 1.0]])
    for theta2 in (-0.4, 0.1, 0.7):
        t = np.tan(theta2)
        kappa = capacity * abs(z2 - z1) * c / (moment * shock * v)
        squares = [(kappa**2 - z**2) / (kappa**2 + 2 * z * c * t + (c * t) ** 2) for z in (z1, z2)]
        expected = np.arcsin(np.sqrt(min(squares)))
        got, status = np.empty((1, 1)), np.zeros((1, 1), np.uint8)
        one = np.ones((1, 1))
        permissible.bearing_limits(
            one, one, t * one, np.array([moment]), data, np.array([[capacity]]), status, None, got, None
        )
        assert got[0, 0] == pytest.approx(expected, rel=1e-13)


@settings(deadline=None, max_examples=50)
@given(
    theta1=some.floats(0.01, 1.3), theta2=some.floats(-1.2, 1.2), mu=some.floats(0.0, 0.2),
    limit=some.floats(0.3, 20.0), overhung=some.booleans(),
)  # fmt: skip
def test_utilisation_crosses_one_at_the_permissible_angle(theta1, theta2, mu, limit, overhung):
    """Reserve and utilisation say the same; utilisation rises with theta1, so one bracket is enough."""
    c, z1, z2 = 20.0, (12.0 if overhung else -18.0), 30.0
    data = np.array([[c, z1, z2, 10.0, 12.0, 14.0, 18.0, 1.0, 6.0, mu]])
    limits, moment = np.array([[limit, limit, 0.5 * limit]]), np.array([900.0])

    def at(angle):
        s, t = np.sin(angle), np.tan(theta2)
        components = (np.array([[x]]) for x in (np.cos(angle), s, s * t))
        used, allowed, reserve, status = *(np.empty((1, 1)) for _ in range(3)), np.zeros((1, 1), np.uint8)
        permissible.bearing_limits(*components, moment, data, limits, status, used, allowed, reserve)
        return used[0, 0], allowed[0, 0], reserve[0, 0], status[0, 0]

    used, allowed, reserve, status = at(theta1)
    if status == st.JAMMED:
        assert allowed < theta1
        return
    assert (used < 1.0) == (reserve > 0.0) or abs(reserve) < 1e-9
    angles = np.linspace(0.0, theta1, 40)
    rising = [at(x)[0] for x in angles]
    assert (np.diff(rising) >= -1e-12 * rising[-1]).all()
    assert bearings.Sliding._fields[9] == "mu"
