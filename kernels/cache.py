"""numba's disk cache of machine code, kept in the folder of :mod:`kernels.cache_folder` and checked as it is read.

This is the one file that derives from classes of ``numba.core``.  Where a version of numba has different classes,
`kernels.jit` does without this file and kernels use numba's own cache inside that folder.
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

# Exceptions of an incomplete file (numba does not wait for its files to reach the disk), and of one that names an
# argument's type from a module which this process does not have.
DAMAGED = (EOFError, ImportError, AttributeError)
HASH_BYTES = hashlib.sha256().digest_size


class _Locator:
    """Folder of a kernel's machine code, with the methods that numba expects of a locator."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._folder = CACHE_DIR / resolved(file).relative_to(SOURCES).with_suffix("")
        self._py_file = file  # which numba names in its warning that a function cannot be kept
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Locator | None:
        """Return the locator of a function, its folder made if need be; None where the folder cannot be written."""
        place = cls(function, file)
        return place if writable(place._folder) else None

    def get_cache_path(self) -> str:
        """Path of the folder."""
        return str(self._folder)

    def ensure_cache_path(self) -> None:
        """Make the folder, which may have been emptied meanwhile."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Name of the cache folder, which is a hash of the sources already."""
        return CACHE_DIR.name

    def get_disambiguator(self) -> str:
        """Line of the function, which tells functions of one name and file apart."""
        return str(self._line)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012 (as numba has it)


class _CheckedFile(IndexDataCacheFile):
    """numba's index and machine code in files that begin with a hash of their name and of the rest.

    The machine code that is read is run, so a file with a changed bit or with the contents of another one is refused.
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
    """Hash of a file's path inside the cache and its content, so that the file is refused under another name."""
    place = path.relative_to(CACHE_DIR).as_posix()
    return hashlib.sha256(place.encode() + b"\0" + data).digest()


def _checked(path: Path) -> bytes:
    """Read the content behind the hash at the beginning of a file; EOFError if the two do not match."""
    content = path.read_bytes()
    data = content[HASH_BYTES:]
    if _hash(path, data) != content[:HASH_BYTES]:
        raise EOFError(f"{path} is damaged")
    return data


@cache
def _processor(codegen: Any) -> Any:
    """Processor and features for which machine code is made, as numba names them."""
    return codegen.magic_tuple()


class KernelCache(FunctionCache):
    """numba's cache of one function, in the folder of :mod:`kernels.cache_folder`."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        base, stamp = self._impl.filename_base, self._impl.locator.get_source_stamp()
        self._cache_file = _CheckedFile(self._cache_path, base, stamp)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Key of a function's machine code: signature, processor and byte code.

        numba adds a hash of the closure.  Kernels inside a closure carry a random number, so no process would find the
        code of another one.  A generated kernel has a name that stands for its closure (`kernels.jit`).
        """
        code: bytes = self._py_func.__code__.co_code
        return sig, _processor(codegen), hashlib.sha256(code).hexdigest()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load the machine code of one signature, or None; the index of damaged files is emptied."""
        try:
            return super().load_overload(sig, target_context)
        except DAMAGED:
            with suppress(OSError), locked():
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save the machine code of one signature; one process at a time."""
        # A full disk saves nothing; the compiled code serves this process all the same.
        with suppress(OSError, *DAMAGED), locked():
            super().save_overload(sig, data)


def keep(dispatcher: Any) -> None:
    """Let a compiled function load its machine code from the cache folder and save it there."""
    dispatcher._cache = KernelCache(dispatcher.py_func)
