"""The design space: order of the lattice, same bits however sliced, Sobol points equal to scipy's."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

from sweep.study.sobol import BITS, DIMENSIONS, Sobol
from sweep.study.space import Axis, DesignSpace

QUICK = settings(deadline=None, max_examples=30)

SEED_7 = [["0x1.e563b34376990p-5", "0x1.d551df8c73923p-1"], ["0x1.6078c2d6baa76p-2", "0x1.9fbed6f0d810dp-1"]]

NUMBERS = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))


@st.composite
def lattice_axes(draw: st.DrawFn, name: str) -> Axis:
    if draw(st.booleans()):
        return Axis.listed(name, draw(st.lists(NUMBERS, min_size=1, max_size=5, unique=True)), "deg", math.pi / 180)
    low = draw(NUMBERS)
    ends = (low, low + draw(st.floats(0.001, 1e3)))
    return Axis.lattice(name, ends, draw(st.integers(1, 6)), "mm")


@st.composite
def spaces(draw: st.DrawFn) -> DesignSpace:
    swept = draw(st.lists(st.sampled_from("abcdef"), min_size=1, max_size=4, unique=True))
    axes = tuple(draw(lattice_axes(name)) for name in swept)
    fixed = {name: float(k) for k, name in enumerate("abcdefg") if name not in swept}
    if draw(st.booleans()):
        return DesignSpace(tuple("abcdefg"), axes, fixed)
    sampled = tuple(
        Axis.sampled(
            axis.name, (abs(axis.low) + 1.0, abs(axis.low) + 9.0), scale=draw(st.sampled_from(["linear", "log"]))
        )
        if axis.count > 3
        else axis
        for axis in axes
    )
    return DesignSpace(tuple("abcdefg"), sampled, fixed, "sobol", draw(st.integers(1, 5000)), draw(st.integers(0, 99)))


@QUICK
@given(spaces(), st.data())
def test_columns_have_the_same_bits_however_sliced(space: DesignSpace, data: st.DataObject) -> None:
    whole = space.columns(0, space.count)
    assert list(whole) == list("abcdefg")
    cuts = sorted(data.draw(st.lists(st.integers(0, space.count), max_size=5)))
    for start, stop in itertools.pairwise([0, *cuts, space.count]):
        for name, values in space.columns(start, stop).items():
            assert values.dtype == np.float64
            assert values.tobytes() == whole[name][start:stop].tobytes()


@QUICK
@given(st.lists(st.integers(1, 5), min_size=1, max_size=4))
def test_lattice_runs_as_nested_loops_the_last_axis_fastest(counts: list[int]) -> None:
    axes = tuple(Axis.listed(f"p{k}", [10.0 * k + j for j in range(n)]) for k, n in enumerate(counts))
    space = DesignSpace(tuple(axis.name for axis in axes), axes, {})
    loops = list(itertools.product(*[[10.0 * k + j for j in range(n)] for k, n in enumerate(counts)]))
    columns = space.columns(0, space.count)
    assert space.count == len(loops)
    assert [tuple(row) for row in np.column_stack(list(columns.values()))] == loops


@QUICK
@given(spaces())
def test_values_stay_within_the_bounds(space: DesignSpace) -> None:
    columns = space.columns(0, space.count)
    for name, (low, high) in space.bounds.items():
        assert low <= columns[name].min()
        assert columns[name].max() <= high


def test_lattice_of_whole_degrees_is_exact_in_degrees() -> None:
    axis = Axis.lattice("alpha", (0.0, 90.0), 10, "deg", math.pi / 180)
    assert axis.values is not None
    assert axis.values.tolist() == [math.radians(10.0 * k) for k in range(10)]


@QUICK
@given(NUMBERS, st.floats(0.001, 1e3), st.integers(2, 50), st.sampled_from(["linear", "log"]))
def test_axis_is_rising_and_ends_exactly(low: float, length: float, count: int, scale: str) -> None:
    low = abs(low) + 0.001
    values = Axis.lattice("x", (low, low + length), count, scale=scale).values  # type: ignore[arg-type]
    assert values is not None
    assert (values[0], values[-1]) == (low, low + length)
    assert (np.diff(values) > 0.0).all()


def test_log_axis_has_equal_ratios() -> None:
    values = Axis.lattice("x", (1e-3, 1e3), 61, scale="log").values
    assert values is not None
    np.testing.assert_allclose(values[1:] / values[:-1], 10.0**0.1, rtol=1e-14)


def test_count_of_one_is_the_lower_end() -> None:
    assert Axis.lattice("x", (3.0, 5.0), 1).values == [3.0]


def test_a_space_of_10_to_the_12_is_addressed_without_being_made() -> None:
    axes = (Axis.lattice("x", (0.0, 999_999.0), 1_000_000), Axis.lattice("y", (0.0, 999_999.0), 1_000_000))
    space = DesignSpace(("x", "y"), axes, {})
    assert space.count == 10**12
    columns = space.columns(10**12 - 2, 10**12)
    assert columns["x"].tolist() == [999_999.0, 999_999.0]
    assert columns["y"].tolist() == [999_998.0, 999_999.0]


@pytest.mark.parametrize(("start", "stop"), [(-1, 2), (0, 7), (4, 3)])
def test_a_slice_outside_the_space_is_refused(start: int, stop: int) -> None:
    space = DesignSpace(("x",), (Axis.listed("x", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),), {})
    with pytest.raises(IndexError, match="the space has 6"):
        space.columns(start, stop)


def points(dimensions: int, seed: int | None, start: int, stop: int) -> np.ndarray:
    """Points start to stop - 1 of a sequence, one row per dimension."""
    return some_points(Sobol(dimensions, seed), range(dimensions), start, stop)


def some_points(sequence: Sobol, which: Sequence[int], start: int, stop: int) -> np.ndarray:
    out = np.empty((stop - start, len(which)))
    sequence.fill(start, stop, which, [(0.0, 1.0)] * len(which), range(len(which)), out)
    return out.T


def test_plain_sobol_points_are_those_of_scipy_in_every_dimension() -> None:
    theirs = qmc.Sobol(DIMENSIONS, scramble=False, bits=BITS).random(2**13).T
    assert (points(DIMENSIONS, None, 0, 2**13) == theirs).all()


def test_plain_sobol_points_are_those_of_scipy_far_along() -> None:
    engine = qmc.Sobol(8, scramble=False, bits=30)
    engine.fast_forward(2**24 - 5)
    ours = points(8, None, 2**24 - 5, 2**24 + 2**10)
    assert (np.floor(ours * 2.0**30) == engine.random(2**10 + 5).T * 2.0**30).all()


@pytest.mark.parametrize("seed", [0, 1, 2**63 - 1])
def test_scrambled_points_keep_one_point_in_each_cell(seed: int) -> None:
    # A block of 2^k points has one in each of 2^k equal slices of every axis, and the first two axes, a
    # (0, 2)-sequence, one in each of 2^j by 2^(k - j) boxes: what scrambling must not destroy.
    block = points(12, seed, 3 * 2**10, 4 * 2**10)
    assert block.min() > 0.0
    assert block.max() < 1.0
    for row in block:
        assert sorted((row * 2**10).astype(int)) == list(range(2**10))
    for j in range(11):
        boxes = (block[0] * 2**j).astype(int) * 2 ** (10 - j) + (block[1] * 2 ** (10 - j)).astype(int)
        assert sorted(boxes) == list(range(2**10))


@pytest.mark.parametrize(("start", "stop"), [(0, 5000), (1023, 2049), (2**21 - 700, 2**21 + 700), (7, 8), (9, 9)])
def test_points_of_a_slice_are_those_of_its_numbers_one_by_one(start: int, stop: int) -> None:
    sequence = Sobol(9, 11)
    index = np.arange(start, stop)
    expected = np.array([sequence.at(index[k : k + 1])[:, 0] for k in range(index.size)]).reshape(-1, 9).T
    np.testing.assert_array_equal(some_points(sequence, range(9), start, stop), expected)
    np.testing.assert_array_equal(sequence.at(index[::-1])[:, ::-1], expected)
    np.testing.assert_array_equal(some_points(sequence, [6, 2], start, stop), expected[[6, 2]])
    np.testing.assert_array_equal(sequence.at(index, [8]), expected[[8]])


@QUICK
@given(spaces(), st.data())
def test_some_columns_of_some_designs_have_the_bits_of_the_whole(space: DesignSpace, data: st.DataObject) -> None:
    whole = space.columns(0, space.count)
    names = data.draw(st.lists(st.sampled_from("abcdefg"), unique=True))
    index = np.array(data.draw(st.lists(st.integers(0, space.count - 1), max_size=20)), np.int64)
    matrix, some = space.matrix(0, space.count, names), space.columns_at(index, names)
    assert matrix.shape == (space.count, len(names))
    assert list(some) == names
    for name, values in zip(names, matrix.T, strict=True):
        assert values.tobytes() == whole[name].tobytes()
        assert some[name].tobytes() == whole[name][index].tobytes()


def test_seeds_give_different_points_and_the_same_seed_the_same() -> None:
    assert (points(3, 1, 0, 64) == points(3, 1, 0, 64)).all()
    assert (points(3, 1, 0, 64) != points(3, 2, 0, 64)).all()


def test_scrambled_points_are_the_same_on_every_machine() -> None:
    # Kept from the first run: a dataset must not change because a library did.
    first = points(2, 7, 0, 2)
    assert [[x.hex() for x in row] for row in first.tolist()] == SEED_7


def test_sampled_mean_converges_faster_than_chance() -> None:
    space = DesignSpace(
        ("x", "y"), (Axis.sampled("x", (1.0, 3.0)), Axis.sampled("y", (2.0, 8.0))), {}, "sobol", 2**14, 5
    )
    columns = space.columns(0, space.count)
    product = float(np.mean(columns["x"] * columns["y"]))
    assert abs(product - 10.0) < 1e-3  # plain random numbers miss by 0.06 on average


def test_listed_values_in_a_sample_come_equally_often() -> None:
    axes = (Axis.listed("branch", [-1.0, 1.0]), Axis.sampled("x", (0.0, 1.0)))
    space = DesignSpace(("x", "branch"), axes, {}, "sobol", 2**10, 0)
    assert float(space.columns(0, 2**10)["branch"].sum()) == 0.0
