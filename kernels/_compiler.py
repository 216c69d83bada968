"""numba's compiler as the kernels need it: the same kernels, without the work that nobody uses.

From an empty cache a study compiles hundreds of helpers that only other kernels call.  For each of them numba makes a
function that Python can call, optimises it and translates it to machine code, and throws all that away when the helper
is folded into its caller.  For each ``a * b`` it asks every operator it knows anew.  Here instead

* a :class:`Part`, what kernels call, ends as LLVM code.  It is optimised and translated within its callers.
* what an operator gives for the types of its operands is remembered.
* optimisers of single functions run on those that have a body.

Side by side with numba's own way a first use took a third less, and loops 0.97 to 1.04 of their time; ``make
bench-first-use`` and ``make bench`` give both as they are now.
The classes derive from numba's at the places that numba has for it: dispatcher, compiler, pass, code library.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import operator
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba import types
from numba.core import codegen
from numba.core.compiler import CompilerBase, DefaultPassBuilder, compile_result
from numba.core.compiler_machinery import register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering
from numba.core.typing.context import Context

PART = "part"  # kind of a library without machine code, in the cache on disk
_OPERATORS = {id(function) for function in vars(operator).values() if callable(function)}


class _Library(codegen.JITCodeLibrary):
    """The LLVM module of one compiled function."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            # A declaration has nothing to optimise, but preparing its passes takes longer than most bodies do.
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                with self._recorded_timings.record(f"Function passes on {function.name!r}", builder):
                    passes.run(function, builder)


class _PartLibrary(_Library):
    """The LLVM module of a part, to be linked into those of its callers."""

    @classmethod
    def loaded(cls, codegen: Any, name: str, bitcode: bytes) -> _PartLibrary:
        """Return the library whose optimised module was kept on disk."""
        library = cls(codegen, name)
        library._final_module = library._shared_module = llvm.parse_bitcode(bitcode)
        library._finalized = True
        return library

    def _optimize_final_module(self) -> None:
        """Leave that to the callers: what is optimised twice takes twice as long, and hides loops from the second."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        for function in self._final_module.functions:
            # Callers bring copies, of which the linker takes one and drops those that nothing calls.
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        self._shared_module = self._final_module
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """Return what the cache keeps; there is no object code."""
        self._ensure_finalized()
        return self.name, PART, self._final_module.as_bitcode()


class _Typing(Context):
    """numba's table of types, remembering what operators give; it shares all else with the one it is made of."""

    def __init__(self, of: Context) -> None:
        self.__dict__ = of.__dict__
        self._known_operators: dict[Any, Any] = {}

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a function for types of arguments."""
        function = func.typing_key if isinstance(func, types.BaseFunction) else func
        if id(function) not in _OPERATORS or kws:
            return super().resolve_function_type(func, args, kws)
        key = id(function), args
        if key not in self._known_operators:
            self._known_operators[key] = super().resolve_function_type(func, args, kws)
        return self._known_operators[key]


_remembering = cache(_Typing)  # one for each table: numba keeps what it has compiled of its own by the table asked for


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """Code for callers alone."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # numba finds the code to call by what Python would call.  Anything else that is one of a kind will do.
        state["cr"] = lowered._replace(cfunc=object())
        state.library._ensure_finalized()
        state.targetctx.insert_user_function(state["cr"].cfunc, lowered.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        return True


class _KernelCompiler(CompilerBase):
    """numba's way from a Python function to machine code, with our library and table of types."""

    library: type[_Library] = _Library

    def __init__(self, typingctx: Any, *args: Any) -> None:
        super().__init__(_remembering(typingctx), *args)

    def define_pipelines(self) -> list[Any]:
        """Return the passes that a function goes through."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return [DefaultPassBuilder.define_nopython_pipeline(state)]


class _PartCompiler(_KernelCompiler):
    library = _PartLibrary

    def define_pipelines(self) -> list[Any]:
        passes = super().define_pipelines()
        for way in passes:
            way.passes = [(_PartLowering if made is NativeLowering else made, about) for made, about in way.passes]
        return passes


class Kernel(CPUDispatcher):
    """A function that Python and other kernels call; one set of machine code per set of types."""

    compiler: type[_KernelCompiler] = _KernelCompiler

    def __init__(self, py_func: Callable[..., Any], locals: Any = None, targetoptions: dict[str, Any] | None = None):
        super().__init__(py_func, locals, targetoptions, self.compiler)

    def __reduce__(self) -> Any:
        """By its name where it has one: numba would send the source, and the process that gets it compile it anew."""
        home = sys.modules.get(self.py_func.__module__)
        name = self.py_func.__name__
        return name if getattr(home, name, None) is self else super().__reduce__()


class Part(Kernel):
    """A function that kernels call.  For a call from Python, as tests have them, it is compiled once more."""

    compiler = _PartCompiler
    _callable: Any = None  # the kernel for calls from Python

    def add_overload(self, cres: Any) -> None:
        """Take compiled code in for callers among the kernels; for Python there is nothing to call."""
        self.overloads[tuple(cres.signature.args)] = cres

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        if self._callable is None:
            options = {key: value for key, value in self.targetoptions.items() if key != "no_cpython_wrapper"}
            self._callable = Kernel(self.py_func, None, options)
        return self._callable._compile_for_args(*args, **kws)


def rebuilt_part(target: Any, payload: tuple[Any, ...]) -> Any:
    """Return the compiled part that the cache kept, from what numba keeps of compiled code."""
    kept, fndesc, environment, signature, objectmode, lifted, annotation, reload_init, referenced = payload
    name, _, bitcode = kept
    for function in reload_init:
        function()
    return compile_result(
        target_context=target,
        typing_context=target.typing_context,
        library=_PartLibrary.loaded(target.codegen(), name, bitcode),
        environment=environment,
        entry_point=object(),
        fndesc=fndesc,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        reload_init=reload_init,
        referenced_envs=referenced,
    )
