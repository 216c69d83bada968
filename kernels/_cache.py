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

What lies in such a folder is run.  A folder that belongs to somebody else, or that others may write to, is not used;
ours is closed to others.
"""

from __future__ import annotations

import errno
import hashlib
import marshal
import os
import pickle
import stat
import struct
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import platformdirs
from filelock import FileLock
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator

from kernels._compiler import PART, rebuilt_part

SOURCES = Path(__file__).resolve().parent
PACKAGE = __name__.partition(".")[0]

# What a .pyc says before the code: magic number, flags, seconds and size of the source.
PYC_HEADER = 16
# A .pyc is younger than its source if it was written so much later [ns].
YOUNGER = 2_000_000_000
# What reading a file that is not whole raises (numba does not wait for its files to reach the disk), and one that names
# what this process does not know: an argument's type of a module that only the writer had.
DAMAGED = (EOFError, ImportError, AttributeError)
HASH_BYTES = hashlib.sha256().digest_size
# What a file system answers that has no locks.
UNLOCKABLE = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)
# The folder of the cache and its parent are made by this package.
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

    It is the user's cache folder.  Where somebody else could have put something there, it is a private folder under the
    system's one for temporary files, and that is said in a line on the standard error.
    """
    usual = Path(platformdirs.user_cache_dir("linksweep")) / "kernels"
    reason = distrust(usual)
    if reason is None:
        return usual
    private = Path(tempfile.gettempdir()) / f"linksweep-{os.getuid()}" / "kernels"
    if distrust(private) is not None:
        private = Path(tempfile.mkdtemp(prefix="linksweep-")) / "kernels"
    _say(f"compiled kernels are kept in {private}, as {reason}")
    return private


def distrust(folder: Path) -> str | None:
    """Why what lies in a folder could be somebody else's, in words; None if only this user can have put it there.

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
    """Make a folder, and those above it that are missing, for this user alone."""
    for place in (*reversed(folder.parents), folder):
        if not place.is_dir():
            with suppress(FileExistsError):  # another process was faster
                place.mkdir(mode=0o700)


def _say(text: str) -> None:
    with suppress(OSError, AttributeError):  # a lost terminal
        sys.stderr.write(f"linksweep: {text}\n")


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


@cache
def _resolved(file: str) -> Path:
    return Path(file).resolve()


@cache
def _writable(folder: Path) -> bool:
    """Return whether a folder of the cache, made if need be, takes files."""
    try:
        _made(CACHE_DIR)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


class _Place(UserProvidedCacheLocator):
    """The folder of a kernel's compiled code."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)  # type: ignore[no-untyped-call]
        self._cache_path = str(CACHE_DIR / _resolved(file).relative_to(SOURCES).with_suffix(""))

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Place | None:
        """Return the folder, made if need be; None where it cannot be written."""
        place = cls(function, file)
        return place if _writable(Path(place.get_cache_path())) else None  # type: ignore[no-untyped-call]

    def get_source_stamp(self) -> str:
        """Nothing: the folder's name is made of the sources' hash already, so numba need not compare them."""
        return CACHE_DIR.name


_said: set[str] = set()


@contextmanager
def locked() -> Iterator[None]:
    """Let one process at a time write.  Where the file system has no locks nothing is kept, and one warning says so."""
    try:
        with FileLock(CACHE_DIR / "_lock", fallback_to_soft=False):
            yield
    except OSError as error:
        if error.errno in UNLOCKABLE and not _said:
            _said.add("no locks")
            _say(f"the file system of {CACHE_DIR} has no locks: every process compiles its kernels anew. "
                 "XDG_CACHE_HOME can name a folder on another one")  # fmt: skip
        raise


class _Form(CompileResultCacheImpl):
    _locator_classes = [_Place]  # noqa: RUF012 (as numba has it)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        if payload[0][1] == PART:
            return rebuilt_part(target_context, payload)
        return super().rebuild(target_context, payload)  # type: ignore[no-untyped-call]


class _Checked(IndexDataCacheFile):
    """numba's index and machine code in files that begin with a hash of the rest: a changed bit would be run."""

    def _load_index(self) -> dict[Any, str]:
        path = Path(self._index_path)
        version, stamp, overloads = pickle.loads(_checked(path)) if path.exists() else (None, None, {})
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return pickle.loads(_checked(Path(self._data_path(name))))  # type: ignore[no-untyped-call]

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)  # type: ignore[no-untyped-call]

    def _write(self, path: str, content: Any) -> None:
        data = self._dump(content)  # type: ignore[no-untyped-call]
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


def _checked(path: Path) -> bytes:
    """Return what stands behind the hash at the beginning of a file.

    Raises
    ------
    EOFError
        if it is not what was hashed.
    """
    content = path.read_bytes()
    data = content[HASH_BYTES:]
    if hashlib.sha256(data).digest() != content[:HASH_BYTES]:
        raise EOFError(f"{path} is damaged")
    return data


@cache
def _processor(codegen: Any) -> Any:
    """Return what compiled code depends on besides its source."""
    return codegen.magic_tuple()


class KernelCache(FunctionCache):
    """numba's cache of one function, in our folder."""

    _impl_class = _Form

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        base, stamp = self._impl.filename_base, self._impl.locator.get_source_stamp()
        self._cache_file = _Checked(self._cache_path, base, stamp)  # type: ignore[no-untyped-call]

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return what tells compiled code apart: signature, processor and byte code.

        numba adds a hash of what a function closes over.  Other kernels in there carry a random number, so no process
        would find the code of another.  A generated kernel says by its name what it closes over (`kernels._jit`).
        """
        code: bytes = self._py_func.__code__.co_code
        return sig, _processor(codegen), hashlib.sha256(code).hexdigest()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code of one signature, or None; of files that cannot be read nothing is kept."""
        try:
            data = self._cache_file.load(self._index_key(sig, target_context.codegen()))  # type: ignore[no-untyped-call]
            if data is None:
                return None
            target_context.refresh()  # numba's does that before it knows whether there is anything
            return self._impl.rebuild(target_context, data)
        except DAMAGED:
            with suppress(OSError), locked():
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the compiled code of one signature; one process at a time."""
        # A disk that is full takes no code; what was compiled serves this process all the same.
        with suppress(OSError, *DAMAGED), locked():
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


def kept(dispatcher: Any) -> Any:
    """Make a dispatcher that loads its machine code and keeps what it compiles, where that is safe and there is room.

    A function from outside of the package, as a bench or a study may have, is in no hash: every process compiles it.
    """
    file = dispatcher.py_func.__code__.co_filename
    ours = _resolved(file).is_relative_to(SOURCES)
    if ours and _IMPORTED.as_hashed() and _Place.from_function(dispatcher.py_func, file):
        dispatcher._cache = KernelCache(dispatcher.py_func)
    return dispatcher
