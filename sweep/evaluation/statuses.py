"""What status codes say, in words: for tables that people read, and for the report."""

from __future__ import annotations

from collections.abc import Iterable

from kernels.status import MEANING


def meaning(code: int) -> str:
    """What one status code says; a number that is none of ours says so."""
    return MEANING.get(int(code), f"status {int(code)}: unknown")


def meanings(codes: Iterable[int]) -> list[str]:
    """What each of many status codes says, in their order."""
    known: dict[int, str] = {}
    return [known.setdefault(int(code), meaning(code)) for code in codes]
