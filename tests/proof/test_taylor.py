"""Taylor models enclose what they claim: formulas on boxes against exact rational numbers and against the house."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs

import sweep
from kernels.boxes.tape import Tape, run
from kernels.boxes.taylor import VALUE, constant, least, multiply, variable, width
from kernels.families.rssr import box_locus
from kernels.families.rssr import box_turn as bt
from sweep.synthesis.locus import locus_designs

ENDS = hs.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-6)


def enclosed(form: np.ndarray, value: float, xi: np.ndarray, error: float) -> bool:
    """Whether a form holds a value, known to ``error``, at the place xi of its box, from -1 to 1."""
    n = len(xi)
    products = [xi[k] * xi[m] for k in range(n) for m in range(k, n)]
    model = form[0] + form[1 : 1 + n] @ xi + form[1 + n : -1] @ np.array(products)
    return bool(abs(value - model) <= form[-1] + error and least(form, n) <= value + error)


@settings(max_examples=200, deadline=None)
@given(ENDS, ENDS, hs.floats(1e-9, 10.0), hs.floats(-1.0, 1.0), hs.floats(-1.0, 1.0))
def test_products_and_quotients_of_variables_lie_in_their_enclosures(x, y, size, p, q):
    tape = Tape(2)
    a, b = tape.input(0), tape.input(1)
    product, square = a * b, (a - b).square()
    sine, cosine = (a + b.times(0.5)).sine_cosine(of_half=True)
    tape.end()
    quotient = a * (square + tape.one()).inverse()
    tape.end()
    root = (square + tape.one()).root()
    tape.end()
    half, at = np.full(2, size), np.zeros((tape.forms, width(2)))
    variable(at, 0, x, half, 0)
    variable(at, 1, y, half, 1)
    recorded = tape.recorded()
    assert run(*recorded, 0, at, 2)
    xi = np.array([p, q])
    u, v = x + p * size, y + q * size
    angle = 0.5 * (u + 0.5 * v)
    found = [(product, u * v), (square, (u - v) ** 2), (sine, math.sin(angle)), (cosine, math.cos(angle))]
    # where the box is too wide for a quotient or a root, it is refused
    if run(*recorded, 1, at, 2):
        found.append((quotient, u / ((u - v) ** 2 + 1.0)))
    if run(*recorded, 2, at, 2):
        found.append((root, math.sqrt((u - v) ** 2 + 1.0)))
    # what this test rounds itself: a few operations on numbers of that size
    bound = 2.0**-50 * (abs(x) + abs(y) + 2.0 * size + 1.0) ** 2
    for number, value in found:
        assert enclosed(at[number.form], value, xi, bound)


@pytest.mark.parametrize("size", [0.3, 0.03])
def test_enclosures_tighten_with_the_third_power_of_the_width(size):
    tape = Tape(2)
    a, b = tape.input(0), tape.input(1)
    sine, _ = a.sine_cosine()
    made = [a * b * a, (a * b).inverse(), (a + b).root(), sine * b]
    tape.end()
    rests = []
    for half in (np.full(2, size), np.full(2, 0.5 * size)):
        at = np.zeros((tape.forms, width(2)))
        variable(at, 0, 1.0, half, 0)
        variable(at, 1, 1.5, half, 1)
        assert run(*tape.recorded(), 0, at, 2)
        rests.append(np.array([at[number.form, -1] for number in made]))
    # halved widths divide terms of third order by 8, all higher ones by more
    assert (rests[0] > 7.9 * rests[1]).all()


def test_inverse_and_root_refuse_where_they_have_no_enclosure():
    tape = Tape(1)
    tape.input(0).inverse()
    tape.end()
    tape.input(0).root()
    tape.end()
    half, at = np.array([1.0]), np.zeros((tape.forms, width(1)))
    variable(at, 0, 0.5, half, 0)
    assert not run(*tape.recorded(), 0, at, 1)
    assert not run(*tape.recorded(), 1, at, 1)


def test_rounding_to_nearest_alone_would_lose_the_exact_product():
    # 0.1 * 0.1 in float64 is above the exact square of the double 0.1; the enclosure reaches below it.
    from fractions import Fraction

    at = np.zeros((2, width(1)))
    constant(at, 0, 0.1, 0.1)
    multiply(at, 1, 0, 0, 1)
    exact = Fraction(0.1) ** 2
    assert Fraction(0.1 * 0.1) != exact
    rest = Fraction(float(at[1, -1]))
    assert Fraction(float(at[1, VALUE])) - rest < exact < Fraction(float(at[1, VALUE])) + rest


def test_lowest_point_inside_the_box_bounds_a_parabola():
    form = np.array([1.0, 1.0, 2.0, 0.0])  # 1 + xi + 2 xi^2
    assert 0.875 - 1e-12 < least(form, 1) <= 0.875
    assert least(np.array([1.0, 1.0, -2.0, 0.0]), 1) == pytest.approx(-2.0, abs=1e-12)


@pytest.mark.parametrize("size", [1e-5, 1e-3, 2e-2])
@pytest.mark.parametrize("by_rocker", [False, True])
def test_lengths_and_motion_of_every_design_lie_in_the_enclosures_of_its_box(by_rocker, size):
    formulas = box_locus.by_rocker() if by_rocker else box_locus.by_axes()
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
        half, xi = np.full(4, size), rng.uniform(-1.0, 1.0, 4)
        at = np.zeros((formulas.forms, width(4)))
        for j, x in enumerate(designs):
            constant(at, j, x, x)
        for k, j in enumerate(varied):
            variable(at, j, designs[j], half, k)
        constant(at, bt.BRANCH, -1.0, -1.0)
        theta = rng.uniform(0, 2 * np.pi)
        for slot, x in ((bt.COS_THETA, math.cos(theta)), (bt.SIN_THETA, math.sin(theta))):
            constant(at, slot, x - 2.0**-52, x + 2.0**-52)
        recorded = (formulas.operations, formulas.factors, formulas.ends)
        run(*recorded, bt.PLACE, at, 4)
        if not by_rocker:
            sign = math.copysign(1.0, at[formulas.slots[bt.SIGNED], VALUE])
            constant(at, formulas.slots[bt.SIGN], sign, sign)
        if not (run(*recorded, bt.LENGTHS, at, 4) and run(*recorded, bt.CLOSURE, at, 4)
                and run(*recorded, bt.MOTION, at, 4)):  # fmt: skip
            continue
        place = designs.copy()
        place[varied] += size * xi
        made = _made(_by_axes(place) if by_rocker else place)
        if made is None:
            continue
        found = sweep.evaluate("rssr", made, phi=place[2] + theta, want=["dpsi", "d2psi"])
        slots = formulas.slots
        for slot, value in ((bt.CRANK, made["a"][0]), (bt.PSI1, found.dpsi.iloc[0]), (bt.PSI2, found.d2psi.iloc[0])):
            # the synthesis' own rounding of a design, times how hard the motion leans on it
            assert enclosed(at[slots[slot]], value, xi, 1e-9 * (abs(value) + 1.0)), (slot, place)
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
