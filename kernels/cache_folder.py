"""Folder of the compiled kernels between runs, and the checks that they were made from the present sources.

numba compares only the file of the function it loads, not the files of the helpers inlined into it, so its own folders
would serve stale machine code after an edit of a helper.  Here the folder's name is a hash of all kernel sources, taken
before the first kernel is imported, and three things keep foreign code out of it:

* Sources may change while a process imports them.  Every module is compared with its hash as soon as its first
  function is decorated; from the first difference on nothing is loaded or saved, the process compiles for itself.
* Python trusts a .pyc that names the second and the size of its source.  A .pyc that is not clearly younger than its
  source is compared with it.
* Two processes that compile different signatures of one function at the same moment would take the same number for
  their files.  Saving is locked.

The place inside the folder is that of the source inside the package, so copies of the same sources share it.

The files of such a folder are run.  A folder that belongs to another user, or that others may write to, is not used;
folders made here are closed to others.
"""

from __future__ import annotations

import errno
import hashlib
import marshal
import os
import stat
import struct
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import ModuleType

import numba
import platformdirs
from filelock import FileLock

SOURCES = Path(__file__).resolve().parent
PACKAGE = __name__.partition(".")[0]

# Bytes of a .pyc before the code: magic number, flags, seconds and size of the source.
PYC_HEADER = 16
# A .pyc counts as younger than its source if it was written later by more than this [ns].
YOUNGER = 2_000_000_000
# Errors of a file system without locks.
UNLOCKABLE = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)
# Levels of folders that this package makes: the folder of the cache and its parent.
OWN_LEVELS = 2


def _digests() -> dict[str, str]:
    """Hash of every kernel source, by its path in the package."""
    return {
        path.relative_to(SOURCES).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(SOURCES.rglob("*.py"))
    }


HASHED = _digests()


def source_hash() -> str:
    """Hash of every kernel source as it was when this process began to import them, and of the numba version."""
    return hashlib.sha256(f"{numba.__version__} {sorted(HASHED.items())}".encode()).hexdigest()[:16]


def cache_root() -> Path:
    """Folder that holds the compiled kernels of every version (what ``sweep cache clear`` removes).

    It is in the user's cache folder.  Where another user could have written there, it is a private folder under the
    system's folder for temporary files, and a line on the standard error says so.
    """
    usual = Path(platformdirs.user_cache_dir("linksweep")) / "kernels"
    reason = distrust(usual)
    if reason is None:
        return usual
    private = Path(tempfile.gettempdir()) / f"linksweep-{os.getuid()}" / "kernels"
    if distrust(private) is not None:
        private = Path(tempfile.mkdtemp(prefix="linksweep-")) / "kernels"
    say(f"compiled kernels are kept in {private}, as {reason}")
    return private


def distrust(folder: Path) -> str | None:
    """Reason why another user may have written to a folder, in words; None if no other user can have.

    The folder and its parent must be this user's and nobody else may write to them; a folder further up may be the
    system's, and others may write to it if they cannot rename there what is not theirs.
    """
    if not hasattr(os, "getuid"):  # Windows: a user's folders are closed to others
        return None
    place = folder.resolve()
    for depth, above in enumerate((place, *place.parents)):
        try:
            about = above.stat()
        except OSError:
            continue  # not made yet, or out of reach: then nothing is loaded from it
        open_to_others = about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
        if about.st_uid != os.getuid() and (depth < OWN_LEVELS or about.st_uid != 0):
            return f"{above} belongs to another user"
        if open_to_others and (depth < OWN_LEVELS or not about.st_mode & stat.S_ISVTX):
            return f"others may write to {above}"
    return None


def _made(folder: Path) -> None:
    """Make a folder and its missing parents, for this user alone."""
    for place in (*reversed(folder.parents), folder):
        if not place.is_dir():
            with suppress(FileExistsError):  # another process was faster
                place.mkdir(mode=0o700)


@cache
def say(text: str) -> None:
    """Write a line to the standard error, the same line once only."""
    with suppress(OSError, AttributeError):  # a lost terminal
        sys.stderr.write(f"linksweep: {text}\n")


CACHE_DIR = cache_root() / source_hash()


class _Imported:
    """Modules of this package that were imported so far, compared with their hashes."""

    def __init__(self) -> None:
        self.known: set[str] = set()
        self.seen: tuple[int, str] = (0, "")
        self.unchanged = True

    def as_hashed(self) -> bool:
        """Whether every module imported so far matches its hash."""
        now = len(sys.modules), next(reversed(sys.modules))
        if now == self.seen:  # nothing was imported since; each of several hundred functions asks
            return self.unchanged
        self.seen, prefix = now, f"{PACKAGE}."
        for name in [name for name in sys.modules if name.startswith(prefix) and name not in self.known]:
            self.known.add(name)
            self.unchanged = self.unchanged and _is_as_hashed(sys.modules[name])
        return self.unchanged


_IMPORTED = _Imported()


def _is_as_hashed(module: ModuleType) -> bool:
    path = Path(str(module.__file__)).resolve()
    text = path.read_bytes()
    if hashlib.sha256(text).hexdigest() != HASHED.get(path.relative_to(SOURCES).as_posix()):
        return False
    compiled = Path((module.__spec__ and module.__spec__.cached) or "")
    if not compiled.is_file() or compiled.stat().st_ctime_ns - path.stat().st_ctime_ns > YOUNGER:
        return True
    header, code = compiled.read_bytes()[:PYC_HEADER], compiled.read_bytes()[PYC_HEADER:]
    if header[8:] != struct.pack("<II", int(path.stat().st_mtime) & 0xFFFFFFFF, len(text) & 0xFFFFFFFF):
        return True  # of an older source: Python did not take it
    return bool(marshal.loads(code) == compile(text, str(module.__file__), "exec", dont_inherit=True))


@cache
def resolved(file: str) -> Path:
    """Resolve the path of a source; the result is cached."""
    return Path(file).resolve()


@cache
def writable(folder: Path) -> bool:
    """Whether files can be written to a folder of the cache, which is made if need be."""
    try:
        _made(CACHE_DIR)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@contextmanager
def locked() -> Iterator[None]:
    """Let one process at a time write.  Where the file system has no locks nothing is kept, and one warning says so."""
    try:
        with FileLock(CACHE_DIR / "_lock", fallback_to_soft=False):
            yield
    except OSError as error:
        if error.errno in UNLOCKABLE:
            say(f"the file system of {CACHE_DIR} has no locks: every process compiles its kernels anew. "
                 "XDG_CACHE_HOME can name a folder on another one")  # fmt: skip
        raise


def may_keep(file: str) -> bool:
    """Whether machine code of a file may be loaded and saved: only of sources of this package that match their hash."""
    return resolved(file).is_relative_to(SOURCES) and _IMPORTED.as_hashed()
