"""Parameters of a test with the same code path for each: some in `make test`, all in `make test-long`."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def mostly_long(values: Iterable[Any], quick: Collection[Any]) -> list[Any]:
    """Return the values as parameters and mark all but the ``quick`` ones, which must be among them, as long."""
    known = list(values)
    assert all(one in known for one in quick), "a quick parameter that the test does not have"
    return [one if one in quick else pytest.param(one, marks=pytest.mark.long) for one in known]
