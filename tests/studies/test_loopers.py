"""The studies looper1097, looper-sphere and looper-slotted: accepted figures recomputed, their statements checked.

Tolerances: accepted figures are computed from accepted links, which are stored with all their digits; what hangs on the
optimiser's word (limits met) has its promise of 1e-6.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.chunks.chunk import compute_chunk
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.quantities.limits import meets
from sweep.study import Study, load_study
from sweep.study.study import Limit

STUDIES = Path(__file__).parents[2] / "studies"
NAMES = ("looper1097", "looper-sphere", "looper-slotted")
CLOSE = 1e-6


def accepted(name: str) -> tuple[Study, dict]:
    return load_study(STUDIES / name), json.loads((STUDIES / name / "expected.json").read_text())


def outputs(study: Study, rows: list[dict], names: tuple[str, ...]) -> pd.DataFrame:
    known = [name for name in study.family.parameter_names if name in rows[0]]
    designs, _ = design_matrix(study.family, {n: np.array([r[n] for r in rows]) for n in known})
    return pd.DataFrame(design_outputs(study.family, designs, names, study.accuracy, study.window))


@pytest.mark.parametrize("name", NAMES)
def test_accepted_figures_are_those_of_the_accepted_links(name: str) -> None:
    study, expected = accepted(name)
    found = outputs(study, [expected["optimum"]], study.want).iloc[0]
    assert found["status"] == 0
    for output in study.want:
        off = float(found[output]) - expected["optimum"][output]
        if output.startswith("phi_"):
            off = math.remainder(off, 2.0 * math.pi)
        # A place of an extremum is known to the root of what its value is.
        allowed = 1e-6 if output.startswith("phi_") else 1e-9
        assert abs(off) <= allowed * (1.0 + abs(expected["optimum"][output])), output


@pytest.mark.parametrize("name", NAMES)
def test_accepted_optimum_keeps_limits_and_bounds(name: str) -> None:
    study, expected = accepted(name)
    best = expected["optimum"]
    for limit in study.limits:
        low, high = limit.minimum, limit.maximum
        wide = Limit(
            limit.output, None if low is None else low - CLOSE * abs(low), None if high is None else high + CLOSE * high
        )
        assert meets(wide, np.array([best[limit.output]], float))[0], limit
    for axis, (low, high) in study.space.bounds.items():
        assert low - 1e-9 <= best[axis] <= high + 1e-9


def test_five_link_gains_with_h_what_the_page_says() -> None:
    study, expected = accepted("looper1097")
    rows = expected["along_h"]
    found = outputs(study, [row | {"alpha": math.pi / 2, "s2": 0.0, "mode": 1.0} for row in rows], study.want)
    assert [row["h"] for row in rows] == [0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    np.testing.assert_allclose(found["max_abs_d2psi"], [row["max_abs_d2psi"] for row in rows], rtol=1e-9)
    assert (np.diff(found["max_abs_d2psi"]) < 0.0).all()
    assert 1.0 - found["max_abs_d2psi"].iloc[-1] / found["max_abs_d2psi"].iloc[0] == pytest.approx(0.077, abs=5e-4)
    assert (np.degrees(found["max_abs_beta"]) > 45.0).all() and (np.degrees(found["max_abs_beta"]) < 52.0).all()
    assert (found["swing"].abs() >= math.radians(50.0) * (1.0 - CLOSE)).all()
    assert (found["stroke_ratio"] >= 1.2 * (1.0 - CLOSE)).all()


def test_five_link_with_h_zero_is_the_best_crank_rocker_of_its_locus() -> None:
    _, expected = accepted("looper1097")
    row = expected["along_h"][0]
    # Sought among crank-rockers on their locus, where swing and stroke ratio hold exactly, by another search.
    found = sweep.summarise(
        "rssr",
        {k: row[k] for k in ("a", "b", "c", "e", "f", "g", "branch")} | {"alpha": math.pi / 2},
        ["max_abs_d2psi"],
    )
    assert found["max_abs_d2psi"][0] == pytest.approx(0.5218954168325, rel=1e-7)


def test_tip_stays_with_the_needle_and_off_it_on_a_dense_grid() -> None:
    study, expected = accepted("looper-sphere")
    known = expected["optimum"]
    table = {name: known[name] for name in study.family.parameter_names if name in known}
    phi = np.radians(np.arange(0.0, 360.0, 0.01))
    poses = sweep.evaluate(study.family, table, ["clearance", "looper.p_x", "looper.p_y", "looper.p_z"], phi=phi)
    assert (poses["status"] == 0).all() and poses["clearance"].min() >= 0.1
    near = phi[poses["clearance"] <= 0.5]
    # One stretch of 20 degrees, to two steps of the grid.
    assert np.degrees(near[-1] - near[0]) == pytest.approx(20.0, abs=0.02)
    assert len(near) == pytest.approx(2000, abs=2)
    assert np.ptp(poses["looper.p_y"]) == pytest.approx(20.0, abs=1e-4)
    # On a sphere about the point where both axes of the looper meet; the looper's z is the machine's y.
    at = [expected["optimum"][f"looper.{x}_at"] for x in "xyz"]
    centre = np.array([at[0] + expected["optimum"]["looper.e1"], at[1] + expected["optimum"]["looper.o"], at[2]])
    radius = np.linalg.norm(poses[["looper.p_x", "looper.p_y", "looper.p_z"]].to_numpy() - centre, axis=1)
    assert np.ptp(radius) < 1e-12 * radius.max() and 30.0 < radius.max() < 45.0


def test_optimum_of_the_sphere_is_better_than_feasible_designs_of_a_sample() -> None:
    study, expected = accepted("looper-sphere")
    rows = pd.DataFrame(compute_chunk(study, 0, 4096).columns)
    assert len(rows) > 20
    assert (rows["looper.max_acceleration_p"] > expected["optimum"]["looper.max_acceleration_p"]).all()


def test_best_slotted_link_for_equal_times_is_the_closed_form_one() -> None:
    _, expected = accepted("looper-slotted")
    best = expected["optimum"]
    # Axes at right angles, e = s = 0: tan psi is (a/f) cos phi turned by a quarter, so tan(swing/2) = a/|f|.
    assert best["alpha"] == pytest.approx(math.pi / 2, abs=1e-6) and abs(best["e"]) + abs(best["s"]) < 1e-6
    k = best["a"] / abs(best["f"])
    assert k == pytest.approx(math.tan(math.radians(25.0)), rel=1e-6)
    phi = np.linspace(0.0, np.pi, 100001)
    u, v = np.cos(phi), np.sin(phi)
    d2psi = -k * u / (1.0 + k * k * u * u) - 2.0 * k**3 * u * v * v / (1.0 + k * k * u * u) ** 2
    assert best["max_abs_d2psi"] == pytest.approx(np.abs(d2psi).max(), rel=1e-6)
    assert best["max_abs_d2psi"] < math.radians(25.0)  # a sine of the same swing


def test_slotted_link_goes_on_where_the_pressure_angle_stops_crank_rockers() -> None:
    study, expected = accepted("looper-slotted")
    slotted, other = pd.DataFrame(expected["front"]), pd.DataFrame(expected["crank_rockers"])
    found = outputs(study, expected["front"], ("max_abs_d2psi", "stroke_ratio", "swing", "max_pressure_angle"))
    np.testing.assert_allclose(found["max_abs_d2psi"], slotted["max_abs_d2psi"], rtol=1e-9)
    assert (found["stroke_ratio"] >= slotted["bound"] * (1.0 - CLOSE)).all() and (
        found["max_pressure_angle"] < 1e-6
    ).all()
    again = sweep.summarise(
        "rssr", other[[*"abcefg", "alpha", "branch"]],
        ["max_abs_d2psi", "max_pressure_angle", "swing", "stroke_ratio"], accuracy=1e-8,
    )  # fmt: skip
    np.testing.assert_allclose(again["max_abs_d2psi"], other["max_abs_d2psi"], rtol=1e-6)
    np.testing.assert_allclose(np.abs(again["swing"]), math.radians(50.0), rtol=1e-9)
    np.testing.assert_allclose(again["stroke_ratio"], other["ratio"], rtol=1e-9)
    keeps = np.degrees(again["max_pressure_angle"]) <= 45.0 + 1e-4
    assert keeps.tolist() == [True, True, True, False, False]
    gain = found["max_abs_d2psi"].to_numpy()[:3] / again["max_abs_d2psi"].to_numpy()[:3] - 1.0
    assert (gain > 0.0).all() and (gain < 0.015).all()
