"""numba's compiler as the kernels need it: the same kernels, without the work that nobody uses.

From an empty cache a study compiles hundreds of helpers that only other kernels call.  For each of them numba makes a
function that Python can call, optimises it and translates it to machine code, and throws all that away when the helper
is folded into its caller.  Here instead

* a :class:`Part`, what kernels call, ends as LLVM code.  It is optimised and translated within its callers.
* optimisers of single functions run on those that have a body.
* Python does not look for garbage meanwhile.
* the way from Python to LLVM code is that of :mod:`kernels._frontend`.

Side by side with numba's own way a first use takes half the time, and loops 0.97 to 1.04 of theirs; ``make
bench-first-use`` and ``make bench`` give both as they are now.
The classes derive from numba's at the places that numba has for it: dispatcher, compiler, pass, code library.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen
from numba.core.compiler import CompilerBase, compile_result
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.registry import CPUDispatcher

from kernels._frontend import KernelLowering, contexts, passes, plainly

PART = "part"  # kind of a library without machine code, in the cache on disk


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


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(KernelLowering):
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
    lowering: type[KernelLowering] = KernelLowering

    def __init__(self, typingctx: Any, targetctx: Any, *args: Any) -> None:
        super().__init__(*contexts(typingctx, targetctx), *args)

    def define_pipelines(self) -> list[Any]:
        """Return the passes that a function goes through."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return [passes(state, self.lowering)]


class _PartCompiler(_KernelCompiler):
    library = _PartLibrary
    lowering = _PartLowering


@contextmanager
def _without_collector() -> Iterator[None]:
    """Keep Python from looking for garbage: of what a compiler makes, nearly all lives until it is done."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


class Kernel(CPUDispatcher):
    """A function that Python and other kernels call; one set of machine code per set of types."""

    compiler: type[_KernelCompiler] = _KernelCompiler

    def __init__(self, py_func: Callable[..., Any], locals: Any = None, targetoptions: dict[str, Any] | None = None):
        super().__init__(py_func, locals, targetoptions, self.compiler)

    def compile(self, sig: Any) -> Any:
        """Load or compile the code for types of arguments."""
        with global_compiler_lock, _without_collector(), plainly():
            return super().compile(sig)

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
