"""How the kernels' LLVM code is written from numba's intermediate code: the same, without instructions for nothing.

Against numba's own way

* a number has no references to count, so none of its variables is read to count down before it is set or ends;
* a variable that is set once, before all places where it is read, has no room in memory;
* an operator's code is looked up by the types of its operands alone.

LLVM takes the needless instructions out again, but each is made, printed, read and looked at before.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import operator
from collections import Counter
from functools import partial
from typing import Any

from numba.core import analysis, errors, ir, lowering
from numba.core.compiler_machinery import register_pass
from numba.core.errors import new_error_context  # type: ignore[attr-defined]
from numba.core.typed_passes import NativeLowering

from kernels._calls import catches
from kernels._counts import borrows, counted


class Lowering(lowering.Lower):
    """Writes LLVM code."""

    def _find_singly_assigned_variable(self) -> None:
        """Find variables that need no room in memory.

        numba takes those that are set once and read in the same block.  Here are also those that are set once, in a
        block that every way to where they are read goes through.  An error that is caught leaves a block on the way.
        """
        used, defined = analysis.compute_use_defs(self.blocks)
        times = Counter(inst.target.name for block in self.blocks.values() for inst in block.find_insts(ir.Assign))
        readers: dict[str, list[int]] = {}
        for offset, names in used.items():
            for name in names:
                readers.setdefault(name, []).append(offset)
        whole = not self.context.catches
        before = analysis.compute_cfg_from_blocks(self.blocks).dominators() if readers and whole else {}
        self._blk_local_varmap: dict[str, Any] = {}
        self._singly_assigned_vars = {
            name
            for offset, names in defined.items()
            for name in names
            if times[name] == 1 and not self.func_ir.is_generator
            if name not in readers
            or (whole and not self._counted(name) and all(offset < at and offset in before[at] for at in readers[name]))
        }

    def lower_block(self, block: Any) -> None:
        """Write a block; numba would set up for each instruction what describes it in a complaint."""
        self.pre_block(block)
        for inst in block.body:
            self.loc = inst.loc
            try:
                self.lower_inst(inst)
            except Exception as error:
                kind = partial(errors.LoweringError, loc=inst.loc)
                with new_error_context('lowering "{inst}" at {loc}', inst=inst, loc=self.loc, errcls_=kind):
                    raise error
        self.post_block(block)

    def lower_inst(self, inst: Any) -> None:
        """Write an instruction; numba would print each for a protocol that nobody keeps."""
        if type(inst) is ir.Del:
            self.delvar(inst.value)
        elif type(inst) is ir.Assign and type(inst.value) is not ir.Arg:
            name = inst.target.name
            self.storevar(self.lower_assign(self.typeof(name), inst), name)
        else:
            super().lower_inst(inst)

    def storevar(self, value: Any, name: str, argidx: Any = None) -> None:
        """Write that a variable is set; only what counts references is read before, to count down."""
        if name in self._singly_assigned_vars or self._counted(name):
            super().storevar(value, name, argidx)
        else:
            self._alloca_var(name, self.typeof(name))
            self.builder.store(value, self.getvar(name))

    def delvar(self, name: str) -> None:
        """Write that a variable ends, which is nothing where there are no references to count."""
        if self._counted(name):
            super().delvar(name)
        elif name not in self._blk_local_varmap:
            self._singly_assigned_vars.discard(name)

    def _counted(self, name: str) -> bool:
        return self.context.enable_nrt and counted(self.context, self.typeof(name))

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """Write an operator; numba would first try whether its code for constants fits variables."""
        if expr.static_lhs is not ir.UNDEFINED or expr.static_rhs is not ir.UNDEFINED:
            return super().lower_binop(resty, expr, op)
        return self._operator(op, self.fndesc.calltypes[expr], (expr.lhs, expr.rhs), resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """Write an access to an element."""
        return self._operator(operator.getitem, signature, (value, index), resty)

    def _operator(self, op: Any, signature: Any, operands: Any, result: Any) -> Any:
        table = self.context.typing_context
        function = table.resolve_value_type(op)
        code = self.context.get_function(function, table.resolve_function_type(function, signature.args, {}))
        values = [
            self.context.cast(self.builder, self.loadvar(x.name), self.typeof(x.name), to)
            for x, to in zip(operands, signature.args, strict=True)
        ]
        return self.context.cast(self.builder, code(self.builder, values), signature.return_type, result)


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """The pass that writes LLVM code."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Write the code of a function."""
        state.targetctx.catches = catches(state.func_ir)
        if state.targetctx.enable_nrt and borrows(state):
            state.targetctx.enable_nrt = False
            vars(state.targetctx).pop("nrt", None)  # the counter, made for the setting before
        return bool(super().run_pass(state))

    @property
    def lowering_class(self) -> Any:
        """What writes it."""
        return Lowering
