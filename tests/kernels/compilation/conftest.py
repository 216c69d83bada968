"""Kernels with a cache folder of their own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.kernel_tree import FORKS, HELPER, KERNEL, SOURCES


@pytest.fixture(scope="module")
def forks() -> Iterator[None]:
    """Begin what forks itself for each program."""
    with FORKS:
        yield


@pytest.fixture
def tree(tmp_path: Path, forks: None) -> Path:
    """A package of two kernels around the house's decorators, with a cache folder of its own."""
    package = tmp_path / "tree" / "kernels"
    package.mkdir(parents=True)
    for path in (SOURCES / "__init__.py", *(SOURCES / name for name in ("jit.py", "cache.py", "cache_folder.py"))):
        (package / path.name).write_text(path.read_text())
    (package / "loop.py").write_text(KERNEL)
    (package / "helper.py").write_text(HELPER.format(step=1))
    return package
