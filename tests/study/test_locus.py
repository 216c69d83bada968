"""[locus] in study files: prescribed limit positions are met, known optima come out, faults are told.

Tolerance of what is prescribed: the synthesis is accurate to some hundred units of rounding and the limit positions
report their own errors, 1e-10 covers both away from parallel limit positions; the optimum is held by its equations to
1e-9 and flat in what remains, so its value is good to 1e-9 and its links to the 1e-6 asked for.
"""

from __future__ import annotations

import cmath
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from kernels import status as st
from sweep.chunks.chunk import compute_chunk
from sweep.dataset.files import beside
from sweep.engine.run import run
from sweep.errors import StudyError
from sweep.optimise.starts.dataset import random_designs
from sweep.optimise.starts.posing import problem_of
from sweep.study import Study, load_study
from sweep.study.study import Limit

PHI0 = 'phi0 = { from = 160, to = 170, count = 3, unit = "deg" }'

ROCKER = """
[study]
name = "rocker"
[mechanism]
family = "rssr"
[locus]
swing = { values = [45, -60], unit = "deg" }
phi0 = "165 deg"
phi_ext = { from = 0, to = 360, count = 61, unit = "deg" }
[design]
e = "100 mm"
f = { values = [-20, 30], unit = "mm" }
g = "15 mm"
alpha = { values = [0, 70], unit = "deg" }
[limits]
max_pressure_angle = { max = 70, unit = "deg" }
c = { max = 120, unit = "mm" }
"""

SLIDER = """
[study]
name = "slider"
[mechanism]
chain = ["rssp"]
[locus]
stroke = "24.5 mm"
phi0 = { from = 160, to = 200, count = 3, unit = "deg" }
phi_ext = { from = 10, to = 350, count = 35, unit = "deg" }
[design]
f = "8 mm"
alpha = "35 deg"
[limits]
rotatable = true
"""

# Freudenstein and Primrose: swing 45 degrees over 165 degrees of crank, ground link 100 mm.
BEST_TRANSMISSION = """
[study]
name = "transmission"
[mechanism]
family = "rssr"
[locus]
swing = "45 deg"
phi0 = "165 deg"
phi_ext = { from = 0, to = 360, count = 181, unit = "deg" }
[design]
e = "100 mm"
f = "0 mm"
g = "0 mm"
alpha = "0 deg"
[objective]
minimise = "max_pressure_angle"
[optimise]
starts = 3
seed = 1
"""


def study_of(folder: Path, text: str) -> Study:
    path = folder / "study.toml"
    path.write_text(text)
    return load_study(path)


def rows(study: Study) -> pd.DataFrame:
    return pd.DataFrame(compute_chunk(study, 0, study.space.count).columns)


def test_every_row_has_the_limit_positions_of_its_design(tmp_path):
    study = study_of(tmp_path, ROCKER)
    found = rows(study)
    asked = study.space.columns(0, study.space.count)
    assert set(np.sign(found.swing)) == {1.0, -1.0} and set(found.branch) == {1.0, -1.0}
    assert len(found) > 20
    for name in ("swing", "phi0"):
        np.testing.assert_allclose(found[name], asked[name][found.design], atol=1e-10, rtol=0)
    # The axis ends at a whole turn, which as an output is zero again.
    np.testing.assert_allclose(np.exp(1j * (found.phi_ext - asked["phi_ext"][found.design])), 1.0, atol=1e-10, rtol=0)
    assert (found.max_pressure_angle <= math.radians(70)).all() and (found.c <= 120.0).all()


def test_slider_crank_has_its_stroke(tmp_path):
    study = study_of(tmp_path, SLIDER)
    found = rows(study)
    asked = study.space.columns(0, study.space.count)
    assert len(found) > 5
    np.testing.assert_allclose(found.stroke, 24.5, rtol=1e-10)
    np.testing.assert_allclose(found.phi0, asked["phi0"][found.design], atol=1e-10, rtol=0)


def test_places_without_a_mechanism_keep_their_status_and_are_counted(tmp_path):
    study = study_of(tmp_path, ROCKER + '[output]\nkeep = "all"\n')
    result = compute_chunk(study, 0, study.space.count)
    refused = result.columns["status"] == st.NOT_ADMISSIBLE
    assert result.counts_by_status[st.NOT_ADMISSIBLE] == refused.sum() > 100
    assert np.isnan(result.columns["a"][refused]).all() and np.isnan(result.columns["swing"][refused]).all()
    assert np.isfinite(result.columns["a"][~refused]).all()


