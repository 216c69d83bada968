"""Another package called kernels: noticed when sweep is imported, whichever of the two was installed last."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def imported(*path: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, "-c", "import sweep; print('imported')"]
    return subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=path[0], timeout=60, check=False
    )


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """As after pip install: sweep and kernels side by side (of sweep, what its import needs)."""
    (tmp_path / "site" / "sweep").mkdir(parents=True)
    for name in ("__init__.py", "_kernels.py", "errors.py"):
        shutil.copy(ROOT / "sweep" / name, tmp_path / "site" / "sweep" / name)
    (tmp_path / "site" / "kernels").mkdir()
    for name in ("__init__.py", "jit.py", "cache.py", "cache_folder.py"):
        shutil.copy(ROOT / "kernels" / name, tmp_path / "site" / "kernels" / name)
    return tmp_path / "site"


def test_our_own_kernels_are_taken(installed: Path) -> None:
    assert imported(installed).stdout == "imported\n", imported(installed).stderr


def test_another_package_before_ours_is_named_with_the_remedy(installed: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "kernels"
    other.mkdir(parents=True)
    (other / "__init__.py").write_text('"""Hugging kernels."""\n')
    done = imported(tmp_path / "other", installed)
    assert done.returncode == 1 and "ImportError" in done.stderr
    assert str(other / "__init__.py") in done.stderr and "pip uninstall kernels linksweep" in done.stderr


def test_another_package_over_ours_is_named_too(installed: Path) -> None:
    """pip lays its files over ours: our other files are still there."""
    (installed / "kernels" / "__init__.py").write_text("from .layer import load\n")
    done = imported(installed)
    assert done.returncode == 1 and "is another package called kernels" in done.stderr


def test_kernels_of_another_copy_are_refused(installed: Path, tmp_path: Path) -> None:
    shutil.copytree(installed / "kernels", tmp_path / "copy" / "kernels")
    done = imported(tmp_path / "copy", installed)
    assert done.returncode == 1 and "two copies of linksweep" in done.stderr


def test_a_single_file_called_kernels_is_refused(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "file").mkdir()
    (tmp_path / "file" / "kernels.py").write_text("")
    done = imported(tmp_path / "file", installed)
    assert done.returncode == 1 and "another package called kernels" in done.stderr
