"""What lies in a cache folder is run: one that others may write to, or that belongs to somebody else, is not used."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.kernel_tree import REPORT, process, report
from tests.support.selection import mostly_long

PAYLOAD = """
import hashlib, pathlib, pickle, sys

class Planted:
    def __reduce__(self):
        return exec, ("import pathlib; pathlib.Path({mark!r}).touch()",)

(root,) = (pathlib.Path({cache!r}) / "linksweep" / "kernels").iterdir()
for path in root.rglob("*.nb[ic]"):
    data = pickle.dumps(Planted())
    path.write_bytes(hashlib.sha256(path.relative_to(root).as_posix().encode() + bytes(1) + data).digest() + data)
"""


def planted(tree: Path) -> tuple[Path, Path]:
    """A cache whose files do something when they are loaded; the folder, and what they leave behind."""
    report(tree)
    cache, mark = tree.parents[1] / "cache", tree.parents[1] / "ran"
    subprocess.run([sys.executable, "-c", PAYLOAD.format(mark=str(mark), cache=str(cache))], check=True)
    return cache / "linksweep" / "kernels", mark


def test_cache_folders_are_closed_to_others(tree: Path) -> None:
    report(tree, REPORT)
    root = tree.parents[1] / "cache" / "linksweep" / "kernels"
    (version,) = root.iterdir()
    assert all(folder.stat().st_mode & 0o777 == 0o700 for folder in (version, root, root.parent, root.parent.parent))


def test_what_lies_in_a_cache_is_run(tree: Path) -> None:
    """The reason for the tests below: a planted file in a folder that is trusted does what it likes."""
    _, mark = planted(tree)
    with process(tree, REPORT, PYTHONWARNINGS="ignore") as running:
        running.communicate(timeout=60)
    assert mark.exists()


@pytest.mark.parametrize("level", mostly_long(["kernels", "linksweep", "cache"], ["cache"]))
def test_a_cache_that_others_may_write_to_is_not_used(tree: Path, tmp_path: Path, level: str) -> None:
    root, mark = planted(tree)
    {"kernels": root, "linksweep": root.parent, "cache": root.parent.parent}[level].chmod(0o777)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    for hits in ("0", "1"):  # the private one in its place is kept and found again
        with process(tree, REPORT, TMPDIR=str(temporary), errors=subprocess.PIPE) as running:
            found, said = running.communicate(timeout=60)
        assert running.returncode == 0 and found.split() == ["2.0", hits, "KernelCache"]
        assert not mark.exists(), "planted code ran"
        (line,) = said.splitlines()
        assert "others may write to" in line and str(temporary) in line
    (private,) = temporary.iterdir()
    assert private.stat().st_mode & 0o777 == 0o700


def test_a_cache_of_another_user_is_not_used(tree: Path, tmp_path: Path) -> None:
    """To whom the folder belongs cannot be changed by everybody who runs the tests, but who asks can."""
    _, mark = planted(tree)
    program = f"""
    import os
    uid = os.getuid()
    os.getuid = lambda: uid + 12345
    {REPORT}
    """
    with process(tree, program, TMPDIR=str(tmp_path), errors=subprocess.PIPE) as running:
        found, said = running.communicate(timeout=60)
    assert found.split() == ["2.0", "0", "KernelCache"] and not mark.exists()
    assert "belongs to another user" in said


def test_a_private_folder_that_somebody_took_is_not_used_either(tree: Path, tmp_path: Path) -> None:
    root, _ = planted(tree)
    root.chmod(0o777)
    taken = tmp_path / f"linksweep-{os.getuid()}"
    taken.mkdir()
    taken.chmod(0o777)
    with process(tree, REPORT, TMPDIR=str(tmp_path), errors=subprocess.PIPE) as running:
        found, said = running.communicate(timeout=60)
    assert found.split() == ["2.0", "0", "KernelCache"] and not list(taken.iterdir()), said
