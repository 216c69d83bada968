"""Cams with translating and swinging followers: printed coefficients, pressure angles, as first stage of a chain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from sweep.families import family
from sweep.families.base import Angles
from sweep.quantities.resolve import output
from tests.reference import plain_linkages as naive
from tests.support.plain_designs import DESIGNS, PHI, evaluated


def test_cam_laws_have_their_printed_extremes():
    table = {"lift": 1.0, "r0": 5.0, "rise": 1.0, "fall": 1.0, "dwell": 1.0, "law": [1.0, 2.0, 3.0]}
    frame = sweep.summarise("cam", table, ["max_abs_ds", "max_abs_d2s", "max_abs_d3s", "stroke"], accuracy=1e-9)
    # velocity, acceleration and jerk coefficients of the handbooks
    np.testing.assert_allclose(frame.max_abs_ds, [1.875, 4.0 * math.pi / (4.0 + math.pi), 2.0], rtol=1e-9)
    modified = 4.0 * math.pi**2 / (4.0 + math.pi)
    np.testing.assert_allclose(frame.max_abs_d2s, [10.0 / math.sqrt(3.0), modified, 2.0 * math.pi], rtol=1e-9)
    np.testing.assert_allclose(frame.max_abs_d3s, [60.0, 4.0 * math.pi * modified, 4.0 * math.pi**2], rtol=1e-7)
    np.testing.assert_allclose(frame.stroke, 1.0, rtol=1e-12)


@pytest.mark.parametrize("name", ["cam", "cam_lever"])
def test_cam_pressure_angle_is_that_of_the_pitch_curve(name):
    for k, design in enumerate(DESIGNS[name]):
        phi = PHI[k % len(PHI)]
        row = evaluated(name, design, ["pressure_angle", "x_p", "y_p", family(name).position], phi)
        curves = getattr(naive, name)

        def pitch(x, design=design, curves=curves):
            numbers = {key: mp.mpf(value) for key, value in design.items()}
            value = next(iter(curves(numbers, x).values()))
            if name == "cam":
                base = mp.sqrt(numbers["r0"] ** 2 - numbers["e"] ** 2)
                return mp.mpc(base + value, -numbers["e"]) * mp.expj(-x)
            return (numbers["e"] + numbers["c"] * mp.expj(value)) * mp.expj(-x)

        centre = complex(row.x_p, row.y_p) * complex(math.cos(phi), math.sin(phi))
        velocity = 1.0 if name == "cam" else 1j * complex(math.cos(row.psi), math.sin(row.psi))
        assert row.pressure_angle == pytest.approx(naive.contact_pressure(pitch, centre, velocity, phi), abs=1e-9), (
            design
        )


@pytest.mark.parametrize(
    "change",
    [
        {"rise": 4.0, "fall": 3.0},
        {"law": 2.5},
        {"rise": 0.0},
        {"dwell": -0.1},
        {"r0": 0.0},
        {"e": 40.0},
        {"c3": math.nan},
    ],
)
def test_cam_that_means_nothing_is_invalid(change):
    mechanism = family("cam")
    design = {"lift": 5.0, "r0": 30.0} | change
    values = [design.get(p.name, p.default if p.default is not None else 0.0) for p in mechanism.parameters]
    columns = mechanism.poses(np.array([values]), Angles.of(np.array([[0.4]])), frozenset({"s", "pressure_angle"}))
    assert columns["status"][0, 0] == st.INVALID_INPUT
    assert np.isnan(columns["s"][0, 0]) and np.isnan(columns["pressure_angle"][0, 0])


def test_cam_drives_a_linkage_as_the_first_stage_of_a_chain():
    table = {"lift1": 0.5, "r01": 30.0, "c1": 50.0, "e1": 60.0, "law1": 2.0}
    table |= {"a2": 2.0, "b2": 3.0, "e2": 0.5, "f2": 0.0, "alpha2": 0.0, "offset2": 0.4}
    phi = np.linspace(0.0, 6.2, 9)
    frame = sweep.evaluate(["cam_lever", "rssp"], table, ["s", "ds"], phi)
    lever = sweep.evaluate(
        "cam_lever", {"lift": 0.5, "r0": 30.0, "c": 50.0, "e": 60.0, "law": 2.0}, ["psi", "dpsi"], phi
    )
    rod = {"a": 2.0, "b": 3.0, "e": 0.5, "f": 0.0, "alpha": 0.0, "phi": lever.psi + 0.4}
    alone = sweep.evaluate("rssp", rod, ["s", "ds"])
    np.testing.assert_allclose(frame.s, alone.s, atol=1e-14)
    np.testing.assert_allclose(frame.ds, alone.ds * lever.dpsi, atol=1e-13)


def test_negative_control_cycloidal_curve_is_not_the_modified_sine():
    row = evaluated("cam", {"lift": 1.0, "r0": 5.0, "law": 3.0}, ["s"], 0.5)
    with mp.workdps(30):
        other = naive.rise(2, mp.mpf(0.5) / (mp.pi / 2))
    assert abs(float(other) - row.s) > 1e-3


@pytest.mark.parametrize("target", [1e-6, 1e-10, 1e-12])
@pytest.mark.parametrize("law", [1.0, 2.0, 3.0])
def test_place_of_the_lever_s_greatest_speed_is_the_middle_of_a_phase_within_its_error(law, target):
    """Every law is symmetric about the middle of its phase, where its velocity is greatest."""
    random, n = np.random.default_rng(int(law)), 60
    rows = {
        "lift": random.uniform(0.1, 0.6, n), "rise": random.uniform(0.3, 2.0, n), "dwell": random.uniform(0.0, 1.5, n),
        "fall": random.uniform(0.3, 2.0, n), "start": random.uniform(-6.0, 6.0, n), "law": np.full(n, law),
        "r0": np.full(n, 3.0), "c": np.full(n, 5.0), "e": np.full(n, 6.0), "branch": random.choice([-1.0, 1.0], n),
    }  # fmt: skip
    found = sweep.summarise("cam_lever", rows, ["phi_max_dpsi"], accuracy=target)
    returns = rows["start"] + rows["rise"] + rows["dwell"] + 0.5 * rows["fall"]
    place = np.where(rows["branch"] < 0.0, rows["start"] + 0.5 * rows["rise"], returns)
    off = np.abs(np.remainder(found["phi_max_dpsi"] - place + np.pi, 2.0 * np.pi) - np.pi)
    known = np.isfinite(found["phi_max_dpsi"].to_numpy())
    assert known.mean() > 0.8  # at 1e-12 rounding is all there is for some
    assert (off[known] <= found["err_phi_max_dpsi"][known]).all()
    assert (found["err_phi_max_dpsi"][known] < 1e-5).all()


def test_the_pressure_angle_of_a_cam_in_a_chain_is_that_of_its_stage_and_the_chain_s_says_whose_it_is():
    """A cam has no coupler: a limit on the chain's own angle does not hold for it, which the definition has to say."""
    chain = ["rssr", "cam"]
    example = family(chain).example
    found = sweep.summarise(chain, example, "max_pressure_angle, max_pressure_angle1, max_pressure_angle2").iloc[0]
    phi = np.linspace(0.0, 2.0 * np.pi, 2001)
    dense = sweep.evaluate(chain, example, ["pressure_angle1", "pressure_angle"], phi=phi).max()
    assert found["max_pressure_angle"] == found["max_pressure_angle1"]
    # Of 2001 poses the highest is lower than the top by the square of half their distance, times the curvature.
    assert 0.0 <= found["max_pressure_angle1"] - dense["pressure_angle1"] < 1e-4
    assert 0.0 <= found["max_pressure_angle2"] - dense["pressure_angle"] < 1e-4
    assert "stage 1, the only one with a coupler" in output(family(chain), "max_pressure_angle").text
