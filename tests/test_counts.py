"""Where references to arrays are counted: only in functions that make or return one, or where that is not plain."""

# mypy: disable-error-code="no-untyped-call, no-untyped-def, attr-defined, arg-type"
# numba names no types.

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from kernels._compiler import Kernel
from kernels._jit import inline, kernel

COUNTS = ("NRT_incref", "NRT_decref", "NRT_MemInfo_alloc")


@inline
def _sum_of(x, wanted):
    total = 0.0
    for k in range(x.size):
        total += x[k]
    if wanted is not None:
        wanted[0] = total
    return total


@inline
def _doubled(x):
    return 2.0 * x


def _views(x, n, wanted):
    rows = (x[0], x[1:, n])
    row, column = rows
    row[1:3] = 7.0
    row = x[n] if n > 0 else column
    return _sum_of(row, wanted) + len(column) + x[n, 0] + x[:, n].shape[0]


def _made(x, n, wanted):
    return np.zeros(n).size + x[0, 0]


def _made_within(x, n, wanted):
    return _sum_of(_doubled(x[0]), wanted)


def _returned(x, n, wanted):
    return x[n]


def _chosen(x, n, wanted):
    return _sum_of(x[0][x[0] > 0.0], wanted)


def _taken(x, n, wanted):
    return _sum_of(x[0, 1:][np.array([0, 1])], wanted)


def _method(x, n, wanted):
    return x.sum() + x[n].max()


def _function(x, n, wanted):
    return np.median(x)


def _put(x, n, wanted):
    x[n, :] = x[0]
    return x[0, 0]


def _walked(x, n, wanted):
    total = 0.0
    for value in x[n]:
        total += value
    return total


def _loop(x, n, wanted):
    wanted += x[0, :1]
    return n


FUNCTIONS = [_made, _made_within, _returned, _chosen, _taken, _method, _function, _put, _walked, _loop]


def arguments() -> tuple[Any, ...]:
    return np.arange(12.0).reshape(3, 4) - 3.0, 2, np.zeros(1)


def body(function: Kernel) -> str:
    """Return the LLVM code of a compiled function, without the one that Python calls."""
    (compiled,) = function.overloads.values()
    text: str = compiled.library.get_llvm_str()
    return text.split(f"@{compiled.fndesc.mangled_name}(", 1)[1].split("\n}\n", 1)[0]


@pytest.fixture
def watched() -> Iterator[None]:
    """Let numba count what it allocates."""
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


def test_a_function_that_only_uses_arrays_counts_no_references() -> None:
    compiled, (x, n, wanted), (same, _, found) = kernel(_views), arguments(), arguments()
    assert compiled(x, n, wanted) == _views(same, n, found)
    assert x.tolist() == same.tolist() and wanted.tolist() == found.tolist()
    assert not any(name in body(compiled) for name in COUNTS)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda x: x.__name__)
def test_a_function_that_makes_or_returns_an_array_counts_references(function: Callable[..., Any]) -> None:
    """Control of the above, and of the search for what counts: it must find it here."""
    compiled = kernel(function)
    compiled(*arguments())
    assert compiled.nopython_signatures
    assert any(name in compiled.inspect_llvm(compiled.signatures[0]) for name in COUNTS)


@pytest.mark.parametrize("function", [_views, *FUNCTIONS], ids=lambda x: x.__name__)
@pytest.mark.usefixtures("watched")
def test_no_array_is_kept_or_freed_twice(function: Callable[..., Any]) -> None:
    compiled, (x, n, wanted) = kernel(function), arguments()
    compiled(x, n, wanted)
    before, held = rtsys.get_allocation_stats(), (sys.getrefcount(x), sys.getrefcount(wanted))
    for _ in range(5):
        compiled(x, n, wanted)
    after = rtsys.get_allocation_stats()
    assert (sys.getrefcount(x), sys.getrefcount(wanted)) == held
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free
