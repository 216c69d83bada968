"""What will be read soon, fetched to the cache while something else is computed."""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from kernels.jit import inline

LINE = 8  # float64 in a line of the cache
_FOR_READING, _SECOND_LEVEL, _DATA = 0, 2, 1  # how the instruction is told


@intrinsic
def _fetch_line(typingctx: Any, memory: Any, place: Any) -> Any:
    """Fetch the line of the cache with number ``place`` of a C-contiguous array."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        pointer, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        address = builder.bitcast(builder.gep(array.data, [args[1]]), pointer)
        kind = ir.FunctionType(ir.VoidType(), [pointer, number, number, number])
        function = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
        builder.call(function, [address, *(ir.Constant(number, x) for x in (_FOR_READING, _SECOND_LEVEL, _DATA))])
        return context.get_dummy_value()

    return types.void(memory, types.int64), codegen


_fetch: Any = _fetch_line


def _asked(table: Any, place: Any) -> None:
    """Ask for a line of the cache; in plain Python there is nothing to ask for."""


@overload(_asked, inline="always")
def _asked_typed(table: Any, place: Any) -> Any:
    def fetched(table: Any, place: Any) -> None:
        _fetch(table, place)

    return fetched


@inline
def prefetch_rows(table: Any, begin: int, end: int) -> None:
    """Have rows begin, ..., end - 1 of a C-contiguous (n, P) table of float64 fetched to the second-level cache."""
    columns = table.shape[1]
    for line in range(0, (min(end, table.shape[0]) - begin) * columns, LINE):
        _asked(table, begin * columns + line)
