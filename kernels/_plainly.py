"""What numba does tens of thousands of times in a first use, less roundabout: functions that take the place of its own.

They give the same.  They stand there only while a kernel is compiled.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import errors, ir
from numba.core.runtime.context import NRTContext
from numba.core.targetconfig import TargetConfig

from kernels._counts import meminfos

# Neither these nor what they are made of are variables of numba's intermediate code.
_NO_VARIABLES = (ir.Loc, str, int, float, bool, type(None))


def _variables_in(self: Any, value: Any) -> list[Any]:
    """Return the variables in an instruction, or in what it is made of, as `ir.Inst._rec_list_vars` does."""
    if isinstance(value, ir.Var):
        return [value]
    if isinstance(value, ir.Inst):
        return value.list_vars()  # type: ignore[no-any-return, no-untyped-call]
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
    found: list[Any] = []
    for one in inside:
        if type(one) is ir.Var:
            found.append(one)
        elif type(one) not in _NO_VARIABLES:
            found += _variables_in(self, one)
    return found


def _values(self: Any) -> dict[str, Any]:
    """Return the options that a function is compiled with, as `TargetConfig.values` does."""
    return {name: self._values.get(name, option.default) for name, option in self.options.items()}


# What numba does tens of thousands of times, and what takes its place: the same, but less roundabout.  Complaints are
# caught, and colours would set up the terminal for each.
_REPLACED: tuple[tuple[Any, str, Any], ...] = (
    (ir.Inst, "_rec_list_vars", _variables_in),
    (TargetConfig, "values", _values),
    (NRTContext, "get_meminfos", meminfos),
    (type(errors.termcolor()), "_markup", lambda _self, text, *_style: text),
)


@contextmanager
def plainly() -> Iterator[None]:
    """Let numba list variables and options without asking each for its own way, and complain without colours."""
    before = [(kind, name, vars(kind)[name]) for kind, name, _ in _REPLACED if name in vars(kind)]
    for kind, name, ours in _REPLACED:
        if name in vars(kind):
            setattr(kind, name, ours)
    try:
        yield
    finally:
        for kind, name, theirs in before:
            setattr(kind, name, theirs)
