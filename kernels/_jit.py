"""The one place where compile options are decided, and where the compiled code is kept.

Every kernel of the house is made by :func:`kernel`.  The options and why they are these:

* ``error_model="numpy"``: division by zero gives inf or nan instead of a branch to an exception; the Python
  model costs a factor of five in the sweep loops.
* ``nogil=True``: chunks run in threads.
* fast-math stays off.  The full set makes ``isnan`` answer false.  Only the fused sweep loops (:func:`kernel_fused`)
  may contract a product and a sum into one instruction: it gains about 8 % there and costs the promise of equal last
  bits on processors with and without that instruction, which all other kernels keep.  The reductions of
  :mod:`kernels.reduce` carry the two flags they need themselves.
* ``cache=True`` in a folder whose name is a hash of all kernel sources.  numba compares only the file of the function
  it loads, not the files of the helpers inlined into it, so a shared folder would serve stale machine code after an
  edit of a helper.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.core import config

F = TypeVar("F", bound=Callable[..., Any])

SOURCES = Path(__file__).resolve().parent


def source_hash() -> str:
    """Hash of every kernel source file and the numba version: the identity of the compiled code."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(SOURCES.rglob("*.py")):
        digest.update(path.relative_to(SOURCES).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Folder that holds the compiled kernels of every version (what ``sweep cache clear`` removes)."""
    return Path(platformdirs.user_cache_dir("linksweep")) / "kernels"


CACHE_DIR = cache_root() / source_hash()


def _compiled(function: F, **options: Any) -> F:
    # numba reads the folder when the cache object is made, so the setting is lent for this one call
    # and other users of numba in the same process keep theirs.
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = str(CACHE_DIR)  # type: ignore[attr-defined]
    try:
        return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function))
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]


def kernel(function: F) -> F:
    """Compile ``function`` to machine code at its first call; kept on disk."""
    return _compiled(function)


def kernel_fused(function: F) -> F:
    """As :func:`kernel`, for the dense sweep loops: products and sums may be contracted."""
    return _compiled(function, fastmath={"contract"})


def inline(function: F) -> F:
    """Compile a scalar helper for kernels; it is always folded into its caller, so that the loop there vectorises."""
    return cast(F, numba.njit(nogil=True, error_model="numpy", forceinline=True)(function))
