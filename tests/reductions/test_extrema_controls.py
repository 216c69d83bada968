"""What the search must find on curves whose extrema are known, and that simpler searches fail on them.

The synthetic family needs poses alone: no steps, no discriminant, no derivatives.
"""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from sweep.families.base import Family, Output, Parameter
from sweep.quantities.kinds import Request
from sweep.reductions import peak_search
from sweep.reductions.extrema import true_extrema
from sweep.reductions.sampling import sample_turn
from tests.support.turn_designs import RSSR, crank_rockers

NAMES = ("centre", "width", "height", "level", "hole")


def bumps(designs, angles, wanted):
    """A broad wave and a resonance with its centre, width and height; within ``hole`` it does not assemble."""
    centre, width, height, level, hole = (designs[:, k, None] for k in range(5))
    away = 2.0 * np.sin(0.5 * (angles.phi - centre))
    y = level + np.cos(angles.phi) + height * width**2 / (away**2 + width**2)
    status = np.where(np.abs(np.mod(angles.phi, 2.0 * np.pi) - 3.0) < hole, st.NOT_ASSEMBLED, st.OK).astype(np.uint8)
    columns = {"y": np.where(status == st.OK, y, np.nan)}
    return {name: columns[name] for name in columns if name in wanted} | {"status": status}


BUMPS = Family(
    name="bumps",
    title="a wave with a resonance",
    parameters=tuple(Parameter(name, "none", name) for name in NAMES),
    position="y",
    pose_outputs=(Output("y", "1", "the curve"),),
    poses=bumps,
)


def resonances(n, width, seed=1):
    r = np.random.default_rng(seed)
    return np.column_stack(
        [r.uniform(0.0, 2.0 * np.pi, n), np.full(n, width), r.uniform(1.5, 4.0, n), np.full(n, 0.0), np.zeros(n)]
    )


def finest(designs):
    """Largest value from samples placed around the wave's crest and the resonance."""
    around = np.concatenate([np.linspace(-1.0, 1.0, 4001), np.linspace(-0.02, 0.02, 4001)])
    best = np.full(len(designs), -np.inf)
    for centre in (designs[:, 0], np.zeros(len(designs))):
        phi = centre[:, None] + around * designs[:, 1:2] * 5.0
        angles = type("Angles", (), {"phi": phi})
        best = np.maximum(best, bumps(designs, angles, {"y"})["y"].max(axis=1))
    return best


@pytest.mark.parametrize("width", [1.0, 0.3, 0.1, 0.05])
def test_narrow_resonances_are_found_from_poses_alone(width):
    designs = resonances(300, width)
    found, status = true_extrema(BUMPS, designs, [Request("y", 1)], 1e-9)
    assert (status == st.OK).all()
    np.testing.assert_allclose(found[Request("y", 1)].value, finest(designs), rtol=2e-6)


def test_without_the_look_at_roughness_narrow_resonances_are_lost(monkeypatch):
    designs = resonances(300, 0.05)
    true = finest(designs)
    found, _ = true_extrema(BUMPS, designs, [Request("y", 1)], 1e-9)
    monkeypatch.setattr(peak_search, "ROUGH", np.inf)
    monkeypatch.setattr(peak_search, "DISAGREEMENT", np.inf)
    careless, _ = true_extrema(BUMPS, designs, [Request("y", 1)], 1e-9)
    lost = (found[Request("y", 1)].value < true * (1.0 - 1e-3)).sum()
    lost_careless = (careless[Request("y", 1)].value < true * (1.0 - 1e-3)).sum()
    assert lost_careless > 20
    assert lost == 0


