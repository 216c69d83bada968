"""Domains: a closed turn, an interval whose ends are candidates, a march on its own grid; events as roots.

The families are made up, so every answer is known in closed form.  Tolerances: 1e-8 is the accuracy asked; roots are
found to rounding, which 1e-12 leaves room for.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.families.base import Angles, Event, Family, Interval, March, Output, Parameter


def _no_status(shape: tuple[int, ...]) -> dict[str, Any]:
    return {"status": np.zeros(shape, np.uint8)}


def parabola(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    p, rho = designs[:, :1], angles.phi
    values = {"tension": (rho - p) ** 2, "dtension": 2.0 * (rho - p)}
    shape = np.broadcast_shapes(p.shape, rho.shape)
    return {name: np.broadcast_to(values[name], shape).copy() for name in wanted} | _no_status(shape)


BEAM = Family(
    name="beam",
    title="a parabola over the radius of a beam",
    parameters=(
        Parameter("p", "length", "place of the least tension"),
        Parameter("low", "length", "radius of the empty beam"),
        Parameter("high", "length", "radius of the full beam"),
    ),
    position="tension",
    pose_outputs=(Output("tension", "force", "(rho - p)^2"), Output("dtension", "force", "its derivative by rho")),
    poses=parabola,
    domain=Interval("rho", "length", "radius of the beam", lambda designs: (designs[:, 1], designs[:, 2])),
    derivative_of={"tension": "dtension"},
    events=(Event("slack", "tension", "the tension falls below 4", level=4.0, rising=False),),
)
TABLE = pd.DataFrame({"p": [2.0, 0.0, 9.0], "low": 1.0, "high": [4.0, 4.0, 12.0]})


def test_extrema_over_an_interval_count_its_ends() -> None:
    """A minimum inside, and ones at either end; the stroke of a monotone curve is the difference of its ends."""
    found = sweep.summarise(BEAM, TABLE, ["min_tension", "max_tension", "stroke", "rho_min_tension"], accuracy=1e-8)
    assert (found["status"] == st.OK).all()
    np.testing.assert_allclose(found["min_tension"], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["max_tension"], [4.0, 16.0, 64.0], rtol=1e-12)
    np.testing.assert_allclose(found["stroke"], [4.0, 15.0, 64.0], rtol=1e-12)
    np.testing.assert_allclose(found["rho_min_tension"], [2.0, 1.0, 9.0], atol=1e-5)  # flat: as the root of 1e-8 twice


@pytest.mark.parametrize("length", [1e-13, 1e-12, 1e-6])
def test_values_at_the_ends_of_an_interval_are_those_of_its_ends_however_short_it_is(length: float) -> None:
    """In a line between the ends one rounding of the variable is a share of the way: 1.5e-4 of it at 1e-12."""

    def straight(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
        share = (angles.phi - designs[:, 1:2]) / (designs[:, 2:] - designs[:, 1:2])
        return {"tension": share, "dtension": share, **_no_status(angles.phi.shape)}

    full = np.linspace(0.3, 0.9, 40)
    table = pd.DataFrame({"p": 0.0, "low": full * (1.0 - length), "high": full})
    names = ["min_tension", "max_tension"]
    for accuracy in ({"accuracy": 1e-8}, {"samples": 360}):
        found = sweep.summarise(replace(BEAM, poses=straight, events=()), table, names, **accuracy)
        np.testing.assert_array_equal(found[names], np.tile([0.0, 1.0], (len(full), 1)))


def test_stroke_of_three_over_an_interval_is_three_on_samples_too() -> None:
    """The measured failure of one closed turn for everything was 0.055 for a stroke of 3.0, with status 0."""
    line = {"p": 0.0, "low": 1.0, "high": 2.0}
    found = sweep.summarise(BEAM, line, ["stroke"], samples=64)
    assert found["stroke"][0] == pytest.approx(3.0, rel=1e-12)
    assert sweep.summarise(BEAM, line, ["stroke"], accuracy=1e-8)["stroke"][0] == pytest.approx(3.0, rel=1e-12)


def test_an_interval_is_evaluated_in_a_column_of_its_own_variable() -> None:
    single = sweep.evaluate(BEAM, TABLE.assign(rho=[1.0, 2.0, 3.0]), ["tension"])
    np.testing.assert_array_equal(single["tension"], [1.0, 4.0, 36.0])
    grid = sweep.evaluate(BEAM, TABLE[:1], ["tension"], phi=[1.0, 3.0])
    assert list(grid.columns) == ["design", "rho", "tension", "status"]
    with pytest.raises(sweep.InputError, match="a column rho"):
        sweep.evaluate(BEAM, TABLE, ["tension"])


@pytest.mark.parametrize("name", ["rms_tension", "phi0", "tension_ext", "window_angle", "rotatable"])
def test_what_an_interval_does_not_have_is_refused_by_name(name: str) -> None:
    with pytest.raises(sweep.InputError, match=name):
        sweep.summarise(BEAM, TABLE, [name])


def test_events_are_roots_with_place_and_count() -> None:
    found = sweep.summarise(BEAM, TABLE[::2], ["rho_slack", "count_slack"], accuracy=1e-8)
    # (rho - 2)^2 = 4 has its falling root 0 outside 1 ... 4; (rho - 9)^2 = 4 at 7.
    assert found["status"].tolist() == [st.NO_EVENT, st.OK]
    assert found["count_slack"].tolist() == [0.0, 1.0]
    assert found["rho_slack"][2] == pytest.approx(7.0, abs=1e-12)
    assert np.isnan(found["rho_slack"][0])


def hinge(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    x = np.cos(3.0 * angles.phi) + 0.0 * designs[:, :1]
    return {name: x.copy() for name in wanted} | _no_status(x.shape)


def test_events_over_a_turn_count_every_passage() -> None:
    wave = Family(
        "wave", "", (Parameter("p", "none", "unused"),), "x", (Output("x", "1", "cos 3 phi"),), hinge,
        events=(Event("lift", "x", "x rises through one half", level=0.5),),
    )  # fmt: skip
    found = sweep.summarise(wave, {"p": [0.0]}, ["phi_lift", "count_lift", "err_phi_lift"[4:]], accuracy=1e-8)
    assert found["count_lift"][0] == 3.0
    assert abs(found["phi_lift"][0] - 5.0 * np.pi / 9.0) <= found["err_phi_lift"][0] <= 1e-13


def touching(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    """At phi = 0 all are 0: a skew top, a skew bottom, two passages, and two passages a hundredth apart."""
    phi = angles.phi + 0.0 * designs[:, :1]
    hill, late = 1.0 - np.cos(phi), np.cos(phi - 0.005) - np.cos(0.005)
    values = {"top": -hill * (1.0 + 0.5 * np.sin(phi)), "bottom": hill * (1.0 + 0.5 * np.sin(phi)),
              "wave": np.sin(phi), "pair": np.where(angles.phi == 0.0, 0.0, late)}  # fmt: skip
    return {name: values[name] for name in wanted} | _no_status(phi.shape)


@pytest.mark.parametrize("given", [{"accuracy": 1e-8}, {"samples": 256}, {"samples": 2048}])
@pytest.mark.parametrize("rising", [True, False])
def test_a_curve_that_touches_its_level_at_a_sample_does_not_pass_it(given: dict[str, Any], rising: bool) -> None:
    """A touch at a sample counted as a passage in one of the two senses; between samples it did not."""
    names = ("top", "bottom", "wave", "pair")
    family = Family(
        "touch", "", (Parameter("p", "none", "unused"),), "top", tuple(Output(name, "1", name) for name in names),
        touching, events=tuple(Event(f"at_{name}", name, name, rising=rising) for name in names),
    )  # fmt: skip
    for name in ("top", "bottom"):
        found = sweep.summarise(family, {"p": 0.0}, [f"phi_at_{name}", f"count_at_{name}"], **given)
        assert found["status"][0] == st.NO_EVENT and found[f"count_at_{name}"][0] == 0.0
    # The pair is a hundredth apart: without an accuracy its fall is missed where it lies between two of 256 samples.
    for name in ("wave",) if given.get("samples") == 256 and not rising else ("wave", "pair"):
        found = sweep.summarise(family, {"p": 0.0}, [f"phi_at_{name}", f"count_at_{name}"], **given)
        assert found["status"][0] == st.OK and found[f"count_at_{name}"][0] == 1.0
        first = {"wave": 0.0 if rising else np.pi, "pair": 0.0 if rising else 0.01}[name]
        # A root is found to rounding; the slope of the pair, 5e-3, makes 2e-14 of it.
        assert abs(np.remainder(found[f"phi_at_{name}"][0] - first + 1.0, 2.0 * np.pi) - 1.0) <= 1e-12


def friction(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    x = np.cumsum(np.ones_like(angles.phi), axis=1) + 0.0 * designs[:, :1]
    return {name: x.copy() for name in wanted} | _no_status(x.shape)


MARCHED = Family(
    "marched", "", (Parameter("p", "none", "unused"),), "x", (Output("x", "1", "steps so far"),), friction,
    domain=March(),
)  # fmt: skip


def test_a_march_is_sampled_in_order_and_has_no_accuracy() -> None:
    assert sweep.summarise(MARCHED, {"p": 0.0}, ["max_x"], samples=48)["max_x"][0] == 48.0
    assert "err_max_x" not in sweep.summarise(MARCHED, {"p": 0.0}, ["max_x"])
    with pytest.raises(sweep.InputError, match="depends on those before"):
        sweep.summarise(MARCHED, {"p": 0.0}, ["max_x"], accuracy=1e-6)
    with pytest.raises(sweep.InputError, match="equal steps of one turn"):
        sweep.evaluate(MARCHED, {"p": 0.0}, ["x"], phi=[0.0, 1.0, 2.0])
    with pytest.raises(sweep.InputError, match="depends on those before"):
        sweep.evaluate(MARCHED, {"p": 0.0, "phi": 1.0}, ["x"])
    steps = np.arange(6) * (2.0 * np.pi / 6)
    np.testing.assert_array_equal(sweep.evaluate(MARCHED, {"p": 0.0}, ["x"], phi=steps)["x"], np.arange(1.0, 7.0))


def test_intervals_and_marches_are_no_stages_of_a_chain() -> None:
    from sweep.families.chain import chain

    with pytest.raises(sweep.InputError, match="closed turn"):
        chain((BEAM, BEAM))


def test_the_optimiser_follows_extrema_over_an_interval_with_and_without_complex_poses() -> None:
    """Least largest tension (rho - p)^2 over 1 ... 4: p in the middle, 2.25; both ends are active."""
    from dataclasses import replace

    from sweep.optimise import Problem, minimise
    from sweep.study import OptimiseSettings

    for family in (BEAM, replace(BEAM, analytic=False)):
        box = np.array([0.0]), np.array([8.0])
        problem = Problem(family, ("p",), *box, {"low": 1.0, "high": 4.0}, "max_tension")
        best = minimise(problem, problem.rows(np.array([[0.5]])), OptimiseSettings())[0]
        assert best.objective == pytest.approx(2.25, rel=1e-9)
        assert best.design[0] == pytest.approx(2.5, abs=1e-8)
    with pytest.raises(sweep.InputError, match="have no gradient"):
        Problem(MARCHED, ("p",), np.array([0.0]), np.array([1.0]), {}, "max_x")
