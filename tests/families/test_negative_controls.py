"""Methods known to be wrong must fail the very tests that the kernels pass; otherwise those tests prove nothing.

Each control is a full substitute for the closure or the derivative, written out here and judged like the kernels: by
the factor on the oracle table (8 x 2^-53 max(cond, |y|)), by the exact branch, or by the status.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numba
import numpy as np
import pytest

from kernels import status as st
from kernels.linkage.verdict import turning_status
from sweep.families import family
from sweep.families.base import Angles
from tests.support import oracle_factors as oracle
from tests.support import sixty_digits as reference

FOLDER = Path(__file__).parents[1] / "oracle"
ROWS = [row for row in oracle.read(FOLDER, "rssr") if row["feasible"] and row["kind"] != "hard_scale"]
NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
DESIGNS = np.array([[row[name] for name in NAMES] for row in ROWS], dtype=float)
PHI = np.array([row["phi"] for row in ROWS])
RSSR = family("rssr")
FACTOR = 8.0


def closure(designs, phi):
    """X, Y, W in units of the crank's own, with the stable constant K* of the sheet, so that only the root differs."""
    a, b, c, e, f, g, alpha, _ = designs.T
    sa, ca = np.sin(alpha), np.cos(alpha)
    half = np.where(ca >= 0.0, np.sin(0.5 * alpha), np.cos(0.5 * alpha))
    q = np.where(ca >= 0.0, (f - g) ** 2 + 4.0 * f * g * half**2, (f + g) ** 2 - 4.0 * f * g * half**2)
    square = (c - b) * (c + b) + (a * a + e * e) + q
    x, y = e - a * np.cos(phi), f * sa + a * ca * np.sin(phi)
    w = (square + 2.0 * a * (g * sa * np.sin(phi) - e * np.cos(phi))) / (2.0 * c)
    return x, y, w


def worst(psi, which=slice(None)):
    """Largest factor of an angle over the table, as oracle.py measures it; nan counts as failed."""
    found = []
    for value, row in zip(psi[which], np.array(ROWS)[which], strict=True):
        size = max(float(row["cond"]["psi"]), 1.0)
        with np.errstate(invalid="ignore"):
            error = math.inf if math.isnan(value) else abs(math.sin(value - float(row["psi"])))
        # the double nearest to the table's psi is off by up to one rounding of pi
        found.append(max(0.0, error - 4.0 * 2.0**-53) / (2.0**-53 * size))
    return max(found)


def house(designs=DESIGNS, phi=PHI, name="psi"):
    return RSSR.poses(designs, Angles.of(phi[:, None]), frozenset({name}))[name][:, 0]


def test_the_kernels_pass_what_the_controls_must_fail():
    assert worst(house()) < FACTOR


