"""Single machine instructions that Python does not have, by numba's intrinsics.

Maximum and minimum that LLVM can vectorise, the lowest set bit of an integer, the binade of a float without a call, and
the prefetch of data into the cache.

``if v > m: m = v`` stays a scalar loop, even under fast-math, because LLVM must keep the order of comparisons with nan.
``llvm.maxnum`` with the flags nnan and nsz on this one instruction is a plain ``vmaxpd``.  The flags promise that no
operand is nan: the sweep loops clamp the arguments of square roots, so none is, and they report the clamp by a status.
"""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from kernels.jit import inline

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


@intrinsic
def _lowest_bit(typingctx: Any, bits: Any) -> Any:
    """Return the number of the lowest set bit of an int64; 64 where none is set."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # With the second argument false the result is defined for zero too.
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 0))

    return types.int64(types.int64), codegen


_cttz: Any = _lowest_bit


def lowest_bit(bits: Any) -> Any:
    """Find the lowest set bit of an int64; 64 where none is set."""
    return (bits & -bits).bit_length() - 1 if bits else 64


@overload(lowest_bit, inline="always")
def _lowest_bit_typed(bits: Any) -> Any:
    def lowest(bits: Any) -> Any:
        return _cttz(bits)

    return lowest


_EXPONENT = 0x7FF0000000000000  # the bits of a float64 that hold its exponent


def power_below(x: Any) -> Any:
    """Largest power of two not above abs(x); 0 for subnormal numbers, infinity where x is not finite.

    In kernels it is vector code, which `math.frexp` is not.
    """
    if not math.isfinite(x):
        return math.inf
    return 0.0 if abs(x) < 2.0**-1022 else math.ldexp(0.5, math.frexp(x)[1])


@intrinsic
def _exponent_of(typingctx: Any, x: Any) -> Any:
    """Return the float64 with the exponent bits of x; sign and mantissa bits are 0."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(64))
        return builder.bitcast(builder.and_(bits, ir.Constant(ir.IntType(64), _EXPONENT)), ir.DoubleType())

    return types.float64(types.float64), codegen


_exponent_alone: Any = _exponent_of


@overload(power_below)
def _power_below_typed(x: Any) -> Any:
    def power(x: Any) -> Any:
        return _exponent_alone(x)

    return power


LINE = 8  # float64 numbers in a cache line
_FOR_READING, _SECOND_LEVEL, _DATA = 0, 2, 1  # operands of llvm.prefetch


@intrinsic
def _fetch_line(typingctx: Any, memory: Any, place: Any) -> Any:
    """Prefetch the cache line that holds element number ``place`` of a C-contiguous array."""

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
    """Prefetch the cache line of an element; does nothing in plain Python."""


@overload(_asked, inline="always")
def _asked_typed(table: Any, place: Any) -> Any:
    def fetched(table: Any, place: Any) -> None:
        _fetch(table, place)

    return fetched


@inline
def prefetch_rows(table: Any, begin: int, end: int) -> None:
    """Prefetch rows begin, ..., end - 1 of a C-contiguous (n, P) table of float64 into the second-level cache."""
    columns = table.shape[1]
    for line in range(0, (min(end, table.shape[0]) - begin) * columns, LINE):
        _asked(table, begin * columns + line)
