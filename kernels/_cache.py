"""Where compiled kernels are kept between runs, and what makes sure that they are those of the sources at hand.

numba compares only the file of the function it loads, not the files of the helpers inlined into it, so its own folders
would serve stale machine code after an edit of a helper.  Here the folder's name is a hash of all kernel sources, taken
before the first kernel is imported, and three things keep foreign code out of it:

* Sources may change while a process imports them.  Every module is compared with what was hashed as soon as its first
  function is decorated; from the first difference on nothing is loaded or kept, the process compiles for itself.
* Python trusts a .pyc that names the second and the size of its source.  A .pyc that is not clearly younger than its
  source is compared with it.
* Two processes that compile different signatures of one function at the same moment would take the same number for
  their files.  Saving is locked.

The place inside the folder is that of the source inside the package, so copies of the same sources share it.
"""

from __future__ import annotations

import hashlib
import marshal
import pickle
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import platformdirs
from filelock import FileLock
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator

SOURCES = Path(__file__).resolve().parent
PACKAGE = __name__.partition(".")[0]

# What a .pyc says before the code: magic number, flags, seconds and size of the source.
PYC_HEADER = 16
# A .pyc is younger than its source if it was written so much later [ns].
YOUNGER = 2_000_000_000
# What reading a file that is empty or ends too soon raises; numba does not wait for its files to reach the disk.
DAMAGED = (EOFError, pickle.UnpicklingError)


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
    """Folder that holds the compiled kernels of every version (what ``sweep cache clear`` removes)."""
    return Path(platformdirs.user_cache_dir("linksweep")) / "kernels"


CACHE_DIR = cache_root() / source_hash()


class _Imported:
    """The modules of this package that were imported so far, compared with what was hashed."""

    def __init__(self) -> None:
        self.known: set[str] = set()
        self.unchanged = True

    def as_hashed(self) -> bool:
        """Whether every module imported so far is the one that was hashed."""
        prefix = f"{PACKAGE}."
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


class _Place(UserProvidedCacheLocator):
    """The folder of a kernel's compiled code."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)  # type: ignore[no-untyped-call]
        self._cache_path = str(CACHE_DIR / Path(file).resolve().relative_to(SOURCES).with_suffix(""))

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Place | None:
        """The folder, made if need be; None where it cannot be written."""
        place = cls(function, file)
        try:
            place.ensure_cache_path()  # type: ignore[no-untyped-call]
        except OSError:
            return None
        return place

    def get_source_stamp(self) -> str:
        """What the code is of; the folder's name says it already."""
        return CACHE_DIR.name


class _Form(CompileResultCacheImpl):
    _locator_classes = [_Place]  # noqa: RUF012 (as numba has it)


class KernelCache(FunctionCache):
    """numba's cache of one function, in our folder."""

    _impl_class = _Form

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled code of one signature, or None; of files that a power cut left short nothing is kept."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except DAMAGED:
            with suppress(OSError), FileLock(CACHE_DIR / "_lock"):
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the compiled code of one signature; one process at a time."""
        # A disk that is full takes no code; what was compiled serves this process all the same.
        with suppress(OSError, *DAMAGED), FileLock(CACHE_DIR / "_lock"):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


def kept(dispatcher: Any) -> Any:
    """A dispatcher that loads its machine code and keeps what it compiles, where that is safe and there is room.

    A function from outside of the package, as a bench or a study may have, is in no hash: every process compiles it.
    """
    file = dispatcher.py_func.__code__.co_filename
    ours = Path(file).resolve().is_relative_to(SOURCES)
    if ours and _IMPORTED.as_hashed() and _Place.from_function(dispatcher.py_func, file):
        dispatcher._cache = KernelCache(dispatcher.py_func)  # type: ignore[no-untyped-call]
    return dispatcher
