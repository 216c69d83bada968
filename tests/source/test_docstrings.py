"""Public docstrings: each names its arguments and what comes back, and its example gives what it shows."""

from __future__ import annotations

import doctest
import inspect
import os
import re
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name

import matplotlib.pyplot as plt
import pytest

import sweep
from sweep.cli.first_study import smoke_text, study_text
from sweep.families import family

ROOT = Path(__file__).parents[2]
SOURCES = [file for file in sorted((ROOT / "sweep").rglob("*.py")) if ">>> " in file.read_text(encoding="utf-8")]
MODULES = [".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for file in SOURCES]


def public():
    """Every function that `sweep` offers, by the name that a user writes."""
    for name in sweep.__all__:
        found = getattr(sweep, name)
        inner = {f"{name}.{key}": getattr(found, key) for key in getattr(found, "__all__", ())}
        yield from ((key, value) for key, value in (inner or {name: found}).items() if inspect.isfunction(value))


FUNCTIONS = dict(public())


@pytest.fixture(scope="module")
def press(tmp_path_factory):
    """The folder in which examples run: a study `press`, begun by `sweep init` and computed with an optimum."""
    place = tmp_path_factory.mktemp("examples")
    (place / "press").mkdir()
    text = study_text("press", family("slider_crank"), "study.schema.json")
    for line in ("[optimise]", "starts = ", "[tolerance]", "lengths = "):
        text = text.replace(f"# {line}", line)
    (place / "press" / "study.toml").write_text(text, encoding="utf-8")
    (place / "press" / "smoke.toml").write_text(smoke_text(family("slider_crank")), encoding="utf-8")
    here = Path.cwd()
    os.chdir(place)
    sweep.run("press", jobs=1)
    yield place
    os.chdir(here)


@pytest.mark.parametrize("module", MODULES)
def test_examples_give_what_they_show(module, press):
    found = doctest.testmod(import_module(module), extraglobs={"sweep": sweep}, optionflags=doctest.FAIL_FAST)
    plt.close("all")
    assert found.failed == 0 and found.attempted > 0


@pytest.mark.parametrize("folder", ["kernels", "sweep"])
def test_docstrings_refer_to_what_exists(folder):
    missing = []
    for file in sorted((ROOT / folder).rglob("*.py")):
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for name in re.findall(r":(?:func|class|meth|mod|data|attr):`([\w.]+)`", file.read_text(encoding="utf-8")):
            try:
                resolve_name(name if name.split(".")[0] in ("kernels", "sweep") else f"{module}.{name}")
            except (AttributeError, ImportError, ValueError):
                missing.append(f"{module}: {name}")
    assert not missing


def test_a_wrong_example_is_noticed():
    case = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert doctest.DocTestRunner(verbose=False).run(case, out=lambda text: None).failed == 1


@pytest.mark.parametrize("name", FUNCTIONS)
def test_public_function_says_what_it_takes_and_gives_and_shows_it(name):
    text, module = inspect.getdoc(FUNCTIONS[name]), FUNCTIONS[name].__module__
    assert module in MODULES and ">>> " in text
    sections = re.findall(r"^(\w+)\n-+$", text, flags=re.MULTILINE)
    assert sections == [x for x in ("Parameters", "Returns", "Raises", "Warns", "Notes", "Examples") if x in sections]
    assert {"Parameters", "Returns", "Examples"} <= set(sections)
    listed = text.split("Parameters\n----------\n")[1].split("\n\n")[0]
    known = {word for line in re.findall(r"^([\w, *]+) : ", listed, re.MULTILINE) for word in re.split(r"[, *]+", line)}
    assert set(inspect.signature(FUNCTIONS[name]).parameters) <= known
    summary = text.split("\n")[0]
    assert len(summary) > 20 and not summary[0].islower()
