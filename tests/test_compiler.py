"""Kernels as they are compiled: what only kernels call has no machine code of its own, and is found again on disk."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from kernels._compiler import PART, Kernel, Part, rebuilt_part
from kernels._jit import inline, kernel
from kernels.families import rssr
from kernels.families.rssr.derivatives import rocker_fused


@inline
def _half(x: float) -> float:
    return 0.5 * x


@inline
def _quarter(x: float) -> float:
    return _half(_half(x))


@kernel
def _quarters(x: np.ndarray) -> None:  # type: ignore[type-arg]
    for i in range(x.size):
        x[i] = _quarter(x[i])


def test_a_part_is_code_for_its_callers_alone() -> None:
    values = np.array([4.0, -8.0])
    _quarters(values)
    assert values.tolist() == [1.0, -2.0]
    assert isinstance(_quarter, Part) and isinstance(_quarters, Kernel) and not isinstance(_quarters, Part)
    (compiled,) = _quarter.overloads.values()
    assert compiled.library.serialize_using_object_code()[1] == PART
    (whole,) = _quarters.overloads.values()
    assert whole.library.serialize_using_object_code()[1] == "object"


def test_a_part_that_python_calls_gives_what_its_source_gives() -> None:
    assert _quarter(3.0) == _quarter.py_func(3.0) == 0.75


def test_a_part_that_was_kept_on_disk_can_be_linked_again() -> None:
    _quarters(np.ones(1))
    (compiled,) = _quarter.overloads.values()
    again = rebuilt_part(compiled.target_context, compiled._reduce())
    assert again.signature == compiled.signature
    assert again.library._get_module_for_linking() is again.library._final_module
    names = {f.name for f in again.library.get_defined_functions()}
    assert compiled.fndesc.mangled_name in names


@pytest.mark.parametrize("function", [rssr.margin, rocker_fused], ids=["kernel", "part"])
def test_a_kernel_goes_to_another_process_by_its_name(function: Kernel) -> None:
    """Not as its source, which that process would compile anew."""
    sent = pickle.dumps(function)
    assert pickle.loads(sent) is function and len(sent) < 200


def test_a_kernel_without_a_name_of_its_own_goes_as_its_source() -> None:
    nameless = kernel(lambda x: 2.0 * x)
    assert pickle.loads(pickle.dumps(nameless))(1.5) == 3.0
