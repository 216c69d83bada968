"""The mean value form in balls of libflint, called from compiled code: what balls cost without Python in between.

The library is the one that python-flint brings.  A ball (``arb_struct``) takes 48 bytes: the exponent, size and two
words of its middle, exponent and mantissa of its radius; at 53 bits nothing of it lies elsewhere, and zeros are a zero.
"""

from __future__ import annotations

import ctypes
from ctypes.util import find_library
from pathlib import Path
from typing import Any

import flint
import numba
import numpy as np

from kernels.boxes.tape import COMBINE, CONSTANT, INVERSE, MULTIPLY, ROOT
from tests.bench.boxes import Array, Boxes, Formula, arguments
from tests.bench.slopes import down, up

BITS, BYTES, RADIUS, DOUBLE = 53, 48, 32, 3  # BYTES of a ball, its radius behind 32 of them, rounding to a double
CENTRE, WHOLE, SLOPES = 0, 1, 2  # a form: value at the centre, over the box, derivatives over the box

compiled = numba.njit(error_model="numpy", nogil=True)


def _function(name: str, *kinds: Any, gives: Any = None) -> Any:
    found = getattr(LIBRARY, name)
    found.argtypes, found.restype = kinds, gives
    return found


BUNDLED = [*(Path(flint.__file__).parents[1] / "python_flint.libs").glob("libflint*")]
LIBRARY = ctypes.CDLL(str(BUNDLED[0]) if BUNDLED else find_library("flint"))
BALL, LONG, NUMBER = ctypes.c_uint64, ctypes.c_int64, ctypes.c_double
arb_add, arb_sub, arb_mul, arb_addmul, arb_sin_cos, arb_div = (
    _function(f"arb_{x}", BALL, BALL, BALL, LONG) for x in ("add", "sub", "mul", "addmul", "sin_cos", "div")
)
arb_sqr, arb_inv, arb_sqrt, arb_mul_2exp_si = (
    _function(f"arb_{x}", BALL, BALL, LONG) for x in ("sqr", "inv", "sqrt", "mul_2exp_si")
)
arb_set, arb_neg, arb_add_error = (_function(f"arb_{x}", BALL, BALL) for x in ("set", "neg", "add_error"))
arb_set_d = _function("arb_set_d", BALL, NUMBER)
arf_get_d = _function("arf_get_d", BALL, ctypes.c_int32, gives=NUMBER)
mag_get_d = _function("mag_get_d", BALL, gives=NUMBER)


@compiled
def _set(ball: int, value: float, error: float, scratch: int) -> None:
    arb_set_d(ball, value)
    if error > 0.0:
        arb_set_d(scratch, error)
        arb_add_error(ball, scratch)


@compiled
def _combine(out: int, p: float, a: int, q: float, b: int, cells: int, scratch: int) -> None:
    for k in range(cells):
        x, y, z = a + BYTES * k, b + BYTES * k, out + BYTES * k
        if p == 1.0:
            arb_set(z, x)
        else:
            arb_set_d(scratch, p)
            arb_mul(z, x, scratch, BITS)
        if q == 1.0:
            arb_add(z, z, y, BITS)
        elif q == -1.0:
            arb_sub(z, z, y, BITS)
        elif q != 0.0:
            arb_set_d(scratch, q)
            arb_addmul(z, y, scratch, BITS)


@compiled
def _multiply(out: int, a: int, b: int, cells: int) -> None:
    for k in range(SLOPES):
        if a == b:
            arb_sqr(out + BYTES * k, a + BYTES * k, BITS)
        else:
            arb_mul(out + BYTES * k, a + BYTES * k, b + BYTES * k, BITS)
    whole_a, whole_b = a + BYTES * WHOLE, b + BYTES * WHOLE
    for k in range(SLOPES, cells):
        arb_mul(out + BYTES * k, a + BYTES * k, whole_b, BITS)
        if a == b:
            arb_mul_2exp_si(out + BYTES * k, out + BYTES * k, 1)
        else:
            arb_addmul(out + BYTES * k, whole_a, b + BYTES * k, BITS)


@compiled
def _inverse(out: int, a: int, cells: int, scratch: int) -> None:
    for k in range(SLOPES):
        arb_inv(out + BYTES * k, a + BYTES * k, BITS)
    arb_sqr(scratch, out + BYTES * WHOLE, BITS)
    arb_neg(scratch, scratch)
    for k in range(SLOPES, cells):
        arb_mul(out + BYTES * k, a + BYTES * k, scratch, BITS)