def test_first_stage_of_a_chain_is_prescribed_by_numbered_names(tmp_path):
    text = re.sub(r"^(swing|phi0|phi_ext|e|f|g|alpha|max_pressure_angle|c) =", r"\g<1>1 =", ROCKER, flags=re.MULTILINE)
    second = 'a2 = "20 mm"\nb2 = "90 mm"\ne2 = "10 mm"\nf2 = "0 mm"\nalpha2 = "0 deg"\n[limits]'
    text = text.replace('family = "rssr"', 'chain = ["rssr", "rssp"]').replace("[limits]", second)
    found, alone = rows(study_of(tmp_path, text)), rows(study_of(tmp_path, ROCKER))
    np.testing.assert_array_equal(found.design, alone.design)
    np.testing.assert_allclose(found[["a1", "b1", "c1"]], alone[["a", "b", "c"]], rtol=1e-15)
    np.testing.assert_allclose(found.swing1, alone.swing, atol=1e-12)


def test_prescribed_values_are_equations_of_the_optimiser_and_no_test_of_the_sweep(tmp_path):
    study = study_of(tmp_path, BEST_TRANSMISSION)
    swing, phi0 = math.radians(45), math.radians(165)
    assert study.limits == (Limit("swing", swing, swing), Limit("phi0", phi0, phi0))
    assert study.tested_limits == ()
    swept = study_of(
        tmp_path, BEST_TRANSMISSION.replace('"165 deg"', '{ from = 160, to = 170, count = 3, unit = "deg" }')
    )
    assert swept.limits[1] == Limit("phi0", math.radians(160), math.radians(170))
    designs = np.tile([27.0, 60.0, 73.0, 100.0, 0.0, 0.0, 0.0, -1.0], (3, 1))
    problem = problem_of(study, designs, on_locus=False)
    assert problem.variables == ("a", "b", "c") and "phi_ext" not in problem.fixed and len(problem.limits) == 2
    along = problem_of(study, designs)
    assert along.variables == ("phi_ext",) and along.fixed["swing"] == swing and along.limits == ()
    assert problem_of(swept, designs).variables == ("phi0", "phi_ext")


def test_fingerprint_knows_what_is_prescribed(tmp_path):
    one, other = (study_of(tmp_path, BEST_TRANSMISSION.replace("165 deg", phi0)) for phi0 in ("165 deg", "166 deg"))
    assert one.fingerprint != other.fingerprint


def best_transmission(swing: float, phi0: float) -> tuple[float, float, float, float]:
    """Links over the ground link, and the transmission angle, from the cubic of Freudenstein and Primrose.

    Its root gives the ratio of coupler and crank; the rocker's pivot is the centre of the rotation by the swing that
    takes the joint from its extended to its folded position (complex numbers, crank centre at 0, crank 1).
    """
    t, u = math.tan(phi0 / 2.0), math.tan((phi0 - swing) / 2.0)
    roots = np.roots([1.0, 2.0, -(t**2), -(t**2 / u**2) * (1.0 + t**2)])
    q = float(max(r.real for r in roots if abs(r.imag) < 1e-12))
    b = abs(t) / math.sqrt(q)
    extended, folded = b + 1.0, (b - 1.0) * cmath.exp(1j * (phi0 - math.pi))
    turn = cmath.exp(1j * swing)
    pivot = (extended * turn - folded) / (turn - 1.0)
    c, d = abs(extended - pivot), abs(pivot)
    least, most = (math.acos((b * b + c * c - (d + side) ** 2) / (2.0 * b * c)) for side in (-1.0, 1.0))
    return 1.0 / d, b / d, c / d, min(least, math.pi - most)


@pytest.mark.parametrize(("swing", "phi0"), [(45.0, 165.0), (70.0, 170.0), (40.0, 200.0)])
def test_best_transmission_crank_rocker_comes_out(tmp_path, swing, phi0):
    text = BEST_TRANSMISSION.replace("45 deg", f"{swing} deg").replace("165 deg", f"{phi0} deg")
    if phi0 > 180.0:  # the forward stroke takes longer: the same linkage with the rocker on the other side
        text = text.replace(f'swing = "{swing}', f'swing = "{-swing}')
        phi0 = 360.0 - phi0
    a, b, c, mu = best_transmission(math.radians(swing), math.radians(phi0))
    folder = run(study_of(tmp_path, text), tmp_path / "out", jobs=1)
    best = pd.read_parquet(beside(folder) / "_optimum.parquet").iloc[0]
    assert best.ended == "converged" and best.agree == 3
    np.testing.assert_allclose([best.a / 100, best.b / 100, best.c / 100], [a, b, c], rtol=1e-6)
    assert math.pi / 2 - best.max_pressure_angle == pytest.approx(mu, abs=1e-9)
    units = pq.read_schema(next(folder.glob("part-*"))).field("phi_ext").metadata
    assert units[b"unit"] == b"rad"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("swing = {", "swnig = {"), "locus.swnig: unknown key; allowed: swing, did you mean 'swing'?"),
        (("165 deg", "365 deg"), "locus.phi0 = '365 deg'; allowed: an angle between 0 and 360 deg"),
        (("165 deg", "165 mm"), "locus.phi0 = '165 mm'; allowed: an angle"),
        (("values = [45, -60]", "from = -45, to = 45, count = 3"), "allowed: an angle below one turn, or its negative"),
        (('phi0 = "165 deg"\n', ""), "locus.phi0 is missing; needed: crank angle from the extended"),
        (("g = ", 'a = "10 mm"\ng = '), "design.a = '10 mm'; allowed: nothing here: it follows from [locus]"),
        (("[limits]", '[limits]\nswing = { max = 50, unit = "deg" }'), "[locus] prescribes it; with [tolerance]"),
        (("[limits]", '[limits]\nswing = "40 +- 60 deg"'), "[locus] prescribes it; with [tolerance]"),
        (('"rssr"', '"geared_dwell"'), "allowed: a mechanism that is or begins with rssr or rssp"),
    ],
)  # fmt: skip
def test_faults_of_locus_are_told(tmp_path, change, message):
    with pytest.raises(StudyError) as caught:
        study_of(tmp_path, ROCKER.replace(*change))
    assert message in str(caught.value)


