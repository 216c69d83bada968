"""Chains: status of poses, refused chains and tables, names."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep import InputError
from sweep.families import family

FIRST = {"a1": 1.0, "b1": 2.0, "c1": 3.0, "e1": 3.0, "f1": 0.0, "g1": 0.0, "alpha1": 0.0}
GUIDE = {"a2": 1.0, "b2": 3.0, "c2": 3.0, "e2": 3.0, "xi2": 1.0, "eta2": 2.0, "lam2": 0.3, "h2": 0.1}


def test_chain_status_is_that_of_the_first_stage_that_fails():
    changes = {
        "both reach": {},
        "first does not reach": {"e1": 7.0},
        "second does not reach": {"e2": 9.0},
        "neither reaches": {"e1": 7.0, "e2": 9.0},
        "dead point of the first": {"e1": 6.0},
        "dead point of the first, second does not reach": {"e1": 6.0, "e2": 9.0},
        "singular first": {"e1": 1.0, "b1": 3.0},
    }
    table = {k: [(FIRST | GUIDE | change)[k] for change in changes.values()] for k in FIRST | GUIDE}
    want = ["s", "d2s", "psi1", "discriminant", "discriminant1", "discriminant2", "pressure_angle", "x_m2"]
    frame = sweep.evaluate(["rssr", "guide"], table, want, phi=[0.0])
    expected = [
        st.OK,
        st.NOT_ASSEMBLED,
        st.NOT_ASSEMBLED,
        st.NOT_ASSEMBLED,
        st.DEAD_POINT,
        st.DEAD_POINT,
        st.SINGULAR,
    ]
    assert list(frame.status) == expected
    assert frame.loc[0].notna().all()
    assert frame.loc[[1, 3, 6], ["s", "d2s", "psi1", "discriminant", "pressure_angle", "x_m2"]].isna().all().all()
    assert frame.discriminant1.notna().all()
    assert frame.discriminant1[1] < 0.0
    assert (frame.psi1[2], frame.discriminant2[2]) == (frame.psi1[0], frame.discriminant[2])
    assert frame.discriminant2[2] < 0.0
    assert np.isfinite(frame.s[4])  # a dead point has a position but no derivatives
    assert np.isnan(frame.d2s[4])
    assert np.isnan(frame.s[5])


@pytest.mark.parametrize("names", [["rssp", "rssr"], ["guide", "guide"], ["rssr", "guide", "rssr"]])
def test_chain_refuses_a_slider_that_should_drive_a_crank(names):
    with pytest.raises(InputError) as caught:
        family(names)
    message = str(caught.value)
    assert "stage" in message
    assert "drives no crank" in message
    assert str(names) in message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kappa2": 2.0}, ["kappa2", "2.0", "-1 or +1", "row 0"]),
        ({"kapa2": 1.0}, ["kapa2", "did you mean 'kappa2'"]),
        ({"offset2": float("nan")}, ["offset2", "nan", "row 0"]),
        ({"b2": -3.0}, ["b2", "-3.0", "positive"]),
        ({"xi2": "long"}, ["xi2", "'long'", "number"]),
    ],
)
def test_chain_table_faults_name_the_column(change, words):
    with pytest.raises(InputError) as caught:
        sweep.evaluate(["rssr", "guide"], FIRST | GUIDE | change, "s", phi=[0.0])
    for word in words:
        assert word in str(caught.value)


def test_chain_unknown_output_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'discriminant1'"):
        sweep.evaluate(["rssr", "guide"], FIRST | GUIDE, "discriminnt1", phi=[0.0])


def test_chain_names_its_parameters_and_outputs():
    mechanism = family(["rssr", "rssr", "guide"])
    names = mechanism.parameter_names
    assert names[:10] == ("a1", "b1", "c1", "e1", "f1", "g1", "alpha1", "branch1", "a2", "b2")
    assert {"kappa2", "offset2", "kappa3", "offset3", "branch2", "branch3", "xi3"} <= set(names)
    assert len(set(names)) == len(names)
    outputs = mechanism.pose_names
    assert len(set(outputs)) == len(outputs)
    assert {"s", "d3s", "dev", "d2dev", "psi1", "d3psi1", "psi2", "pressure_angle3", "x_m3", "x_c2"} <= set(outputs)
    # of later stages no derivatives: their own are with respect to another angle
    assert not {"dpsi2", "ds3", "ddev3"} & set(outputs)
    assert mechanism.position == "s"
    assert mechanism.derivative_of["s"] == "ds"
    assert mechanism.derivative_of["psi1"] == "dpsi1"
    assert "with respect to phi of stage 1" in next(o.text for o in mechanism.pose_outputs if o.name == "d2s")


def test_chain_couplings_default_to_the_same_sense_without_offset():
    phi = [0.0, 1.0]
    plain = sweep.evaluate(["rssr", "guide"], FIRST | GUIDE, "d2s", phi)
    stated = sweep.evaluate(["rssr", "guide"], FIRST | GUIDE | {"kappa2": 1.0, "offset2": 0.0}, "d2s", phi)
    np.testing.assert_array_equal(plain.d2s, stated.d2s)
    assert family(["rssr"]) is family("rssr")
