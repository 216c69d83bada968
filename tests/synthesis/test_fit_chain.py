"""The inner fit of a guide in a chain: what it sets is what summarise then finds, and study files say it clearly.

Tolerance of the deviation: the fit sees 48 Chebyshev points of the swing, between which a smooth curve moves by about
(pi/47)^2/8 = 6e-4 of its range; 1e-2 of the deviation covers the sharpest curves of the sample.
"""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from sweep.errors import InputError, StudyError
from sweep.evaluation.summaries import summarise
from sweep.families import family
from sweep.study import load_study
from sweep.synthesis.fit import LineFit, fit_line

CHAIN = ["rssr", "guide"]


def random_designs(count, seed=0):
    rng = np.random.default_rng(seed)
    columns = {
        "a1": rng.uniform(4, 8, count), "b1": rng.uniform(25, 50, count), "c1": 20.0, "e1": rng.uniform(20, 40, count),
        "f1": rng.uniform(-15, 15, count), "g1": rng.uniform(-15, 15, count), "alpha1": rng.uniform(0, 1.5, count),
        "a2": 10.0, "b2": rng.uniform(10, 40, count), "c2": rng.uniform(10, 40, count),
        "e2": rng.uniform(10, 40, count), "offset2": rng.uniform(-3, 3, count),
        "branch1": 1.0, "branch2": 1.0, "kappa2": 1.0,
    }  # fmt: skip
    names = family(CHAIN).parameter_names
    return np.column_stack([np.broadcast_to(columns.get(name, 0.0), count) for name in names])


def table_of(designs):
    return dict(zip(family(CHAIN).parameter_names, designs.T, strict=True))


def test_fitted_designs_have_the_stroke_and_a_small_deviation():
    fitted, status = fit_line(family(CHAIN), random_designs(400), LineFit(24.5, True), (0.0, 0.6))
    good = fitted[status == st.OK]
    assert len(good) > 50
    got = summarise(CHAIN, table_of(good), ["stroke", "max_abs_dev"], accuracy=1e-6, window=(0.0, 0.6))
    got = got[got.status == st.OK]
    assert len(got) > 40
    # An extreme of s inside the swing falls between two fit points: quadratic, so a thousandth in 99 of 100.
    np.testing.assert_allclose(got.stroke, 24.5, rtol=5e-3)
    assert (abs(got.stroke - 24.5) < 24.5e-3).mean() > 0.99
    assert (got.max_abs_dev < 0.02 * 24.5).mean() > 0.5


def test_a_guide_that_turns_is_scaled_to_its_stroke_as_well():
    rng = np.random.default_rng(4)
    names = family("guide").parameter_names
    designs = np.zeros((300, len(names)))
    designs[:, :4] = rng.uniform((6, 20, 20, 20), (12, 40, 40, 40), (300, 4))
    designs[:, names.index("branch")] = 1.0
    fitted, status = fit_line(family("guide"), designs, LineFit(20.0, True), None)
    got = summarise("guide", dict(zip(names, fitted[status == st.OK].T, strict=True)), "stroke")
    assert (got.status == st.OK).sum() > 100
    # The largest distance of 256 Chebyshev points of a turn is pi^2/255: half of it, squared, over two is 2e-4.
    np.testing.assert_allclose(got.stroke[got.status == st.OK], 20.0, rtol=1e-3)


def test_deviation_cannot_be_improved_by_moving_the_point():
    designs = random_designs(200, seed=1)
    fitted, status = fit_line(family(CHAIN), designs, LineFit(None, False), None)
    rows = np.flatnonzero(status == st.OK)[:20]
    base = summarise(CHAIN, table_of(fitted[rows]), "max_abs_dev", accuracy=1e-8)
    names = family(CHAIN).parameter_names
    for name in ("xi2", "eta2", "h2"):
        for step in (-0.05, 0.05):
            moved = fitted[rows].copy()
            moved[:, names.index(name)] += step
            other = summarise(CHAIN, table_of(moved), "max_abs_dev", accuracy=1e-8)
            assert (other.max_abs_dev > base.max_abs_dev * 0.99).all()


