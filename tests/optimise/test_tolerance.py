"""Sensitivities against differences of ``design_outputs``, at a corner against a closed form; tolerances by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

import sweep
from kernels import status as st
from sweep.chunks.cascade import Dropped
from sweep.dataset.files import MADE, beside
from sweep.effects import extended
from sweep.engine.run import run
from sweep.errors import StudyError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem
from sweep.optimise.manufacture.margins import inequalities
from sweep.optimise.manufacture.sample import Sampler, sampled_designs, tolerance_rows
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.report.dataset import read_dataset
from sweep.report.made import made
from sweep.study import Limit, Tolerance, load_study
from tests.optimise.test_study import STUDY

RSSR = family("rssr")
DESIGN = np.array([25.0, 100.0, 60.0, 100.0, 5.0, 10.0, 0.35, 1.0])
NOWHERE = """
[study]
name = "nowhere"
[mechanism]
family = "rssr"
[locus]
swing = "60 deg"
phi0 = "195 deg"
phi_ext = { from = 164.301, to = 194.301, unit = "deg" }
[design]
sample = { kind = "sobol", n = 30000, seed = 57 }
e = "100 mm"
f = { from = -60, to = 60, unit = "mm" }
g = "0 mm"
alpha = "89.999999999 deg"
[limits]
rotatable = true
a = { min = 3, unit = "mm" }
[objective]
minimise = "max_pressure_angle"
[optimise]
starts = 2
[tolerance]
lengths = "0.05 mm"
"""
OUTPUTS = ("max_abs_d2psi", "max_pressure_angle", "swing", "phi0", "stroke_ratio", "margin", "min_dpsi")


def sampler_of(tolerance: Tolerance, **more: Any) -> Sampler:
    names = RSSR.parameter_names[:7]
    problem = Problem(
        RSSR, names, DESIGN[:7] - 0.5, DESIGN[:7] + 0.5, {}, "max_abs_d2psi", accuracy=Accuracy(target=1e-9)
    )
    return Sampler(problem, tolerance, 3, **more)


def test_sensitivities_are_the_slopes_of_design_outputs() -> None:
    table = pd.DataFrame(sensitivities(RSSR, DESIGN, OUTPUTS))
    assert (table.growing == table.shrinking).all()  # nothing is shared here
    for k, parameter in enumerate(RSSR.parameter_names[:7]):
        h = 1e-3 * max(1.0, abs(DESIGN[k])) if k < 6 else 1e-4
        moved = np.repeat(DESIGN[None, :], 4, axis=0)
        moved[:, k] += h * np.array([-2.0, -1.0, 1.0, 2.0])
        columns = design_outputs(RSSR, moved, OUTPUTS, Accuracy(target=1e-12))
        for output in OUTPUTS:
            x = np.abs(columns[output]) if output == "swing" else np.asarray(columns[output], np.float64)
            slope = (x[0] - 8.0 * x[1] + 8.0 * x[2] - x[3]) / (12.0 * h)
            found = table[(table.parameter == parameter) & (table.output == output)].growing.item()
            # The refined extrema are good to 1e-12 relative at best, over steps of 1e-3.
            assert found == pytest.approx(slope, rel=1e-6, abs=1e-8 * np.abs(x).max()), (parameter, output)


def test_shared_extrema_have_the_slopes_of_both_sides_whether_least_or_largest() -> None:
    """A central slider-crank is as bad at 90 as at 270 degrees: with an offset the sine of its angle is (a + |e|)/b."""
    crank, rod = 10.0, 25.0
    across = 1.0 / math.sqrt(rod * rod - crank * crank)
    known = {
        "margin": -2.0 * crank / (rod * rod), "minus_margin": 2.0 * crank / (rod * rod),
        "max_pressure_angle": across, "minus_max_pressure_angle": -across, "least_transmission_angle": -across,
    }  # fmt: skip
    table = pd.DataFrame(sensitivities(family("slider_crank"), np.array([crank, rod, 0.0, 1.0]), tuple(known)))
    for output, growing in known.items():
        row = table[(table.parameter == "e") & (table.output == output)].iloc[0]
        assert row.growing == pytest.approx(growing, rel=1e-12), output
        assert row.shrinking == pytest.approx(-growing, rel=1e-12), output


def test_pressure_angle_of_nothing_has_no_endless_slope() -> None:
    """A slotted lever in line has no pressure angle; with the offset h the sine of its largest is h/(e - a)."""
    lever, outputs = family("inverted_slider_crank"), ("max_pressure_angle", "least_transmission_angle")
    for offset, known in ((0.0, 0.0), (1e-12, 0.0), (1e-3, 1.0 / 80.0)):
        table = pd.DataFrame(sensitivities(lever, np.array([30.0, 110.0, offset, 1.0]), outputs))
        slopes = table[table.parameter == "h"].set_index("output").growing
        # Below 1.5e-8 rad the angle is lost in the rounding of its cosine; at 1e-3/80 rad six digits of its slope stay.
        assert slopes.max_pressure_angle == pytest.approx(known, rel=1e-6, abs=1e-7)
        assert slopes.least_transmission_angle == pytest.approx(-known, rel=1e-6, abs=1e-7)
        assert table[table.parameter == "a"].growing.abs().max() < 1e-6


def test_a_curve_that_is_the_same_all_over_the_turn_has_the_slopes_of_every_angle() -> None:
    """A tool on the axis of its rocker weighs what it weighs; beside it, m (psi'' e_t - psi'^2 e_r) omega^2 more."""
    mass, weight, omega = 0.2, 3.0, 10.0
    given = dict(zip(RSSR.parameter_names, DESIGN.tolist(), strict=True))
    given |= {"m_tool": mass, "gravity_x": -weight, "speed": omega, "tool_x": 0.0, "tool_y": 0.0, "tool_z": 0.0}
    phi = np.linspace(0.0, 2.0 * math.pi, 100_001)
    psi, first, second = (
        sweep.evaluate("rssr", given, ["psi", "dpsi", "d2psi"], phi=phi)[["psi", "dpsi", "d2psi"]].to_numpy().T
    )
    pull = mass * omega**2 * (-second * np.sin(psi) - first**2 * np.cos(psi))  # along x, against the weight
    low, high = pull.min(), pull.max()
    known = {"min_tip_load": (low, high), "max_tip_load": (high, low), "minus_min_tip_load": (-low, -high)}
    known |= {"max_abs_tip_load": (high, low), "range_tip_load": (high - low, low - high)}
    whole = extended(RSSR, list(known))
    table = pd.DataFrame(sensitivities(whole, design_matrix(whole, given)[0][0], tuple(known)))
    for output, ends in known.items():
        row = table[(table.parameter == "tool_x") & (table.output == output)].iloc[0]
        # extremes of the dense grid miss a peak by the square of their distance
        assert (row.growing, row.shrinking) == pytest.approx(ends, rel=1e-7), output


@pytest.mark.parametrize("offset", [0.0, 2.0, 4.0, 5.5])
def test_of_tops_alike_a_member_has_the_place_that_summaries_give_whatever_its_offset(offset: float) -> None:
    """A central slider-crank is as fast on its way out as back; each comes once per turn of its crank."""
    machine, output = sweep.machine({"x": {"family": "slider_crank", "offset": offset}}, {}), "x.phi_max_abs_ds"
    drive = {"x.a": 10.0, "x.b": np.array([25.0, 25.01, 24.99]), "x.e": 0.0}
    place, longer, shorter = sweep.summarise(machine, drive, [output], accuracy=1e-12)[output]
    row = pd.DataFrame(sensitivities(family(machine), design_matrix(family(machine), drive)[0][0], (output,)))
    row = row[row.parameter == "x.b"].iloc[0]
    assert row.value == pytest.approx(place, rel=1e-12)
    assert row.growing == pytest.approx((longer - shorter) / 0.02, rel=1e-5)  # the square of the step


def test_planar_mechanism_has_its_alpha_and_offsets_in_second_order_only() -> None:
    planar = np.array([25.0, 100.0, 60.0, 100.0, 0.0, 0.0, 0.0, 1.0])
    table = pd.DataFrame(sensitivities(RSSR, planar, ("max_abs_d2psi", "swing")))
    flat = table[table.parameter.isin(["alpha", "f", "g"])]
    assert np.abs(flat.growing).max() < 1e-12
    assert table[table.parameter == "a"].growing.min() > 1e-3


def test_output_that_does_not_exist_has_no_slope() -> None:
    stuck = np.array([80.0, 30.0, 40.0, 100.0, 0.0, 0.0, 0.0, 1.0])
    table = pd.DataFrame(sensitivities(RSSR, stuck, ("max_abs_d2psi",)))
    assert table.value.isna().all() and table.growing.isna().all()


def test_design_without_links_has_no_slopes_and_ends_no_study(tmp_path: Path) -> None:
    assert sensitivities(RSSR, np.where(DESIGN == 60.0, math.nan, DESIGN), OUTPUTS)["growing"] == []
    (tmp_path / "study.toml").write_text(NOWHERE)
    folder = run(load_study(tmp_path), tmp_path / "out", jobs=1)
    best = pd.read_parquet(beside(folder) / "_optimum.parquet").iloc[0]
    assert math.isnan(best.a) and best.status == st.LIMIT_EXCEEDED
    assert len(pd.read_parquet(beside(folder) / "_sensitivity.parquet")) == 0


def test_deviating_designs_have_the_tolerance_as_three_standard_deviations() -> None:
    designs = sampled_designs(RSSR, DESIGN, Tolerance(0.03, 0.0), seed=1)
    assert designs.shape == (2048, 8) and (designs[:, 6:] == DESIGN[6:]).all()
    off = (designs - DESIGN)[:, :6] / 0.01
    for column in off.T:
        assert stats.kstest(column, "norm").pvalue > 1e-3
    assert np.abs(np.corrcoef(off.T) - np.eye(6)).max() < 0.05
    np.testing.assert_array_equal(designs, sampled_designs(RSSR, DESIGN, Tolerance(0.03, 0.0), seed=1))


def test_small_tolerances_give_the_band_of_the_sensitivities() -> None:
    tolerance = Tolerance(0.003, 0.0001)
    names = ("max_abs_d2psi", "max_pressure_angle")
    rows = pd.DataFrame(tolerance_rows(sampler_of(tolerance), DESIGN, names, ())).set_index("output")
    table = pd.DataFrame(sensitivities(RSSR, DESIGN, names))
    for name in names:
        slopes = table[table.output == name].growing.to_numpy()
        sigma = math.hypot(*(slopes * np.array([0.001] * 6 + [0.0001 / 3])))
        row = rows.loc[name]
        # 2048 samples of a scrambled Sobol sequence: the quantiles are good to some percent of sigma.
        assert row["mean"] == pytest.approx(row.nominal, abs=0.05 * sigma)
        assert row.high - row.low == pytest.approx(2 * 1.959964 * sigma, rel=0.05)
        assert row.missing == 0.0 and math.isnan(row.within)


def test_share_within_a_limit_at_the_nominal_value_is_half() -> None:
    nominal = design_outputs(RSSR, DESIGN[None, :], ["max_pressure_angle"], Accuracy(target=1e-9))["max_pressure_angle"]
    limits = (Limit("max_pressure_angle", None, float(nominal[0])), Limit("swing", 0.0, None))
    rows = tolerance_rows(sampler_of(Tolerance(0.003)), DESIGN, ("max_pressure_angle", "swing"), limits)
    assert rows["output"] == ["max_pressure_angle", "swing", "all limits"]
    assert rows["within"][0] == pytest.approx(0.5, abs=0.03)
    assert rows["within"][1] == 1.0 and rows["within"][2] == rows["within"][0]


def test_equations_are_no_limits_of_what_is_made() -> None:
    names, tolerance = ("max_pressure_angle", "swing"), Tolerance(0.003)
    at = {k: float(x[0]) for k, x in design_outputs(RSSR, DESIGN[None, :], names, Accuracy(target=1e-9)).items()}
    held = Limit("swing", abs(at["swing"]), abs(at["swing"]))
    limits = (Limit("max_pressure_angle", None, at["max_pressure_angle"]), held)
    rows = tolerance_rows(sampler_of(tolerance), DESIGN, names, limits)
    # Nothing that is made has a prescribed swing to the last digit: it would be 0 % of everything.
    assert math.isnan(rows["within"][1])
    assert rows["within"][2] == rows["within"][0] == pytest.approx(0.5, abs=0.03)
    lower, upper = DESIGN[:7] - 0.5, DESIGN[:7] + 0.5
    problem = Problem(RSSR, RSSR.parameter_names[:7], lower, upper, {}, "max_abs_d2psi", limits)
    sampler = Sampler(problem, tolerance, 3)
    assert sampler.share(DESIGN, inequalities(problem)) == pytest.approx(0.5, abs=0.03)
    band = replace(held, minimum=0.5 * abs(at["swing"]), maximum=abs(at["swing"]))
    assert sampler.share(DESIGN, (band,)) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_is_made_is_computed_in_blocks_with_the_bits_of_one_call(
    jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.optimise.manufacture.sample.batch_size", lambda _: 100)
    monkeypatch.setattr("sweep.optimise.manufacture.sample.SPREAD_SECONDS", -1.0)
    tolerance, told, names = Tolerance(0.03, 0.001, samples=512), list[int](), ("swing", "max_pressure_angle")
    sampler = sampler_of(tolerance, jobs=jobs, tell=told.append)
    found = sampler.outputs(DESIGN, names)
    assert sorted(told) == [12, 100, 100, 100, 100, 100]
    designs = sampled_designs(RSSR, DESIGN, tolerance, 3, 512)
    whole = design_outputs(RSSR, designs, names, Accuracy(target=1e-9))
    for name in names:
        np.testing.assert_array_equal(found[name], whole[name])
    limits = (
        Limit("max_pressure_angle", None, float(np.median(found["max_pressure_angle"]))),
        Limit("swing", 0.1, None),
    )
    assert sampler.share(DESIGN, limits) == 0.5
    # the first of them, with one dimension as it is drawn
    designs[:, 2] = DESIGN[2]
    exact = sampler.outputs(DESIGN, names, count=150, exact=2)
    whole = design_outputs(RSSR, designs[:150], names, Accuracy(target=1e-9))
    np.testing.assert_array_equal(exact["swing"], whole["swing"])


def test_what_is_made_stops_behind_the_block_that_it_is_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.optimise.manufacture.sample.batch_size", lambda _: 64)
    told = list[int]()
    sampler = sampler_of(Tolerance(0.03, samples=1024), should_stop=lambda: len(told) >= 3, tell=told.append)
    with pytest.raises(Dropped):
        sampler.outputs(DESIGN, ["swing"])
    assert told == [64, 64, 64]


def test_study_writes_its_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = STUDY.format(swing=40.0).replace("count = 8", "count = 4").replace("starts = 3", "starts = 1")
    (tmp_path / "study.toml").write_text(text + '[tolerance]\nlengths = "0.02 mm"\nangles = "0.05 deg"\n')
    study = load_study(tmp_path)
    assert study.tolerance == Tolerance(0.02, pytest.approx(math.radians(0.05), rel=1e-15))
    folder = run(study, tmp_path / "out", jobs=1)
    slopes, bands = (pd.read_parquet(beside(folder) / f"_{name}.parquet") for name in ("sensitivity", "tolerance"))
    assert set(slopes.role) == set(bands.role) == {"optimum", "reference"}
    assert set(slopes.parameter) == {"a", "b", "c", "e", "f", "g", "alpha"}
    best = bands[bands.role == "optimum"].set_index("output")
    assert best.loc["max_abs_d2psi"].low < best.loc["max_abs_d2psi"].nominal < best.loc["max_abs_d2psi"].high
    assert 0.0 < best.loc["all limits"].within < 0.9  # an active limit is missed by half of what is made
    with monkeypatch.context() as patch:
        patch.setattr("sweep.report.made.manufactured", None)  # a report reads what the run has made
        noted = made(read_dataset(folder))
    (beside(folder) / MADE).unlink()  # as in a folder of an earlier version
    anew = made(read_dataset(folder))
    assert (noted.share, noted.costs) == (anew.share, anew.costs) and 0.0 < noted.share < 0.9 and noted.costs
    np.testing.assert_array_equal(noted.histogram.edges, anew.histogram.edges)
    np.testing.assert_array_equal(noted.histogram.shares, anew.histogram.shares)
    (tmp_path / "study.toml").write_text(text + '[tolerance]\nlengths = "0.03 mm"\n')
    run(load_study(tmp_path), folder, jobs=1)
    assert (beside(folder) / MADE).exists()
    (tmp_path / "study.toml").write_text(text)
    run(load_study(tmp_path), folder, jobs=1)
    assert not (beside(folder) / "_tolerance.parquet").exists() and not (beside(folder) / MADE).exists()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[tolerance]\n", "tolerance.lengths"),
        ('[tolerance]\nlengths = "0.02 deg"\n', "tolerance.lengths"),
        ('[tolerance]\nangles = "-1 deg"\n', "positive"),
        ('[tolerance]\nlenghts = "0.02 mm"\n', "lengths"),
        (
            '[tolerance]\nlengths = "300 mm"\n',
            "tolerance.lengths = '300 mm'; allowed: less than the links: a is at most",
        ),
        ('[tolerance]\nlengths = "0.02 mm"\nown = { b = "7 m" }\n', "tolerance.own = '7000 mm'; allowed: .*: b is at"),
    ],
)
def test_bad_tolerances_are_named(tmp_path: Path, table: str, message: str) -> None:
    (tmp_path / "study.toml").write_text(STUDY.format(swing=40.0) + table)
    with pytest.raises(StudyError, match=message):
        load_study(tmp_path)
