"""Root mean squares of crank-rockers near change points, whose peaks no coarse grid sees, against crowded sums."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.reductions.means import mean_squares
from tests.support.near_change_points import RSSR, crowded_angles, near_change_points

# At a margin of 2e-9 two coarse grids agree on 0.3043, neither of which sees the peak.
SHARP = (
    0.276336336001507, 2.0919398127969067, 1.0124840763424654, -1.3453910659259398, 0.02132801057111333,
    -0.1888516574413175, -0.3426740771991339,
)  # fmt: skip
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


def dense(designs: np.ndarray, output: str) -> np.ndarray:
    """Root mean squares by Gauss rules between poses that crowd about the deepest dip of the discriminant."""
    edges = np.sort(np.mod(crowded_angles(designs), 2.0 * np.pi), axis=1)
    edges = np.concatenate([edges, edges[:, :1] + 2.0 * np.pi], axis=1)
    half = 0.5 * np.diff(edges, axis=1)
    total = np.zeros(len(designs))
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        phi = edges[:, :-1] + half * (1.0 + node)
        values = RSSR.precise().poses(designs, Angles.of(phi), frozenset([output]))[output]
        total += weight * (values * values * half).sum(axis=1)
    return np.sqrt(total / (2.0 * np.pi))


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_root_mean_square_sees_a_peak_that_falls_between_coarse_poses(accuracy: float, branch: float) -> None:
    design = np.array([[*SHARP, branch]])
    table = dict(zip(RSSR.parameter_names, design[0], strict=True))
    names = [f"rms_{output}" for output in ("dpsi", "d2psi", "d3psi")]
    found = sweep.summarise("rssr", table, names, accuracy=accuracy).iloc[0]
    assert found["status"] == st.OK
    for name in names:
        exact = dense(design, name.removeprefix("rms_"))[0]
        assert abs(found[name] - exact) <= found[f"err_{name}"] + 1e-11 * exact
        assert found[f"err_{name}"] <= 1.1 * accuracy * exact


@pytest.mark.parametrize("output", ["dpsi", "d2psi"])
def test_root_mean_squares_near_change_points_are_dense_sums_within_their_errors(output: str) -> None:
    designs = near_change_points(300, 12, 1.0)
    exact = dense(designs, output)
    for accuracy in (1e-4, 1e-8):
        columns = dict(zip(RSSR.parameter_names, designs.T, strict=True))
        found = sweep.summarise("rssr", columns, [f"rms_{output}"], accuracy=accuracy)
        off = np.abs(found[f"rms_{output}"] - exact)
        # Where the search is not sure its error still has to hold.
        assert (off <= found[f"err_rms_{output}"] + 1e-10 * exact).all()
        assert (found["status"] == st.OK).mean() > 0.9


def test_a_mean_of_a_curve_that_switches_stands_where_another_member_of_a_machine_does_not_turn():
    """Every design is lost to the needle's route: what comes behind is asked for no design at all."""
    machine = sweep.machine({"needle": "slider_crank", "thread": {"family": "cam", "ratio": -3}})
    given = {f"needle.{name}": value for name, value in family("slider_crank").example.items()}
    given |= {f"thread.{name}": value for name, value in family("cam").example.items()}
    asked = ["needle.max_d2s", "needle.rms_d2s", "thread.rms_d2s"]
    turning = sweep.summarise(machine, given, asked, accuracy=1e-8).iloc[0]
    lost = sweep.summarise(machine, given | {"needle.b": 0.5 * given["needle.a"]}, asked, accuracy=1e-8).iloc[0]
    assert turning["status"] == st.OK and lost["status"] == st.NOT_ROTATABLE
    assert lost["thread.rms_d2s"] == pytest.approx(turning["thread.rms_d2s"], rel=1e-8)  # as accurate as asked for
    assert np.isnan(lost["needle.rms_d2s"]) and np.isnan(lost["needle.max_d2s"])


def peaks(designs, angles, wanted):
    """Square roots of peaks at the crank angle and with the width that the first two inputs give."""
    place, width = designs[:, :1], designs[:, 1:2]
    values = np.sqrt(np.sinh(width) / (np.cosh(width) - np.cos(angles.phi - place)))
    return dict.fromkeys(wanted, values) | {"status": np.zeros(values.shape, np.uint8)}


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_a_mean_of_samples_knows_its_error_wherever_a_peak_falls(accuracy: float) -> None:
    """Nothing names these peaks: every other sample alone gives the same mean of some peaks by chance."""
    draw, n = np.random.default_rng(8), 2000
    designs = np.tile(np.ones(8), (n, 1))
    designs[:, 0], designs[:, 1] = draw.uniform(0.0, 2.0 * np.pi, n), np.exp(draw.uniform(np.log(0.02), 0.0, n))
    peaked = replace(RSSR, poses=peaks, precise_poses=None, steps=(), capabilities=())
    found = mean_squares(peaked, designs, ["rms_dpsi"], Accuracy(target=accuracy))
    assert (found["status"] == st.OK).all()
    # The mean of the squares is 1; the slack is rounding of 128 samples.
    assert (np.abs(found["rms_dpsi"] - 1.0) <= found["err_rms_dpsi"] + 1e-14).all()
    # The target refers to the largest estimate of the integral: a first panel may take a peak for a wider one.
    assert (found["err_rms_dpsi"] <= 4.0 * accuracy).all()
