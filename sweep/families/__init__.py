"""The register of mechanism families: a new family is one kernel file, one entry file here, and its name below."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib import import_module

import sweep.sources  # noqa: F401 (read before any source that makes a value is imported, and all of those begin here)
from sweep.errors import InputError, nearest
from sweep.families.base import Family

NAMES = (
    "rssr", "rssp", "guide", "geared_dwell", "heddle", "backrest", "backrest_tension", "backrest_closure",
    "feed", "feed_triad",
)  # fmt: skip


def family(name: str | Sequence[str]) -> Family:
    """The family of that name, or the chain of the families named in a list.

    Raises
    ------
    InputError
        if a name is unknown; the message gives the nearest known one.
    """
    if isinstance(name, str):
        return _single(name)
    names = tuple(name) if isinstance(name, Sequence) else (name,)
    if not names or not all(isinstance(part, str) for part in names):
        raise InputError("family", name, f"one of {', '.join(NAMES)}, or a list of them", "family")
    if len(names) == 1:
        return _single(names[0])
    return _chain(names)


@lru_cache
def _single(name: str) -> Family:
    if name not in NAMES:
        raise InputError("family", name, f"one of {', '.join(NAMES)}{nearest(name, NAMES)}", "family")
    entry: Family = import_module(f"sweep.families.{name}").FAMILY
    return entry


@lru_cache
def _chain(names: tuple[str, ...]) -> Family:
    from sweep.families.chain import chain

    return chain(tuple(_single(name) for name in names))
