"""Bits of numbers: the lowest bit of an integer, in one instruction, and the binade of a float, without a call."""

from __future__ import annotations

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload


@intrinsic
def _lowest_bit(typingctx: Any, bits: Any) -> Any:
    """Return the number of the lowest bit that is set in an int64; 64 where none is."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # The second argument says that zero is a value like others: then the result is defined for it too.
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 0))

    return types.int64(types.int64), codegen


_cttz: Any = _lowest_bit


def lowest_bit(bits: Any) -> Any:
    """Find the lowest bit that is set in an int64; 64 where none is."""
    return (bits & -bits).bit_length() - 1 if bits else 64


@overload(lowest_bit, inline="always")
def _lowest_bit_typed(bits: Any) -> Any:
    def lowest(bits: Any) -> Any:
        return _cttz(bits)

    return lowest


_EXPONENT = 0x7FF0000000000000  # the bits of a float64 that hold its exponent


def power_below(x: Any) -> Any:
    """Return the largest power of two that is not above abs(x), for a float of 2^-1022 at least.

    Below that it is 0, of what is not finite infinity.  In kernels it is vector code, which `math.frexp` is not.
    """
    if not math.isfinite(x):
        return math.inf
    return 0.0 if abs(x) < 2.0**-1022 else math.ldexp(0.5, math.frexp(x)[1])


@intrinsic
def _exponent_of(typingctx: Any, x: Any) -> Any:
    """Return the float64 that has the exponent of x and nothing else."""

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
