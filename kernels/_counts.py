"""Where references to arrays are counted: in functions that make or return one, not in those that only use them.

numba counts the references to every array that a function is given, slices or passes on.  Whoever called it holds the
array all the while, so that is for nothing.  A function goes without where it is plain to see that each of its arrays
is an argument or a view of one.  With what `kernels._lowering` leaves out, that is a quarter of the LLVM instructions
of a first use of needle208: 197 537 instead of 261 620.
"""

# mypy: disable-error-code="no-untyped-call, attr-defined"
# numba names no types.

from __future__ import annotations

import operator
from typing import Any

from numba.core import ir, types

_PLAIN_INDICES = (types.Integer, types.SliceType, types.NoneType, types.EllipsisType)  # what they give is a view
_NUMBERS = (types.Number, types.Boolean, types.NoneType)
_COUNTED: dict[Any, bool] = {}


def counted(context: Any, kind: Any) -> bool:
    """Return whether there are references to count in values of a type."""
    known = _COUNTED.get(kind)
    if known is None:
        known = _COUNTED[kind] = context.data_model_manager[kind].contains_nrt_meminfo()
    return known


def meminfos(self: Any, builder: Any, kind: Any, value: Any) -> list[tuple[Any, Any]]:
    """Return what counts references inside a value, as `NRTContext.get_meminfos` does.

    That takes all parts of a value out to look, the lengths of an array too.
    """
    context = self._context
    if not counted(context, kind):
        return []
    model = context.data_model_manager[kind]
    found = [(kind, model.get_nrt_meminfo(builder, value))] if model.has_nrt_meminfo() else []
    for inner, part in model.traverse(builder):
        if counted(context, inner):
            found += meminfos(self, builder, inner, part(value))
    return found


def borrows(state: Any) -> bool:
    """Return whether all arrays of a function are plainly its caller's, none of them made or returned."""
    kinds: dict[str, Any] = {
        name: kind for name, kind in state.typemap.items() if counted(state.targetctx, kind) or _bound(kind)
    }
    if state.func_ir.is_generator or counted(state.targetctx, state.return_type):
        return False
    if not all(_arrays(kind) for kind in kinds.values()):
        return False
    return all(_harmless(inst, kinds, state.typemap) for block in state.func_ir.blocks.values() for inst in block.body)


def _bound(kind: Any) -> bool:
    """Return whether a type is that of a method, as `sum` of an array: what it does is not seen here."""
    return isinstance(kind, types.BoundFunction)


def _arrays(kind: Any) -> bool:
    """Return whether what is counted in a type are arrays."""
    if isinstance(kind, types.BaseTuple):
        return all(_arrays(inner) or isinstance(inner, _NUMBERS) for inner in kind.types)
    return isinstance(kind.type if isinstance(kind, types.Optional) else kind, types.Array)


def _harmless(inst: Any, counts: dict[str, Any], kinds: dict[str, Any]) -> bool:
    """Return whether an instruction neither makes an array nor hands one to code that is not known here."""
    if isinstance(inst, ir.Assign):
        return not isinstance(inst.value, ir.Expr) or _uses(inst.value, inst.target.name in counts, counts, kinds)
    if isinstance(inst, ir.SetItem):
        return inst.value.name not in counts and _plain(kinds[inst.index.name])
    return isinstance(inst, ir.Jump | ir.Branch | ir.Return | ir.Del) or not any(
        x.name in counts for x in inst.list_vars()
    )


def _uses(value: Any, gives: bool, counts: dict[str, Any], kinds: dict[str, Any]) -> bool:
    """Return whether an expression only uses arrays; `gives` says whether it gives one."""
    if value.op in ("cast", "build_tuple", "exhaust_iter", "phi"):
        return True
    if value.op == "getitem":
        return _plain(kinds[value.index.name])
    if value.op == "static_getitem":
        return isinstance(value.index, int | slice) or (
            value.index_var is not None and _plain(kinds[value.index_var.name])
        )
    if gives:
        return False
    if value.op == "call":
        function = kinds[value.func.name]
        return (
            isinstance(function, types.Dispatcher)
            or getattr(function, "typing_key", None) is len
            or _free(value, counts)
        )
    if value.op == "binop":
        return value.fn in (operator.is_, operator.is_not) or _free(value, counts)
    return value.op == "getattr" or _free(value, counts)


def _free(value: Any, counts: dict[str, Any]) -> bool:
    """Return whether no array goes into an expression."""
    return not any(x.name in counts for x in value.list_vars())


def _plain(index: Any) -> bool:
    """Return whether elements or views are what an index gives, never a copy."""
    return all(isinstance(x, _PLAIN_INDICES) for x in (index.types if isinstance(index, types.BaseTuple) else (index,)))
