"""Limits of size that keep the code readable: length and arguments of functions, length of files, share of comments.

They are counted on the syntax tree, signatures included.  The lines of a docstring are no lines of code; that of a
public function holds an example that is run.  Options with a default that can only be given by name count apart from
the other arguments, and a command of the terminal takes as many as it has options.
"""

from __future__ import annotations

import ast
import io
import statistics
import tokenize
from pathlib import Path

import pytest

import kernels
from sweep.families import NAMES

ROOT = Path(kernels.__file__).parent.parent
LIMITS = {"kernels": (60, 10), "sweep": (60, 10)}  # lines and arguments of a function, by room


def sources(room):
    return sorted((ROOT / room).rglob("*.py"))


def functions(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def arguments(function):
    a = function.args
    options = sum(default is not None for default in a.kw_defaults)
    others = len([*a.posonlyargs, *a.args, *a.kwonlyargs]) - options + (a.vararg is not None) + (a.kwarg is not None)
    commands = [d for d in function.decorator_list if isinstance(d, ast.Call) and "command" in ast.unparse(d.func)]
    return 0 if commands else max(options, others)


def lines_of(function):
    first = function.body[0]
    said = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str)
    return function.end_lineno - function.lineno + 1 - (first.end_lineno - first.lineno + 1 if said else 0)


def offenders(files, lines, most):
    """Functions longer than ``lines`` or with more than ``most`` arguments, as "file: name lines arguments"."""
    return [
        f"{path}: {f.name} {lines_of(f)} {arguments(f)}"
        for path, text in files
        for f in functions(ast.parse(text))
        if lines_of(f) > lines or arguments(f) > most
    ]


@pytest.mark.parametrize("room", LIMITS)
def test_no_function_is_longer_or_takes_more_arguments_than_its_room_allows(room):
    files = [(path.relative_to(ROOT), path.read_text()) for path in sources(room)]
    assert len(files) > 30
    assert offenders(files, *LIMITS[room]) == []


def test_a_function_that_breaks_a_limit_is_named():
    text = "def f(a, b, *, c=1, **d):\n    'Said.'\n    return (\n        a,\n    )\n"
    assert offenders([("x.py", text)], 4, 3) == []
    assert offenders([("x.py", text)], 3, 3) == ["x.py: f 4 3"]
    assert offenders([("x.py", text)], 4, 2) == ["x.py: f 4 3"]


@pytest.mark.parametrize("room", LIMITS)
def test_files_stay_short(room):
    lengths = {path: len(path.read_text().splitlines()) for path in sources(room)}
    assert [str(path) for path, length in lengths.items() if length > 350] == []
    assert statistics.median(lengths.values()) <= 180  # fewer files, each still read at one sitting


def test_files_of_tests_stay_short():
    lengths = {path: len(path.read_text().splitlines()) for path in sources("tests")}
    assert [str(path) for path, length in lengths.items() if length > 350] == []


def test_kernels_explain_their_numerical_tricks():
    """Three lines in a hundred carry a comment; what only steers the formatter does not count."""
    lines, comments = 0, 0
    for path in sources("kernels"):
        text = path.read_text()
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        found = [
            t for t in tokens if t.type == tokenize.COMMENT and not t.string.startswith(("# fmt", "# noqa", "# type"))
        ]
        lines, comments = lines + len(text.splitlines()), comments + len({t.start[0] for t in found})
    assert comments >= 0.03 * lines


def test_every_kernel_and_helper_names_its_own_floating_point_flags():
    """A helper without flags of its own would be compiled with those of whichever kernel called it first."""
    import importlib

    found = {}
    for path in sources("kernels"):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        found |= {id(x): x for x in vars(importlib.import_module(name)).values() if hasattr(x, "targetoptions")}
    assert len(found) > 150
    assert [str(x) for x in found.values() if x.targetoptions.get("fastmath") not in (False, {"contract"})] == []


def test_no_code_asks_for_a_familys_name():
    """What an effect, a proof or a drawing needs of a family is a capability; a comparison with a name is not."""
    asked = []
    for path in (*sources("sweep"), *sources("kernels")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Compare):
                words = {c.value for c in ast.walk(node) if isinstance(c, ast.Constant) and isinstance(c.value, str)}
                asked += [f"{path}:{node.lineno}: {word}" for word in words.intersection(NAMES)]
    assert asked == []


def test_drawing_of_the_house_has_every_room_and_every_kernel():
    page = (ROOT / "docs" / "architecture.md").read_text()
    drawn = page.split("    kernels/ ")[1].split("    studies/ ")[0]
    kernels_drawn, sweep_drawn = drawn.split("    sweep/ ")
    for text, room in ((kernels_drawn, "kernels"), (sweep_drawn, "sweep")):
        there = {path.name for path in (ROOT / room).iterdir() if path.suffix == ".py" or path.is_dir()}
        missing = [name for name in there - {"__init__.py", "__main__.py", "__pycache__"} if name not in text]
        assert missing == [], room
        named = {word.rstrip(",;") for word in text.split() if word.rstrip(",;").endswith((".py", "/"))}
        gone = [x for x in named if "/X" not in x and not list((ROOT / room).rglob(x.rstrip("/")))]
        assert gone == [], room