def test_half_angle_closure_fails_the_oracle():
    """psi = 2 arctan of a root of the quadratic in tan(psi/2): its leading coefficient vanishes where psi = pi."""
    x, y, w = closure(DESIGNS, PHI)
    delta = x * x + y * y - w * w
    root = DESIGNS[:, 7] * np.sqrt(np.maximum(delta, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        psi = 2.0 * np.arctan((y + root) / (w - x))
    assert worst(psi) > 8.0 * FACTOR


def test_half_angle_closure_has_no_answer_at_psi_of_half_a_turn():
    # Planar at phi = 0 with coupler and rocker in line towards the crank: X = W and Y = 0.
    phi = np.array([0.0])
    folded = np.array([[1.0, 1.5, 1.0, 3.5, 0.0, 0.0, 0.0, 1.0]])
    x, y, w = closure(folded, phi)
    assert x[0] == w[0] and y[0] == 0.0
    with np.errstate(invalid="ignore"):
        assert np.isnan(2.0 * np.arctan(y / (w - x)))[0]
    assert abs(house(folded, phi)[0]) == pytest.approx(math.pi, abs=1e-15)


def test_unguarded_arccosine_loses_dead_points():
    """atan2 + acos(W/R) without a guard: nan, where rounding pushes the cosine of an assembled pose past one."""
    generator = np.random.default_rng(2)
    a, b, c = generator.uniform(0.3, 1.0, (3, 2000)) * np.array([[1.0], [3.0], [2.0]])
    phi = generator.uniform(0.0, 2.0 * math.pi, 2000)
    # distance from pin to pivot b + c exactly, up to the rounding of e
    e = a * np.cos(phi) + np.sqrt((b + c) ** 2 - (a * np.sin(phi)) ** 2)
    zero = np.zeros(2000)
    designs = np.column_stack([a, b, c, e, zero, zero, zero, zero + 1.0])
    x, y, w = closure(designs, phi)
    with np.errstate(invalid="ignore"):
        naive = np.arctan2(y, -x) + np.arccos(w / np.hypot(x, y))
    columns = RSSR.poses(designs, Angles.of(phi[:, None]), frozenset({"psi"}))
    assert np.isnan(naive).mean() > 0.2
    assert (columns["status"] == st.DEAD_POINT).all()
    assert np.isfinite(columns["psi"]).all()


def test_arccosine_of_the_pressure_angle_fails_the_oracle_near_zero():
    rows = [r for r in oracle.read(FOLDER, "pressure") if r["kind"] == "rssr" and "theta_near_zero" in r["case"]]
    row = rows[0]
    designs = np.array([[row["inputs"][name] for name in NAMES]], dtype=float)
    phi = np.array([row["inputs"]["phi"]])
    x, y, w = closure(designs, phi)
    naive = math.acos(min(1.0, math.sqrt((x * x + y * y - w * w)[0]) / designs[0, 1]))
    exact, size = float(row["expected"]["theta"]), max(float(row["sens"]["theta"]), float(row["expected"]["theta"]))
    allowed = 64.0 * 2.0**-53 * size
    assert abs(house(designs, phi, "pressure_angle")[0] - exact) <= allowed
    assert abs(naive - exact) > 1000.0 * allowed


def test_tracking_the_nearest_root_changes_the_branch():
    """Marching in steps of 5 degrees and keeping the nearer root crosses over where the branches nearly touch."""
    rows = [row for row in oracle.read(FOLDER, "limits") if row["kind"] == "hard_change_point" and row["full_rotation"]]
    phi = np.linspace(0.0, 2.0 * math.pi, 73)
    lost = 0
    for row in rows:
        design = np.array([row[name] for name in NAMES], dtype=float)
        both = np.array([np.tile(np.append(design[:7], s), (phi.size, 1)) for s in (design[7], -design[7])])
        own, other = (house(d, phi) for d in both)
        tracked = [own[0]]
        for k in range(1, phi.size):
            roots = (own[k], other[k])
            tracked.append(min(roots, key=lambda root: abs(math.sin(0.5 * (root - tracked[-1])))))
        lost += bool((np.abs(np.sin(0.5 * (np.array(tracked) - own))) > 1e-6).any())
        # what the kernel gives is the root of the wanted branch: sign of dF/dpsi in 40 digits
        for k in range(0, phi.size, 12):
            exact = reference.transfer_functions(design, float(phi[k]))[0]
            assert reference.angle_error(own[k], exact) < 1e-6
    assert lost >= 3


def test_full_fast_math_hides_what_is_no_number():
    """With the full set of flags the test for nan is optimised away, and an invalid design gets a verdict."""
    plain = numba.njit(error_model="numpy")(turning_status.py_func)
    fast = numba.njit(error_model="numpy", fastmath=True)(turning_status.py_func)
    assert plain(math.nan, 1e-16, True) == st.INVALID_INPUT
    assert fast(math.nan, 1e-16, True) != st.INVALID_INPUT


def test_no_kernel_is_compiled_with_full_fast_math():
    from kernels.families import guide, rssp, rssr

    for kernel in (rssr.poses, rssr.margin, rssr.true_maxima, rssp.poses, guide.poses, turning_status):
        assert not kernel.targetoptions.get("fastmath", False)
    assert rssr.dense_maxima.targetoptions["fastmath"] == {"contract"}


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1e-5])
def test_differenced_jerk_fails_the_oracle(step):
    ends = [house(DESIGNS, PHI + s * step, "d2psi") for s in (-1.0, 1.0)]
    jerk = (ends[1] - ends[0]) / (2.0 * step)
    regular = [i for i, row in enumerate(ROWS) if row["kind"].startswith("regular")]
    factors = []
    for values in (jerk, house(DESIGNS, PHI, "d3psi")):
        errors = [abs(values[i] - float(ROWS[i]["d3"])) for i in regular]
        sizes = [max(float(ROWS[i]["cond"][k]) for k in ("d1", "d2", "d3")) for i in regular]
        factors.append(
            max(
                e / (2.0**-53 * max(s, abs(float(ROWS[i]["d3"]))))
                for e, s, i in zip(errors, sizes, regular, strict=True)
            )
        )
    assert factors[1] < FACTOR
    assert factors[0] > 1e4 * FACTOR


def test_the_constant_as_printed_fails_the_oracle_for_nearly_parallel_axes():
    """f^2 + g^2 - 2 f g cos(alpha) as the source prints it loses what the stable form keeps."""
    rows = [i for i, row in enumerate(ROWS) if row["kind"] == "hard_huge_offsets"]
    designs, phi = DESIGNS[rows], PHI[rows]
    a, b, c, e, f, g, alpha, branch = designs.T
    square = a * a - b * b + c * c + e * e + f * f + g * g - 2.0 * f * g * np.cos(alpha)
    x, y, _ = closure(designs, phi)
    w = (square + 2.0 * a * (g * np.sin(alpha) * np.sin(phi) - e * np.cos(phi))) / (2.0 * c)
    root = branch * np.sqrt(np.maximum(x * x + y * y - w * w, 0.0))
    psi = np.full(len(ROWS), np.nan)
    psi[rows] = np.arctan2(y * w - x * root, -(x * w + y * root))
    assert worst(psi, rows) > 100.0 * FACTOR


def test_the_tables_are_not_empty():
    assert len(ROWS) == 400
    assert json.loads((FOLDER / "rssr_open.json").read_text())["n_rows"] == 422
