"""Root mean squares of fused curves: against many samples of precise poses, to the target and within their errors."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.quantities.kinds import Request
from sweep.reductions.fused import curve_of
from tests.support.rssr_designs import random_designs
from tests.support.turn_designs import NEEDLE, needle_drives

MANY = 4096  # samples of the reference: 20 per distance of the nearest singularity where that is 0.03 or more
TARGETS = (1e-4, 1e-8)


def by_samples(mechanism, designs, pose):
    """Root mean squares of precise poses, not at the angles of the kernel, and whether so many samples resolve them."""
    found = []
    for shift in (0.1, 0.6):
        angles = Angles.of(((np.arange(MANY) + shift) * (2.0 * np.pi / MANY))[None])
        parts = np.array_split(designs, max(len(designs) // 64, 1))
        values = [mechanism.precise_poses(part, angles, frozenset([pose]))[pose] for part in parts]
        found.append(np.sqrt(np.concatenate([np.square(part).mean(axis=1) for part in values])))
    return found[0], np.abs(found[0] - found[1]) <= 1e-13 * found[0]


def crank_rockers():
    designs = random_designs(400, 11)
    mechanism = family("rssr")
    return mechanism, designs[design_outputs(mechanism, designs, ["margin"], Accuracy(target=1e-8))["margin"] > 1e-3]


def needles():
    mechanism, designs = NEEDLE, needle_drives(200, 12)
    return mechanism, designs[design_outputs(mechanism, designs, ["margin"], Accuracy(target=1e-8))["margin"] > 1e-3]


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(
    ("make", "pose"),
    [(crank_rockers, "dpsi"), (crank_rockers, "d2psi"), (crank_rockers, "d3psi"), (needles, "ds"), (needles, "d2s")],
)
def test_means_are_those_of_many_samples_within_their_errors(make, pose, target) -> None:
    mechanism, designs = make()
    found = design_outputs(mechanism, designs, [f"rms_{pose}"], Accuracy(target=target))
    value, error = found[f"rms_{pose}"], found[f"err_rms_{pose}"]
    exact, resolved = by_samples(mechanism, designs, pose)
    assert resolved.mean() > 0.9 and (found["status"] == 0).all()
    off = np.abs(value - exact)[resolved]
    # The sum of the reference rounds by 2^-53 for each factor of two in its number of samples.
    assert (off <= error[resolved] + 12.0 * 2.0**-53 * exact[resolved]).all()
    assert (off <= target * exact[resolved]).all()


def test_kernel_decides_nearly_all_and_fewer_samples_would_not_do() -> None:
    mechanism, designs = crank_rockers()
    curve = curve_of(mechanism, Request("d2psi", 0), False, mean=True)
    value, _, status, undecided = curve.mean(designs, 1e-8)
    assert undecided.mean() < 0.01 and (status[~undecided] == 0).all()
    # Negative control: sixteen samples err by more than is asked for.
    angles = Angles.of((np.arange(16) * (2.0 * np.pi / 16))[None])
    few = np.sqrt(np.square(mechanism.poses(designs, angles, frozenset(["d2psi"]))["d2psi"]).mean(axis=1))
    assert (np.abs(few - value) > 1e-8 * value).mean() > 0.25


@pytest.mark.parametrize(("name", "pose"), [("four_bar", "d2psi"), ("kim_dison", "d2alpha")])
def test_families_with_the_loop_of_a_crank_rocker_share_its_kernel(name, pose) -> None:
    mechanism = family(name)
    row = np.array([[mechanism.example.get(p.name, p.default) for p in mechanism.parameters]], np.float64)
    curve = curve_of(mechanism, Request(pose, 0), False, mean=True)
    assert curve is not None and curve.forms[0].matrix is not None
    value, error, _, undecided = curve.mean(row, 1e-10)
    exact, resolved = by_samples(mechanism, row, pose)
    assert resolved.all() and not undecided.any()
    assert (np.abs(value - exact) <= error + 12.0 * 2.0**-53 * exact).all()


@pytest.mark.parametrize("order", [("dpsi", "d2psi"), ("dpsi", "d3psi"), ("dpsi", "d2psi", "d3psi")])
def test_maxima_have_the_same_bits_alone_and_together(order) -> None:
    mechanism, designs = crank_rockers()
    names = [f"{kind}max_abs_{pose}" for pose in order for kind in ("", "phi_")]
    step = next(step for step in mechanism.steps if step.name == "true maxima")
    together = step.run(designs, frozenset(names), Accuracy(target=1e-8))
    for pose in order:
        own = frozenset((f"max_abs_{pose}", f"phi_max_abs_{pose}"))
        alone = step.run(designs, own, Accuracy(target=1e-8))
        for name in (*own, *(f"err_{name}" for name in own)):
            np.testing.assert_array_equal(together[name], alone[name])
