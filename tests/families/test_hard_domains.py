"""Every family over an interval or a march: edge inputs get a status, never an exception; cases from the register."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, Angles, March, Turn

CASES = [name for name in NAMES if not isinstance(family(name).domain, Turn)]
SECONDS = 120.0  # far more than any of these takes, far less than a hang
SAMPLES = 48


def example(mechanism):
    given = {p.name: p.default for p in mechanism.parameters if p.default is not None} | dict(mechanism.example)
    return np.array([given[name] for name in mechanism.parameter_names])


def variable(mechanism, designs):
    """Values of the domain's variable (n, m): a march's own grid, or an interval from end to end."""
    if isinstance(mechanism.domain, March):
        return np.arange(SAMPLES)[None, :] * (2.0 * math.pi / SAMPLES)
    with np.errstate(all="ignore"):
        low, high = mechanism.domain.ends(designs)
        return low[:, None] + np.linspace(0.0, 1.0, SAMPLES) * (high - low)[:, None]


def poses(mechanism, designs):
    with np.errstate(all="ignore"):
        return mechanism.poses(designs, Angles.of(variable(mechanism, designs)), frozenset([mechanism.position]))


def summary(mechanism, designs):
    wanted = [f"max_{mechanism.position}"]
    return design_outputs(mechanism, designs, wanted, Accuracy(samples=SAMPLES)), wanted[0]


def explained(columns, name):
    missing = ~np.isfinite(np.asarray(columns[name], float))
    return bool((columns["status"][missing] != st.OK).all())


@pytest.mark.parametrize("name", CASES)
def test_the_ordinary_design_has_an_answer(name):
    mechanism = family(name)
    design = example(mechanism)[None, :]
    assert (poses(mechanism, design)["status"] == st.OK).all()
    found, wanted = summary(mechanism, design)
    assert found["status"][0] == st.OK and math.isfinite(found[wanted][0])


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", CASES)
def test_a_parameter_that_is_no_number_gives_no_number(name, value):
    mechanism = family(name)
    changed = np.tile(example(mechanism), (len(mechanism.parameters), 1))
    np.fill_diagonal(changed, value)
    found, wanted = summary(mechanism, changed)
    assert (found["status"] != st.OK).all(), np.array(mechanism.parameter_names)[found["status"] == st.OK]
    assert not np.isfinite(np.asarray(found[wanted], float)).any()


@pytest.mark.parametrize("name", CASES)
def test_random_bit_patterns_never_raise_never_hang_and_every_nan_is_explained(name):
    mechanism = family(name)
    generator = np.random.default_rng(31)
    bits = generator.integers(0, 2**64, (60, len(mechanism.parameters)), dtype=np.uint64)
    designs = bits.view(np.float64).copy()
    mixed = np.where(generator.uniform(size=designs.shape) < 0.2, designs, example(mechanism))
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.choices is not None:
            mixed[:, k] = generator.choice(parameter.choices, len(mixed))
    start = time.process_time()
    for rows in (designs, mixed):
        assert explained(poses(mechanism, rows), mechanism.position)
        assert explained(*summary(mechanism, rows))
    assert time.process_time() - start < SECONDS


POWERS = {"length": 1, "1/length": -1, "force": 1, "N": 1, "length^2": 2, "length/time": 1, "torque": 2, "N*s": 1}


@pytest.mark.parametrize("exponent", [-199, -60, 60, 199])
@pytest.mark.parametrize("name", CASES)
def test_scale_changes_no_bit(name, exponent):
    """All lengths times 2^k, and all forces, so that stiffnesses, masses and times stay what they are."""
    mechanism = family(name)
    names = frozenset(o.name for o in mechanism.pose_outputs)
    designs = example(mechanism) * np.where(
        [p.unit in ("length", "force") for p in mechanism.parameters],
        np.random.default_rng(25).uniform(0.99, 1.01, (3, len(mechanism.parameters))), 1.0,
    )  # fmt: skip
    scaled = np.ldexp(designs, exponent * np.array([POWERS.get(p.unit, 0) for p in mechanism.parameters]))
    at = variable(mechanism, designs)
    of_domain = exponent * POWERS.get(mechanism.domain.unit, 0)
    plain = mechanism.poses(designs, Angles.of(at), names)
    big = mechanism.poses(scaled, Angles.of(np.ldexp(at, of_domain)), names)
    np.testing.assert_array_equal(plain["status"], big["status"])
    assert (plain["status"] == st.OK).any()
    for output in mechanism.pose_outputs:
        power = exponent * POWERS.get(output.unit, 0)
        same = np.asarray(plain["status"]) == st.OK
        np.testing.assert_array_equal(
            np.ldexp(plain[output.name], power)[same], big[output.name][same], err_msg=output.name
        )
    wanted = f"max_{mechanism.position}"
    (unit,) = (o.unit for o in mechanism.pose_outputs if o.name == mechanism.position)
    accuracies = [Accuracy(samples=SAMPLES)] + [Accuracy(target=1e-8)] * (not isinstance(mechanism.domain, March))
    for accuracy in accuracies:
        one, other = (design_outputs(mechanism, d, [wanted], accuracy) for d in (designs, scaled))
        np.testing.assert_array_equal(one["status"], other["status"])
        np.testing.assert_array_equal(np.ldexp(one[wanted], exponent * POWERS.get(unit, 0)), other[wanted])
