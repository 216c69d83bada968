"""What follows from a family alone is found once and kept beside it: a call for few designs is mostly such matters."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from sweep.families.base import Family

Found = TypeVar("Found")


def of_family(function: Callable[[Family], Found]) -> Callable[[Family], Found]:
    """Let a function of a family, which never changes, find its result once.

    The result is shared by all who ask for it, so it must not be changed.
    """

    @wraps(function)
    def found(family: Family) -> Found:
        if function not in family.derived:
            family.derived[function] = function(family)
        result: Found = family.derived[function]
        return result

    return found
