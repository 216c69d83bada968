"""What numba does tens of thousands of times in a first use, less roundabout: functions that take the place of its own.

They give the same.  They stand there only while a kernel is compiled.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from llvmlite.ir import IRBuilder
from llvmlite.ir._utils import NameScope
from numba.core import analysis, base, errors, event, ir, ssa, transforms
from numba.core.cpu import CPUContext
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.runtime.context import NRTContext
from numba.core.targetconfig import TargetConfig
from numba.core.typing.context import Context

from kernels._counts import meminfos
from kernels._operations import part_of

# Neither these nor what they are made of are variables of numba's intermediate code.
_HASHES: dict[type, int] = {}
_NO_VARIABLES = (ir.Loc, str, int, float, bool, type(None))


def _variables_in(self: Any, value: Any) -> list[Any]:
    """Return the variables in an instruction, or in what it is made of, as `ir.Inst._rec_list_vars` does."""
    if isinstance(value, ir.Var):
        return [value]
    if isinstance(value, ir.Inst):
        return value.list_vars()  # type: ignore[no-any-return, no-untyped-call]
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
    found: list[Any] = []
    for one in inside:
        if type(one) is ir.Var:
            found.append(one)
        elif type(one) not in _NO_VARIABLES:
            found += _variables_in(self, one)
    return found


def _values(self: Any) -> dict[str, Any]:
    """Return the options that a function is compiled with, as `TargetConfig.values` does."""
    return {name: self._values.get(name, option.default) for name, option in self.options.items()}


def _same(self: Any, other: Any) -> bool:
    """Return whether two sets of options are equal, as `TargetConfig.__eq__` does; most are the same to the letter."""
    alike = isinstance(other, TargetConfig)
    return alike and (self is other or self._values == other._values or self.values() == other.values())


def _hash(self: Any) -> int:
    """Return the hash of a set of options; numba's is of their names alone too, but sorts them each time."""
    kind = type(self)
    if kind not in _HASHES:
        _HASHES[kind] = hash(tuple(sorted(self.options)))
    return _HASHES[kind]


def _uses_and_definitions(blocks: Any) -> Any:
    """Return the variables that each block reads and sets, as `analysis.compute_use_defs` does, listing each once."""
    used: dict[int, set[str]] = {}
    defined: dict[int, set[str]] = {}
    for offset, block in blocks.items():
        uses = used[offset] = set()
        sets = defined[offset] = set()
        for statement in block.body:
            if type(statement) in analysis.ir_extension_usedefs:
                analysis.ir_extension_usedefs[type(statement)](statement, uses, sets)
                continue
            if isinstance(statement, ir.Assign):
                value = statement.value
                read = {value.name} if isinstance(value, ir.Var) else _names(value)
                if statement.target.name not in read:
                    sets.add(statement.target.name)
            else:
                read = _names(statement)
            uses |= read - sets
    return analysis._use_defs_result(usemap=used, defmap=defined)


def _handled(states: Any, block: Any, handler: Any) -> Iterator[Any]:
    """Hand the statements of a block to one that renames variables, as `ssa._run_ssa_block_pass` does, and no log."""
    for statement in block.body:
        handle = handler.on_assign if isinstance(statement, ir.Assign) else handler.on_other
        yield handle(states, statement)


def _names(value: Any) -> set[str]:
    return {x.name for x in value.list_vars()} if isinstance(value, ir.Inst) else set()  # type: ignore[no-untyped-call]


def _in_order(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Bring the blocks of a function into order, as `PostProcessor.run` does after each pass.

    Where variables live and end it finds each time; here it does when that is asked for, as at the last time.
    """
    function = self.func_ir
    if emit_dels or function.is_generator:
        _numbas_order(self, emit_dels, extend_lifetimes)
    else:
        function.blocks = transforms.canonicalize_cfg(function.blocks)  # type: ignore[no-untyped-call]
        function.variable_lifetime = VariableLifetime(function.blocks)  # type: ignore[no-untyped-call]


_numbas_order = PostProcessor.run


def _registered(self: Any, name: str, deduplicate: bool = False) -> str:
    """Return a name for an LLVM value that no other has, as `NameScope.register` does."""
    used = self._useset
    if name in used:
        if not deduplicate:
            return str(_numbas_name(self, name))
        wanted, number = name, self._basenamemap[name]
        while name in used:
            number += 1
            name = f"{wanted}.{number}"
        self._basenamemap[wanted] = number
    used.add(name)
    return name


_numbas_name = NameScope.register


def _takes_a_place(function: Any) -> bool:
    """Return whether a function takes an argument `loc`, as `base._has_loc` does."""
    if type(function) is not FunctionType or hasattr(function, "__wrapped__"):
        return bool(_numbas_look(function))
    code = function.__code__
    return "loc" in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]


_numbas_look: Any = base._has_loc


def _after_an_import(look: Any) -> Any:
    """Return what looks for functions that were added to numba's tables, in all modules only if some came in since."""
    seen: dict[int, int] = {}

    def looked(self: Any) -> None:
        table = id(self._registries)
        if seen.get(table) != len(sys.modules):
            look(self)
            seen[table] = len(sys.modules)
        else:
            for registry in list(self._registries):
                self.install_registry(registry)

    return looked


def _unless_nobody_listens(told: Any) -> Any:
    """Return what tells of an event, without making one for nobody: LLVM's lock has two at each call of LLVM."""

    def tell(kind: str, *about: Any, **more: Any) -> None:
        if event._registered[kind]:
            told(kind, *about, **more)

    return tell


# What numba does tens of thousands of times, and what takes its place: the same, but less roundabout.  Complaints are
# caught, and colours would set up the terminal for each.
REPLACED: list[tuple[Any, str, Any]] = [
    (ir.Inst, "_rec_list_vars", _variables_in),
    (TargetConfig, "values", _values),
    (TargetConfig, "__eq__", _same),
    (TargetConfig, "__hash__", _hash),
    (analysis, "compute_use_defs", _uses_and_definitions),
    (event, "start_event", _unless_nobody_listens(event.start_event)),
    (event, "end_event", _unless_nobody_listens(event.end_event)),
    (NRTContext, "get_meminfos", meminfos),
    (ssa, "_run_ssa_block_pass", _handled),
    (PostProcessor, "run", _in_order),
    (base, "_has_loc", _takes_a_place),
    (CPUContext, "load_additional_registries", _after_an_import(CPUContext.load_additional_registries)),
    (Context, "load_additional_registries", _after_an_import(Context.load_additional_registries)),
    (IRBuilder, "extract_value", part_of),
    (NameScope, "register", _registered),
    (type(errors.termcolor()), "_markup", lambda _self, text, *_style: text),
]


@contextmanager
def plainly() -> Iterator[None]:
    """Let numba list variables and options without asking each for its own way, and complain without colours."""
    before = [(kind, name, vars(kind)[name]) for kind, name, _ in REPLACED if name in vars(kind)]
    for kind, name, ours in REPLACED:
        if name in vars(kind):
            setattr(kind, name, ours)
    try:
        yield
    finally:
        for kind, name, theirs in before:
            setattr(kind, name, theirs)
