"""Maximum and minimum that LLVM can vectorise.

``if v > m: m = v`` stays a scalar loop, even under fast-math, because LLVM must keep the order of comparisons with nan.
``llvm.maxnum`` with the flags nnan and nsz on this one instruction is a plain ``vmaxpd``.  The flags promise that no
operand is nan: the sweep loops clamp what goes under the square root, so none is, and they report the clamp through a
status.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

_FLAGS = ("nnan", "nsz")


def largest(a: Any, b: Any) -> Any:
    """Larger of two numbers, neither of them nan."""
    return max(a, b)


def smallest(a: Any, b: Any) -> Any:
    """Smaller of two numbers, neither of them nan."""
    return min(a, b)


def _instruction(name: str) -> Any:
    @intrinsic
    def function(typingctx: Any, a: Any, b: Any) -> Any:
        single = a == types.float32 and b == types.float32

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            number = ir.FloatType() if single else ir.DoubleType()
            llvm_function = builder.module.declare_intrinsic(name, [number], ir.FunctionType(number, [number, number]))
            return builder.call(llvm_function, args, fastmath=_FLAGS)

        kind = types.float32 if single else types.float64
        return kind(kind, kind), codegen

    return function


_maxnum: Any = _instruction("llvm.maxnum")
_minnum: Any = _instruction("llvm.minnum")


@overload(largest, inline="always")
def _largest_typed(a: Any, b: Any) -> Any:
    def larger(a: Any, b: Any) -> Any:
        return _maxnum(a, b)

    return larger


@overload(smallest, inline="always")
def _smallest_typed(a: Any, b: Any) -> Any:
    def smaller(a: Any, b: Any) -> Any:
        return _minnum(a, b)

    return smaller
