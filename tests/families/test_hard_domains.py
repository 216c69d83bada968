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