def test_refining_the_top_sample_alone_picks_wrong_peaks(monkeypatch):
    """The plain method: 24 samples, refine the best one."""
    designs = crank_rockers(60_000, 9)
    discriminant = Request("discriminant", -1)
    margin, _ = true_extrema(RSSR, designs, [discriminant], 1e-8, anywhere=True)
    scale = (2.0 * designs[:, 1] * designs[:, 2]) ** 2
    designs = designs[margin[discriminant].value / scale > 1e-3][:20_000]
    peak = Request("d2psi", 0)
    true, _ = true_extrema(RSSR, designs, [peak], 1e-8)
    monkeypatch.setattr(peak_search, "START", 24)
    monkeypatch.setattr(peak_search, "SHARE", 1.0)
    monkeypatch.setattr(peak_search, "ROUGH", np.inf)
    monkeypatch.setattr(peak_search, "PER_SINGULARITY", 0.0)
    monkeypatch.setattr(peak_search, "DISAGREEMENT", np.inf)
    plain, _ = true_extrema(RSSR, designs, [peak], 1e-8)
    wrong = plain[peak].value < true[peak].value * (1.0 - 1e-4)
    assert 0.0005 < wrong.mean() < 0.05
    assert not (plain[peak].value > true[peak].value * (1.0 + 1e-9)).any()


def test_poses_that_do_not_assemble_are_reported_not_skipped():
    designs = resonances(3, 0.5)
    designs[:, 4] = (0.0, 0.3, 0.0)
    found, status = true_extrema(BUMPS, designs, [Request("y", 0)], 1e-6)
    assert status.tolist() == [st.OK, st.NOT_ROTATABLE, st.OK]
    assert np.isnan(found[Request("y", 0)].value).tolist() == [False, True, False]


def test_constant_and_zero_curves_have_an_extremum():
    designs = np.array([[0.0, 1.0, 0.0, 0.0, 0.0]])
    flat = Family("flat", "", BUMPS.parameters, "y", BUMPS.pose_outputs, lambda d, a, w: zero(d, a))
    for mode in (-1, 0, 1):
        found, status = true_extrema(flat, designs, [Request("y", mode)], 1e-8)
        assert status[0] == st.OK
        assert found[Request("y", mode)].value[0] == 0.0


def zero(designs, angles):
    shape = (len(designs), angles.cos.shape[1])
    return {"y": np.zeros(shape), "status": np.zeros(shape, np.uint8)}


def stepped(jumps):
    """A family whose only output is a square wave with so many jumps on a small cosine."""

    def poses(designs, angles, wanted):
        y = np.where(np.sin(0.5 * jumps * angles.phi - 1.0) > 0.0, 1.0, 0.0) + np.cos(angles.phi) * 0.1
        return {
            "y": np.broadcast_to(y, (len(designs), y.shape[1])),
            "status": np.zeros((len(designs), y.shape[1]), np.uint8),
        }

    return Family("stepped", "", BUMPS.parameters, "y", BUMPS.pose_outputs, poses)


def test_curve_that_no_sampling_resolves_says_so():
    _, status = true_extrema(stepped(64), np.zeros((1, 5)), [Request("y", 0)], 1e-6)
    assert status[0] == st.NOT_CONVERGED


def test_a_few_jumps_are_bracketed():
    """The largest value is the limit of the cosine where the wave switches on, at phi = 1."""
    found, status = true_extrema(stepped(2), np.zeros((1, 5)), [Request("y", 0)], 1e-6)
    assert status[0] == st.OK
    assert found[Request("y", 0)].value[0] == pytest.approx(1.0 + 0.1 * np.cos(1.0), rel=1e-12)
    assert found[Request("y", 0)].phi[0] == pytest.approx(1.0, abs=1e-9)


def test_an_angle_that_makes_full_turns_has_no_extremum():
    def turning(designs, angles, wanted):
        shape = (len(designs), angles.phi.shape[1])
        psi = np.angle(np.exp(1j * (angles.phi + 0.1 * np.sin(angles.phi))))
        return {"psi": np.array(np.broadcast_to(psi, shape)), "status": np.zeros(shape, np.uint8)}

    family = Family("turning", "", BUMPS.parameters, "psi", (Output("psi", "rad", "", wraps=True),), turning)
    found, status = true_extrema(family, np.zeros((2, 5)), [Request("psi", 1)], 1e-6)
    assert (status == st.NOT_OSCILLATING).all()
    assert np.isnan(found[Request("psi", 1)].value).all()
    _, _, winds = sample_turn(family, np.zeros((2, 5)), 64, ["psi"])
    assert winds.all()
