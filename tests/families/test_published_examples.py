"""Published examples that nobody of this project made and that no test of a family has yet.

Tolerances are half a unit of the last published digit, or what the rounding of the published links leaves.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from sweep.evaluation import thread

PLANAR = {"f": 0.0, "g": 0.0, "alpha": 0.0}


def test_crank_rocker_of_goessner_swings_80_degrees_in_nine_tenths_of_the_return() -> None:
    # Published: crank 60 and frame 120, swing 80 deg, ratio 10/9; coupler 103, rocker 94, transmission angle 35 deg.
    links = {"a": 60.0, "b": 103.197, "c": 93.965, "e": 120.0, "branch": -1.0} | PLANAR
    found = sweep.summarise("rssr", links, ["swing", "phi0", "stroke_ratio", "max_pressure_angle"], accuracy=1e-10)
    # The links have six digits: 1e-3 deg and 1e-4 of the ratio are left.
    assert math.degrees(abs(found["swing"][0])) == pytest.approx(80.0, abs=1e-3)
    # Mirrored, the linkage takes 170.53 deg of the crank where the published one takes 189.47.
    angle = math.degrees(found["phi0"][0])
    assert max(angle, 360.0 - angle) == pytest.approx(189.4737, abs=1e-3)
    assert max(found["stroke_ratio"][0], 1.0 / found["stroke_ratio"][0]) == pytest.approx(10.0 / 9.0, rel=1e-4)
    assert 90.0 - math.degrees(found["max_pressure_angle"][0]) == pytest.approx(35.038, abs=1e-3)
    assert (round(links["b"]), round(links["c"])) == (103, 94)


def test_crank_rocker_of_goessner_lies_on_the_locus_of_its_requirement() -> None:
    phi0 = math.radians(360.0 * 10.0 / 19.0)
    phi1 = np.radians(np.arange(0.0, 360.0, 0.02))
    table = {"swing": math.radians(80.0), "phi0": phi0, "phi1": phi1, "e": 120.0} | PLANAR
    found = sweep.synthesise("rssr", table)
    found = found[found["status"] == 0]
    near = found.iloc[(found["a"] - 60.0).abs().argmin()]
    # A step of 0.02 deg on the locus moves links of some 100 by some 0.05.
    assert near["a"] == pytest.approx(60.0, abs=0.05)
    assert near["b"] == pytest.approx(103.197, abs=0.1) and near["c"] == pytest.approx(93.965, abs=0.1)


@pytest.mark.parametrize(
    ("swing", "mu", "a", "b", "c"),
    [(40.0, 50.0, 0.3081694119, 0.5320888862, 0.9010270826), (60.0, 40.0, 0.4374082579, 0.6527036447, 0.8748165158)],
)
def test_central_crank_rocker_has_the_published_swing_and_transmission(
    swing: float, mu: float, a: float, b: float, c: float
) -> None:
    found = sweep.summarise(
        "rssr", {"a": a, "b": b, "c": c, "e": 1.0} | PLANAR, ["swing", "phi0", "max_pressure_angle"], accuracy=1e-10
    )
    # Ten digits of the links; the angle of a limit takes their root where both limits are nearly in line.
    assert math.degrees(abs(found["swing"][0])) == pytest.approx(swing, abs=1e-6)
    assert math.degrees(found["phi0"][0]) == pytest.approx(180.0, abs=1e-6)
    assert 90.0 - math.degrees(found["max_pressure_angle"][0]) == pytest.approx(mu, abs=1e-6)


@pytest.mark.parametrize(("ratio", "mu"), [(14.0, 0.280012679), (19.0, 0.312414679)])
def test_rope_of_one_and_a_half_turns_has_the_published_friction(ratio: float, mu: float) -> None:
    found = thread.capstan({"T1": 1.0, "wrap": 3.0 * math.pi, "mu": mu})
    # Nine digits of mu over 9.4 rad.
    assert found["T2"][0] == pytest.approx(ratio, rel=3.0 * math.pi * 0.5e-9 * 1.1)


def test_bell_crank_of_the_six_bar_needle_drive_swings_as_recomputed() -> None:
    links = {"a": 47.5, "b": 105.0, "c": 67.5, "e": math.hypot(30.0, 120.0)} | PLANAR
    for branch in (1.0, -1.0):
        found = sweep.summarise("rssr", links | {"branch": branch}, ["swing"], accuracy=1e-10)
        assert math.degrees(abs(found["swing"][0])) == pytest.approx(94.099, abs=0.0005)


def test_sine_of_the_needle_stroke_has_the_published_peaks() -> None:
    # 24.5 mm at 7000 per minute: 8.98 m/s and 6582 m/s^2, the limit of a rod that is long beside the crank.
    omega = 7000.0 * math.pi / 30.0
    found = sweep.summarise(
        "slider_crank", {"a": 12.25, "b": 1e7}, ["stroke", "max_abs_ds", "max_abs_d2s"], accuracy=1e-9
    )
    assert found["stroke"][0] == pytest.approx(24.5, rel=1e-6)
    assert found["max_abs_ds"][0] * omega / 1e3 == pytest.approx(8.98, abs=0.005)
    assert found["max_abs_d2s"][0] * omega**2 / 1e3 == pytest.approx(6582.0, abs=0.5)
