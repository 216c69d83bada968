"""Every family and chains of them: edge inputs get a status, and a question asked differently the same bits.

The crank-rocker has tests of its own (test_hard_inputs.py, rssr/test_metamorphic.py); here is what no family may fail.
All goes to the families' own functions, below the checks of tables.
"""

from __future__ import annotations

import itertools
import math
import time

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, Angles, Turn
from sweep.families.capabilities import Assembly
from sweep.families.chain import Chain
from tests.support.selection import mostly_long

SECOND = {"a": 1.9, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "lam": 1.1, "h": -0.6, "branch": 1.0}
# Over a closed turn; families over an interval or a march: test_hard_domains.py.
CASES = {name: (name, (family(name).example,)) for name in NAMES if isinstance(family(name).domain, Turn)}
BAR = {"a": 1.0, "e": 4.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "s": 0.5, "k": 3.4, "tau": -1.0, "branch": -1.0}
CASES["slotted, bar"] = ("slotted", (BAR,))
CASES["rssr, guide"] = (["rssr", "guide"], (family("rssr").example, SECOND))
CASES["rssr, rssp"] = (["rssr", "rssp"], (family("rssr").example, family("rssp").example))
# Those with lengths; others have ratios or values in fixed units.
LINKED = [name for name, (names, _) in CASES.items() if any(p.unit == "length" for p in family(names).parameters)]
PHI = np.linspace(0.0, 2.0 * math.pi, 19)[None, :]
FINE = Accuracy(target=1e-6)
DEAR = {"free_cam": 40}  # designs of families whose poses are sought by iteration
SECONDS = 60.0  # far more than any of these takes, far less than a hang


def built(name):
    """The family, and one ordinary design of it (P,) in the order of its parameters."""
    names, stages = CASES[name]
    mechanism = family(names)
    values = {}
    for k, stage in enumerate(stages, start=1):
        values |= {f"{p}{k}" if isinstance(mechanism, Chain) else p: v for p, v in stage.items()}
    design = np.array([values.get(p.name, p.default if p.default is not None else 0.0) for p in mechanism.parameters])
    return mechanism, design


def ladder(mechanism):
    """The position and its derivatives, lowest first."""
    names = [mechanism.position]
    while names[-1] in mechanism.derivative_of:
        names.append(mechanism.derivative_of[names[-1]])
    return names


def wanted(mechanism):
    return [*ladder(mechanism), *(n for n in ("dev", "pressure_angle", "discriminant") if n in mechanism.pose_names)]


def poses(mechanism, designs, phi=PHI):
    return mechanism.poses(np.atleast_2d(designs), Angles.of(phi), frozenset(wanted(mechanism)))


def of_turn(mechanism):
    highest = ladder(mechanism)[:3][-1]
    return [f"max_abs_{highest}"] + (["margin"] if mechanism.find(Assembly) else [])


def summary(mechanism, designs, accuracy=FINE):
    return design_outputs(mechanism, np.atleast_2d(designs), of_turn(mechanism), accuracy)


def explained(columns, names):
    """Whether every nan stands beside a status that is not OK."""
    bad = np.zeros(columns["status"].shape, bool)
    for name in names:
        bad |= np.isnan(np.asarray(columns[name], float))
    return bool((columns["status"][bad] != st.OK).all())


@pytest.mark.parametrize("name", CASES)
def test_the_ordinary_design_has_an_answer(name):
    mechanism, design = built(name)
    assert (poses(mechanism, design)["status"] == st.OK).all()
    assert summary(mechanism, design)["status"][0] == st.OK


PLACES = ("shift", "turn")  # where a stage of a chain stands in the machine: its motion does not depend on it


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", CASES)
def test_a_parameter_that_is_no_number_gives_no_number(name, value):
    mechanism, design = built(name)
    changed = np.tile(design, (design.size, 1))
    np.fill_diagonal(changed, value)
    columns, found = poses(mechanism, changed), summary(mechanism, changed)
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.name.startswith(PLACES):
            continue
        position = np.asarray(columns[mechanism.position][k], float)
        assert (columns["status"][k] == st.INVALID_INPUT).all(), parameter.name
        assert np.isnan(position).all(), parameter.name
        assert found["status"][k] != st.OK and np.isnan(found[of_turn(mechanism)[0]][k]), parameter.name


