"""`sweep.mechanism`: the numbers of `evaluate` and `summarise`, bit for bit, and the project's own errors."""

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.families import family
from sweep.families.base import Angles

CRANK_ROCKER = {"a": 12.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.0}
PHI = np.linspace(0.0, 7.0, 50)


def numbered(stage, design):
    return {f"{name}{stage}": value for name, value in design.items()}


def of(name):
    return {key: float(value) for key, value in family(name).example.items()}


CASES = {
    "rssr": ("rssr", CRANK_ROCKER, ["swing", "max_abs_d2psi", "margin"]),
    "guide": ("guide", of("guide"), ["stroke", "max_abs_d2s", "max_abs_dev"]),
    "geared_dwell": ("geared_dwell", of("geared_dwell"), ["dwell_angle", "max_abs_d2psi"]),
    "chain": (
        ["rssr", "guide"],
        numbered(1, of("rssr")) | numbered(2, of("guide")),
        ["rotatable", "stroke", "max_abs_d2s", "max_abs_d2psi1"],
    ),
    "machine": (
        {"needle": "rssr", "looper": {"family": "rssr", "ratio": 2}},
        {f"{member}.{name}": value for member in ("needle", "looper") for name, value in CRANK_ROCKER.items()},
        ["needle.swing", "looper.max_abs_d2psi"],
    ),
    "effect": ("rssr", CRANK_ROCKER | {"x_point": 15.0}, ["max_abs_x_p", "max_abs_d2psi"]),
}


@pytest.fixture(params=list(CASES))
def case(request):
    return CASES[request.param]


def assert_same(found, frame):
    assert list(found) == list(frame.columns)
    for name, values in found.items():
        np.testing.assert_array_equal(values, frame[name], err_msg=name)


def test_poses_are_those_of_evaluate(case):
    mechanism, design, _ = case
    bound = sweep.mechanism(mechanism, **design)
    names = list(family(mechanism).pose_names)
    frame = sweep.evaluate(mechanism, design, names, phi=PHI).drop(columns=["design", "phi"])
    assert_same(bound(PHI), frame)
    if "x_point" in design:
        frame = sweep.evaluate(mechanism, design, "psi, coupler", phi=PHI).drop(columns=["design", "phi"])
        assert_same(bound.poses(PHI, "psi, coupler"), frame)
        return
    assert_same(bound.poses(PHI, names[:2]), frame[[*names[:2], "status"]])
    alone = bound.poses(float(PHI[3]), names[:2])
    assert alone == frame.loc[3, [*names[:2], "status"]].to_dict()
    pd.testing.assert_frame_equal(pd.DataFrame(bound(PHI)), frame, check_index_type=False)


@pytest.mark.parametrize("how", [{}, {"accuracy": 1e-6}, {"samples": 90}])
def test_outputs_are_those_of_summarise(case, how):
    mechanism, design, names = case
    found = sweep.mechanism(mechanism, **design).outputs(names, **how)
    frame = sweep.summarise(mechanism, design, names, **how)
    assert_same({name: [value] for name, value in found.items()}, frame)


def test_another_design_changes_what_is_given_alone():
    one = sweep.mechanism("rssr", **CRANK_ROCKER)
    other = one.with_(a="1 cm", alpha="60 deg")
    design = CRANK_ROCKER | {"a": 10.0, "alpha": np.deg2rad(60.0)}
    assert_same(other(PHI), sweep.evaluate("rssr", design, family("rssr").pose_names, phi=PHI).iloc[:, 2:])
    assert one.dimensions["a"] == 12.0 and other.dimensions["b"] == 40.0


def test_a_pose_that_is_missing_has_its_status():
    bound = sweep.mechanism("rssr", **CRANK_ROCKER | {"b": 20.0})
    frame = sweep.evaluate("rssr", bound.dimensions, "psi, d2psi", phi=PHI).iloc[:, 2:]
    assert frame["psi"].isna().any()
    assert_same(bound.poses(PHI, "psi, d2psi"), frame)
    assert_same({k: [v] for k, v in bound.outputs("swing").items()}, sweep.summarise("rssr", bound.dimensions, "swing"))


@pytest.mark.parametrize(
    ("given", "name", "words"),
    [
        ({"a": "12 deg"}, "a", "a length"),
        ({"a": "12"}, "a", "a number and its unit"),
        ({"a": -1.0}, "a", "positive"),
        ({"a": float("nan")}, "a", "finite"),
        ({"a": None}, "a", "finite"),
        ({"a": [1.0, 2.0]}, "a", "finite"),
        ({"a": 10**400}, "a", "finite"),
        ({"alpha": 60.0}, "alpha", "60 deg"),
        ({"branch": 0.5}, "branch", "+1"),
        ({"alfa": 1.0}, "dimension", "alpha"),
        ({"speed": "7000 mm"}, "speed", "rpm"),
    ],
)
def test_a_bad_dimension_is_named(given, name, words):
    with pytest.raises(sweep.InputError) as caught:
        sweep.mechanism("rssr", **CRANK_ROCKER | given)
    assert caught.value.name == name and words in caught.value.allowed
    assert caught.value.place == "mechanism rssr"


def test_what_is_missing_is_named():
    with pytest.raises(sweep.InputError, match="b is missing; needed: the coupler; given a"):
        sweep.mechanism("rssr", a=12.0)
    with pytest.raises(sweep.InputError, match="speed is missing"):
        sweep.mechanism("rssr", **CRANK_ROCKER).poses(0.0, "tip_load")


@pytest.mark.parametrize("phi", [np.nan, [0.0, np.inf], [[0.0]], 90.0, "x", None])
def test_bad_crank_angles_are_refused_as_evaluate_refuses_them(phi):
    with pytest.raises(sweep.InputError) as expected:
        sweep.evaluate("rssr", CRANK_ROCKER, "psi", phi=np.asarray(phi))
    with pytest.raises(sweep.InputError) as caught:
        sweep.mechanism("rssr", **CRANK_ROCKER).poses(phi, "psi")
    assert caught.value.allowed == expected.value.allowed


@pytest.mark.parametrize("want", ["psy", ["psi", 3], 7, "swing"])
def test_a_bad_name_is_refused(want):
    with pytest.raises(sweep.InputError, match=r"psi|name"):
        sweep.mechanism("rssr", **CRANK_ROCKER).poses(0.0, want)


def test_angles_that_change_after_a_call_count():
    """Cosines and sines are kept from call to call by what the angles are, not by where they stand."""
    bound, phi = sweep.mechanism("rssr", **CRANK_ROCKER), PHI.copy()
    bound.poses(phi, "psi")
    phi += 0.25
    precise = family("rssr").precise()
    row = np.array([[*CRANK_ROCKER.values(), 1.0]])
    np.testing.assert_array_equal(
        bound.poses(phi, "psi")["psi"], precise.poses(row, Angles.of(phi[None]), frozenset(["psi"]))["psi"][0]
    )
