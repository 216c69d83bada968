"""Numbers that say their unit, wherever numbers are taken: texts, quantities of pint, headings; as bare ones."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pint
import pytest

import sweep

BARE = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": math.pi / 3}
LOADED = BARE | {"m_crank": 20e-6, "m_coupler": 30e-6, "m_rocker": 25e-6, "speed": 7000.0 * 2.0 * math.pi / 60.0}
WANT = ["max_force_a", "swing"]
UNITS = pint.UnitRegistry()
SAID = {
    "texts": LOADED | {"a": "1 cm", "alpha": "60 deg", "m_crank": "20 g", "speed": "7000 rpm"},
    "headings": {name: x for name, x in LOADED.items() if name not in ("a", "alpha", "m_crank", "speed")}
    | {"a [cm]": 1.0, "alpha [deg]": 60.0, "m_crank [g]": 20.0, "speed [rpm]": 7000.0},
    "quantities": LOADED
    | {"a": UNITS.Quantity(1.0, "cm"), "alpha": UNITS.Quantity(60.0, "degree"), "m_crank": UNITS.Quantity(20.0, "gram"),
       "speed": UNITS.Quantity(7000.0, "rpm")},
}  # fmt: skip
ROUNDED = 4.0 * 2.0**-53  # a unit's factor and its product are each rounded once, and so is the number's square


def close(found, bare):
    np.testing.assert_allclose(found[WANT], bare[WANT], rtol=1e3 * ROUNDED)  # cond of a force is some hundred


@pytest.mark.parametrize("way", SAID)
def test_what_says_its_unit_gives_the_numbers_of_bare_ones(way):
    close(sweep.summarise("rssr", SAID[way], WANT), sweep.summarise("rssr", LOADED, WANT))


def test_columns_of_texts_and_of_a_quantity_with_an_array():
    bare = sweep.summarise("rssr", LOADED | {"a": [8.0, 10.0]}, WANT)
    close(sweep.summarise("rssr", pd.DataFrame([LOADED] * 2).assign(a=["8 mm", "1 cm"]), WANT), bare)
    close(sweep.summarise("rssr", LOADED | {"a": UNITS.Quantity([0.8, 1.0], "cm")}, WANT), bare)
    close(sweep.summarise("rssr", LOADED | {"a": ["8 mm", 10.0]}, WANT), bare)


def test_crank_angles_speeds_and_bound_designs_say_theirs():
    bare = sweep.evaluate("rssr", BARE, "psi", phi=[math.radians(30.0)])["psi"][0]
    for phi in (["30 deg"], UNITS.Quantity([30.0], "degree"), ["0.5235987755982988 rad"]):
        assert sweep.evaluate("rssr", BARE, "psi", phi=phi)["psi"][0] == pytest.approx(bare, rel=1e-14)
    bound = sweep.mechanism("rssr", **BARE | {"a": UNITS.Quantity(1.0, "cm"), "alpha": "60 deg"})
    assert bound.dimensions["a"] == 10.0
    for phi in (UNITS.Quantity(np.array([1.0, 30.0]), "degree"), [UNITS.Quantity(x, "degree") for x in (1.0, 30.0)]):
        assert bound.poses(phi, "psi")["psi"].tolist() == bound.poses(np.radians([1.0, 30.0]), "psi")["psi"].tolist()
    assert bound.poses(UNITS.Quantity(30.0, "degree"), "psi") == bound.poses("30 deg", "psi")
    (axes, *_) = sweep.plot.motion("rssr", BARE, "d2psi", speed="7000 rpm")
    assert axes.child_axes


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (LOADED | {"a": "10 kg"}, "a = '10 kg'; allowed: a length, in mm"),
        (LOADED | {"a": UNITS.Quantity(1.0, "second")}, "a length, in mm"),
        (LOADED | {"speed": "7000 rmp"}, "did you mean 'rpm'"),
        (LOADED | {"a": "ten"}, "a number"),
        ({name: x for name, x in LOADED.items() if name != "m_crank"} | {"m_crank [mm]": 20.0}, "a mass, in kg"),
    ],
)
def test_a_unit_of_something_else_is_refused(table, words):
    with pytest.raises(sweep.InputError, match=words):
        sweep.summarise("rssr", table, WANT)
