"""Exact gradients where a divisor vanishes: numba's complex division by zero raises, whatever its error model is.

A search meets such designs at the bounds of its space: an offset of 0 beside parallel axes, a pin on an axis.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from kernels import status as st
from kernels.synthesis.rssp_locus import rssp_on_locus
from kernels.synthesis.rssr_locus import rssr_of_size, rssr_on_locus
from sweep.families import NAMES, family
from sweep.families.base import Angles, Turn

STEP = 1e-30j
CASES = [*(name for name in NAMES if family(name).analytic), ["rssr", "guide"], ["rssr", "rssp"], ["rssr", "slotted"]]
QUARTERS = np.array([[0.0, 0.5, 1.0, 1.5, 0.2]]) * math.pi


def hard_designs(mechanism, example):
    """The ordinary design with each dimension at 0 or 1, with each two of them at 0 or equal, and with all of them."""
    given = {p.name: p.default for p in mechanism.parameters if p.default is not None} | example
    ordinary = np.array([given[name] for name in mechanism.parameter_names])
    free = [k for k, p in enumerate(mechanism.parameters) if p.choices is None]
    changes = [dict.fromkeys(some, value) for value in (0.0, 1.0) for some in ([k] for k in free)]
    for first, second in itertools.combinations(free, 2):
        changes += [{first: 0.0, second: 0.0}, {first: ordinary[second]}, {first: -ordinary[second]}]
    changes += [dict.fromkeys(free, value) for value in (0.0, 1.0)]
    designs = np.repeat(ordinary[None, :], len(changes) + 1, axis=0).astype(np.complex128)
    for row, change in zip(designs[1:], changes, strict=True):
        row[list(change)] = list(change.values())
    designs[:, free] += STEP
    return ordinary, designs


@pytest.mark.parametrize("name", CASES, ids=str)
def test_poses_with_complex_designs_never_raise_and_every_nan_is_explained(name):
    mechanism = family(name)
    chain = enumerate(name, 1) if isinstance(name, list) else ()
    stages = {f"{key}{k}": value for k, own in chain for key, value in family(own).example.items()}
    ordinary, designs = hard_designs(mechanism, dict(mechanism.example) | stages)
    with np.errstate(all="ignore"):
        phi = QUARTERS
        if not isinstance(mechanism.domain, Turn):
            low, high = mechanism.domain.ends(ordinary[None, :])
            phi = low[:, None] + np.linspace(0.0, 1.0, 5) * (high - low)[:, None]
        wanted = frozenset(output.name for output in mechanism.pose_outputs)
        found = mechanism.poses(designs, Angles.of(phi.astype(np.complex128)), wanted)
    position = np.asarray(found[mechanism.position])
    assert position.dtype == np.complex128 and (found["status"] == st.OK).any()
    assert (found["status"][~np.isfinite(position.real)] != st.OK).all()


SWINGS, TURNS, ENDS, LENGTHS = (0.8, math.pi), (math.pi, 0.5 * math.pi, 3.2), (0.0, 0.5 * math.pi, 1.0), (0.0, 1.0)
ALPHAS = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi, 1.0)
REQUIREMENTS = {
    rssr_on_locus: (8, [SWINGS, TURNS, ENDS, LENGTHS, LENGTHS, LENGTHS, ALPHAS]),
    rssr_of_size: (8, [SWINGS, TURNS, ENDS, [1.0], LENGTHS, ENDS, ALPHAS]),
    rssp_on_locus: (6, [SWINGS, TURNS, ENDS, LENGTHS, ALPHAS]),
}


@pytest.mark.parametrize("kernel", REQUIREMENTS, ids=lambda kernel: kernel.__name__)
def test_linkages_of_a_locus_with_complex_requirements_never_raise(kernel):
    width, values = REQUIREMENTS[kernel]
    rows = np.array(list(itertools.product(*values))).astype(np.complex128) + STEP
    status, failed = (np.empty(len(rows), np.uint8) for _ in range(2))
    designs, place = np.empty((len(rows), width), rows.dtype), np.empty(len(rows), rows.dtype)
    kernel(rows, status, failed, designs, place)
    np.testing.assert_array_equal(np.isfinite(designs[:, 0].real), status == st.OK)
    assert (status == st.OK).any() and (status != st.OK).any()
