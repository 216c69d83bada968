"""Slope arithmetic encloses what it claims: formulas on boxes against exact rational numbers and against the house."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs

import sweep
from kernels.families.rssr import box_by_axes, box_by_rocker
from kernels.families.rssr import box_turn as bt
from kernels.proof.slopes import CENTRE, RANGE, SLOPES, constant, multiply, variable
from kernels.proof.tape import Tape, run
from sweep.synthesis import locus_designs

ENDS = hs.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-6)


def enclosed(form: np.ndarray, value: float, shift: np.ndarray, error: float) -> bool:
    """Whether range and centred form of one row hold a value, known to ``error``."""
    low, high = form[SLOPES::2] * shift, form[SLOPES + 1 :: 2] * shift
    least, most = form[CENTRE] + np.minimum(low, high).sum(), form[CENTRE + 1] + np.maximum(low, high).sum()
    return bool(form[RANGE] - error <= value <= form[RANGE + 1] + error and least - error <= value <= most + error)


@settings(max_examples=200, deadline=None)
@given(ENDS, ENDS, hs.floats(1e-9, 10.0), hs.floats(-1.0, 1.0), hs.floats(-1.0, 1.0))
def test_products_and_quotients_of_variables_lie_in_their_enclosures(x, y, width, p, q):
    tape = Tape(2)
    a, b = tape.input(0), tape.input(1)
    product, square = a * b, (a - b).square()
    tape.end()
    quotient = a * (square + tape.one()).inverse()
    root = (square + tape.one()).root()
    tape.end()
    half, at = np.full(2, width), np.zeros((tape.forms, SLOPES + 4))
    variable(at, 0, x, half, 0)
    variable(at, 1, y, half, 1)
    recorded = tape.recorded()
    assert run(*recorded, 0, at, half) and run(*recorded, 1, at, half)
    shift = np.array([p, q]) * width
    u, v = x + shift[0], y + shift[1]
    size = (abs(u) + abs(v) + 1.0) ** 2
    # what this test rounds itself: a few operations on numbers of that size
    for number, value in ((product, u * v), (square, (u - v) ** 2), (quotient, u / ((u - v) ** 2 + 1.0)),
                          (root, math.sqrt((u - v) ** 2 + 1.0))):  # fmt: skip
        assert enclosed(at[number.form], value, shift, 2.0**-50 * size)


def test_inverse_and_root_refuse_where_they_have_no_enclosure():
    tape = Tape(1)
    tape.input(0).inverse()
    tape.end()
    tape.input(0).root()
    tape.end()
    half, at = np.array([1.0]), np.zeros((tape.forms, SLOPES + 2))
    variable(at, 0, 0.5, half, 0)
    assert not run(*tape.recorded(), 0, at, half)
    assert not run(*tape.recorded(), 1, at, half)


def test_rounding_to_nearest_alone_would_lose_the_exact_product():
    # 0.1 * 0.1 in float64 is above the exact square of the double 0.1; the enclosure reaches below it.
    from fractions import Fraction

    at = np.zeros((2, SLOPES + 2))
    constant(at, 0, 0.1, 0.1)
    multiply(at, 1, 0, 0, np.array([0.0]))
    exact = Fraction(0.1) ** 2
    assert Fraction(0.1 * 0.1) != exact
    assert Fraction(float(at[1, CENTRE])) < exact < Fraction(float(at[1, CENTRE + 1]))


@pytest.mark.parametrize("width", [1e-5, 1e-3, 2e-2])
@pytest.mark.parametrize("by_rocker", [False, True])
def test_lengths_and_motion_of_every_design_lie_in_the_enclosures_of_its_box(by_rocker, width):
    formulas = (box_by_rocker if by_rocker else box_by_axes).recorded()
    rng = np.random.default_rng(3)
    checked = 0
    for _ in range(150):
        place = (rng.uniform(0.3, 1.5), rng.uniform(2.7, 3.0), rng.uniform(0, 6.28), 1.0, *rng.uniform(-2, 2, 2))
        designs, varied = np.array([*place, rng.uniform(0.3, 1.5)]), np.array([2, 4, 5, 6])
        if by_rocker:
            made = _made(designs)
            if made is None:
                continue
            psi = sweep.summarise("rssr", made, want=["psi_ext"]).psi_ext.iloc[0]
            designs = np.array([*designs[:3], psi, made["c"][0], designs[4], designs[6]])
            varied = np.array([2, 3, 5, 6])
        half, shift = np.full(4, width), rng.uniform(-width, width, 4)
        at = np.zeros((formulas.forms, SLOPES + 8))
        for j, x in enumerate(designs):
            constant(at, j, x, x)
        for k, j in enumerate(varied):
            variable(at, j, designs[j], half, k)
        constant(at, bt.BRANCH, -1.0, -1.0)
        theta = rng.uniform(0, 2 * np.pi)
        for slot, x in ((bt.COS_THETA, math.cos(theta)), (bt.SIN_THETA, math.sin(theta))):
            constant(at, slot, x - 2.0**-52, x + 2.0**-52)
        recorded = (formulas.operations, formulas.factors, formulas.ends)
        run(*recorded, bt.PLACE, at, half)
        if not by_rocker:
            sign = math.copysign(1.0, at[formulas.slots[bt.SIGNED], CENTRE])
            constant(at, formulas.slots[bt.SIGN], sign, sign)
        if not (run(*recorded, bt.LENGTHS, at, half) and run(*recorded, bt.CLOSURE, at, half)
                and run(*recorded, bt.MOTION, at, half)):  # fmt: skip
            continue
        place = designs.copy()
        place[varied] += shift
        made = _made(_by_axes(place) if by_rocker else place)
        if made is None:
            continue
        found = sweep.evaluate("rssr", made, phi=place[2] + theta, want=["dpsi", "d2psi"])
        slots = formulas.slots
        for slot, value in ((bt.CRANK, made["a"][0]), (bt.PSI1, found.dpsi.iloc[0]), (bt.PSI2, found.d2psi.iloc[0])):
            # the synthesis' own rounding of a design, times how hard the motion leans on it
            assert enclosed(at[slots[slot]], value, shift, 1e-9 * (abs(value) + 1.0)), (slot, place)
        checked += 1
    assert checked >= 5


def _by_axes(place):
    """Swing, phi0, phi_ext, e, f, g, alpha of a place given by the rocker.

    e and h = g sin(alpha) follow from the two conditions that the ball lies in the plane of crank axis and crank.
    """
    swing, phi0, phi1, psi, c, f, alpha = place
    matrix = np.array([[math.sin(phi1), math.cos(phi1)], [math.sin(phi1 + phi0), math.cos(phi1 + phi0)]])
    right = [
        math.cos(p) * math.cos(alpha) * c * math.sin(s) - math.sin(p) * c * math.cos(s)
        for p, s in ((phi1, psi), (phi1 + phi0, psi + swing))
    ]
    e, h = np.linalg.solve(matrix, right)
    return np.array([swing, phi0, phi1, e, f, h / math.sin(alpha), alpha])


def _made(place):
    """Columns of the design at a place on the locus; None where there is none."""
    names = ("swing", "phi0", "phi1", "e", "f", "g", "alpha")
    made, status = locus_designs("rssr", {name: np.array([x]) for name, x in zip(names, place, strict=True)})
    return made if status[0] == 0 else None