def test_offset_of_the_line_is_in_the_middle_of_the_deviations_over_the_window():
    fitted, status = fit_line(family(CHAIN), random_designs(200, seed=3), LineFit(None, True), (0.0, 0.6))
    got = summarise(
        CHAIN, table_of(fitted[status == st.OK]), ["max_dev", "min_dev", "max_abs_dev"], samples=2880, window=(0.0, 0.6)
    )
    got = got[got.status == st.OK]
    assert len(got) > 40
    # The end of the window lies between two of 256 samples: 1.03 found; with 48 the median was 1.16.
    assert np.median(2.0 * got.max_abs_dev / (got.max_dev - got.min_dev)) < 1.08


def test_what_does_not_swing_keeps_its_status():
    designs = random_designs(5)
    designs[2, 0] = 500.0
    fitted, status = fit_line(family(CHAIN), designs, LineFit(24.5, True), None)
    assert status[2] == st.NOT_ROTATABLE
    np.testing.assert_array_equal(fitted[2], designs[2])


def test_scale_is_proportional_to_the_stroke():
    designs = random_designs(50, seed=2)
    small, status = fit_line(family(CHAIN), designs, LineFit(10.0, True), None)
    large, _ = fit_line(family(CHAIN), designs, LineFit(20.0, True), None)
    names = family(CHAIN).parameter_names
    for name in ("a2", "b2", "xi2", "eta2", "h2"):
        k = names.index(name)
        np.testing.assert_allclose(large[status == st.OK, k], 2.0 * small[status == st.OK, k], rtol=1e-12)


def test_only_a_guide_can_be_fitted():
    with pytest.raises(InputError, match="a guide, or a chain that ends in one"):
        fit_line(family("rssr"), np.zeros((1, 8)), LineFit(1.0, True), None)


STUDY = """
[study]
name = "fit"
[mechanism]
chain = ["rssr", "guide"]
[design]
a1 = "6 mm"
b1 = "40 mm"
c1 = "20 mm"
e1 = "35 mm"
f1 = "0 mm"
g1 = "0 mm"
alpha1 = "0 deg"
a2 = "10 mm"
b2 = { from = 10, to = 40, count = 30, unit = "mm" }
c2 = "25 mm"
e2 = "20 mm"
[fit]
stroke = "24.5 mm"
[limits]
b2 = { max = 60, unit = "mm" }
[objective]
minimise = "max_abs_dev"
"""


def write(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text(text)
    return path


def test_study_needs_no_fitted_parameters_and_bounds_the_scaled_ones(tmp_path):
    study = load_study(write(tmp_path, STUDY))
    assert study.fit == LineFit(24.5, True)
    assert study.want == ("max_abs_dev",)
    assert [limit.output for limit in study.parameter_limits] == ["b2"]
    plain = load_study(write(tmp_path, STUDY.replace('"24.5 mm"', '"20 mm"')))
    assert plain.fingerprint != study.fingerprint


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[design]", '[design]\nxi2 = "3 mm"'), "design.xi2 = '3 mm'; allowed: nothing here: [fit] finds it"),
        (('"24.5 mm"', '"24.5 deg"'), "fit.stroke = '24.5 deg'; allowed: a length"),
        (("[fit]", "[fit]\nstork = 1"), "fit.stork: unknown key; allowed: stroke, direction"),
        (("[fit]", "[optimise]\n[fit]"), "limits.stroke is missing; needed: bounds near fit.stroke"),
        (("b2 = { max = 60", "b22 = { max = 60"), "limits.b22: unknown design output"),
    ],
)
def test_faults_of_fit_are_told(tmp_path, change, message):
    with pytest.raises(StudyError) as caught:
        load_study(write(tmp_path, STUDY.replace(*change)))
    assert message in str(caught.value)


def test_missing_parameters_without_fit_are_told(tmp_path):
    with pytest.raises(StudyError) as caught:
        load_study(write(tmp_path, STUDY.replace('[fit]\nstroke = "24.5 mm"\n', "")))
    assert "design.xi2 is missing" in str(caught.value)
