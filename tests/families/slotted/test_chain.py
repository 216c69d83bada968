"""Crank-rocker driving a slotted link: the chain, its planar places, and the second stage of task 5."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.errors import InputError
from sweep.families import family
from sweep.synthesis.tasks import Task5

RSSR = ("a", "b", "c", "e", "f", "g", "alpha", "branch")


def test_task5_second_stage_is_the_chain_of_crank_rocker_and_slotted_link():
    task = Task5(0.8, 3.2, e=1.0, g=0.3, alpha=0.6, f_range=(-3.0, 3.0), rho0=0.5, kappa=-1)
    candidates = [[phi1, f, t1, 1.8] for phi1 in np.arange(0.1, 6.2, 0.3) for f in (-1.0, 0.5) for t1 in (0.6, 4.0)]
    found = task.evaluate(np.array(candidates))
    good = np.flatnonzero(np.isfinite(found.curve).all(axis=1) & (found.results["a2"] > 0.0))
    assert good.size > 0
    for k in good[:4]:
        m = {name: float(column[k]) for name, column in found.results.items()}
        table = {f"{name}1": [m[f"{name}1"]] for name in RSSR}
        start = sweep.evaluate(["rssr"], {n: table[f"{n}1"] for n in RSSR}, ["psi"], phi=[candidates[k][0]]).psi[0]
        table |= {"a2": [m["a2"]], "e2": [m["e2"]], "kappa2": [-1.0], "offset2": [m["t1"] + start]}
        phi = candidates[k][0] + np.linspace(0.0, 2.0 * np.pi, 4000)
        frame = sweep.evaluate(["rssr", "slotted"], table, ["rho", "d2rho"], phi=phi)
        # the task looks at its own grid of the turn, this at another
        assert np.abs(frame.d2rho).max() == pytest.approx(np.abs(found.curve[k]).max(), rel=2e-3)
        assert frame.rho[0] == pytest.approx(abs(m["a2"] * np.exp(1j * m["t1"]) - m["e2"]), rel=1e-12)


def test_slotted_drives_a_crank_rocker():
    """A slotted link that turns fully is a quick-return drive in front of a crank-rocker: the chain rule holds."""
    table = {"a1": [2.0], "e1": [0.6], "a2": [1.0], "b2": [4.1], "c2": [3.2], "e2": [2.9], "alpha2": [0.4]}
    table |= {"f2": [0.2], "g2": [0.1]}
    phi, h = np.linspace(0.0, 6.0, 9), 1e-5
    frame, ahead, behind = (
        sweep.evaluate(["slotted", "rssr"], table, ["psi", "dpsi", "psi1"], phi=phi + d) for d in (0.0, h, -h)
    )
    turn = np.angle(np.exp(1j * (ahead.psi - behind.psi)))
    # a central difference errs like h^2 and like rounding over h: both below 1e-9 here
    np.testing.assert_allclose(frame.dpsi, turn / (2.0 * h), atol=1e-8)


@pytest.mark.parametrize("name", ["spherical_looper", "cylindrical_looper"])
def test_chain_refuses_a_looper_with_two_drives_before_its_end_and_names_the_remedy(name):
    with pytest.raises(InputError, match="put it last"):
        family(["rssr", name, "rssr"])
