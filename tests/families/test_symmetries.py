"""Mechanisms that are the same but for what they are called: another unit of length, a mirror image, an idle stage.

No formula of the sheets is used.  Values may differ by their errors and by what rounding of the inputs does.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs, output, output_names
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, March
from sweep.families.names import error_of
from tests.search.subjects import CHAINS, all_at_once, random_designs, subjects
from tests.support.selection import mostly_long

SUBJECTS = subjects()
# Back-rests have forces; a thread over a bare cam searches hundreds of roots for each design.
LEFT_OUT = ("backrest", "backrest_tension", "backrest_closure", "free_cam")
ASKED = [*(n for n in NAMES if n not in LEFT_OUT and not isinstance(family(n).domain, March)), *CHAINS]
QUICK = ("rssr",)
TWO_PI = 2.0 * np.pi
TARGET = 1e-8
ROUNDING = 1e-10  # of a value: roundings of the inputs times the sensitivities of ordinary and wide designs
BEYOND = 2.0  # times the sum of two estimates of errors


def asked(full, designs, names):
    return design_outputs(full, designs, names, Accuracy(target=TARGET))


def assert_equal(one, other, name, factor=1.0, angle=False, read=None):
    """Assert that a design output of one table is ``factor`` times that of another, read from ``read`` there."""
    values, errors = ([np.asarray(x, np.float64) for x in (t[n], t[error_of(n)])] for t, n in
                      ((other, read or name), (one, name)))  # fmt: skip
    (expected, off), (found, own) = values, errors
    difference = np.abs(found - factor * expected)
    if angle:
        difference = np.abs(difference - TWO_PI * np.rint(difference / TWO_PI))
    allowed = BEYOND * (own + abs(factor) * off) + ROUNDING * np.maximum(np.abs(found), 1.0 if angle else 0.0)
    np.testing.assert_array_less(difference, allowed + np.finfo(float).tiny, err_msg=name)


@pytest.mark.parametrize("name", mostly_long(ASKED, QUICK))
def test_every_design_output_in_another_unit_of_length_has_its_dimension(name):
    subject = SUBJECTS[name]()
    full = all_at_once(subject.family)
    names = [n for n in output_names(full) if n not in full.parameter_names and "window_angle" not in n]
    dimension = {n: _power(output(full, n).unit) for n in names}
    designs = np.concatenate([random_designs(subject, kind, 2, 11) for kind in ("ordinary", "wide", "tiny")])
    here = asked(full, designs, names)
    for scale in (1e-3, 7e3):
        there = asked(full, designs * [scale ** _power(p.unit) for p in full.parameters], names)
        np.testing.assert_array_equal(there["status"], here["status"])
        for n in names:
            assert_equal(there, here, n, scale ** dimension[n], "phi" in n or output(full, n).unit == "rad")


def _power(unit: str) -> int:
    """Power of a length in a unit of motion: nothing but lengths, angles and numbers."""
    found = re.findall(r"(^|[*/])length(?:\^(\d))?", unit)
    return sum((-1 if sign == "/" else 1) * int(power or 1) for sign, power in found)


# Parameters that change their sign in the mirror image, and sign of the follower's position in it.
MIRRORS = {
    "rssr": ({"alpha", "branch"}, -1.0),
    "rssp": ({"alpha", "branch"}, -1.0),
    "guide": ({"eta", "lam", "h", "branch"}, 1.0),
    "four_bar": ({"eta", "branch"}, -1.0),
    "five_link": ({"alpha", "s2", "branch"}, -1.0),
}


@pytest.mark.parametrize("name", mostly_long(MIRRORS, QUICK))
def test_a_mirror_image_that_turns_backwards_has_its_extremes_at_the_opposite_angles(name):
    subject, (flipped, side) = SUBJECTS[name](), MIRRORS[name]
    full = all_at_once(subject.family)
    designs = np.concatenate([random_designs(subject, kind, 3, 21) for kind in ("ordinary", "wide")])
    curves = full.derivatives(full.position)[1:]
    reductions = [f"{r}_{o}" for o in curves for r in ("max_abs", "max", "min", "rms", "phi_max", "phi_min")]
    same = ["margin", "max_pressure_angle", "size", "stroke" if "stroke" in output_names(full) else "range_psi"]
    names = [*reductions, *same, "phi_ext", "phi_fold", "phi0"]
    here = asked(full, designs, names)
    there = asked(full, designs * [-1.0 if p in flipped else 1.0 for p in full.parameter_names], names)
    assert (here["status"] == st.OK).all() and (there["status"] == st.OK).all()
    for n in same:
        assert_equal(there, here, n)
    for order, o in enumerate(curves, start=1):
        sign = side * (-1.0) ** order
        ends = ("max", "min") if sign > 0.0 else ("min", "max")
        for n in ("max_abs", "rms"):
            assert_equal(there, here, f"{n}_{o}")
        for n, opposite in zip(("max", "min"), ends, strict=True):
            assert_equal(there, here, f"{n}_{o}", sign, read=f"{opposite}_{o}")
            assert_equal(there, here, f"phi_{n}_{o}", -1.0, angle=True, read=f"phi_{opposite}_{o}")
    # The extended position is the largest one of branch +1: where s keeps its sign, the mirror image calls it folded.
    names = ("phi_ext", "phi_fold") if side < 0.0 else ("phi_fold", "phi_ext")
    for n, other in zip(("phi_ext", "phi_fold"), names, strict=True):
        assert_equal(there, here, n, -1.0, angle=True, read=other)
    assert_equal(there, here, "phi0", side, angle=True)


@pytest.mark.parametrize("name", mostly_long(["guide", "rssp", "slotted"], ("guide",)))
def test_behind_a_stage_that_turns_with_its_crank_everything_is_as_without_it(name):
    """The rocker of an inverted slider-crank without a frame turns with the crank: psi = phi."""
    subject, first = SUBJECTS[name](), {"a1": 2.0, "e1": 0.0, "h1": 0.0, "branch1": 1.0}
    own = subject.family
    (follower,) = own.positions
    curves = own.derivatives(follower)[1:]
    names = [*(f"{r}_{o}" for o in curves for r in ("max_abs", "rms", "phi_max")), "margin", "phi_ext", "phi0"]
    designs = np.concatenate([random_designs(subject, kind, 3, 12) for kind in ("ordinary", "wide")])
    table = dict(zip(own.parameter_names, designs.T, strict=True))
    alone = sweep.summarise(name, table, names, accuracy=TARGET)
    behind = {f"{n}2": values for n, values in table.items()} | {"kappa2": 1.0, "offset2": 0.0}
    chain = sweep.summarise(["inverted_slider_crank", name], first | behind, names, accuracy=TARGET)
    assert (alone["status"] == st.OK).all() and (chain["status"] == st.OK).all()
    for n in names:
        assert_equal(chain, alone, n, angle=n.startswith("phi"))
