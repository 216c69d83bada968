"""What pytest settles before the tests: where hypothesis draws from, and what is kept of helpers that tests call."""

from __future__ import annotations

from functools import cached_property
from types import FunctionType
from typing import Any

from hypothesis import settings

from kernels import jit

# `make test` sees the same examples on every machine; `make test-long` searches on at random, and what it finds
# becomes an @example of the test.
settings.register_profile("fixed", derandomize=True, database=None)
settings.register_profile("random", print_blob=True)
settings.load_profile("fixed")


def _for_python(helper: jit.Helper) -> Any:
    """Compile a helper for Python as the house does, and keep it on disk beside the kernels.

    The house leaves that out, as nobody but tests calls helpers from Python: they compiled hundreds of them anew.
    """
    source = helper.py_func
    name = f"{source.__name__}_for_python"  # the cache tells functions by name and line
    copy = FunctionType(source.__code__, source.__globals__, name, source.__defaults__, source.__closure__)
    copy.__qualname__, copy.__module__ = name, source.__module__
    return jit._compiled(copy, **helper.targetoptions)


jit.Helper._for_python = cached_property(_for_python)
jit.Helper._for_python.__set_name__(jit.Helper, "_for_python")
