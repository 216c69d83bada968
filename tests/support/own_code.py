"""Separate machine code for every set of pose outputs, as a long study compiles it."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from sweep.families import poses


@contextmanager
def own_code() -> Iterator[None]:
    """Compile every set of outputs separately, as for many poses."""
    with patch.object(poses, "MANY", 0):
        yield
