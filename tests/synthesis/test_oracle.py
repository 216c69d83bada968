"""Loci against the 25-digit table and against plain geometry at 40 digits.

Tolerance 16 x 2^-53 max(cond, |y|), as the sheet states: the inputs are rounded once, sines and the locus equation add
a few roundings of the same size.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels import synthesis
from tests.reference import synthesis as naive

ROWS = json.loads((Path(__file__).parents[1] / "oracle" / "synthesis_open.json").read_text())["rows"]
RSSR = [row for row in ROWS if row["mechanism"] == "RSSR"]
RSSP = [row for row in ROWS if row["mechanism"] == "RSSP"]
EPS = mpf(2) ** -53
FACTOR = 16.0


def factor(got, expected, cond, angle=False):
    error = mpf(float(got)) - expected
    if angle:
        error -= 2 * mp.pi * mp.nint(error / (2 * mp.pi))
    return float(abs(error) / (EPS * max(mpf(cond), abs(expected))))


def worst_of_best(family, rows, columns, names):
    """Per row the better of the two solutions, its largest error factor of all outputs."""
    table = {ours: [row[theirs] for row in rows] for ours, theirs in columns.items()}
    frame = sweep.synthesise(family, table)
    assert len(frame) == 2 * len(rows)
    factors = []
    with mp.workdps(40):
        for k, row in enumerate(rows):
            solutions = frame.loc[k]
            solutions = solutions[solutions["status"] == st.OK]
            assert len(solutions) >= 1, (row["id"], row["kind"])
            assert (solutions["branch"] == row["sigma"]).all()
            best = min(
                max(
                    factor(s[ours], mpf(row[theirs]), row["cond"][theirs], theirs == "phi1")
                    for ours, theirs in names.items()
                )
                for _, s in solutions.iterrows()
            )
            factors.append(best)
    return np.array(factors)


def test_crank_rockers_match_the_oracle_on_every_row():
    columns = {"swing": "psi0"} | {n: n for n in ("phi0", "psi1", "e", "f", "g", "alpha")}
    factors = worst_of_best("rssr", RSSR, columns, {"a": "a", "b": "b", "c": "c", "phi_ext": "phi1"})
    assert len(factors) == 86
    assert factors.max() <= FACTOR


def test_slider_cranks_match_the_oracle_on_every_row():
    columns = {"stroke": "S0"} | {n: n for n in ("phi0", "e", "f", "alpha")}
    factors = worst_of_best("rssp", RSSP, columns, {"a": "a", "b": "b", "s_ext": "S1", "phi_ext": "phi1"})
    assert len(factors) == 32
    assert factors.max() <= FACTOR


def test_linear_parametrisation_matches_plain_geometry():
    """The same rows by phi1: expected values and condition numbers from the reference at the given doubles."""
    inputs = [[row[n] for n in ("psi0", "phi0")] + [float(row["phi1"])] for row in RSSR]
    inputs = np.array(
        [head + [row[n] for n in ("e", "f", "g", "alpha")] for head, row in zip(inputs, RSSR, strict=True)]
    )
    names = ("swing", "phi0", "phi1", "e", "f", "g", "alpha")
    frame = sweep.synthesise("rssr", dict(zip(names, inputs.T, strict=True)))
    assert (frame["status"] == st.OK).all()
    largest = 0.0
    with mp.workdps(40):
        for k, row in enumerate(inputs):
            exact = naive.rssr(*row)
            step = mpf(10) ** -15
            moved = [naive.rssr(*(mpf(x) * (1 + step * (i == j)) for i, x in enumerate(row))) for j in range(len(row))]
            for name in ("a", "b", "c"):
                cond = sum(abs(m[name] - exact[name]) for m in moved) / step
                largest = max(largest, factor(frame[name][k], exact[name], cond))
    assert 0.1 < largest <= FACTOR


def test_negative_control_phi0_in_place_of_the_swing_fails():
    """The misprint of (9), phi0 under every sine, is far outside the tolerance."""
    columns = {"swing": "phi0"} | {n: n for n in ("phi0", "psi1", "e", "f", "g", "alpha")}
    rows = [row for row in RSSR if row["kind"] == "regular"]
    frame = sweep.synthesise("rssr", {ours: [row[theirs] for row in rows] for ours, theirs in columns.items()})
    best = [
        min((abs(float(s["c"]) - float(row["c"])) / float(row["c"]) for _, s in frame.loc[k].iterrows()), default=9.0)
        for k, row in enumerate(rows)
    ]
    assert np.nanmin(np.where(np.isnan(best), 9.0, best)) > 1e-3


@pytest.mark.parametrize(
    "kernel", [synthesis.rssr_on_locus, synthesis.rssr_of_size, synthesis.rssr_at_direction, synthesis.rssp_on_locus,
               synthesis.rssp_at_offset, synthesis.rssp_at_place, synthesis.rssr_arc_ends, synthesis.rssp_arc_ends]
)  # fmt: skip
def test_jitted_equals_plain_python(kernel):
    crank = np.array([[r["psi0"], r["phi0"], float(r["phi1"]), r["e"], r["f"], r["g"], r["alpha"]] for r in RSSR[::9]])
    slider = {
        "on_locus": [[r["S0"], r["phi0"], float(r["phi1"]), r["f"], r["alpha"]] for r in RSSP[::5]],
        "at_offset": [[r["S0"], r["phi0"], r["e"], r["f"], r["alpha"]] for r in RSSP[::5]],
        "at_place": [[r["S0"], float(r["S1"]), r["e"], r["f"], r["alpha"]] for r in RSSP[::5]],
    }
    name = kernel.py_func.__name__
    rows = crank if name.startswith("rssr") else np.array(slider.get(name.removeprefix("rssp_"), slider["on_locus"]))
    results = []
    for function in (kernel, kernel.py_func):
        if name.endswith("arc_ends"):
            outputs = [np.empty((len(rows), 8 if name.startswith("rssr") else 4))]
            function(rows, *outputs)
        else:
            outputs = [np.empty(len(rows), np.uint8), np.empty(len(rows), np.uint8)]
            outputs += [np.empty((len(rows), 8 if name.startswith("rssr") else 6)), np.empty(len(rows))]
            outputs += [np.empty(len(rows))] * (name in ("rssp_at_offset", "rssp_at_place"))
            roots = [np.ones(len(rows))] if name in ("rssr_at_direction", "rssp_at_offset") else []
            function(rows, *roots, *outputs)
        results.append(outputs)
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, plain)


# Where the table does not go: the rocker ball close to the crank axis or two roots close together, by psi1 ...
CLOSE_RSSR = (
    (-0.28999613801222174, 2.4676961902828674, 1.5665163670170728, 0.0, -39.255, 0.737, 0.7627056462691528),
    (-0.3486795772024203, 2.526705810769529, 1.5600222628457443, 0.0, 48.249, 12.66, -2.9843519854385976),
    (0.1457514745657605, 3.1560686769560133, -1.1463114266383276, -17.155, -25.349, 35.684, -0.8419599370054853),
    (-0.28138125650927237, 2.6152440757413795, -2.991373733774806, 38.283, -23.492, 0.0, -1.7355718542609346),
)
# ... and strokes of nearly equal time, by e.
CLOSE_RSSP = (
    (-54.80952562375366, 3.1416926535897933, 0.08076430898817533, -31.173705699843254, -2.3048516029443107),
    (46.2563805558641, 3.141592663589793, -0.9076895371880904, -3.7552679029052953, -2.9250663228509284),
    (54.468511640711064, 3.141592653590793, 0.12479642313298767, 23.337097928207427, -1.3169935571052802),
    (59.33515563242346, 3.141591653589793, -0.6928009387367708, 54.45016774511396, 0.31695665503678194),
)


def rssr_by_psi1(swing, phi0, psi1, *rest, near):
    """Plain geometry by phi1, and phi1 from the rocker angle asked for."""
    phi1 = mp.findroot(lambda x: mp.sin(naive.rssr(swing, phi0, x, *rest)["psi1"] - psi1), near)
    return naive.rssr(swing, phi0, phi1, *rest) | {"phi1": phi1}


def rssp_by_offset(stroke, phi0, e, f, alpha, near):
    """Plain geometry by s1, and s1 from the crank angle asked for."""
    s1 = mp.findroot(lambda x: mp.sin(naive.rssp(stroke, x, e, f, alpha)["phi0"] - phi0), near)
    return naive.rssp(stroke, s1, e, f, alpha) | {"s1": s1}


@pytest.mark.parametrize(
    ("family", "rows", "columns", "exact", "start", "names"),
    [
        ("rssr", CLOSE_RSSR, ("swing", "phi0", "psi1", "e", "f", "g", "alpha"), rssr_by_psi1, "phi_ext",
         {"a": "a", "b": "b", "c": "c", "phi_ext": "phi1"}),
        ("rssp", CLOSE_RSSP, ("stroke", "phi0", "e", "f", "alpha"), rssp_by_offset, "s_ext",
         {"a": "a", "b": "b", "s_ext": "s1", "phi_ext": "phi1"}),
    ],
)  # fmt: skip
def test_close_to_singular_places_the_tolerance_holds_too(family, rows, columns, exact, start, names):
    frame = sweep.synthesise(family, dict(zip(columns, np.array(rows).T, strict=True)))
    found = frame[frame["status"] == st.OK]
    assert set(found.index) == set(range(len(rows)))
    with mp.workdps(40):
        step = mpf(10) ** -15
        for k, solution in found.iterrows():
            row = [mpf(x) for x in rows[k]]
            expected = exact(*row, near=mpf(solution[start]))
            moved = [
                exact(*(x * (1 + step * (i == j)) for i, x in enumerate(row)), near=expected[names[start]])
                for j in range(len(row))
            ]
            for ours, theirs in names.items():
                cond = sum(abs(m[theirs] - expected[theirs]) for m in moved) / step
                turn = expected[theirs] % (2 * mp.pi) if theirs == "phi1" else expected[theirs]
                assert factor(solution[ours], turn, cond, theirs == "phi1") <= FACTOR, (k, ours)
