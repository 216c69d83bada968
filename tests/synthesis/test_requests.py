"""What a synthesis can be asked for: a rocker of given length instead of its offsets; what is refused by name."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from tests.synthesis.test_reference import requirements


@pytest.mark.parametrize(
    ("family", "change", "words"),
    [
        ("rssr", {"swing": 0.0}, "column swing, row 0"),
        ("rssr", {"swing": 7.0}, "at most 2 pi"),
        ("rssr", {"phi0": -1.0}, "column phi0, row 0"),
        ("rssr", {"alpha": math.nan}, "finite"),
        ("rssr", {"phi1": None}, "phi1.*or swing, phi0, psi1"),
        ("rssr", {"phi1": None, "phi_1": 1.0}, "requirement"),
        ("rssr", {"psi1": 1.0}, "requirement"),
        ("guide", {}, "rssr or rssp or slotted"),
        ("sloted", {}, "did you mean 'slotted'"),
        ("rssp", {"stroke": 0.0}, "not zero"),
    ],
)
def test_bad_requirements_are_refused_by_name(family, change, words):
    table = {"swing": 0.5, "stroke": 1.0, "phi0": 3.2, "phi1": 1.0, "e": 1.0, "f": 0.0, "g": 0.0, "alpha": 0.5} | change
    with pytest.raises(InputError, match=words):
        sweep.synthesise(family, {name: value for name, value in table.items() if value is not None})


def test_pressure_limit_out_of_range_is_refused():
    with pytest.raises(InputError, match="max_pressure_angle"):
        sweep.synthesise("rssr", requirements(1, 1), max_pressure_angle=2.0)


@pytest.mark.parametrize(
    ("change", "most"),
    [
        ({"phi0": math.pi}, 1),  # in half a turn the other root is the rocker axis itself, c = 0
        ({"phi0": math.pi, "alpha": math.pi / 2}, 0),  # all balls of this locus lie at psi1 = -swing/2
        ({"phi0": math.pi, "alpha": -math.pi / 2, "e": 0.0}, 0),
        ({"e": 0.0, "alpha": math.pi}, 0),  # axes in line
        ({"e": 0.0, "alpha": math.pi, "phi1": True}, 0),
    ],
)
def test_mechanism_of_rounded_right_angles_is_none(change, most):
    """At the floats next to 90 and 180 degrees there were cranks of 1e-16 and couplers of 1e15."""
    place = "phi1" if change.get("phi1") else "psi1"
    table = requirements(500, 7, **{name: x for name, x in change.items() if name != "phi1"})
    found = sweep.synthesise("rssr", table.rename(columns={"phi1": place}))
    made = found[~found["a"].isna()]
    lengths = made[["a", "b", "c"]].to_numpy()
    assert (made.index.value_counts() <= most).all()
    assert len(made) >= 50 * most and ((lengths > 1e-7) & (lengths < 1e7)).all()
    assert set(found["status"][found["a"].isna()]) == {st.NOT_ADMISSIBLE}


def test_slot_whose_axes_are_in_line_has_no_crank():
    found = sweep.synthesise("slotted", {"phi0": 2.0, "e": [0.0, 0.5], "f": 1.0, "alpha": math.pi})
    assert list(found["status"]) == [st.NOT_ADMISSIBLE, st.OK]
    assert found["a"].iloc[1] == pytest.approx(0.5 * math.cos(1.0), rel=1e-15)


def test_rocker_of_given_length_is_the_mechanism_of_its_offsets():
    rng = np.random.default_rng(12)
    n = 4000
    table = {
        "swing": rng.uniform(0.2, 1.5, n), "phi0": rng.uniform(2.6, 3.7, n), "phi1": rng.uniform(0, 6.28, n),
        "c": rng.uniform(0.5, 3.0, n), "f": rng.uniform(-1, 1, n), "direction": rng.uniform(-1.5, 1.5, n),
        "alpha": rng.uniform(0.1, 1.4, n),
    }  # fmt: skip
    found = sweep.synthesise("rssr", table)
    good = (found.status == st.OK).to_numpy()
    assert good.sum() > 100
    np.testing.assert_allclose(found.c[good], table["c"][good], rtol=1e-14)
    np.testing.assert_allclose(np.arctan2(found.g, found.e)[good], table["direction"][good], rtol=1e-14, atol=1e-15)
    again = {name: table[name][good] for name in ("swing", "phi0", "phi1", "f", "alpha")}
    other = sweep.synthesise("rssr", again | {"e": found.e[good].to_numpy(), "g": found.g[good].to_numpy()})
    for name in ("a", "b", "c", "psi_ext", "margin"):
        np.testing.assert_allclose(other[name], found[name][good], rtol=1e-9, atol=1e-12, err_msg=name)


def test_rocker_of_given_length_needs_offsets_that_reach_it():
    flat = {"swing": 0.5, "phi0": 3.2, "phi1": 1.0, "c": 1.0, "f": 0.0, "direction": math.pi / 2, "alpha": 0.0}
    assert sweep.synthesise("rssr", flat).status.iloc[0] != st.OK  # parallel axes: g does not reach the plane
    nowhere = sweep.synthesise("rssr", flat | {"phi1": 4.6, "direction": 0.3})
    assert nowhere.status.iloc[0] == st.NOT_ADMISSIBLE and np.isnan(nowhere.e.iloc[0])
    with pytest.raises(InputError, match="positive"):
        sweep.synthesise("rssr", flat | {"c": -1.0})
