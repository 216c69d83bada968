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
from typing import Any, TypeVar, cast

import numba

from kernels._cache import kept

F = TypeVar("F", bound=Callable[..., Any])


def _compiled(function: F, **options: Any) -> F:
    return cast(F, kept(numba.njit(nogil=True, error_model="numpy", **options)(function)))


def kernel(function: F) -> F:
    """Compile ``function`` to machine code at its first call; kept on disk."""
    return _compiled(function)


def kernel_fused(function: F) -> F:
    """As :func:`kernel`, for the dense sweep loops: products and sums may be contracted."""
    return _compiled(function, fastmath={"contract"})


def inline(function: F) -> F:
    """Compile a scalar helper for kernels; it is always folded into its caller, so that the loop there vectorises.

    Helpers are kept on disk too: a kernel that is compiled for another set of wanted outputs then finds them, which
    was measured to take a quarter of the time.
    """
    return _compiled(function, forceinline=True, no_cfunc_wrapper=True)
