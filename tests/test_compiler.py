"""Kernels as they are compiled: what only kernels call has no machine code of its own, and is found again on disk."""

from __future__ import annotations

import gc
import math
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import errors

from kernels._compiler import PART, Helper, Kernel, Part, rebuilt_part
from kernels._jit import inline, kernel, part
from kernels.families import rssr
from kernels.families.rssr.derivatives import rocker_fused

ROOT = Path(__file__).parents[1]


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


def _everything(x, z, n, wanted):  # type: ignore[no-untyped-def]
    """What kernels are written with: loops, branches, tuples, arrays of several kinds, optional ones, numpy's loops."""
    count, total = 0, 0.0
    shape = (x.shape[0], 2 * n + 1)
    for i in range(shape[0]):
        y = abs(x[i] - 0.5) ** 2 if x[i] > 0.0 else math.sin(x[i])
        if wanted is not None:
            wanted[i, 0] = y
        while count < n and y < 1.0:
            y, count = 2.0 * y + min(x[i], 1.0), count + 1
        _, exponent = math.frexp(y)  # an integer of 32 bits
        exponent = exponent if y > 1.0 else 0
        total += math.ldexp(y, -exponent)
    room = np.zeros(n)
    room[:] = 2.0 * room + total
    row = x[1:] + room[: x.size - 1]
    return row, z * (1.0 + 2.0j) / z.real, math.copysign(total, -1.0), count, shape[1]


OPTIONS = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": None, "fastmath": False}
ARGUMENTS = [(np.linspace(-1.0, 1.0, 9), 1.0 + 1.0j, 12, wanted) for wanted in (None, np.empty((9, 1)))]


def texts_of(arguments: tuple[object, ...]) -> set[str]:
    """Return the LLVM code of `_everything` by our compiler and by numba's: one text if they are alike.

    It is the instructions with their types, each with numbers for its operands, in alphabetical order: blocks may come
    in another one.
    """
    ours, theirs = Kernel(_everything, None, OPTIONS | {"no_cfunc_wrapper": True}), numba.jit(**OPTIONS)(_everything)
    found, expected = ours(*arguments), theirs(*arguments)
    assert np.array_equal(found[0], expected[0]) and found[1:] == expected[1:]
    (own,), (other,) = ours.overloads.values(), theirs.overloads.values()
    return {_body(compiled.library.get_llvm_str(), compiled.fndesc.mangled_name) for compiled in (own, other)}


@pytest.mark.parametrize("number", range(len(ARGUMENTS)), ids=["none", "array"])
def test_the_llvm_code_is_that_of_numbas_own_way(number: int) -> None:
    """In a process of its own: numba takes functions of its own over from what was compiled in a process before."""
    code = f"""if True:
        from tests.test_compiler import ARGUMENTS, texts_of
        found = texts_of(ARGUMENTS[{number}])
        print(len(found), all("fmul" in text for text in found))
    """
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["1", "True"], done.stderr


def _body(text: str, name: str) -> str:
    """The LLVM instructions of a function, sorted, without the names of what they work on."""
    # Ours is optimised without numba's wrapper, so LLVM does not see that nobody compares addresses of it.
    text = text.replace(" local_unnamed_addr", "")
    (body,) = re.findall(rf"^define [^\n]*@{re.escape(name)}\(.*?^}}", text, re.M | re.S)
    body = "\n".join(body.splitlines()[1:])  # what the first line says of the result is LLVM's guess of its range
    lines = re.findall(r"^  (.*)", re.sub(r"[@%!#][\w.$<>\"-]+", "@", body), re.M)
    ways = [re.sub(r"\[.*\]", lambda found: str(sorted(found[0].split("], ["))), line) for line in lines]
    # Where an error ends the function, and what it says, depends on where the blocks of several errors are joined.
    return "\n".join(sorted(line for line in ways if not re.match(r"br|@ = phi (i32|ptr) |store ptr @, ptr @", line)))


def test_a_function_of_numbas_own_has_no_machine_code_for_itself() -> None:
    """It is optimised as numba does it; the test above holds the code of its caller against numba's."""
    whole = kernel(lambda n: np.zeros(n).sum() + min((n, 3)))
    made = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Helper, "add_overload", lambda self, known: made.append(known) or Part.add_overload(self, known))
        assert whole(4) == 3.0
    assert made and {known.library.serialize_using_object_code()[1] for known in made} == {PART}


@inline
def _from(begin: int, x: float) -> float:
    return x + begin


@kernel
def _after(begin: int, x: float) -> float:
    return x - begin


@kernel
def _counted(x: np.ndarray) -> float:  # type: ignore[type-arg]
    count, total = 0, 0.0
    while count < x.size:
        total += _from(count, x[count]) * _after(0, x[count]) * _after(count, 1.0)
        count += 1
    return total


def test_a_counter_that_begins_at_a_constant_compiles_what_it_calls_once() -> None:
    """A number that is written at the place of a call has code of its own: loops may depend on it."""
    assert _counted(np.array([2.0, 3.0])) == 4.0
    assert [str(args) for args in _from.overloads] == ["(int64, float64)"]
    assert [str(args) for args in _after.overloads] == ["(Literal[int](0), float64)", "(int64, float64)"]


def test_loops_of_a_part_are_those_of_the_number_at_the_place_of_its_call() -> None:
    part = inline(lambda n, x: x * n)
    whole = kernel(lambda x: part(3, x))
    assert whole(2.0) == 6.0
    assert [str(args) for args in part.overloads] == ["(Literal[int](3), float64)"]


def test_one_code_of_a_shared_part_serves_whatever_numbers_stand_in_its_calls() -> None:
    shared = part(lambda n, x: x * n)
    whole = kernel(lambda x: shared(3, x) + shared(4, x))
    assert whole(2.0) == 14.0
    assert [str(args) for args in shared.overloads] == ["(int64, float64)"]


FROZEN = """
import gc, sys
from kernels._garbage import program_of_our_own
from kernels._jit import kernel
if sys.argv[1] == "ours":
    program_of_our_own()
kernel(lambda x: 5.0 * x)(1.0)
print(gc.get_freeze_count() > 0, gc.isenabled())
"""


@pytest.mark.parametrize(("whose", "frozen"), [("ours", "True"), ("theirs", "False")])
def test_what_compiling_left_stays_for_good_in_a_program_of_our_own_only(whose: str, frozen: str) -> None:
    done = subprocess.run([sys.executable, "-c", FROZEN, whose], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == [frozen, "True"]


@pytest.mark.parametrize("works", [True, False])
def test_garbage_is_collected_and_complaints_are_coloured_again_after_compiling(works: bool) -> None:
    markup = vars(type(errors.termcolor())).get("_markup")
    function = kernel(lambda x: x + (1.0 if works else "one"))
    assert gc.isenabled()
    if works:
        assert function(1.0) == 2.0
    else:
        with pytest.raises(errors.TypingError, match=r"\+"):
            function(1.0)
    assert gc.isenabled() and vars(type(errors.termcolor())).get("_markup") is markup


def test_a_program_that_does_without_the_collector_is_left_without_it() -> None:
    gc.disable()
    try:
        assert kernel(lambda x: 3.0 * x)(1.0) == 3.0
        assert not gc.isenabled()
    finally:
        gc.enable()
