"""Sets of small numbers as the bits of an integer: the lowest of them in one instruction."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def _lowest_bit(typingctx: Any, bits: Any) -> Any:
    """Return the number of the lowest bit that is set in an int64; 64 where none is."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # The second argument says that zero is a value like others: then the result is defined for it too.
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 0))

    return types.int64(types.int64), codegen


lowest_bit: Any = _lowest_bit
