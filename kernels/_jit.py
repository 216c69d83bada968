"""The one place where compile options are decided.

Every kernel of the house is made by :func:`kernel`.  The options and why they are these:

* ``error_model="numpy"``: division by zero gives inf or nan instead of a branch to an exception; the Python
  model costs a factor of five in the sweep loops.
* ``nogil=True``: chunks run in threads.
* fast-math stays off.  The full set makes ``isnan`` answer false.  Only the fused sweep loops (:func:`kernel_fused`)
  may contract a product and a sum into one instruction: it gains about 8 % there and costs the promise of equal last
  bits on processors with and without that instruction, which all other kernels keep.  The reductions of
  :mod:`kernels.reduce` carry the two flags they need themselves.
* Machine code is kept on disk by :mod:`kernels._cache`.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, cast

from kernels._cache import kept
from kernels._compiler import Kernel, Part, Shared

F = TypeVar("F", bound=Callable[..., Any])


def _compiled(function: F, kind: type[Kernel], fastmath: bool | set[str] = False, **options: Any) -> F:
    # Flags must be said: a helper without them takes those of the kernel that happens to be compiled first, and keeps
    # them in every other kernel, so the last bits of a result would depend on what was computed before it.
    said = {"nopython": True, "boundscheck": None, "nogil": True, "error_model": "numpy", "fastmath": fastmath}
    # Nothing calls kernels from C.
    return cast(F, kept(kind(function, None, said | {"no_cfunc_wrapper": True} | options)))


def kernel(function: F) -> F:
    """Compile ``function`` to machine code at its first call; kept on disk."""
    return _compiled(function, Kernel)


def kernel_fused(function: F) -> F:
    """As :func:`kernel`, for the dense sweep loops: products and sums may be contracted."""
    return _compiled(function, Kernel, fastmath={"contract"})


def inline(function: F) -> F:
    """Compile a scalar helper for kernels; it is always folded into its caller, so that the loop there vectorises.

    Helpers are kept on disk too: a kernel that is compiled for another set of wanted outputs then finds them, which
    was measured to take a quarter of the time.
    """
    return _compiled(function, Part, forceinline=True, no_cpython_wrapper=True)


def inline_once(function: F) -> F:
    """As :func:`inline`, for a helper whose loops do not depend on numbers written in its calls: one code for all."""
    return _compiled(function, Shared, forceinline=True, no_cpython_wrapper=True)


def part(function: F) -> F:
    """Compile a larger function that kernels call, as :func:`inline_once`; whether it is folded in is up to LLVM."""
    return _compiled(function, Shared, no_cpython_wrapper=True)


def kernel_uncounted(function: F) -> F:
    """As :func:`kernel`, for functions that take arrays and neither make nor return one.

    numba counts the references to the arrays that a function is given wherever it cannot see that this is needless, as
    where a branch calls a helper.  In decisions taken one by one, of a few dozen instructions, that was half the time.
    """
    return _compiled(function, Kernel, _nrt=False)


def inline_uncounted(function: F) -> F:
    """As :func:`inline`, for helpers of :func:`kernel_uncounted`."""
    return _compiled(function, Part, forceinline=True, no_cpython_wrapper=True, _nrt=False)


def inline_fused(helper: F) -> F:
    """Return the same helper again, for :func:`kernel_fused` loops: products and sums may be contracted in it too.

    The flag belongs to the instructions of the function that was compiled, so a helper made by :func:`inline` keeps
    its products and sums apart wherever it is folded in.
    """
    source = getattr(helper, "py_func", helper)
    # The cache on disk tells functions by name and line: under one name the two would get each other's machine code.
    name = f"{source.__name__}_fused"
    copy = FunctionType(source.__code__, source.__globals__, name, source.__defaults__, source.__closure__)
    copy.__qualname__, copy.__module__ = name, source.__module__
    return cast(F, _compiled(copy, Part, forceinline=True, no_cpython_wrapper=True, fastmath={"contract"}))


def generated(name: str, function: F) -> F:
    """As :func:`kernel`, for a function that a generator made.

    ``name`` stands for everything that the function closes over, stages, numbers and other generated functions: its
    machine code is kept under that name, so no two may have the same.
    """
    return _compiled(_named(name, function), Kernel)


def generated_inline(name: str, function: F) -> F:
    """As :func:`inline`, for a function that a generator made; ``name`` as of :func:`generated`."""
    return _compiled(_named(name, function), Part, forceinline=True, no_cpython_wrapper=True)


def generated_part(name: str, function: F) -> F:
    """As :func:`part`, for a function that a generator made; ``name`` as of :func:`generated`."""
    return part(_named(name, function))


def _named(name: str, function: F) -> F:
    function.__name__ = function.__qualname__ = name
    return function
