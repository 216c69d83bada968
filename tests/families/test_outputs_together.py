"""Sets of pose outputs that few poses are asked for come from the set of all, with the same bits."""

from __future__ import annotations

import pickle
from typing import Any

import numba
import numpy as np
import pytest

import kernels.families.rssr
from sweep.families import family, rssr
from sweep.families.base import Accuracy, Angles, Array, Columns
from sweep.families.poses import MANY, PAID, Together
from sweep.reductions.sampling import turn
from tests.support.own_code import own_code
from tests.support.rssr_designs import random_designs

TURN = Angles.of(np.linspace(0.0, 6.0, 24)[None, :])
GUIDES = np.array([[1.0, 2.5, 2.5, 2.0, 5.0, 0.3, 0.2, -4.0, 1.0], [3.0, 2.5, 2.5, 2.0, 5.0, 0.3, 0.2, -4.0, -1.0]])


class Recorded:
    """Poses that note what they were asked for."""

    def __init__(self) -> None:
        self.asked: list[frozenset[str]] = []

    def __call__(self, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        self.asked.append(wanted)
        shape = len(designs), angles.cos.shape[1]
        return {name: np.zeros(shape) for name in wanted} | {"status": np.zeros(shape, np.uint8)}


def recorded(*sets: str) -> tuple[Together, list[frozenset[str]]]:
    def own(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        return poses(designs, angles, wanted)

    poses = Recorded()
    return Together(own, [frozenset(names) for names in sets or ("abc",)]), poses.asked


def angles(count: int) -> Angles:
    return Angles.of(np.zeros((1, count)))


ONE, ALL, A = np.ones((1, 2)), frozenset("abc"), frozenset("a")


def test_few_poses_take_all_outputs_and_give_the_wanted_ones() -> None:
    poses, asked = recorded()
    assert set(poses(ONE, angles(MANY - 1), A)) == {"a", "status"}
    assert asked == [ALL]


def test_few_poses_take_the_first_set_that_has_what_is_wanted() -> None:
    poses, asked = recorded("ab", "abc")
    for wanted in ("a", "ab", "c"):
        assert set(poses(ONE, angles(4), frozenset(wanted))) == {*wanted, "status"}
    assert asked == [frozenset("ab"), frozenset("ab"), ALL]


def test_precise_poses_of_few_designs_leave_the_joints_out_where_none_is_wanted() -> None:
    precise = rssr.precise_poses
    assert isinstance(precise, Together)
    values = precise._larger(frozenset({"d2psi"}), False)
    assert "pressure_angle" in values and "x_b" not in values
    assert precise._larger(frozenset({"x_b"}), False) == frozenset(kernels.families.rssr.Outputs._fields)


def test_a_call_on_many_poses_computes_what_it_asks_for_alone() -> None:
    poses, asked = recorded()
    poses(ONE, angles(MANY), A)
    assert asked == [A]


def test_a_set_that_is_asked_for_often_gets_code_of_its_own_and_no_other_does() -> None:
    poses, asked = recorded()
    few = angles(MANY // 2)
    for _ in range(2 * PAID // MANY + 1):
        poses(ONE, few, A)
    assert asked[0] == ALL and asked[-1] == A and asked.count(A) == 1
    poses(ONE, few, frozenset("ab"))
    poses(ONE.astype(complex), few, A)  # other code than that of float64
    assert asked[-2:] == [ALL, A]


def test_complex_poses_take_the_set_asked_for_first_as_long_as_it_will_do() -> None:
    poses, asked = recorded()
    slopes = ONE.astype(complex)
    for wanted in ("ab", "a", "b", "bc", "ab"):
        assert set(poses(slopes, angles(4), frozenset(wanted))) == {*wanted, "status"}
    poses(ONE, angles(4), A)
    assert asked == [frozenset("ab")] * 3 + [ALL, frozenset("ab"), ALL]


def test_own_code_is_taken_at_once_where_a_time_is_measured() -> None:
    poses, asked = recorded()
    with own_code():
        poses(ONE, angles(4), A)
    poses(ONE, angles(4), A)
    assert asked == [A, ALL]


@pytest.mark.parametrize("complex_step", [False, True], ids=["float", "complex"])
@pytest.mark.parametrize(
    ("name", "designs"), [("rssr", random_designs(6, 3)), ("guide", GUIDES)], ids=["rssr", "guide"]
)
def test_a_set_from_the_set_of_all_has_the_bits_of_its_own(name: str, designs: Array, complex_step: bool) -> None:
    """Designs that do not turn among them.  Each set is once taken from all, and once compiled for itself."""
    matrix: Any = designs + 1e-30j if complex_step else designs
    found = family(name)
    for wanted in (frozenset(found.pose_names[:1]), frozenset(found.pose_names[1:4])):
        columns = found.poses(matrix, TURN, wanted)
        many = np.concatenate([matrix] * (1 + MANY // (len(designs) * TURN.cos.shape[1])))
        own = found.poses(many, TURN, wanted)
        assert set(columns) == {*wanted, "status"}
        for key in columns:
            assert np.asarray(columns[key]).tobytes() == np.asarray(own[key])[: len(designs)].tobytes()


def test_poses_go_to_another_process_by_their_name() -> None:
    assert pickle.loads(pickle.dumps(rssr.poses)) is rssr.poses


def test_a_turn_has_the_type_of_all_angles_so_that_kernels_are_compiled_once() -> None:
    assert [numba.typeof(x) for x in turn(16)] == [numba.typeof(x) for x in angles(16)]


@pytest.mark.parametrize("target", [None, 1e-6])
def test_every_set_with_the_pressure_angle_takes_one_code_and_gives_what_is_wanted(
    target: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    designs, accuracy = random_designs(50, 7), Accuracy(target=target)
    kernel, sets = kernels.families.rssr.margin, set()

    def noted(*arrays: Array | None) -> None:
        sets.add(tuple(x is None for x in arrays))
        kernel(*arrays)

    monkeypatch.setattr(kernels.families.rssr, "margin", noted)
    every = rssr.margin(designs, frozenset(("margin", "rotatable", "max_pressure_angle")), accuracy)
    for wanted in (frozenset(("max_pressure_angle",)), frozenset(("rotatable", "max_pressure_angle"))):
        found = rssr.margin(designs, wanted, accuracy)
        errors = {f"err_{name}" for name in wanted} if target is not None else set()
        assert set(found) == {"status"} | wanted | errors
        for name, values in found.items():
            np.testing.assert_array_equal(values, every[name])
    assert len(sets) == 1
    np.testing.assert_array_equal(rssr.margin(designs, frozenset(("margin",)), accuracy)["margin"], every["margin"])
