"""A package of two kernels with this project's decorators, and processes that use it, for tests of the disk cache."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

from tests.support.forks import Forks

SOURCES = Path(__file__).resolve().parents[2] / "kernels"
HELPER = """
from kernels.jit import inline

STEP = {step}


@inline
def shifted(x: float) -> float:
    return x + STEP
"""
KERNEL = """
from kernels.jit import kernel
from kernels.helper import shifted


@kernel
def run(x):
    return shifted(x)
"""
REPORT = "from kernels.loop import run; print(run(1.0), len(run.stats.cache_hits), type(run._cache).__name__)"


def process(tree: Path, program: str, errors: int | None = None, **environment: str) -> subprocess.Popen[str]:
    known = os.environ | {"XDG_CACHE_HOME": str(tree.parents[1] / "cache"), "PYTHONPATH": str(tree.parent)}
    known |= {"PYTHONDONTWRITEBYTECODE": "", "NUMBA_DISABLE_JIT": "0"}
    return subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)], cwd=tree.parents[1],
                            env=known | environment, stdout=subprocess.PIPE, stderr=errors, text=True)  # fmt: skip


FORKS = Forks()


def report(tree: Path, program: str = REPORT, **environment: str) -> list[str]:
    """Return the words that a program prints; a given environment needs a new process instead of a fork."""
    if environment:
        with process(tree, program, **environment) as running:
            found, _ = running.communicate(timeout=60)
        code = running.returncode
    else:
        cache = {"XDG_CACHE_HOME": str(tree.parents[1] / "cache")}
        code, found = FORKS.run(textwrap.dedent(program), str(tree.parent), str(tree.parents[1]), cache)
    assert code == 0
    return found.split()


def edit(tree: Path, step: int, same_time: bool = False) -> None:
    """Rewrite the helper; a step of two digits changes its size, so Python notices it within the same second too."""
    helper = tree / "helper.py"
    before = helper.stat()
    helper.write_text(HELPER.format(step=step))
    if same_time:
        os.utime(helper, ns=(before.st_atime_ns, before.st_mtime_ns))
