"""Extrema and means of smooth curves of dear poses: from the Fourier series of their samples, with honest errors."""

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles
from sweep.reductions import extrema, means
from sweep.reductions.resolution import _beyond, _beyond_mean
from tests.bench.machines import head

DESIGNS, SPREAD = 60, 0.08  # sizes so far apart that some designs are near a dead point, or do not turn
MACHINE, MATRIX = head(DESIGNS)
NAMES = MACHINE.parameter_names
VARIED = ("a1", "b1", "c1", "e1", "f1", "a2", "b2", "c2", "a", "e", "f", "g", "alpha")
SIZES = [k for k, name in enumerate(NAMES) if name.split(".")[-1] in VARIED]
MATRIX[:, SIZES] *= 1.0 + SPREAD * np.random.default_rng(5).standard_normal((DESIGNS, len(SIZES)))
FINE = 3072
ROUNDING = 1e-13  # of the curve's size: poses near a dead point


def vectors(name):
    angles = Angles.of(2.0 * np.pi * np.arange(FINE)[None] / FINE)
    parts = [f"{name}_{x}" for x in "xyz"]
    found = MACHINE.precise().poses(MATRIX, angles, frozenset(parts))
    return np.stack([found[part] for part in parts], axis=1)


def top(curve):
    """Largest value of dense samples, by the parabola of the highest and its neighbours."""
    at, rows = curve.argmax(axis=1), np.arange(len(curve))
    before, here, after = curve[rows, at - 1], curve[rows, at], curve[rows, (at + 1) % FINE]
    return here + (before - after) ** 2 / (8.0 * (2.0 * here - before - after))


@pytest.mark.parametrize("target", [1e-4, 1e-8])
@pytest.mark.parametrize("name", ["shake", "shake_moment"])
def test_values_are_those_of_dense_poses_within_their_errors(name, target):
    dense = vectors(name)
    length = np.sqrt(np.square(dense).sum(axis=1))
    rms = np.sqrt(np.square(length).mean(axis=1))
    expected = {f"max_{name}": top(length), f"max_abs_{name}_y": top(np.abs(dense[:, 1]))}
    expected |= {f"min_{name}_z": -top(-dense[:, 2]), f"rms_{name}": rms}
    for output, value in expected.items():
        found = design_outputs(MACHINE, MATRIX, [output], Accuracy(target=target))
        good = found["status"] == st.OK
        assert 30 < good.sum() < DESIGNS
        size = length.max(axis=1)[good]
        # the parabola through dense samples errs by some h^4 of the fourth derivative: of narrow tops 1e-6
        parabola = 0.0 if output.startswith("rms") else 2e-6
        told = found[f"err_{output}"][good]
        assert (told <= target * size).all()
        np.testing.assert_array_less(np.abs(found[output] - value)[good], told + (ROUNDING + parabola) * size)


@pytest.mark.parametrize("output", ["max_shake", "min_shake_z", "max_abs_torque", "rms_shake_moment"])
def test_search_between_poses_finds_the_same(monkeypatch, output):
    found = design_outputs(MACHINE, MATRIX, [output], Accuracy(target=1e-8))
    for room in (extrema, means):
        monkeypatch.setattr(room, "series_of", lambda family, request: None)
    searched = design_outputs(MACHINE, MATRIX, [output], Accuracy(target=1e-12))
    np.testing.assert_array_equal(found["status"], searched["status"])
    good = found["status"] == st.OK
    off = np.abs(found[output] - searched[output])[good]
    np.testing.assert_array_less(off, (found[f"err_{output}"] + searched[f"err_{output}"])[good])


def test_a_design_has_the_same_bits_alone():
    together = design_outputs(MACHINE, MATRIX, ["max_shake", "rms_shake"], Accuracy(target=1e-8))
    for i in (0, 17, 41):
        alone = design_outputs(MACHINE, MATRIX[[i]], ["max_shake", "rms_shake"], Accuracy(target=1e-8))
        for name, values in alone.items():
            np.testing.assert_array_equal(values, together[name][[i]])


@pytest.mark.parametrize("rho", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("samples", [48, 96, 192])
def test_orders_beyond_the_samples_are_bounded(rho, samples):
    """A pole at the distance rho: the samples' own coefficients tell what they leave out, no more than 200 times."""

    def curve(phi):
        return np.sinh(rho) / (np.cosh(rho) - np.cos(phi - 0.3))

    values = curve(2.0 * np.pi * np.arange(samples) / samples)
    series = np.fft.rfft(values) / samples
    many = 4096
    between = np.fft.irfft(series, many) * many
    off = np.abs(between - curve(2.0 * np.pi * np.arange(many) / many)).max()
    told = _beyond(np.abs(series)[None])[0]
    assert off <= told + 1e-14 * np.abs(values).max()
    assert told <= 200.0 * off + 1e-12 * np.abs(values).max()
    mean = np.sqrt(np.square(values).mean())
    true = np.sqrt(1.0 / np.tanh(rho))  # the mean of the square is coth(rho)
    assert abs(mean - true) <= _beyond_mean(np.abs(series)[None])[0] + 1e-14 * true


def test_a_kink_is_not_taken_for_a_smooth_curve():
    """Negative control: coefficients of |sin| fall by the square of the order, so 384 samples do not give 1e-6."""
    values = np.abs(np.sin(2.0 * np.pi * (np.arange(384) + 0.3) / 384))
    assert _beyond(np.abs(np.fft.rfft(values) / 384)[None])[0] > 1e-4
