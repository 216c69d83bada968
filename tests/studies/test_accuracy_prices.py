"""The price list: it covers the register, its references are right, and a wrong kernel shows up as an error."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.accuracy import effect_prices, prices, subjects, witness
from studies.accuracy.effect_witness import Effected, known_of
from studies.accuracy.regions import Region, margins
from studies.accuracy.scenes import SCENES
from sweep.effects import NAMES as EFFECTS
from sweep.effects import effect, extended
from sweep.families import NAMES, family
from sweep.families.base import March
from sweep.families.capabilities import InSeries
from tests.support import sixty_digits
from tests.support.rssr_designs import random_designs
from tests.support.selection import mostly_long

DOCS = Path(__file__).parents[2] / "docs" / "accuracy"
WRONG = 1e-6


def test_every_registered_family_and_the_chains_are_subjects():
    assert set(subjects.subjects()) == {*NAMES, *subjects.CHAINS}


@pytest.mark.parametrize("name", subjects.subjects())
def test_page_of_families_has_a_row_for(name):
    """If this fails for a new family: make study-accuracy."""
    text = (DOCS / "families.md").read_text()
    assert f"\n| `{name}` | `{subjects.measure(family(name))}` |" in text


@pytest.mark.parametrize("name", EFFECTS)
def test_page_of_effects_has_a_row_and_a_reference_for(name):
    """If this fails for a new effect: make study-accuracy."""
    table, words = (DOCS / "effects.md").read_text().split("## How the errors are known")
    (row,) = (line for line in table.split("\n") if line.startswith(f"| `{name}` | `{effect(name).families[0]}` |"))
    judged, outputs = row.split("|")[-2].split(" of ")
    assert 0 < int(judged) <= int(outputs)
    assert effect(name).whole_turn <= (f"`{name}`" in words), "solved again by a method of its own"


@pytest.mark.parametrize("name", SCENES)
def test_page_of_effects_has_a_row_for_loads_over_the_turn_and_the_thread_of_a_machine(name):
    assert f"\n| `{name}` | `{SCENES[name][0]}` |" in (DOCS / "effects.md").read_text()


def test_measure_is_the_second_derivative_that_the_register_names():
    assert subjects.measure(family("rssr")) == "max_abs_d2psi"
    assert subjects.measure(family("rssr+guide")) == "max_abs_d2s"
    assert subjects.measure(family("backrest")) == "range_K_couple"  # an interval
    assert subjects.measure(family("foot")) == "range_y_foot"  # a march


@pytest.mark.parametrize("name", mostly_long(["rssr", "guide", "backrest", "rssr+guide"], ["rssr", "rssr+guide"]))
def test_regions_hold_designs_that_move(name):
    mechanism = family(name)
    for region in subjects.regions_of(name, (3, 3, 2)):
        assert 0 < len(region.designs) <= 3 and subjects.moves(mechanism, region.designs).all()
        if region.name == subjects.ORDINARY:
            example = subjects.example(mechanism)
            assert (np.abs(region.designs - example) <= subjects.NEAR * np.abs(example) * (1.0 + 1e-12)).all()


def test_designs_near_a_change_point_are_near_one():
    """A pressure angle beyond 80 degrees, which no ordinary design has."""
    found = {region.name: region.designs for region in subjects.regions_of("rssr", (4, 4, 4))}
    assert margins(found[subjects.EDGE]).max() < math.cos(math.radians(80.0)) ** 2 < margins(found["ordinary"]).min()


def test_reference_from_positions_equals_sixty_digits():
    """Another method altogether: implicit derivatives and secants in 60 digits."""
    designs = random_designs(6, 4, rotatable=True)
    known = witness.reference(family("rssr"), designs)
    exact = sixty_digits.largest_acceleration(designs)
    # Ten times: the error is an estimate from neighbouring widths.
    assert (np.abs(known.value - exact) <= 10.0 * known.error).all()
    assert np.median(known.error / exact) < 1e-10


def test_reference_of_a_central_slider_crank_is_the_textbook_s():
    """Largest acceleration at the far limit position: a (1 + a/b)."""
    a, b = 1.0, 4.0
    mechanism = family("slider_crank")
    given = {"a": a, "b": b}
    design = np.array([[given.get(p.name, p.default or 0.0) for p in mechanism.parameters]])
    known = witness.reference(mechanism, design)
    # It says itself how sure it is.
    assert abs(known.value[0] - a * (1.0 + a / b)) <= known.error[0] < 1e-10


def test_narrowing_grids_find_the_side_of_a_jump():
    """A sawtooth: the highest value stands next to the jump, where parabolas and derivatives mislead."""

    def saw(rows, phi, near):
        return np.mod(phi + 1.0, 2.0 * np.pi)

    found = witness._narrowed(saw, 1, 1)
    assert found.value[0] == pytest.approx(2.0 * np.pi, abs=1e-9)


def test_march_is_judged_by_finer_steps_and_offers_grids_alone():
    mechanism = family("foot")
    assert isinstance(mechanism.domain, March)
    assert {method for method, *_ in prices.methods(mechanism, False)} == {prices.GRID}


def region(name, count=2):
    return next(subjects.regions_of(name, (count, 0, 0)))


def refined(rows):
    return [row for row in rows if row["method"] == prices.REFINED]


@pytest.mark.parametrize("name", mostly_long(["guide", "slotted"], ["slotted"]))
@pytest.mark.parametrize("bad", ["d2", "position"])
def test_a_wrong_kernel_shows_up_as_an_error(name, bad):
    """Negative control: one output wrong by 1e-6, all else as it is; without the fused search, which takes no poses."""
    known, here = family(name), region(name)
    right = replace(known, capabilities=tuple(one for one in known.capabilities if not isinstance(one, InSeries)))
    second = right.derivative_of[right.derivative_of[right.position]]
    output = second if bad == "d2" else right.position

    def wrong(designs, angles, wanted):
        columns = right.poses(designs, angles, wanted)
        return {key: x * (1.0 + WRONG) if key == output else x for key, x in columns.items()}

    good = refined(prices.prices_of(right, [here], smoke=True))
    found = refined(prices.prices_of(replace(right, poses=wrong, precise_poses=None), [here], smoke=True))
    assert all(row["largest_error"] < 1e-3 * WRONG for row in good if row["setting"] < 1e-6)
    for row in found:
        assert row["largest_error"] == pytest.approx(WRONG, rel=0.01)


def test_a_wrong_step_shows_up_as_an_error():
    """Negative control: the crank-rocker's own search, which does not use its poses."""
    right, here = family("rssr"), region("rssr")

    def wrong(step):
        def run(designs, wanted, accuracy):
            columns = dict(step.run(designs, wanted, accuracy))
            return columns | {"max_abs_d2psi": columns["max_abs_d2psi"] * (1.0 + WRONG)}

        return replace(step, run=run)

    steps = tuple(wrong(s) if any(o.name == "max_abs_d2psi" for o in s.provides) else s for s in right.steps)
    rows = prices.prices_of(replace(right, steps=steps), [Region(here.name, here.text, here.designs)], smoke=True)
    assert all(row["largest_error"] == pytest.approx(WRONG, rel=1e-3) for row in refined(rows))


