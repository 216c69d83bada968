"""What takes the place of functions of numba while a kernel is compiled gives what they give."""

# mypy: disable-error-code="no-untyped-call, no-untyped-def"
# numba names no types.

from __future__ import annotations

import pytest
from numba.core import analysis, bytecode, event, interpreter
from numba.core.compiler import Flags

from kernels._jit import kernel
from kernels._plainly import REPLACED, plainly
from tests.test_compiler import _everything


def blocks():
    """Return numba's intermediate code of a function with loops, branches, tuples, arrays and calls."""
    identity = bytecode.FunctionIdentity.from_function(_everything)
    return interpreter.Interpreter(identity).interpret(bytecode.ByteCode(identity)).blocks


def test_variables_that_blocks_read_and_set_are_those_that_numba_finds() -> None:
    code = blocks()
    theirs = analysis.compute_use_defs(code)
    with plainly():
        assert analysis.compute_use_defs.__module__ == "kernels._plainly"
        ours = analysis.compute_use_defs(code)
    assert ours == theirs
    assert sum(map(len, ours.usemap.values())) > 20 and sum(map(len, ours.defmap.values())) > 20


def flags(**said: bool) -> Flags:
    made = Flags()
    for name, value in said.items():
        setattr(made, name, value)
    return made


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (flags(nrt=True), flags(nrt=True)),
        (flags(nrt=True), flags()),
        (flags(nrt=False), flags()),  # the default, said and unsaid
        (flags(nrt=True), flags(no_compile=True)),
        (flags(), 1),
    ],
)
def test_options_are_equal_where_numba_finds_them_equal(one: Flags, other: object) -> None:
    theirs, hashed = one == other, hash(one)
    with plainly():
        assert (one == other) is theirs and (one != other) is not theirs
        assert hash(one) == hashed
    assert (one == one.copy()) and hash(one.copy()) == hashed


def test_who_listens_is_told_of_events_and_others_are_not() -> None:
    with plainly(), event.install_recorder("numba:llvm_lock") as heard:
        with event.trigger_event("numba:llvm_lock"):
            pass
        with event.trigger_event("numba:run_pass"):
            pass
    assert [each.kind for _, each in heard.buffer] == ["numba:llvm_lock"] * 2


def test_what_is_replaced_is_numbas_own_again_after_compiling() -> None:
    before = [vars(kind).get(name) for kind, name, _ in REPLACED]
    assert kernel(lambda x: 7.0 * x)(1.0) == 7.0
    assert all(vars(kind).get(name) is own for (kind, name, _), own in zip(REPLACED, before, strict=True))
    assert not any(own is ours for (_, _, ours), own in zip(REPLACED, before, strict=True))
