"""numba's compiler as the kernels need it: the same kernels, without the work that nobody uses.

From an empty cache a study compiles hundreds of helpers that only other kernels call.  For each of them numba makes a
function that Python can call, optimises it and translates it to machine code, and throws all that away when the helper
is folded into its caller.  Here instead

* a :class:`Part`, what kernels call, ends as LLVM code.  It is optimised and translated within its callers.
* a :class:`Helper`, a function of numba's own, has no machine code for itself either.
* optimisers of single functions run on those that have a body.
* what Python calls with reads its arguments once and is not optimised.
* Python does not look for garbage meanwhile (:mod:`kernels._garbage`).
* the way from Python to LLVM code is that of :mod:`kernels._frontend`.
* two processes of one run do not compile the same (:mod:`kernels._claims`).

Side by side with numba's own way a first use takes half the time, and loops 0.97 to 1.04 of theirs; ``make
bench-first-use`` and ``make bench`` give both as they are now.
The classes derive from numba's at the places that numba has for it: dispatcher, compiler, pass, code library.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen, types
from numba.core.cgutils import normalize_ir_text
from numba.core.compiler import CompilerBase, compile_result
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import _OverloadFunctionTemplate

from kernels._claims import claimed
from kernels._frontend import contexts, passes
from kernels._garbage import nobody_looks
from kernels._lowering import KernelLowering
from kernels._plainly import REPLACED, plainly

FOR_PYTHON = "_ZN7cpython"  # how names of functions begin that numba makes for calls from Python
PART = "part"  # kind of a library without machine code, in the cache on disk


def _is_for_python(ir_module: Any) -> bool:
    return any(f.name.startswith(FOR_PYTHON) and not f.is_declaration for f in ir_module.functions)


class _Library(codegen.JITCodeLibrary):
    """The LLVM module of one compiled function."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._for_python: list[Any] = []

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        # Preparing passes takes longer than they run on most bodies, and a declaration has nothing to optimise.
        passes, builder = self._codegen._function_pass_manager()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def add_ir_module(self, ir_module: Any) -> None:
        """Take LLVM code in; what Python calls waits, since it is not worth optimising: it reads arguments once."""
        if not _is_for_python(ir_module):
            super().add_ir_module(ir_module)
            return
        module = llvm.parse_assembly(normalize_ir_text(str(ir_module)))
        module.verify()
        self._for_python.append(module)

    def _optimize_final_module(self) -> None:
        super()._optimize_final_module()
        for module in self._for_python:
            self._final_module.link_in(module)


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


class _HelperLibrary(_PartLibrary):
    """The LLVM module of a function of numba's own, optimised before it is linked, as numba does it."""

    _optimize_final_module = _Library._optimize_final_module


class _HelperCompiler(_PartCompiler):
    library = _HelperLibrary


class Kernel(CPUDispatcher):
    """A function that Python and other kernels call; one set of machine code per set of types."""

    compiler: type[_KernelCompiler] = _KernelCompiler
    _cache: Any
    _compiler: Any
    _cache_hits: Any
    _cache_misses: Any
    _can_compile: bool
    _compiling_counter: Any

    def __init__(self, py_func: Callable[..., Any], locals: Any = None, targetoptions: dict[str, Any] | None = None):
        super().__init__(py_func, locals, targetoptions, self.compiler)

    def compile(self, sig: Any) -> Any:
        """Load or compile the code for types of arguments."""
        if not self._can_compile:
            raise RuntimeError("compilation disabled")
        with global_compiler_lock, nobody_looks(), plainly(), self._compiling_counter:
            args, result = normalize_signature(sig)
            known = self.overloads.get(tuple(args)) or self._loaded(sig)
            return (known or self._made(sig, args, result)).entry_point

    def _made(self, sig: Any, args: Any, result: Any) -> Any:
        """Compile the code of a signature, or wait for the process that does so already."""
        with claimed(f"{self.py_func.__module__}.{self.py_func.__qualname__}", args) as shared:
            known = self._loaded(sig) if shared else None
            if known is None:
                self._cache_misses[sig] += 1
                known = self._compiler.compile(args, result)
                self.add_overload(known)
                self._cache.save_overload(sig, known)
            return known

    def _loaded(self, sig: Any) -> Any:
        """Return what the cache has for a signature, None where it has nothing."""
        found = self._cache.load_overload(sig, self.targetctx)
        if found is not None:
            self._cache_hits[sig] += 1
            self.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
            self.add_overload(found)
        return found

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


class Helper(Part):
    """A function of numba's own that kernels call, as that which makes an array; numba would make machine code too."""

    compiler = _HelperCompiler

    def _made(self, sig: Any, args: Any, result: Any) -> Any:
        known = self._compiler.compile(args, result)
        self.add_overload(known)
        return known


_SAID = {"nopython": True, "boundscheck": None, "no_cpython_wrapper": True}


def _makes_helpers(template: Any) -> Any:
    """Return what makes a function of numba's own, as `_OverloadFunctionTemplate._get_jit_decorator` does."""

    def made(**options: Any) -> Any:
        if options.items() <= _SAID.items():
            return lambda function: Helper(function, None, _SAID | {"no_cfunc_wrapper": True})
        return _numbas_own(template)(**options)

    return made


_numbas_own = _OverloadFunctionTemplate._get_jit_decorator
REPLACED.append((_OverloadFunctionTemplate, "_get_jit_decorator", _makes_helpers))


class Shared(Part):
    """A part of which one code serves whatever numbers are written in its calls."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a call is typed."""
        plain = {name: types.unliteral(kind) for name, kind in kws.items()}
        return super().get_call_template(tuple(types.unliteral(kind) for kind in args), plain)


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