def test_a_band_around_what_is_prescribed_counts_in_what_is_made(tmp_path):
    """The swing of a design on the locus is exact; of what is made of it some has another one."""
    made = BEST_TRANSMISSION.replace("count = 181", "count = 19") + '[tolerance]\nlengths = "0.3 mm"\n'
    exact = study_of(tmp_path, made)
    assert exact.bands == ()
    shares = {}
    for band in (None, "0.1", "1", "60"):
        text = made if band is None else made.replace("[optimise]", f'[limits]\nswing = "45 +- {band} deg"\n[optimise]')
        study = study_of(tmp_path, text)
        shares[band] = pd.read_parquet(
            beside(run(study, out=tmp_path / f"band{band}" / "designs", jobs=1)) / "_optimum.parquet"
        )
    yields = {band: frame["yield"].iloc[0] for band, frame in shares.items()}
    assert yields[None] == 1.0  # nothing is limited that could be missed
    assert 0.02 < yields["0.1"] < yields["1"] <= yields["60"] == 1.0
    values = [frame["max_pressure_angle"].iloc[0] for frame in shares.values()]
    np.testing.assert_allclose(values, values[0], rtol=1e-9)  # the optimum itself is the same
    assert study.bands == study.limits[-1:] and study.tested_limits == ()


@pytest.mark.parametrize(
    ("band", "refused"), [("46 +- 0.5 deg", True), ("45.5 +- 0.6 deg", False), ("<= 46 deg", True)]
)
def test_a_band_has_room_on_both_sides(band, refused, tmp_path):
    text = BEST_TRANSMISSION + f'[tolerance]\nlengths = "0.3 mm"\nrobust = "90 %"\n[limits]\nswing = "{band}"\n'
    if not refused:
        assert [x.output for x in study_of(tmp_path, text.replace('phi0 = "165 deg"', PHI0)).bands] == ["swing"]
        return
    with pytest.raises(StudyError, match=r"limits\.swing = .*; allowed: nothing here: \[locus\] prescribes it; with"):
        study_of(tmp_path, text)


@pytest.mark.parametrize(("limit", "ends"), [("max = 2", (None, 2.0)), ("min = 9000", (9000.0, None))])
def test_link_that_no_design_gives_its_limits_has_bounds_within_them(tmp_path, limit, ends):
    """Couplers of the sampled designs reach from 30 to some thousand mm."""
    text = """
[study]
name = "far"
[mechanism]
family = "rssr"
[locus]
swing = { from = 45, to = 70, unit = "deg" }
phi0 = { from = 165, to = 195, unit = "deg" }
phi_ext = { from = 0, to = 360, unit = "deg" }
[design]
sample = { kind = "sobol", n = 2000 }
e = { from = 5, to = 25, unit = "mm" }
f = { from = 30, to = 50, unit = "mm" }
g = { from = -20, to = 20, unit = "mm" }
alpha = "90 deg"
[limits]
b = { LIMIT, unit = "mm" }
[objective]
minimise = "max_abs_d2psi"
[optimise]
"""
    (tmp_path / "study.toml").write_text(text.replace("LIMIT", limit))
    study = load_study(tmp_path)
    problem = problem_of(study, random_designs(study, 4, 0), on_locus=False)
    k = problem.variables.index("b")
    low, high = float(problem.lower[k]), float(problem.upper[k])
    assert 0.0 < low < high and all(given in (None, end) for given, end in zip(ends, (low, high), strict=True))