@compiled
def _root(out: int, a: int, cells: int, scratch: int) -> None:
    for k in range(SLOPES):
        arb_sqrt(out + BYTES * k, a + BYTES * k, BITS)
    arb_mul_2exp_si(scratch, out + BYTES * WHOLE, 1)
    arb_inv(scratch, scratch, BITS)
    for k in range(SLOPES, cells):
        arb_mul(out + BYTES * k, a + BYTES * k, scratch, BITS)


@compiled
def _sine_cosine(sine: int, cosine: int, a: int, factor: float, cells: int, scratch: int) -> None:
    for k in range(SLOPES):
        arb_set_d(scratch, factor)
        arb_mul(scratch, a + BYTES * k, scratch, BITS)
        arb_sin_cos(sine + BYTES * k, cosine + BYTES * k, scratch, BITS)
    for k in range(SLOPES, cells):
        arb_set_d(scratch, factor)
        arb_mul(scratch, a + BYTES * k, scratch, BITS)
        arb_mul(sine + BYTES * k, cosine + BYTES * WHOLE, scratch, BITS)
        arb_mul(cosine + BYTES * k, sine + BYTES * WHOLE, scratch, BITS)
        arb_neg(cosine + BYTES * k, cosine + BYTES * k)


@compiled
def _run(operations: Any, factors: Array, base: int, cells: int, scratch: int) -> None:
    size = BYTES * cells
    for j in range(operations.shape[0]):
        what = operations[j, 0]
        out, a, b = base + size * operations[j, 1], base + size * operations[j, 2], base + size * operations[j, 3]
        if what == COMBINE:
            _combine(out, factors[j, 0], a, factors[j, 1], b, cells, scratch)
        elif what == MULTIPLY:
            _multiply(out, a, b, cells)
        elif what == INVERSE:
            _inverse(out, a, cells, scratch)
        elif what == ROOT:
            _root(out, a, cells, scratch)
        elif what == CONSTANT:
            for k in range(cells):
                arb_set_d(out + BYTES * k, factors[j, 0] if k < SLOPES else 0.0)
        else:
            _sine_cosine(out, out + size, a, factors[j, 0], cells, scratch)


@compiled
def _ends(ball: int) -> tuple[float, float]:
    middle, radius = arf_get_d(ball, DOUBLE), mag_get_d(ball + RADIUS)
    return down(middle - radius), up(middle + radius)


@compiled
def _over(
    operations: Any, factors: Array, given: Any, values: Array, errors: Array, varied: Any, centre: Array, half: Array,
    wanted: Any, base: int, scratch: int, low: Array, high: Array,
) -> None:  # fmt: skip
    cells = SLOPES + varied.shape[0]
    size, total = BYTES * cells, scratch + BYTES
    for i in range(centre.shape[0]):
        for j in range(given.shape[0]):
            for k in range(cells):
                place = base + size * given[j] + BYTES * k
                _set(place, values[i, j] if k < SLOPES else 0.0, errors[j] if k < SLOPES else 0.0, scratch)
        for j in range(varied.shape[0]):
            place = base + size * varied[j]
            _set(place + BYTES * CENTRE, centre[i, j], 0.0, scratch)
            _set(place + BYTES * WHOLE, centre[i, j], half[i, j], scratch)
            for k in range(SLOPES, cells):
                arb_set_d(place + BYTES * k, 1.0 if k - SLOPES == j else 0.0)
        _run(operations, factors, base, cells, scratch)
        for j in range(wanted.shape[0]):
            form = base + size * wanted[j]
            arb_set(total, form)
            for k in range(varied.shape[0]):
                _set(scratch, 0.0, half[i, k], scratch + 2 * BYTES)
                arb_addmul(total, form + BYTES * (SLOPES + k), scratch, BITS)
            first, second = _ends(total), _ends(form + BYTES * WHOLE)
            low[i, j], high[i, j] = max(first[0], second[0]), min(first[1], second[1])


def first_order(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Ends of the wanted numbers over every box by the mean value form; nan where there is no enclosure."""
    low, high = (np.full((len(boxes), len(formula.wanted)), np.nan) for _ in range(2))
    words = BYTES // 8
    at, scratch = (
        np.zeros((formula.forms, SLOPES + boxes.centre.shape[1], words), np.int64),
        np.zeros((3, words), np.int64),
    )
    _over(*arguments(formula, boxes), formula.wanted, at.ctypes.data, scratch.ctypes.data, low, high)
    lost = np.isinf(low) | np.isinf(high)
    low[lost] = high[lost] = np.nan
    return low, high
