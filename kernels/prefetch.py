"""What will be read soon, fetched to the cache while something else is computed."""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from kernels._jit import inline

LINE = 8  # float64 in a line of the cache
_FOR_READING, _SECOND_LEVEL, _DATA = 0, 2, 1  # how the instruction is told


@intrinsic
def _fetch_line(typingctx: Any, memory: Any, place: Any) -> Any:
    """Fetch the line of the cache with number ``place`` of a C-contiguous array."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        offset = builder.mul(args[1], ir.Constant(args[1].type, 8))
        address = cgutils.pointer_add(builder, array.data, offset, cgutils.voidptr_t)
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, number, number, number])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(function, [address, *(ir.Constant(number, x) for x in (_FOR_READING, _SECOND_LEVEL, _DATA))])
        return context.get_dummy_value()

    return types.void(memory, types.int64), codegen


_fetch: Any = _fetch_line


@inline
def prefetch_rows(table: Any, begin: int, end: int) -> None:
    """Have rows begin, ..., end - 1 of a C-contiguous (n, P) table of float64 fetched to the second-level cache."""
    columns = table.shape[1]
    for line in range(0, (min(end, table.shape[0]) - begin) * columns, LINE):
        _fetch(table, begin * columns + line)
