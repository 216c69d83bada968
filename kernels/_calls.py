"""How kernels call one another: as numba's code does, without instructions for what no kernel has.

After each call numba works out five ways in which it may have ended and writes a branch for ``try``, before each it
clears the room for the result.  A kernel ends well or with an error, and catches nothing.
"""

# mypy: disable-error-code="no-untyped-call, attr-defined, misc"
# numba names no types.

from __future__ import annotations

from typing import Any

from llvmlite.ir import Constant
from numba.core import cgutils, ir, types
from numba.core.callconv import RETCODE_EXC, RETCODE_NONE, RETCODE_OK, RETCODE_STOPIT, RETCODE_USEREXC, CPUCallConv


class _Ending:
    """How a call ended; what is asked about it is worked out where it is asked."""

    def __init__(self, builder: Any, code: Any, excinfo: Any, optional: bool) -> None:
        self._builder = builder
        self._excinfo = excinfo
        self.code = code
        if optional:
            self.is_ok = builder.or_(self._is("==", RETCODE_OK), self._is("==", RETCODE_NONE))
            self.is_error = builder.not_(self.is_ok)
        else:
            self.is_error = self._is("!=", RETCODE_OK)

    def _is(self, relation: str, code: Constant) -> Any:
        return self._builder.icmp_signed(relation, self.code, code)

    def __getattr__(self, name: str) -> Any:
        if name == "excinfoptr":
            return self._builder.load(self._excinfo)
        if name == "is_ok":
            return self._is("==", RETCODE_OK)
        if name == "is_user_exc":
            return self._is(">=", RETCODE_USEREXC)
        codes = {"is_none": RETCODE_NONE, "is_python_exc": RETCODE_EXC, "is_stop_iteration": RETCODE_STOPIT}
        if name not in codes:
            raise AttributeError(name)
        return self._is("==", codes[name])


class Calls(CPUCallConv):
    """Calls of functions that catch nothing."""

    def call_function(
        self, builder: Any, callee: Any, resty: Any, argtys: Any, args: Any, attrs: Any = ()
    ) -> tuple[Any, Any]:
        """Write a call; returns how it ended and its result."""
        room = cgutils.alloca_once(builder, self.get_return_type(resty).pointee)
        optional = isinstance(resty, types.Optional)
        if optional:
            builder.store(Constant(room.type.pointee, None), room)
        excinfo = cgutils.alloca_once(builder, self._get_excinfo_argument(callee).type.pointee, name="excinfo")
        packed = self._get_arg_packer(argtys).as_arguments(builder, args)
        code = builder.call(callee, [room, excinfo, *packed], attrs=attrs)
        ending = _Ending(builder, code, excinfo, optional)
        return ending, self.context.get_returned_value(builder, resty, builder.load(room))

    def return_status_propagate(self, builder: Any, status: Any) -> None:
        """Write that an error of a call goes on to the caller."""
        builder.store(status.excinfoptr, self._get_excinfo_argument(builder.function))
        self._return_errcode_raw(builder, status.code)


def catches(func_ir: Any) -> bool:
    """Return whether a function catches errors, as some of numba's own do."""
    return any(
        isinstance(inst.value, ir.Global) and getattr(inst.value.value, "__module__", "") == "numba.core.unsafe.eh"
        for block in func_ir.blocks.values()
        for inst in block.find_insts(ir.Assign)
    )
