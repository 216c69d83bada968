"""The study geared-dwell: its smoke version run from the outside, against the accepted figures and the closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.dataset.files import beside
from sweep.evaluation.summaries import design_outputs
from sweep.study import load_study

FOLDER = Path(__file__).parents[2] / "studies" / "geared-dwell"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
TOLERANCE = EXPECTED["relative_tolerance"]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    return sweep.run(FOLDER, out=tmp_path_factory.mktemp("geared-dwell") / "designs", smoke=True)


def test_full_study_covers_a_million_designs_and_draws_the_optimum_offset():
    study = load_study(FOLDER)
    assert study.space.count == 1001 * 1001
    curve = study.data["report"]["curves"][0]
    assert all(k == a for k, a in curve["points"])


def test_optimum_and_reference_are_the_accepted_ones(swept):
    best = pd.read_parquet(beside(swept) / "_optimum.parquet").set_index("role")
    for role in ("optimum", "reference"):
        for name, value in EXPECTED[role].items():
            assert best.loc[role, name] == pytest.approx(value, rel=TOLERANCE)


def test_accepted_number_of_feasible_designs_of_the_full_lattice():
    study = load_study(FOLDER)
    columns = study.space.columns(0, study.space.count)
    designs = np.stack([columns["k"], columns["a"]], axis=1)
    wanted = [limit.output for limit in study.limits]
    found = design_outputs(study.family, designs, wanted, study.accuracy)
    kept = found["status"] == st.OK
    for limit in study.limits:
        values = found[limit.output]
        kept &= values >= (limit.minimum if limit.minimum is not None else -np.inf)
        kept &= values <= (limit.maximum if limit.maximum is not None else np.inf)
    assert kept.sum() == EXPECTED["feasible_designs"]


def test_accepted_optimum_is_the_closed_form():
    k = 2.0 / np.sqrt(3.0)
    inner = 3.0 * (1.0 + k**2)
    w = (1.0 + 2.0 * k**2) / (inner + np.sqrt(inner**2 - 1.0 - 2.0 * k**2))
    assert EXPECTED["optimum"]["k"] == pytest.approx(k, rel=1e-15)
    assert EXPECTED["optimum"]["max_abs_d2psi"] == pytest.approx(
        np.sqrt(w) * (1 + 2 * k**2 - w) / (1 + w) ** 2, rel=1e-15
    )


def test_valley_of_the_map_follows_the_optimum_offset(swept):
    designs = sweep.load(swept)
    feasible = designs[designs.status == st.OK]
    best = feasible.loc[feasible.groupby("k").max_abs_d2psi.idxmin()]
    free = best[best.dwell_deviation < np.radians(9.5)]
    assert len(free) > 15
    assert (free.a - free.k).abs().max() <= 0.1  # one step of the smoke lattice
    assert (designs[designs.status == st.OK].dwell_angle >= np.pi / 3).all()
