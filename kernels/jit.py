"""The one place where compile options are decided.

Every kernel of the house is made by one of the decorators below, which are ``numba.njit`` with these options:

* ``error_model="numpy"``: division by zero gives inf or nan instead of a branch to an exception; the Python
  model costs a factor of five in the sweep loops.
* ``nogil=True``: chunks run in threads.
* fast-math stays off.  The full set makes ``isnan`` answer false.  Only the fused sweep loops (:func:`kernel_fused`)
  may contract a product and a sum into one instruction: it gains about 8 % there and costs the promise of equal last
  bits on processors with and without that instruction, which all other kernels keep.  The reductions of
  :mod:`kernels.arithmetic.intrinsics` carry the two flags they need themselves.
* ``no_cfunc_wrapper``: nothing calls kernels from C.  ``no_cpython_wrapper`` of helpers: see :class:`Helper`.
* Machine code is kept on disk by :mod:`kernels.cache`.

``NUMBA_DISABLE_JIT=1`` leaves every function in plain Python.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import cached_property, update_wrapper
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
from numba.core.event import Listener, register
from numba.extending import typeof_impl

from kernels.cache_folder import CACHE_DIR, may_keep, say, writable

F = TypeVar("F", bound=Callable[..., Any])
config: Any = numba.config

# Flags must be said: a helper without them takes those of the kernel that happens to be compiled first, and keeps
# them in every other kernel, so the last bits of a result would depend on what was computed before it.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True}


def _kept(dispatcher: Any) -> Any:
    """Let a compiled function load its machine code from disk and save it there, where that is safe and possible.

    A function from outside the package, as in a bench or a study, is in no hash: every process compiles it.
    """
    if config.DISABLE_JIT:
        return dispatcher  # which is the Python function itself
    if not may_keep(dispatcher.py_func.__code__.co_filename) or not writable(CACHE_DIR):
        return dispatcher
    try:
        from kernels.cache import keep  # imported here, as the import may fail

        keep(dispatcher)
    except (ImportError, AttributeError, TypeError, RuntimeError) as error:  # errors of changed classes of numba
        config.CACHE_DIR = str(CACHE_DIR)
        dispatcher.enable_caching()
        say(f"numba {numba.__version__} keeps its machine code in another way ({error}); its own cache is used")
    return dispatcher


def _compiled(function: F, **options: Any) -> F:
    return cast(F, _kept(numba.njit(**(OPTIONS | options))(function)))


class Helper:
    """Function that kernels call: compiled without a wrapper for Python, which takes a third less time.

    Python may call it all the same, as tests do; for that it is compiled once more at the first call.  A kernel that is
    loaded from disk needs none of its helpers, so their dispatchers, hundreds of them, are made on demand only: all
    together would take a tenth of a second.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self.targetoptions = OPTIONS | options

    @cached_property
    def for_kernels(self) -> Any:
        """Dispatcher of the helper for kernels."""
        return _compiled(self.py_func, no_cpython_wrapper=True, **self.targetoptions)

    @cached_property
    def _for_python(self) -> Callable[..., Any]:
        return cast(Callable[..., Any], numba.njit(**self.targetoptions)(self.py_func))

    def __call__(self, *args: Any) -> Any:
        """Run the helper for a caller in Python."""
        return self._for_python(*args)


@typeof_impl.register(Helper)
def _type_of_helper(helper: Helper, context: Any) -> Any:
    """Type of a helper that a kernel names: that of its dispatcher for kernels."""
    return typeof_impl(helper.for_kernels, context)


def _helper(function: F, **options: Any) -> F:
    return function if config.DISABLE_JIT else cast(F, Helper(function, **options))


def kernel(function: F) -> F:
    """Compile a function to machine code at its first call."""
    return _compiled(function)


def kernel_fused(function: F) -> F:
    """Compile a dense sweep loop, in which products and sums may be contracted."""
    return _compiled(function, fastmath={"contract"})


def inline(function: F) -> F:
    """Compile a scalar helper for kernels; it is always folded into its caller, so that the loop there vectorises.

    Helpers are kept on disk too: a kernel that is compiled for another set of wanted outputs then finds them, which
    was measured to take a quarter of the time.
    """
    return _helper(function, forceinline=True)


def part(function: F) -> F:
    """Compile a larger function that kernels call; whether it is folded in is up to LLVM."""
    return _helper(function)


def folded(function: F) -> F:
    """Fold a function with one caller into it before it is compiled, so that it costs no machine code of its own.

    A caller is optimised together with all that it calls, so optimising the function by itself would be wasted.
    """
    return _helper(function, inline="always")


def inline_fused(helper: F) -> F:
    """Compile the same helper again, for :func:`kernel_fused` loops: products and sums may be contracted in it too.

    The flag belongs to the instructions of the function that was compiled, so a helper made by :func:`inline` keeps
    its products and sums apart wherever it is folded in.
    """
    source = source_of(helper)
    # The cache on disk tells functions by name and line: under one name the two would get each other's machine code.
    name = f"{source.__name__}_fused"
    copy = FunctionType(source.__code__, source.__globals__, name, source.__defaults__, source.__closure__)
    copy.__qualname__, copy.__module__ = name, source.__module__
    return _helper(cast(F, copy), forceinline=True, fastmath={"contract"})


def generated(name: str, function: F) -> F:
    """Compile a function that a generator made, as :func:`kernel`.

    ``name`` stands for everything that the function closes over, stages, numbers and other generated functions: its
    machine code is kept under that name, so no two may have the same.
    """
    return kernel(_named(name, function))


def generated_inline(name: str, function: F) -> F:
    """Compile a function that a generator made, as :func:`inline`; ``name`` as of :func:`generated`."""
    return inline(_named(name, function))


def generated_part(name: str, function: F) -> F:
    """Compile a function that a generator made, as :func:`part`; ``name`` as of :func:`generated`."""
    return part(_named(name, function))


def source_of(function: Any) -> Any:
    """Python function behind a compiled one."""
    return getattr(function, "py_func", function)


def _named(name: str, function: F) -> F:
    function.__name__ = function.__qualname__ = name
    return function


class _PausedCollector(Listener):
    """Pause of Python's garbage collector while numba compiles.

    A compiler makes a million objects that refer to each other, and nearly all live until the process ends: collecting
    after each kernel took a tenth of the time of a first use.
    """

    def __init__(self) -> None:
        self._was_on: list[bool] = []

    def on_start(self, event: Any) -> None:
        """Pause at the beginning of a compilation, which may be inside another one."""
        self._was_on.append(gc.isenabled())
        gc.disable()

    def on_end(self, event: Any) -> None:
        """Restore the collector to its state before the compilation."""
        if self._was_on.pop():
            gc.enable()


register("numba:compile", _PausedCollector())  # type: ignore[no-untyped-call]