@pytest.mark.parametrize("value", [0.0, -0.0, -1.0, 5e-324])
@pytest.mark.parametrize("name", LINKED)
def test_a_link_of_no_length_gives_no_answer(name, value):
    mechanism, design = built(name)
    links = [k for k, p in enumerate(mechanism.parameters) if p.positive]
    changed = np.tile(design, (len(links), 1))
    changed[np.arange(len(links)), links] = value
    columns, found = poses(mechanism, changed), summary(mechanism, changed)
    for row, k in enumerate(links):
        assert (columns["status"][row] != st.OK).all(), mechanism.parameters[k].name
        assert found["status"][row] != st.OK, mechanism.parameters[k].name
    assert explained(columns, wanted(mechanism)) and explained(found, of_turn(mechanism))


@pytest.mark.parametrize("name", CASES)
def test_random_bit_patterns_never_raise_never_hang_and_every_nan_is_explained(name):
    mechanism, _ = built(name)
    generator = np.random.default_rng(21)
    bits = generator.integers(0, 2**64, (400, len(mechanism.parameters)), dtype=np.uint64)
    designs = bits.view(np.float64).copy()
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.choices is not None:
            designs[:, k] = generator.choice(parameter.choices, len(designs))
        elif parameter.positive:
            designs[:200, k] = np.abs(designs[:200, k])
    start = time.process_time()
    assert explained(poses(mechanism, designs), wanted(mechanism))
    for accuracy in (FINE, Accuracy(samples=32)):
        assert explained(summary(mechanism, designs, accuracy), of_turn(mechanism))
    assert time.process_time() - start < SECONDS


@pytest.mark.parametrize("name", CASES)
def test_lengths_over_thirty_decades_never_hang_and_every_nan_is_explained(name):
    mechanism, design = built(name)
    generator = np.random.default_rng(22)
    designs = np.tile(design, (DEAR.get(name, 200), 1))
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.unit in ("length", "ratio"):
            sign = 1.0 if parameter.positive else generator.choice([-1.0, 0.0, 1.0], len(designs))
            designs[:, k] = sign * 10.0 ** generator.uniform(-15.0, 15.0, len(designs))
    start = time.process_time()
    assert explained(poses(mechanism, designs), wanted(mechanism))
    assert explained(summary(mechanism, designs), of_turn(mechanism))
    assert time.process_time() - start < SECONDS


@pytest.mark.parametrize("exponent", [-199, -60, 60, 199])
@pytest.mark.parametrize("name", LINKED)
def test_scale_changes_no_bit(name, exponent):
    mechanism, design = built(name)
    powers = np.array([{"length": 1, "1/length": -1}.get(p.unit, 0) for p in mechanism.parameters])
    scaled = np.ldexp(design, powers * exponent)
    plain, big = poses(mechanism, design), poses(mechanism, scaled)
    np.testing.assert_array_equal(plain["status"], big["status"])
    units = {o.name: o.unit for o in mechanism.pose_outputs}
    for output in wanted(mechanism):
        power = {"length": 1, "length^2": 2, "length^4": 4}.get(units[output], 0)
        if power <= 1:
            np.testing.assert_array_equal(np.ldexp(plain[output], power * exponent), big[output], err_msg=output)


def test_extrema_of_a_tiny_swivel_are_those_of_a_large_one():
    """Lengths of 1e-82: a floor of 2^-106 for what five samples differ by let the search end 4e-7 off with status 0."""
    mechanism = family("swivel")
    tiny = {"a": 1.2939833205967578e-82, "e": 3.850407171075017e-82, "f": -1.6751266098033278e-82,
            "g": -2.1147597597616768e-82, "alpha": 1.0348884223107313, "Lw": 8.390614036491409e-82}  # fmt: skip
    design = np.array([[tiny.get(p.name, p.default) for p in mechanism.parameters]], float)
    found = design_outputs(mechanism, design, ["max_abs_d3x_p"], Accuracy(target=1e-9))
    assert found["status"][0] == st.OK
    assert found["max_abs_d3x_p"][0] / tiny["a"] == pytest.approx(4.44783510044, rel=1e-11)


