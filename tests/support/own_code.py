"""Poses whose every set of outputs has machine code of its own at once: what a long study comes to."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from sweep.families import poses


@contextmanager
def own_code() -> Iterator[None]:
    """Take every call for one of many poses."""
    with patch.object(poses, "MANY", 0):
        yield
