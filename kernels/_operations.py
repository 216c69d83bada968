"""Elements of arrays, loops over ranges and complex arithmetic as LLVM code: numba's, in fewer instructions.

numba writes a whole array, range, loop or complex number to memory to read a part of it.  LLVM takes that out again,
but it is most of what it has to read.  Here parts are taken from the value itself; and where a value was put together
within the function, its part needs no instruction (:func:`part_of`).  With the variables that need no room in memory
(`kernels._lowering`) and the calls of `kernels._calls` a first use of needle208 has 95 311 LLVM instructions instead of
194 881; what LLVM makes of them is the same (``tests/test_compiler.py``).
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, TypeAlias

from llvmlite.ir import Constant, InsertValue, IRBuilder, Undefined
from numba.core import cgutils, types

Code: TypeAlias = Callable[..., Any]  # (builder, arguments) -> value

_NUMBERS = (types.Number, types.Boolean)
_DATA, _SHAPE, _STRIDES = 4, 5, 6  # members of an array
_extracted = IRBuilder.extract_value


def part_of(builder: Any, value: Any, index: Any, name: str = "") -> Any:
    """Return a part of a value, as `IRBuilder.extract_value` does; without an instruction where it was put in here."""
    path = list(index) if isinstance(index, (tuple, list)) else [index]
    while isinstance(value, InsertValue):
        put = list(value.indices)
        if put == path[: len(put)]:
            value, path = value.value, path[len(put) :]
            if not path:
                return value
        elif path == put[: len(path)]:
            break
        else:
            value = value.aggregate
    return _extracted(builder, value, path, name)


def _tuple_of(builder: Any, kind: Any, parts: list[Any]) -> Any:
    value = Constant(kind, Undefined)
    for k, part in enumerate(parts):
        value = builder.insert_value(value, part, k)
    return value


def _place(context: Any, kind: Any, index: Any) -> Callable[[Any, Any, Any], Any] | None:
    """Return what writes the address of an element; None where an index is not one whole number per dimension."""
    kinds = index.types if isinstance(index, types.BaseTuple) else (index,)  # type: ignore[attr-defined]
    if context.enable_boundscheck or not isinstance(kind, types.Array) or not isinstance(kind.dtype, _NUMBERS):
        return None
    if len(kinds) != kind.ndim or not all(isinstance(x, types.Integer) for x in kinds):
        return None

    def place(builder: Any, array: Any, where: Any) -> Any:
        given = [part_of(builder, where, k) for k in range(kind.ndim)] if kinds[0] is not index else [where]
        lengths = [part_of(builder, array, (_SHAPE, k)) for k in range(kind.ndim)]
        indices = [_from_the_front(context, builder, *each) for each in zip(kinds, given, lengths, strict=True)]
        if kind.layout == "C":
            offset = indices[-1]
            step = lengths[-1]
            for k in range(kind.ndim - 2, -1, -1):
                offset = builder.add(builder.mul(indices[k], step), offset)
                step = builder.mul(step, lengths[k]) if k else step
            return builder.gep(part_of(builder, array, _DATA), [offset])
        steps = [part_of(builder, array, (_STRIDES, k)) for k in range(kind.ndim)]
        data = part_of(builder, array, _DATA)
        return cgutils.get_item_pointer2(context, builder, data, lengths, steps, kind.layout, indices)

    return place


def _from_the_front(context: Any, builder: Any, kind: Any, index: Any, length: Any) -> Any:
    """Return an index that counts from the front; a negative one counts from the end."""
    if not kind.signed:
        return context.cast(builder, index, kind, types.uintp)
    index = context.cast(builder, index, kind, types.intp)
    if isinstance(index, Constant) and isinstance(index.constant, int):
        return index if index.constant >= 0 else builder.add(index, length)
    behind = builder.icmp_signed("<", index, index.type(0))
    return builder.select(behind, builder.add(index, length), index)


def _getitem(context: Any, sig: Any) -> Code | None:
    kind = sig.args[0]
    place = _place(context, *sig.args)

    def code(builder: Any, args: Any, loc: Any = None) -> Any:
        at = place(builder, *args)  # type: ignore[misc]
        return context.unpack_value(builder, kind.dtype, at, align=None if kind.aligned else 1)

    return place and code


def _setitem(context: Any, sig: Any) -> Code | None:
    kind, index, given = sig.args
    place = _place(context, kind, index) if isinstance(given, _NUMBERS) else None

    def code(builder: Any, args: Any, loc: Any = None) -> None:
        at = place(builder, *args[:2])  # type: ignore[misc]
        value = context.cast(builder, args[2], given, kind.dtype)
        context.pack_value(builder, kind.dtype, value, at, align=None if kind.aligned else 1)

    return place and code


def _range(context: Any, sig: Any) -> Code:
    """Return what writes a range, the value (start, stop, step)."""

    def code(builder: Any, args: Any, loc: Any = None) -> Any:
        kind = context.get_value_type(sig.return_type)
        number = kind.elements[0]
        start, stop = (number(0), *args) if len(args) == 1 else args[:2]
        return _tuple_of(builder, kind, [start, stop, args[2] if len(args) == 3 else number(1)])

    return code


def _getiter(context: Any, sig: Any) -> Code | None:
    """Return what writes a loop over a range: (room of the number, stop, step, room of how many are left)."""
    if not isinstance(sig.args[0], types.RangeType):
        return None
    general = context.numbas_own("getiter", sig)

    def code(builder: Any, args: Any, loc: Any = None) -> Any:
        start, stop, step = (part_of(builder, args[0], k) for k in range(3))
        if not (isinstance(step, Constant) and step.constant == 1):
            return general(builder, args)  # numba's counts in steps of any size
        number, left = (cgutils.alloca_once(builder, start.type) for _ in range(2))
        count = builder.sub(stop, start)
        builder.store(start, number)
        builder.store(builder.select(builder.icmp_signed(">", count, count.type(0)), count, count.type(0)), left)
        return _tuple_of(builder, context.get_value_type(sig.return_type), [number, stop, step, left])

    return code


def _iternext(context: Any, sig: Any) -> Code | None:
    """Return what writes the next number of a loop over a range, and whether there is one."""
    if not isinstance(sig.args[0], types.RangeIteratorType):
        return None

    def code(builder: Any, args: Any, loc: Any = None) -> Any:
        number, step, left = (part_of(builder, args[0], k) for k in (0, 2, 3))
        count = builder.load(left)
        value = builder.load(number)
        goes_on = builder.icmp_signed(">", count, count.type(0))
        with builder.if_then(goes_on):
            builder.store(builder.sub(count, count.type(1), flags=["nsw"]), left)
            builder.store(builder.add(value, step), number)
        return _tuple_of(builder, context.get_value_type(sig.return_type), [value, goes_on])

    return code


def _complex(context: Any, sig: Any, combine: Callable[..., tuple[Any, Any]]) -> Code | None:
    # With flags for contraction numba's code is that of a function with flags of its own.
    if context.fastmath or not all(isinstance(kind, types.Complex) for kind in sig.args):
        return None

    def code(builder: Any, args: Any, loc: Any = None) -> Any:
        parts = [part_of(builder, x, k) for x in args for k in (0, 1)]
        return _tuple_of(builder, args[0].type, list(combine(builder, *parts)))

    return code


def _sum(context: Any, sig: Any) -> Code | None:
    return _complex(context, sig, lambda by, a, b, c, d: (by.fadd(a, c), by.fadd(b, d)))


def _difference(context: Any, sig: Any) -> Code | None:
    return _complex(context, sig, lambda by, a, b, c, d: (by.fsub(a, c), by.fsub(b, d)))


def _product(context: Any, sig: Any) -> Code | None:
    def combine(by: Any, a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Any]:
        ac, bd, ad, bc = by.fmul(a, c), by.fmul(b, d), by.fmul(a, d), by.fmul(b, c)
        return by.fsub(ac, bd), by.fadd(ad, bc)

    return _complex(context, sig, combine)


OPERATIONS: dict[Any, Callable[[Any, Any], Code | None]] = {
    operator.getitem: _getitem,
    operator.setitem: _setitem,
    operator.add: _sum,
    operator.sub: _difference,
    operator.mul: _product,
    range: _range,
    "getiter": _getiter,
    "iternext": _iternext,
}
