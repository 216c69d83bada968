"""Sizes that follow from the dimensions: least link, ratio of links, arm of a coupler point, distance of pivots."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families import NAMES, family, machine
from sweep.families.capabilities import Dimensions
from sweep.optimise import Problem, minimise
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.quantities.dimensions import sizes
from sweep.study import Limit, OptimiseSettings

GUIDE = {"a": 20.0, "b": 50.0, "c": 45.0, "e": 42.0, "xi": 105.0, "eta": -14.0, "lam": 0.2, "h": -80.0}
CRANK_ROCKER = {"a": 7.0, "b": 30.0, "c": 15.0, "e": 25.0, "f": -6.0, "g": 4.0, "alpha": 1.1}
WITH_SIZES = [name for name in NAMES if sizes(family(name))]
SIZES = ("least_link", "link_ratio", "arm_ratio", "pivot_distance")
CHAIN = {f"{name}1": x for name, x in CRANK_ROCKER.items()} | {f"{name}2": x for name, x in GUIDE.items()}


def asked(mechanism, table, wanted):
    found = sweep.summarise(mechanism, {name: [x] for name, x in table.items()}, wanted)
    assert found["status"].tolist() == [st.OK]
    return [float(found[name].iloc[0]) for name in wanted]


def test_sizes_of_a_guide_are_those_of_its_drawing() -> None:
    """Distances of the drawing, not the formula: the crank pin in the origin, the coupler along x."""
    point, pins = complex(105.0, -14.0), (0.0, 50.0)
    arm = max(abs(point - pin) for pin in pins) / abs(pins[1] - pins[0])
    # a few products, a sum and a root
    assert asked("guide", GUIDE, SIZES) == pytest.approx([20.0, 20.0 / 50.0, arm, 42.0], rel=4e-16)


def test_pivot_distance_of_a_spatial_linkage_is_between_its_bearings() -> None:
    crank = np.array([0.0, -6.0 * math.sin(1.1), -6.0 * math.cos(1.1)])  # f along the crank axis (0, sin, cos)
    rocker = np.array([25.0, 0.0, 4.0])
    (found,) = asked("rssr", CRANK_ROCKER, ["pivot_distance"])
    assert found == pytest.approx(float(np.linalg.norm(rocker - crank)), rel=4e-16)


def test_sizes_of_a_chain_are_those_of_its_worst_stage() -> None:
    chain = ["rssr", "guide"]
    assert asked(chain, CHAIN, ["least_link", "least_link1", "least_link2"]) == [7.0, 7.0, 20.0]
    assert asked(chain, CHAIN, ["link_ratio", "link_ratio1", "link_ratio2"]) == [7.0 / 30.0, 7.0 / 30.0, 0.4]
    assert (
        asked(chain, CHAIN, ["arm_ratio"])
        == asked(chain, CHAIN, ["arm_ratio2"])
        == asked("guide", GUIDE, ["arm_ratio"])
    )


def test_sizes_of_a_machine_reach_members_of_any_gear() -> None:
    found = machine({"needle": ["rssr", "guide"], "looper": {"family": "rssr", "ratio": 2}})
    table = {f"needle.{name}": x for name, x in CHAIN.items()}
    table |= {f"looper.{name}": x for name, x in (CRANK_ROCKER | {"a": 5.0}).items()}
    wanted = ["least_link", "needle.least_link", "needle.least_link2", "looper.least_link", "looper.link_ratio"]
    assert asked(found, table, wanted) == [5.0, 7.0, 20.0, 5.0, 5.0 / 30.0]


def test_a_link_that_is_not_there_limits_nothing() -> None:
    example = family("heddle").example
    parallel = dict(example) | dict.fromkeys(("O3D", "O4F", "O3O4", "DF"), 0.0)
    least = min(parallel[name] for name in ("O2B", "BC", "O3C", "O4E"))
    assert asked("heddle", parallel, ["least_link"]) == [least]
    assert asked("heddle", dict(example) | {"EG": 0.5 * least}, ["least_link"]) == [0.5 * least]


@pytest.mark.parametrize("name", WITH_SIZES)
def test_gradients_of_all_pieces_equal_differences(name) -> None:
    own = family(name)
    design = np.array([[own.example.get(p.name, p.default) for p in own.parameters]])
    steps = np.eye(design.shape[1])
    for size in sizes(own).values():
        for piece in size.pieces:
            exact = piece(design + 1e-30j * steps).imag / 1e-30
            step = 1e-6 * np.abs(design).max()
            difference = (piece(design + step * steps) - piece(design - step * steps)) / (2.0 * step)
            # second order of the step, and rounding over the step
            np.testing.assert_allclose(exact, difference, rtol=1e-6, atol=1e-6 * np.abs(exact).max() + 1e-12)


@given(some.integers(-900, 900))
def test_scaling_all_lengths_by_a_power_of_two_changes_no_bit(k) -> None:
    scaled = {name: math.ldexp(x, k) if name != "lam" else x for name, x in GUIDE.items()}
    here, there = (asked("guide", table, SIZES) for table in (GUIDE, scaled))
    assert there == [math.ldexp(here[0], k), here[1], here[2], math.ldexp(here[3], k)]


def test_every_family_that_declares_links_has_a_least_link() -> None:
    declared = [name for name in NAMES if family(name).find(Dimensions)]
    assert len(declared) >= 17
    for name in declared:
        assert "least_link" in sizes(family(name))
    with pytest.raises(InputError, match="least_link"):  # ratios of lengths only
        sweep.summarise("geared_dwell", {"k": [1.2], "a": [1.0]}, ["least_link"])


def problem(*limits: Limit, objective: str = "max_abs_d2s") -> tuple[Problem, np.ndarray]:
    """Least acceleration of a guided point for a stroke of 24.5, which short links carry if they may."""
    names = ("a", "b", "c", "e", "xi", "eta")
    lower = np.array([2.0, 4.0, 4.0, 4.0, -120.0, -120.0])
    upper = np.array([25.0, 60.0, 60.0, 60.0, 120.0, 120.0])
    stroke = Limit("stroke", 24.5, 24.5)
    fixed = {"lam": 0.0, "h": 0.0, "branch": 1.0}
    found = Problem(family("guide"), names, lower, upper, fixed, objective, (stroke, *limits))
    return found, found.rows(np.array([[9.0, 24.0, 24.0, 20.0, 30.0, 6.0], [10.0, 30.0, 25.0, 22.0, 10.0, 10.0]]))


@pytest.mark.parametrize(
    ("limits", "active"),
    [
        ((Limit("least_link", 12.0, None),), {"least_link": 12.0}),
        ((Limit("least_link", 7.0, None), Limit("link_ratio", None, 0.6)), {"least_link": 7.0, "link_ratio": 0.6}),
        ((Limit("arm_ratio", None, 1.2), Limit("link_ratio", 0.5, None), Limit("least_link", 7.0, None)),
         {"arm_ratio": 1.2}),
        ((Limit("pivot_distance", 12.0, None),), {"pivot_distance": 12.0}),
    ],
)  # fmt: skip
def test_smallest_mechanism_ends_at_the_limits_on_its_links(limits, active) -> None:
    # Without a margin the smallest mechanism is one that all but locks: parallel links of one length.
    limited, starts = problem(*limits, Limit("margin", 0.1, None), objective="size")
    best = minimise(limited, starts, OptimiseSettings())[0]
    assert best.status == st.OK and best.kkt_residual <= 1e-6
    row = dict(zip(limited.family.parameter_names, best.design, strict=True))
    # the last Newton rounds hold active limits to rounding
    assert asked("guide", row, list(active)) == pytest.approx(list(active.values()), rel=1e-12)
    for limit in limits:
        (value,) = asked("guide", row, [limit.output])
        assert (limit.minimum or 0.0) * (1 - 1e-9) <= value <= (limit.maximum or np.inf) * (1 + 1e-9)


def test_sensitivities_of_sizes_are_derivatives_of_the_output_itself() -> None:
    design = np.array([*GUIDE.values(), 1.0])
    rows = sensitivities(family("guide"), design, ["arm_ratio", "pivot_distance"])
    slope = {(o, p): x for o, p, x in zip(rows["output"], rows["parameter"], rows["growing"], strict=True)}
    arm = math.hypot(105.0, 14.0) / 50.0
    assert slope["arm_ratio", "b"] == pytest.approx(-arm / 50.0, rel=1e-12)
    assert slope["arm_ratio", "xi"] == pytest.approx(105.0 / math.hypot(105.0, 14.0) / 50.0, rel=1e-12)
    assert slope["pivot_distance", "e"] == pytest.approx(1.0, rel=1e-12)
