"""Heddle drive and back-rest through `sweep.evaluate`: every row of the tables has its place in the contract."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st

FOLDER = Path(__file__).parents[1] / "oracle"


def rows(table, kind):
    return [r for r in json.loads((FOLDER / f"{table}_open.json").read_text())["rows"] if r["kind"] == kind]


def test_heddle_rows_of_motion_are_evaluated():
    chain = [r for r in rows("heddle", "chain") if not r["tag"].startswith("near_toggle")]
    table = pd.DataFrame([r["in"] for r in chain]).rename(columns={"theta": "phi"})
    names = list(chain[0]["out"])
    got = sweep.evaluate("heddle", table, names)
    assert (got.status == st.OK).all()
    for name in names:
        expected = np.array([float(r["out"][name]) for r in chain])
        # conditioned rows are judged by heddle/test_reference.py; here the names and the order are
        np.testing.assert_allclose(got[name], expected, rtol=1e-11)


@pytest.mark.parametrize("kind", ["geometry", "tension"])
def test_backrest_rows_are_evaluated(kind):
    given = rows("backrest", kind)
    names = list(given[0]["out"])
    got = sweep.evaluate("backrest", pd.DataFrame([r["in"] for r in given]), names)
    assert (got.status == st.OK).all()
    for name in names:
        expected = np.array([float(r["out"][name]) for r in given])
        np.testing.assert_allclose(got[name], expected, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(
    "family, kind", [("backrest_closure", "source_system"), ("backrest_tension", "position_for_tension")]
)
def test_backrest_positions_are_evaluated_root_by_root(family, kind):
    given = rows("backrest", kind)
    for number in (1, 2):
        got = sweep.evaluate(family, pd.DataFrame([r["in"] for r in given]).assign(root=number), ["phi", "roots"])
        for k, row in enumerate(given):
            roots = row["out"]["roots"]
            assert got.roots[k] == len(roots)
            assert got.status[k] == (st.OK if number <= len(roots) else st.NO_ROOT)
            if number <= len(roots):
                assert got.phi[k] == pytest.approx(float(roots[number - 1]["phi"]), abs=1e-14)


def test_backrest_drift_over_the_beam_and_its_place():
    example = sweep.families.family("backrest").example | {"s1": 0.0, "s2": 0.0}
    got = sweep.summarise(
        "backrest", example, ["max_K_couple", "rho_max_K_couple", "min_K_couple"], accuracy=1e-9
    ).iloc[0]
    # the worked example: most with the empty beam, 1558.0 N, and least near 0.23 m
    assert got.rho_max_K_couple == 0.09375
    assert got.max_K_couple == pytest.approx(1558.0, abs=0.05)
    dense = sweep.evaluate("backrest", example, "K_couple", phi=np.linspace(0.09375, 0.375, 2001)).K_couple
    assert got.min_K_couple == pytest.approx(dense.min(), rel=1e-6)


@pytest.mark.parametrize("name", ["backrest", "backrest_tension", "backrest_closure"])
def test_backrest_slopes_over_the_beam_come_by_the_complex_step(name):
    from sweep.families.base import Angles

    family = sweep.families.family(name)
    design = np.array([[family.example.get(p.name, p.default) for p in family.parameters]])
    rho, wanted = np.array([[0.12, 0.2, 0.3]]), frozenset(("K", "R1", "theta"))

    def at(radius):
        still = np.zeros_like(radius)
        return family.poses(design.astype(radius.dtype), Angles(radius, still, still), wanted)

    exact, ahead, behind = at(rho + 1e-30j), at(rho + 1e-6), at(rho - 1e-6)
    for output in wanted:
        slope = (ahead[output] - behind[output]) / 2e-6
        # differences of that step are good to some 1e-9 of the tension
        np.testing.assert_allclose(exact[output].imag / 1e-30, slope, rtol=1e-7, atol=1e-7)


def test_backrest_extrema_over_the_beam_are_followed_to_rest():
    from sweep.families.base import Accuracy
    from sweep.optimise.local.model import Model
    from sweep.optimise.problem.program import Program
    from sweep.optimise.problem.statement import Problem

    family = sweep.families.family("backrest")
    table = family.example | {"s1": 0.0, "s2": 0.0, "K0": 1482.0}
    design = np.array([table.get(p.name, p.default) for p in family.parameters], np.float64)
    free = ("H", "psi")
    place = np.array([table[name] for name in free])
    fixed = {n: float(x) for n, x in zip(family.parameter_names, design, strict=True) if n not in free}
    problem = Problem(family, free, 0.9 * place, 1.1 * place, fixed, "max_abs_drift", (), None, Accuracy(target=1e-9))
    model = Model(problem, Program(problem), design, lambda: False)
    calls = model.curves.calls
    state = model.state(np.array([0.52, 0.48]))
    assert model.curves.calls - calls < 10  # Newton settles; what wanders takes a dozen rounds
    moved = dict(zip(family.parameter_names, state.design, strict=True))
    expected = sweep.summarise("backrest", moved, ["max_abs_drift"], accuracy=1e-10).max_abs_drift[0]
    assert state.objective * model.scale == pytest.approx(expected, rel=1e-9)
