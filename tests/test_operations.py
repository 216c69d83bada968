"""Elements of arrays, loops over ranges, complex arithmetic and errors of calls: kernels have them as Python does."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from kernels._jit import inline, kernel

RANDOM = np.random.default_rng(20261123)
# Every layout: rows one after the other, columns one after the other, every second element of something larger.
SHAPES = [(7,), (4, 3), (2, 3, 4)]
LAYOUTS = {
    "rows": lambda x: x,
    "columns": np.asfortranarray,
    "strides": lambda x: np.repeat(x, 2, axis=x.ndim - 1)[..., ::2],
    "backwards": lambda x: x[::-1],
}


def _read_1(x: Any, i: int) -> Any:
    return x[i]


def _read_2(x: Any, i: int) -> Any:
    return x[i, -1] + x[i - 1, 1]


def _read_3(x: Any, i: int) -> Any:
    return x[i, -1, 2] - x[-i, i + 1, i]


READ = {1: _read_1, 2: _read_2, 3: _read_3}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("shape", SHAPES, ids=len)
def test_an_element_is_that_of_python_in_every_layout(shape: tuple[int, ...], layout: str) -> None:
    x = LAYOUTS[layout](RANDOM.normal(size=shape))
    read = READ[len(shape)]
    compiled = kernel(read)
    for i in range(-shape[0], shape[0]) if len(shape) == 1 else (0, 1):
        assert compiled(x, i) == read(x, i)


@pytest.mark.parametrize("kind", [np.int8, np.int32, np.int64, np.uint8, np.uint64])
def test_an_index_may_be_of_any_kind_of_whole_number(kind: type[np.integer[Any]]) -> None:
    x = RANDOM.normal(size=5)
    assert kernel(_read_1)(x, kind(3)) == x[3]
    if np.issubdtype(kind, np.signedinteger):
        assert kernel(_read_1)(x, kind(-2)) == x[-2]


@pytest.mark.parametrize("value", [True, 3, -2.5, 1.0 - 2.0j], ids=str)
def test_an_element_is_of_the_array_s_type(value: complex) -> None:
    def swap(x: Any) -> None:
        for i in range(len(x) // 2):
            x[i], x[-1 - i] = x[-1 - i], x[i]

    x = np.array([value] * 3 + [0] * 3, dtype=type(value))
    kernel(swap)(x)
    assert x.tolist() == [0] * 3 + [value] * 3


def test_what_is_set_becomes_a_number_of_the_array_s_type() -> None:
    def fill(x: Any, z: Any) -> None:
        for i in range(x.shape[0]):
            for j in range(x.shape[1]):
                x[i, j] = 10 * i + j
                z[i, j] = x[i, j] > 1

    x, z = np.empty((2, 3)), np.empty((3, 2), dtype=bool).T
    kernel(fill)(x, z)
    assert x.tolist() == [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]
    assert z.tolist() == [[False, False, True], [True, True, True]]


def _numbers(start: int, stop: int, step: int) -> tuple[int, int, int]:
    count, total, last = 0, 0, -99
    for i in range(start, stop, step):
        count, total, last = count + 1, total + i * i, i
    for i in range(start, stop):
        for j in range(i):
            count, total, last = count + 1, total + j, i
    for _ in range(stop):
        count += 1
    for i in range(stop, start, -1):
        total -= i
    for i in range(start, stop, 3):
        if i == 2:
            continue
        if i > 5:
            break
        last += i
    return count, total, last


@pytest.mark.parametrize("numbers", [(0, 0, 1), (0, 5, 1), (3, 1, 1), (-4, 9, 2), (9, -4, -3), (0, 1, 7), (-2, -8, 1)])
def test_a_loop_over_a_range_is_that_of_python(numbers: tuple[int, int, int]) -> None:
    assert kernel(_numbers)(*numbers) == _numbers(*numbers)


def test_a_range_without_a_step_is_an_error() -> None:
    with pytest.raises(ValueError, match="must not be zero"):
        kernel(_numbers)(0, 3, 0)


def _together(z: complex, w: complex) -> tuple[complex, complex, complex]:
    return z + w, z - w, z * w


AWKWARD = [0.0, -0.0, 1.0, -2.5, 1e-300, 1e300, math.inf, -math.inf, math.nan]


def test_complex_arithmetic_is_that_of_numpy_to_the_bit() -> None:
    compiled = kernel(_together)
    values = [complex(a, b) for a in AWKWARD for b in AWKWARD]
    with np.errstate(all="ignore"):
        for z in values:
            for w in values:
                found = np.array(compiled(z, w)).view(np.int64)
                expected = np.array(_together(np.complex128(z), np.complex128(w)))
                parts = expected.view(np.float64)
                where = ~np.isnan(parts)  # which nan it is nobody says
                assert (found == expected.view(np.int64))[where].all(), (z, w)
                assert np.isnan(found.view(np.float64)[~where]).all(), (z, w)


@inline
def _positive(x: float) -> float:
    if x < 0.0:
        raise ValueError("negative")
    return math.sqrt(x)


@inline
def _root_or_none(x: float) -> float | None:
    return math.sqrt(x) if x >= 0.0 else None


def test_an_error_in_a_helper_reaches_python() -> None:
    whole = kernel(lambda x: _positive(x) + 1.0)
    assert whole(4.0) == 3.0
    with pytest.raises(ValueError, match="negative"):
        whole(-1.0)
    with pytest.raises(ValueError, match="negative dimensions"):
        kernel(lambda n: np.zeros(n).sum())(-1)


def test_a_function_that_catches_errors_catches_those_of_its_helpers() -> None:
    def caught(x: float) -> float:
        try:
            return _positive(x)
        except Exception:
            return -1.0

    assert kernel(caught)(4.0) == 2.0
    assert kernel(caught)(-4.0) == -1.0


def test_a_helper_may_return_nothing() -> None:
    def known(x: float) -> bool:
        return _root_or_none(x) is not None

    assert kernel(known)(4.0) is True and kernel(known)(-4.0) is False


def _everywhere(x: Any, n: int) -> float:
    """Variables that are set once and read in other blocks, before and after loops, and some that are set later."""
    top = x[0]
    scale = 2.0 * top
    total = 0.0
    i = 0
    while i < n:
        share = scale + i
        if x[i] > 0.5:
            inner = share * x[i]
            j = 0
            while j < i:
                total += inner - top
                j += 1
        else:
            inner = -share
        total += inner
        i += 1
    return total + scale


def test_variables_are_those_of_python_wherever_they_are_read() -> None:
    x = RANDOM.uniform(size=9)
    for n in range(9):
        assert kernel(_everywhere)(x, n) == _everywhere(x, n)