@pytest.mark.parametrize("name", mostly_long(LINKED, ("rssr", "swivel", "guide")))
def test_scale_changes_no_bit_of_extrema(name):
    """The error that is allowed is a part of the curve's size, so no number of the search stands for itself."""
    mechanism, design = built(name)
    generator = np.random.default_rng(24)
    powers = np.array([{"length": 1, "1/length": -1}.get(p.unit, 0) for p in mechanism.parameters])
    steady = np.array([p.unit in ("length", "1/length", "angle") for p in mechanism.parameters])
    designs = design * np.where(steady, generator.uniform(0.95, 1.05, (6, design.size)), 1.0)
    units = {o.name: o.unit for o in mechanism.pose_outputs}
    outputs = [n for n in ladder(mechanism)[:4] if units[n] in ("length", "rad", "1")]
    names = [f"{kind}_{n}" for n in outputs for kind in ("max_abs", "min", "phi_max")]
    accuracy = Accuracy(target=1e-9)
    plain = design_outputs(mechanism, designs, names, accuracy)
    assert (plain["status"] == st.OK).any()
    for exponent in (-199, 199):
        big = design_outputs(mechanism, np.ldexp(designs, powers * exponent), names, accuracy)
        np.testing.assert_array_equal(plain["status"], big["status"])
        for n in outputs:
            for kind in ("max_abs", "min", "phi_max"):
                power = exponent if units[n] == "length" and kind != "phi_max" else 0
                key = f"{kind}_{n}"
                np.testing.assert_array_equal(np.ldexp(plain[key], power), big[key], err_msg=key)
                np.testing.assert_array_equal(np.ldexp(plain[f"err_{key}"], power), big[f"err_{key}"], err_msg=key)


@pytest.mark.parametrize("exponent", [-1000, -332, 332, 1000])  # 1e-300, 1e-100, 1e100, 1e300
@pytest.mark.parametrize("name", LINKED)
def test_a_scale_that_leaves_float64_gives_the_same_numbers_or_a_status(name, exponent):
    mechanism, design = built(name)
    powers = np.array([{"length": 1, "1/length": -1}.get(p.unit, 0) for p in mechanism.parameters])
    scaled = np.ldexp(design, powers * exponent)
    plain, big = poses(mechanism, design), poses(mechanism, scaled)
    units = {o.name: o.unit for o in mechanism.pose_outputs}
    same = big["status"] == st.OK
    for output in (n for n in wanted(mechanism) if units[n] not in ("length^2", "length^4")):
        power = exponent if units[output] == "length" else 0
        np.testing.assert_array_equal(np.ldexp(plain[output], power)[same], big[output][same], err_msg=output)
    assert explained(big, [n for n in wanted(mechanism) if n != "discriminant"])
    found = summary(mechanism, scaled)
    assert explained(found, of_turn(mechanism))
    if found["status"][0] == st.OK and mechanism.find(Assembly):
        np.testing.assert_array_equal(found["margin"], summary(mechanism, design)["margin"])


@pytest.mark.parametrize("name", CASES)
def test_order_company_and_cut_of_the_grid_change_no_bit(name):
    mechanism, design = built(name)
    generator = np.random.default_rng(23)
    designs = np.tile(design, (40, 1))
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.choices is None:
            designs[:, k] *= generator.uniform(0.9, 1.1, len(designs))
    order = generator.permutation(len(designs))
    whole, shuffled = poses(mechanism, designs), poses(mechanism, designs[order])
    left, right = poses(mechanism, designs, PHI[:, :7]), poses(mechanism, designs, PHI[:, 7:])
    alone = poses(mechanism, designs[5:6])
    for output in (*wanted(mechanism), "status"):
        np.testing.assert_array_equal(whole[output][order], shuffled[output])
        np.testing.assert_array_equal(whole[output], np.hstack([left[output], right[output]]))
        np.testing.assert_array_equal(whole[output][5:6], alone[output])
    for accuracy in (FINE, Accuracy(samples=64)):
        whole, shuffled = (summary(mechanism, d, accuracy) for d in (designs, designs[order]))
        alone = summary(mechanism, designs[5:6], accuracy)
        for output in (*of_turn(mechanism), "status"):
            np.testing.assert_array_equal(whole[output][order], shuffled[output])
            np.testing.assert_array_equal(whole[output][5:6], alone[output])


@pytest.mark.parametrize("name", CASES)
def test_every_derivative_is_that_of_the_order_below_at_the_expected_rate(name):
    """Central differences err like h^2: halving h divides the error by four."""
    mechanism, design = built(name)
    phi = np.linspace(0.1, 6.1, 13)[None, :]
    pairs = list(mechanism.derivative_of.items())
    names = frozenset(itertools.chain.from_iterable(pairs))

    def at(h):
        return mechanism.poses(design[None, :], Angles.of(phi + h), names)

    exact = at(0.0)
    assert (exact["status"] == st.OK).all() and len(pairs) >= 3
    for lower, output in pairs:
        errors = []
        for h in (2.0**-7, 2.0**-8, 2.0**-9):
            difference = at(h)[lower] - at(-h)[lower]
            if lower == "psi":
                difference = np.arctan2(np.sin(difference), np.cos(difference))
            errors.append(np.abs(difference / (2.0 * h) - exact[output]).max())
        np.testing.assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 4.0, rtol=0.1, err_msg=output)