def effected(name, count=1):
    bare = family(effect(name).families[0])
    full = extended(bare, effect_prices.outputs_of(name, bare))
    return Effected(bare, full, effect_prices.loaded(bare, full, count))


@pytest.mark.parametrize("name", mostly_long(EFFECTS, EFFECTS[::4]))
def test_no_effect_is_priced_where_it_has_nothing_to_do(name):
    """Bodies without mass would have loads of zero, which are right to any digit."""
    given = effected(name)
    own = len(given.bare.parameters)
    given_inputs = given.full.parameters[own:]
    bodies = [k for k, p in enumerate(given_inputs) if p.unit == "mass" and p.name != "m_tool"]
    assert np.isfinite(given.designs).all()
    assert not bodies or given.designs[:, own:][:, bodies].any()
    if not any(p.unit in ("mass", "inertia") and p.name != "m_tool" for p in given_inputs):
        assert all(given.given(p.name).all() for p in given_inputs if p.name == "tool_x")


JUDGED = ["speed_fluctuation", "dynamic_elasticity", "bearing_life", "slider_elasticity"]
JUDGED.append(pytest.param("swivel_rolling_bearings", marks=pytest.mark.long))


@pytest.mark.parametrize("name", [*JUDGED, *SCENES])
def test_effects_and_scenes_agree_with_their_references(name):
    if name in SCENES:
        on, scene = SCENES[name]
        given, wanted = scene(1)
    else:
        given = effected(name)
        on, wanted = given.bare.name, effect_prices.outputs_of(name, given.bare)
    found = effect_prices.prices_of(name, on, given, wanted, smoke=True)
    (row,) = (r for r in found if r["method"] == prices.REFINED)
    assert row["judged"] == row["outputs"] and row["exceeded"] == 0
    # Even sums over kinks know four digits less than smooth ones.
    assert row["largest_error"] < 1e-5


def test_a_wrong_effect_shows_up_as_an_error():
    """Negative control: the tool's force wrong by 1e-6; its reference asks the poses of another family object."""
    given = effected("tool")
    wanted = effect_prices.outputs_of("tool", given.bare)
    known, _ = known_of("tool", given, wanted)
    off = {name: value._replace(value=value.value * (1.0 + WRONG)) for name, value in known.items()}
    accuracy = prices.Accuracy(target=1e-9)
    assert effect_prices._priced(given, wanted, accuracy, known)["largest_error"] < 1e-12
    row = effect_prices._priced(given, wanted, accuracy, off)
    assert row["largest_error"] == pytest.approx(WRONG, rel=1e-3) and row["exceeded"] == len(wanted)


def test_friction_of_the_speed_has_a_reference_of_its_own():
    known, words = known_of("speed_fluctuation_friction", given := effected("speed_fluctuation_friction"), ())
    plain, _ = known_of("speed_fluctuation", given, ())
    assert "friction" in words
    assert known["unevenness_friction"].value[0] != pytest.approx(plain["unevenness"].value[0], rel=1e-3)
