"""numba's disk cache of machine code, kept in the folder of :mod:`kernels.cache_folder` and checked as it is read.

This is the one file that derives from classes of ``numba.core``.  Where a version of numba has others, `kernels.jit`
leaves it aside and kernels use numba's own cache inside that folder.
"""

# mypy: disable-error-code="no-untyped-call"
# numba names no types.

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile

from kernels.cache_folder import CACHE_DIR, SOURCES, locked, resolved, writable

# What reading a file that is not whole raises (numba does not wait for its files to reach the disk), and one that names
# what this process does not know: an argument's type of a module that only the writer had.
DAMAGED = (EOFError, ImportError, AttributeError)
HASH_BYTES = hashlib.sha256().digest_size


class _Locator:
    """The folder of a kernel's machine code, with the methods that numba asks of such an object."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._folder = CACHE_DIR / resolved(file).relative_to(SOURCES).with_suffix("")
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Locator | None:
        """Make the folder if need be; None where it cannot be written."""
        place = cls(function, file)
        return place if writable(place._folder) else None

    def get_cache_path(self) -> str:
        """Name the folder."""
        return str(self._folder)

    def ensure_cache_path(self) -> None:
        """Make the folder, which may have been emptied meanwhile."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Give numba nothing to compare: the folder's name is a hash of the sources already."""
        return CACHE_DIR.name

    def get_disambiguator(self) -> str:
        """Tell functions of one name and file apart."""
        return str(self._line)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012 (as numba has it)


class _CheckedFile(IndexDataCacheFile):
    """numba's index and machine code in files that begin with a hash of their name and of the rest.

    What is read is run, so a changed bit and a file with the contents of another one must not be.
    """

    def _load_index(self) -> dict[Any, str]:
        path = Path(self._index_path)
        version, stamp, overloads = pickle.loads(_checked(path)) if path.exists() else (None, None, {})
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return pickle.loads(_checked(Path(self._data_path(name))))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, content: Any) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(_hash(Path(path), data) + data)


def _hash(path: Path, data: bytes) -> bytes:
    """Hash a file's place inside the cache with its content, so that it is worth nothing under another name."""
    place = path.relative_to(CACHE_DIR).as_posix()
    return hashlib.sha256(place.encode() + b"\0" + data).digest()


def _checked(path: Path) -> bytes:
    """Read what stands behind the hash at the beginning of a file; EOFError if it is not what was hashed."""
    content = path.read_bytes()
    data = content[HASH_BYTES:]
    if _hash(path, data) != content[:HASH_BYTES]:
        raise EOFError(f"{path} is damaged")
    return data


@cache
def _processor(codegen: Any) -> Any:
    """Name what machine code depends on besides its source."""
    return codegen.magic_tuple()


class KernelCache(FunctionCache):
    """numba's cache of one function, in our folder."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        base, stamp = self._impl.filename_base, self._impl.locator.get_source_stamp()
        self._cache_file = _CheckedFile(self._cache_path, base, stamp)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Tell machine code apart by signature, processor and byte code.

        numba adds a hash of what a function closes over.  Other kernels in there carry a random number, so no process
        would find the code of another.  A generated kernel says by its name what it closes over (`kernels.jit`).
        """
        code: bytes = self._py_func.__code__.co_code
        return sig, _processor(codegen), hashlib.sha256(code).hexdigest()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load the machine code of one signature, or None; files that cannot be read are emptied."""
        try:
            return super().load_overload(sig, target_context)
        except DAMAGED:
            with suppress(OSError), locked():
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the machine code of one signature; one process at a time."""
        # A disk that is full takes no code; what was compiled serves this process all the same.
        with suppress(OSError, *DAMAGED), locked():
            super().save_overload(sig, data)


def keep(dispatcher: Any) -> None:
    """Let a compiled function load its machine code from our folder and keep it there."""
    dispatcher._cache = KernelCache(dispatcher.py_func)
