"""numba's way from Python to LLVM code as the kernels need it: the same code, without work that changes nothing.

numba's front end takes most of a first use.  Here, against its own way,

* passes are left out that look for what no kernel has, as ``with``, or write what nobody reads; those for closures and
  expressions of whole arrays where a function has none;
* what an operator is, and what functions of numba give for the types of their arguments, is remembered;
* a constraint of the types is looked at again only after one of its types has changed.

The code is that of numba: ``tests/test_compiler.py`` compares the two.  The classes derive from numba's at the places
that numba has for it.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import operator
from functools import cache
from types import CodeType
from typing import Any

from numba.core import errors, ir, typeinfer, types, untyped_passes
from numba.core.callconv import CPUCallConv
from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.consts import ConstantInference
from numba.core.cpu import CPUContext
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import (
    AnnotateTypes,
    DumpParforDiagnostics,
    NativeLowering,
    NopythonRewrites,
    NoPythonSupportedFeatureValidation,
    NopythonTypeInference,
)
from numba.core.typing.context import Context

from kernels._calls import Calls
from kernels._lowering import KernelLowering
from kernels._operations import OPERATIONS

_OPERATORS = {id(function) for function in vars(operator).values() if callable(function)}
# No kernel has `with`, functions inlined by numba, nor the features that one pass refuses.
_UNUSED = (
    untyped_passes.WithLifting,
    untyped_passes.InlineInlinables,
    NoPythonSupportedFeatureValidation,
    AnnotateTypes,
    DumpParforDiagnostics,
)
# These are for functions made within a function.
_FOR_CLOSURES = (untyped_passes.InlineClosureLikes, untyped_passes.MakeFunctionToJitFunction)
_SIZES: dict[str, int] = {}


class _Typing(Context):
    """numba's table of types, remembering what operators are and give; it shares the rest with that it is made of."""

    def __init__(self, of: Context) -> None:
        self.__dict__ = of.__dict__
        self._known_values: dict[int, Any] = {}
        self._known_calls: dict[Any, Any] = {}

    def resolve_value_type(self, val: Any) -> Any:
        """Return the type of a constant."""
        if id(val) not in _OPERATORS:
            return super().resolve_value_type(val)
        if id(val) not in self._known_values:
            self._known_values[id(val)] = super().resolve_value_type(val)
        return self._known_values[id(val)]

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a function for types of arguments."""
        if not isinstance(func, types.Function) or kws:
            return super().resolve_function_type(func, args, kws)
        # What numba itself compiles for a call has the flags of who asks first.
        flags = ConfigStack.top_or_none()
        key = func, args, None if flags is None else flags.fastmath.encode()
        if key not in self._known_calls:
            self._known_calls[key] = super().resolve_function_type(func, args, kws)
        return self._known_calls[key]


class _Target(CPUContext):
    """What numba knows of the processor."""

    catches = False  # whether the function that is compiled catches errors

    def get_abi_sizeof(self, ty: Any) -> int:
        """Return the size of a type of LLVM's in memory, which parses a module to ask for it."""
        text = str(ty)
        if text not in _SIZES:
            _SIZES[text] = super().get_abi_sizeof(ty)
        return _SIZES[text]

    def get_function(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """Return the code of a function for a signature."""
        # Asked at every element of an array; only what imitates arrays has it, and looking for it reads all registers.
        if fn == "__array__" and all(type(x) is types.Array for x in sig.args):
            raise NotImplementedError(fn)
        write = OPERATIONS.get(getattr(fn, "typing_key", fn))
        return (write and write(self, sig)) or self.numbas_own(fn, sig, _firstcall)

    def numbas_own(self, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
        """Return numba's code of a function for a signature."""
        return super().get_function(fn, sig, _firstcall)

    def pair_first(self, builder: Any, val: Any, ty: Any) -> Any:
        """Return the first of a pair."""
        return builder.extract_value(val, 0)

    def pair_second(self, builder: Any, val: Any, ty: Any) -> Any:
        """Return the second of a pair."""
        return builder.extract_value(val, 1)

    @property
    def call_conv(self) -> CPUCallConv:
        """How functions are called."""
        return CPUCallConv(self) if self.catches else Calls(self)


_remembering = cache(_Typing)  # one for each table: numba keeps what it has compiled of its own by the table asked for


def contexts(typingctx: Any, targetctx: Any) -> tuple[Any, Any]:
    """Return numba's table of types, and of the processor, in our form; what they know they share with numba's."""
    target = targetctx.subtarget()
    target.__class__ = _Target
    target.typing_context = _remembering(typingctx)
    return target.typing_context, target


class _Constants(ConstantInference):
    """The look for constants."""

    def infer_constant(self, name: str, loc: Any = None) -> Any:
        """Return the value of a variable that is constant."""
        # A place is for people: what is no constant here is an index of a loop.
        return super().infer_constant(name)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Translation(untyped_passes.TranslateByteCode):
    _name = "kernel_translation"

    def run_pass(self, state: Any) -> bool:
        super().run_pass(state)
        state.func_ir._consts = _Constants(state.func_ir)
        return True


class _Network(typeinfer.ConstraintNetwork):
    """The constraints of a function's types."""

    def __init__(self) -> None:
        super().__init__()
        self._names: list[list[str]] = []  # of the variables each depends on; none: it is always looked at
        self._seen: list[Any] = []

    def append(self, constraint: Any) -> None:
        super().append(constraint)
        self._names.append(_variables(constraint))
        self._seen.append(None)

    def propagate(self, typeinfer: Any) -> list[Exception]:
        """Apply the constraints, and return what they complain about."""
        found: list[Exception] = []
        known = typeinfer.typevars
        for k, constraint in enumerate(self.constraints):
            before = [known[name].type for name in self._names[k]]
            if before and before == self._seen[k]:
                continue
            self._seen[k] = None
            try:
                constraint(typeinfer)
            except errors.ForceLiteralArg as error:
                found.append(error)
            except errors.TypingError as error:
                place = errors.TypingError(str(error), loc=constraint.loc, highlighting=False)
                found.append(place.with_traceback(error.__traceback__))
            else:
                self._seen[k] = [known[name].type for name in self._names[k]]
        return found


class _Merged(typeinfer.Propagate):
    """The type of a variable that is set at several places, from one of them."""

    def __call__(self, typeinfer: Any) -> None:
        # A counter that begins at 0 is a number like others.  numba takes it for the constant 0 until it sees what else
        # it becomes, and compiles what is called with it for that constant first.
        known = typeinfer.typevars
        if not known[self.dst].defined and isinstance(known[self.src].type, types.Literal):
            known[self.dst].add_type(types.unliteral(known[self.src].type), loc=self.loc)
        super().__call__(typeinfer)


class _Inferer(typeinfer.TypeInferer):
    """Finds the types of a function's variables."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.constraints = _Network()

    def typeof_expr(self, inst: Any, target: Any, expr: Any) -> None:
        if expr.op != "phi":
            super().typeof_expr(inst, target, expr)
            return
        for value in expr.incoming_values:
            if value is not ir.UNDEFINED:
                self.constraints.append(_Merged(target.name, value.name, expr.loc))


def _variables(constraint: Any) -> list[str]:
    """Return the names of the variables that a constraint reads or sets; none of a kind that is not known here."""
    if isinstance(constraint, (typeinfer.Propagate, typeinfer.ArgConstraint)):
        return [constraint.src, constraint.dst]
    if isinstance(constraint, typeinfer.BuildTupleConstraint):
        return [constraint.target, *(x.name for x in constraint.items)]
    if isinstance(constraint, typeinfer.StaticGetItemConstraint):
        others = constraint.fallback.args if constraint.fallback else ()
        return [constraint.target, constraint.value.name, *(x.name for x in others)]
    if isinstance(constraint, typeinfer.GetAttrConstraint):
        return [constraint.target, constraint.value.name]
    if type(constraint) is typeinfer.IntrinsicCallConstraint:
        return [constraint.target, *(x.name for x in constraint.args)]
    if isinstance(constraint, typeinfer.SetItemConstraint):
        return [constraint.target.name, constraint.index.name, constraint.value.name]
    return []


@register_pass(mutates_CFG=True, analysis_only=False)
class _Inference(NopythonTypeInference):
    """The types of all variables."""

    _name = "kernel_type_inference"

    def run_pass(self, state: Any) -> bool:
        infer = _Inferer(state.typingctx, state.func_ir, None)
        with state.typingctx.callstack.register(state.targetctx.target, infer, state.func_id, state.args):
            for index, (name, kind) in enumerate(zip(state.func_ir.arg_names, state.args, strict=True)):
                infer.seed_argument(name, index, kind)
            if state.return_type is not None:
                infer.seed_return(state.return_type)
            infer.build_constraint()
            infer.propagate()
            state.typemap, state.return_type, state.calltypes = infer.unify()
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Rewrites(NopythonRewrites):
    """Loops for expressions of whole arrays."""

    _name = "kernel_rewrites"

    def run_pass(self, state: Any) -> bool:
        for block in state.func_ir.blocks.values():
            for assigned in block.find_insts(ir.Assign):
                made = isinstance(assigned.value, ir.Expr) and assigned.value.op not in ("cast", "getattr")
                if made and isinstance(state.typemap[assigned.target.name], types.Array):
                    return bool(super().run_pass(state))
        return False


class _Passes(PassManager):
    """The passes of a function, without a protocol of what each does."""

    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        pss.analysis = self._analysis
        pss.run_initialization(internal_state)
        pss.run_pass(internal_state)
        pss.run_finalizer(internal_state)


def passes(state: Any, writer: type[KernelLowering]) -> PassManager:
    """Return the passes that a function goes through; the writer writes LLVM code."""
    own = {
        untyped_passes.TranslateByteCode: _Translation,
        NopythonRewrites: _Rewrites,
        NopythonTypeInference: _Inference,
        NativeLowering: writer,
    }
    has_closures = any(isinstance(x, CodeType) for x in state.func_id.code.co_consts)
    unused = _UNUSED if has_closures else _UNUSED + _FOR_CLOSURES
    found = _Passes("kernel")
    for made, about in DefaultPassBuilder.define_nopython_pipeline(state).passes:
        if made not in unused:
            found.add_pass(own.get(made, made), about)
    found.finalize()
    return found
