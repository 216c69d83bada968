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
from numba.extending import intrinsic

_FLAGS = ("nnan", "nsz")


def _float_intrinsic(name: str) -> Any:
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


largest = _float_intrinsic("llvm.maxnum")
smallest = _float_intrinsic("llvm.minnum")
