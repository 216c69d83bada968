"""The same question asked otherwise: alone or beside others, in another order, in two threads, in other units.

Of every family of the register, some chains and some effects: what an answer is may not depend on how it was asked.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

import sweep
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, March
from sweep.families.names import error_of
from sweep.families.reduction import prefixes
from tests.search.brute import blurred, poses
from tests.search.subjects import all_at_once, random_designs, subjects
from tests.support.near_change_points import near_change_points
from tests.support.selection import mostly_long

SUBJECTS = subjects()
BARE = [name for name in NAMES if not isinstance(family(name).domain, March)]
LOADED = ("pressure", "coupler", "kinetostatics", "rolling_limits", "tool", "thread_speed")
ASKED = [*BARE, "rssr+guide", "rssr+rssp", *LOADED]
QUICK = ("rssr", "guide", "geared_dwell", "cam", "five_link", "spherical_looper", "rssr+guide", "kinetostatics", "tool")
GEOMETRIC = ("length", "angle", "sign", "choice", "ratio")
TARGET = 1e-6
MOST = 2  # outputs of each that are asked for


@cache
def asked(name):
    """A mechanism, ordinary designs of it, its design outputs (reductions of some outputs, the dear ones last), all."""
    subject = SUBJECTS[name]()
    full = all_at_once(subject.family)
    # An angle that makes full turns has no extrema.
    outputs = [o for o in subject.outputs if not (full.pose_output[o].jumps or full.pose_output[o].wraps)][:MOST]
    names = [f"{prefix}{output}" for output in outputs for prefix in prefixes(full.domain)]
    designs = random_designs(subject, "ordinary", 6, 3)
    return subject, full, designs, names, found(full, designs, names)


def found(full, designs, names):
    return design_outputs(full, designs, names, Accuracy(target=TARGET))


def assert_same(one, other, rows=slice(None)):
    for key in one:
        np.testing.assert_array_equal(one[key], np.asarray(other[key])[rows], err_msg=key)


@pytest.mark.parametrize("name", mostly_long(ASKED, QUICK))
def test_an_answer_does_not_depend_on_company(name):
    """Not on other outputs, on other designs, on their order, nor on another thread that asks too."""
    _, full, designs, names, whole = asked(name)
    assert np.isfinite([whole[each] for each in names]).all()
    for each in names[:: len(names) // 2]:
        alone = found(full, designs, [each])
        for key in (each, error_of(each)):
            np.testing.assert_array_equal(whole[key], alone[key], err_msg=key)
    assert_same(found(full, designs[2:3], names), whole, slice(2, 3))
    order = np.array([4, 0, 5, 2, 1, 3, *range(6)])
    with ThreadPoolExecutor(2) as pool:
        again, beside = pool.map(lambda given: found(full, given, names), (designs, designs[order]))
    assert_same(again, whole)
    assert_same(beside, whole, order)


@pytest.mark.parametrize(
    ("name", "other"),
    [("slotted", "load_support_d1"), ("swivel", "life_a1"), ("five_link", "sliding_utilisation_b")],
)
def test_an_error_does_not_depend_on_the_inputs_of_other_effects(name, other):
    """What rounding the inputs does was found with signs that the number of inputs decided."""
    alone, beside = (extended(family(name), wanted) for wanted in (["force_b"], ["force_b", other]))
    designs = ordinary(beside, 6)
    own = designs[:, [beside.parameter_names.index(p) for p in alone.parameter_names]]
    assert_same(found(alone, own, ["rms_force_b"]), found(beside, designs, ["rms_force_b"]))


DRIVE = {"a": 11.0, "b": 40.0, "c": 45.0, "e": 38.0, "xi": 75.0, "eta": 12.0, "lam": 1.4, "h": 5.0}
HEAVY = {"m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 1e-4, "m_tool": 1e-5, "speed": 300.0, "x_point": 7.0}
LOADS = {
    "tool": ({"pierce_force": 400.0, "pierce_at": 60.0}, {}),
    "table": ({}, {"tool_force": ([0.0, 1.98, 2.0, 2.02, 6.0], [0.0, 0.0, 50.0, 0.0, 0.0])}),
    "series": ({}, {"tool_force": {"mean": 0.0, "cos": [0.0] * 63 + [50.0]}}),
}


@pytest.mark.parametrize("kind", LOADS)
@pytest.mark.parametrize("output", ["d2s", "d2x_p", "omega_z", "shaking_estimate_x"])
def test_what_feels_no_load_has_its_bits_beside_loads(output, kind):
    """Tools that pierce and loads over the turn once cut the turn for all curves of the same question."""
    more, loads = LOADS[kind]
    for mechanism, dot in (("guide", ""), (sweep.machine({"needle": {"family": "guide", "ratio": -2}}), "needle.")):
        row = {f"{dot}{name}": value for name, value in (DRIVE | HEAVY | more).items()}
        wanted = [f"{dot}{kind}_{output}" for kind in ("max_abs", "phi_max", "rms")]
        alone = sweep.summarise(mechanism, row, wanted, accuracy=TARGET)
        given = {f"{dot}{name}": load for name, load in loads.items()}
        beside = sweep.summarise(mechanism, row, [*wanted, f"{dot}max_force_d"], accuracy=TARGET, loads=given)
        names = [*wanted, *map(error_of, wanted)]
        assert alone[names].iloc[0].tolist() == beside[names].iloc[0].tolist()


@pytest.mark.parametrize("want", ["rms_d2psi", "rms_d3psi", "max_abs_d3psi"])
def test_bits_near_change_points_do_not_depend_on_company(want):
    """Crowded panels and sums of many samples once depended on how many rows there were: 18 of these 30 means did."""
    mechanism, designs = family("rssr"), near_change_points(30, 5, longest=1.0, lowest=1e-9, highest=1e-3)
    whole = design_outputs(mechanism, designs, [want], Accuracy(target=1e-10))
    for k in range(len(designs)):
        assert_same(
            design_outputs(mechanism, designs[k : k + 1], [want], Accuracy(target=1e-10)), whole, slice(k, k + 1)
        )


@pytest.mark.parametrize("name", mostly_long(ASKED, QUICK))
def test_a_pose_at_the_place_of_an_extremum_is_the_extremum(name):
    _, full, designs, names, whole = asked(name)
    variable = full.domain.name
    for place in (key for key in names if key.startswith(f"{variable}_")):
        kind, output = next((k, place.removeprefix(f"{variable}_{k}_")) for k in ("max_abs", "max", "min")
                            if place.startswith(f"{variable}_{k}_"))  # fmt: skip
        there = poses(full, designs, whole[place][:, None], (output,))[0][output][:, 0]
        there = np.abs(there) if kind == "max_abs" else there
        value, err = whole[f"{kind}_{output}"], whole[error_of(f"{kind}_{output}")]
        # The place is rounded, and known to its error; eight times what rounding the inputs does there.
        allowed = err + 8.0 * blurred(full, designs, output, whole[place]) + 1e-13 * np.abs(value)
        beside = [
            poses(full, designs, (whole[place] + s * whole[error_of(place)])[:, None], (output,))[0][output][:, 0]
            for s in (-1.0, 1.0)
        ]
        off = np.min([np.abs((np.abs(y) if kind == "max_abs" else y) - value) for y in (there, *beside)], axis=0)
        assert (off <= allowed).all(), place


@pytest.mark.parametrize("name", [n for n in BARE if all(p.unit in GEOMETRIC for p in family(n).parameters)])
def test_a_thousand_times_the_lengths_is_a_thousand_times_the_answer(name):
    subject, full, designs, names, small = asked(name)
    lengths = [k for k, p in enumerate(subject.family.parameters) if p.unit == "length"]
    grown = designs.copy()
    grown[:, lengths] *= 1000.0
    large = found(full, grown, names)
    both = (small["status"] == large["status"]) & np.isfinite(large[names[0]])
    assert both.sum() >= 5  # one design may lie where rounding decides whether it assembles
    for output in dict.fromkeys(n.partition("_")[2] for n in names if n.startswith("range_")):
        unit = full.pose_output[output].unit
        power = {"length": 1.0, "1": 0.0, "rad": 0.0}.get(unit)
        if power is None:
            continue
        for key in (f"{kind}_{output}" for kind in ("max_abs", "max", "min", "range", "rms")):
            if key not in small:
                continue
            size = 1000.0**power
            err = small[error_of(key)] * size + large[error_of(key)]
            off = np.abs(small[key] * size - large[key])
            # A thousand is no power of two: each length is rounded once more.
            rounded = 64.0 * 2.0**-53 * np.abs(large[f"max_abs_{output}"])
            rounded += 8.0 * size * blurred(full, designs, output, small[f"{full.domain.name}_max_abs_{output}"])
            assert (off <= err + rounded)[both].all(), key
