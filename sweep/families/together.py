"""Outputs that a kernel of poses computes together.

Such a kernel is compiled for every set of outputs that it gives: what is not in the set is not in the machine code.
That takes a quarter of a second per set, and a study with an optimum asks for dozens of sets, most of them on a few
thousand poses.  Here a set on few poses is taken from a larger one, and gets machine code of its own as soon as it is
asked for on many.  The larger set is that of all outputs.  Where arguments are complex, which takes longer to compile,
it is the first set that was asked for, as long as that will do: who wants slopes asks for all curves first.  The bits
are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import update_wrapper

import numpy as np

from sweep.families.base import Angles, Array, Columns, PoseFunction

MANY = 2**16  # poses of one call: dense samples, or the price of an output being measured
# Poses of all calls so far.  All outputs take up to 40 ns more per pose than a few, 60 ns more where they are complex:
# for so many, less than a set takes to compile.
PAID = 2**21

_each_its_own = ContextVar("every set of outputs has machine code of its own", default=False)


@contextmanager
def own_code() -> Iterator[None]:
    """Give every set of outputs machine code of its own at once: what a long study comes to, to be timed."""
    token = _each_its_own.set(True)
    try:
        yield
    finally:
        _each_its_own.reset(token)


class Together:
    """Poses whose kernel gives the outputs ``names``; ``poses`` calls it for exactly the wanted ones."""

    def __init__(self, poses: PoseFunction, names: Sequence[str]) -> None:
        update_wrapper(self, poses)
        self._poses = poses
        self._all = frozenset(names)
        self._asked: dict[tuple[frozenset[str], bool], int] = {}
        self._first: frozenset[str] | None = None  # set that was asked for with complex arguments

    def __reduce__(self) -> str:
        """By its name, as a function: a process that gets it has its own."""
        return self._poses.__qualname__

    def __call__(self, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        """Return the wanted outputs and the status of every design at its angles, each (n, m)."""
        key = wanted, np.iscomplexobj(angles.cos) or np.iscomplexobj(designs)
        count = len(designs) * angles.cos.shape[1]
        self._asked[key] = self._asked.get(key, 0) + count
        if count >= MANY or self._asked[key] > PAID or _each_its_own.get():
            return self._poses(designs, angles, wanted)
        found = self._poses(designs, angles, self._larger(*key))
        return {name: found[name] for name in (*wanted, "status")}

    def _larger(self, wanted: frozenset[str], is_complex: bool) -> frozenset[str]:
        """Return the set that a set on few poses is taken from."""
        if is_complex and self._first is None:
            self._first = wanted
        return self._first if is_complex and self._first is not None and wanted <= self._first else self._all


def together(*names: str) -> Callable[[PoseFunction], PoseFunction]:
    """Decorate poses whose kernel gives these outputs."""
    return lambda poses: Together(poses, names)
