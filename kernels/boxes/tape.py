"""Formulas as data: recorded once in Python, evaluated in Taylor models by one small kernel.

A :class:`Tape` records the operations of a formula on :class:`Number` objects; :func:`run` carries them out on forms
(:mod:`kernels.boxes.taylor`).  So a formula of a hundred operations reads as a formula, and only the few operations
are compiled, once, for every family.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kernels.boxes.taylor import combine, constant, inverse, multiply, root, sine_cosine
from kernels.jit import kernel
from kernels.types import Array

Operations = NDArray[np.int64]

COMBINE, MULTIPLY, INVERSE, ROOT, SINE, CONSTANT = range(6)


@dataclass(frozen=True)
class Number:
    """Number of a formula: the row of its enclosure in the array of forms."""

    tape: Tape
    form: int

    def __add__(self, other: Number) -> Number:
        return self.tape.put(COMBINE, self, other, 1.0, 1.0)

    def __sub__(self, other: Number) -> Number:
        return self.tape.put(COMBINE, self, other, 1.0, -1.0)

    def __neg__(self) -> Number:
        return self.tape.put(COMBINE, self, self, -1.0, 0.0)

    def __mul__(self, other: Number) -> Number:
        return self.tape.put(MULTIPLY, self, other)

    def times(self, factor: float) -> Number:
        """Product with a number that is exact, as 0.5 or 2."""
        return self.tape.put(COMBINE, self, self, factor, 0.0)

    def square(self) -> Number:
        """Square of the number."""
        return self.tape.put(MULTIPLY, self, self)

    def inverse(self) -> Number:
        """Return 1/x; the run ends without result where x may vanish."""
        return self.tape.put(INVERSE, self, self)

    def root(self) -> Number:
        """Positive square root; the run ends without result where x may be negative or vanish."""
        return self.tape.put(ROOT, self, self)

    def sine_cosine(self, of_half: bool = False) -> tuple[Number, Number]:
        """Sine and cosine of a coordinate, or of half of it."""
        sine = self.tape.put(SINE, self, self, 0.5 if of_half else 1.0)
        return sine, self.tape.new()


@dataclass
class Tape:
    """Record of a formula: inputs first, then operations, in parts that can be run one after the other."""

    inputs: int
    forms: int = 0
    operations: list[tuple[int, int, int, int]] = field(default_factory=list)
    factors: list[tuple[float, float]] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.forms = self.inputs

    def input(self, number: int) -> Number:
        """Return an input of the formula."""
        return Number(self, number)

    def new(self) -> Number:
        """Reserve the next free form for a number."""
        self.forms += 1
        return Number(self, self.forms - 1)

    def one(self) -> Number:
        """Return the number 1."""
        zero = self.input(0)
        return self.put(CONSTANT, zero, zero, 1.0)

    def put(self, operation: int, a: Number, b: Number, p: float = 0.0, q: float = 0.0) -> Number:
        """Record one operation and return its result."""
        out = self.new()
        self.operations.append((operation, out.form, a.form, b.form))
        self.factors.append((p, q))
        return out

    def end(self) -> int:
        """End a part of the formula; return the part's number for :func:`run`."""
        self.ends.append(len(self.operations))
        return len(self.ends) - 1

    def recorded(self) -> tuple[Operations, Array, Operations]:
        """Operations, their factors and the ends of the parts, for :func:`run`."""
        return np.array(self.operations, np.int64), np.array(self.factors), np.array([0, *self.ends], np.int64)


@kernel
def run(operations: Operations, factors: Array, ends: Operations, part: int, at: Array, n: int) -> bool:
    """Evaluate one part of a tape in the forms of a box; false where an operation has no enclosure.

    Parameters
    ----------
    operations, factors, ends : of :meth:`Tape.recorded`
    part : number that :meth:`Tape.end` gave
    at : (forms, width) in and out
    n : variables of the box
    """
    for i in range(ends[part], ends[part + 1]):
        what, out, a, b = operations[i, 0], operations[i, 1], operations[i, 2], operations[i, 3]
        enclosed = True
        if what == MULTIPLY:
            multiply(at, out, a, b, n)
        elif what == COMBINE:
            combine(at, out, factors[i, 0], a, factors[i, 1], b)
        elif what == INVERSE:
            enclosed = bool(inverse(at, out, a, n))
        elif what == ROOT:
            enclosed = bool(root(at, out, a, n))
        elif what == SINE:
            sine_cosine(at, out, out + 1, a, factors[i, 0], n)
        else:
            constant(at, out, factors[i, 0], factors[i, 0])
        if not enclosed:
            return False
    return True
