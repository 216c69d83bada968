"""True extrema of random mechanisms against brute force, for families without steps of their own.

The reference samples 100 000 poses and polishes the best; Brent's method is good to about 1e-14 relative there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema
from tests.reference import turn
from tests.support.turn_designs import MAKERS

TARGET = Accuracy(target=1e-10)


def rotating(name, count, seed, margin=1e-3):
    family, make = MAKERS[name]
    family = replace(family, steps=())
    designs = make(60 * count, seed)
    found = design_outputs(family, designs, ["margin"], TARGET)
    return family, designs[(found["status"] == st.OK) & (found["margin"] > margin)][:count]


def curve(family, design, pose):
    def values(phi):
        return family.poses(design[None, :], Angles.of(np.asarray(phi)[None, :]), frozenset([pose]))[pose][0]

    return values


@pytest.mark.parametrize(
    ("name", "pose"),
    [
        ("rssr", "d2psi"),
        ("rssr", "d3psi"),
        ("rssp", "d2s"),
        ("guide", "dev"),
        ("rssr+guide", "d2s"),
        ("rssr+guide", "dev"),
    ],
)
def test_largest_magnitude_is_that_of_brute_force(name, pose):
    family, designs = rotating(name, 12, seed=4)
    assert len(designs) == 12
    wanted = [f"max_abs_{pose}", f"phi_max_abs_{pose}"]
    found = design_outputs(family, designs, wanted, TARGET)
    assert (found["status"] == st.OK).all()
    for i, design in enumerate(designs):
        y = curve(family, design, pose)
        value, _ = turn.largest(lambda phi, y=y: np.abs(y(phi)))
        got = found[f"max_abs_{pose}"][i]
        assert got == pytest.approx(value, rel=1e-10)
        assert abs(got - value) <= found[f"err_max_abs_{pose}"][i] + 1e-12 * value
        # The place: the curve there has the value claimed (two peaks may be equally high).
        assert abs(y([found[f"phi_max_abs_{pose}"][i]])[0]) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "pose"), [("rssp", "s"), ("guide", "s"), ("rssr+guide", "x_m"), ("rssr", "pressure_angle")]
)
def test_signed_extrema_are_those_of_brute_force(name, pose):
    family, designs = rotating(name, 8, seed=5)
    found = design_outputs(family, designs, [f"max_{pose}", f"min_{pose}", f"range_{pose}"], TARGET)
    for i, design in enumerate(designs):
        y = curve(family, design, pose)
        most, least = turn.largest(y)[0], turn.least(y)[0]
        assert found[f"max_{pose}"][i] == pytest.approx(most, abs=1e-10 * (most - least))
        assert found[f"min_{pose}"][i] == pytest.approx(least, abs=1e-10 * (most - least))
        assert found[f"range_{pose}"][i] == pytest.approx(most - least, rel=2e-10)


@pytest.mark.parametrize("part", [(0.0, 0.6), (0.25, 0.75), (0.9, 1.0)])
def test_deviation_counts_only_inside_the_window(part):
    family, designs = rotating("rssr+guide", 8, seed=6)
    found = design_outputs(family, designs, ["max_abs_dev"], TARGET, part)
    phi = np.linspace(0.0, 2.0 * np.pi, 200_001)
    for i, design in enumerate(designs):
        s, dev = curve(family, design, "s")(phi), np.abs(curve(family, design, "dev")(phi))
        low, high = (s.min() + x * (s.max() - s.min()) for x in part)
        # The samples nearest the edges miss by the slope times their distance, 3e-5 rad.
        slope = np.abs(np.diff(dev)).max()
        sampled = dev[(s >= low) & (s <= high)].max()
        assert sampled - 1e-9 <= found["max_abs_dev"][i] <= sampled + 2.0 * slope


@pytest.mark.parametrize(
    ("name", "pose", "n"), [("rssr", "d2psi", 1500), ("rssr+guide", "d2s", 500), ("rssr+guide", "dev", 500)]
)
def test_no_peak_is_missed_in_many_designs(name, pose, n):
    family, designs = rotating(name, n, seed=7, margin=1e-4)
    assert len(designs) == n
    request = Request(pose, 0)
    found, status = true_extrema(family, designs, [request], 1e-8)
    assert (status == st.OK).all()
    samples = 8192
    angles = Angles.of(np.arange(samples)[None, :] * (2.0 * np.pi / samples))
    grid = np.empty(n)
    for start in range(0, n, 32):
        rows = designs[start : start + 32]
        grid[start : start + 32] = np.abs(family.poses(rows, angles, frozenset([pose]))[pose]).max(axis=1)
    value = found[request].value
    assert (value >= grid * (1.0 - 1e-12)).all()
    # margin >= 1e-4 keeps the nearest singularity 0.01 rad or so away, 13 samples: the grid is 2 % low at most
    assert (value <= grid * 1.02).all()
