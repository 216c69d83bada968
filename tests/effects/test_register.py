"""The register itself: complete, printed, and its page current."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
from docs.effects_page import grouped, of_any_place, page, parts, places_of
from studies.accuracy.ordinary import designs
from sweep.cli import main
from sweep.cli.effects import every_input
from sweep.effects import NAMES, applicable, effect, extended, offered
from sweep.effects.advice import closure, findings, left_out, tree
from sweep.effects.base import REGISTER, PlacedEffect, about
from sweep.families import NAMES as FAMILIES
from sweep.families import family
from sweep.families.capabilities import JointRecords, ThreadPath
from sweep.families.link_tree import LinkTree
from sweep.families.parameter import is_known
from sweep.quantities.units import factor, internal_unit

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_current():
    """`make docs` writes it; after a change of the register it must be run."""
    assert (ROOT / "docs" / "effects.md").read_text() == page()


def test_rows_of_the_page_for_any_link_or_joint_hold_for_those_of_their_kinds():
    """The names that a row for `B` or `J` stands for, with the rows of one effect alone, are those of the register."""
    seen = 0
    for group in grouped(map(effect, NAMES)):
        if len(group) == 1 or any(entry.tree is None for entry in group):
            continue
        for columns in ("output", "output per design", "input"):
            alone = [[row for part, _, rows in parts([e]) if part == columns for row in rows] for e in group]
            found = [places_of(entry) for entry in group]
            general, own = of_any_place(found, alone)
            kinds = {place.kind for one in found for place in one}
            for own_places, table, left in zip(found, alone, own, strict=True):
                named = [row[0] for row in left]
                for name, _, text in general:
                    only = text.rpartition("; ")[2].split(", ")
                    for place in own_places:
                        if f"_{place.sign}" in name and (place.kind in only or not set(only) <= kinds):
                            named.append(name.replace(f"_{place.sign}", f"_{place.name}", 1))
                            seen += 1
                assert sorted(named) == sorted(row[0] for row in table)
    assert seen > 500


def test_a_text_that_the_register_lacks_is_named(monkeypatch):
    """It was a TypeError about arguments of a class, which the writer of the register does not know."""
    entry = {key: text for key, text in REGISTER["effects"]["pressure"].items() if key != "title"}
    monkeypatch.setitem(REGISTER["effects"], "pressure", entry)
    with pytest.raises(TypeError, match=re.escape("sweep/effects.toml: [effects.pressure] lacks title")):
        about("pressure")


@pytest.mark.parametrize("name", NAMES)
def test_an_entry_is_complete(name):
    entry = effect(name)
    assert entry.name == name
    assert entry.title and entry.formulas and entry.called_for and entry.negligible
    assert entry.ns_per_pose > 0.0 or entry.design_result is not None
    outputs = PlacedEffect(entry).outputs
    for o in outputs:
        assert o.text and o.equation, o.name
        assert is_known(o.unit), o.name  # an unknown word would be printed as a pure number
    for item in (*outputs, *entry.inputs):
        assert factor(internal_unit(item.unit), internal_unit(item.unit)) == 1.0
    for needed in entry.needs:
        assert needed in NAMES


@pytest.mark.parametrize("name", FAMILIES)
def test_no_two_outputs_of_a_family_share_a_name(name):
    found = family(name)
    names = [*found.pose_names, *found.parameter_names, *(o.name for step in found.steps for o in step.provides)]
    of_effects = [o.name for o in offered(found)]
    assert len(set(of_effects)) == len(of_effects)
    assert not set(of_effects) & set(names)
    kinds = (JointRecords, LinkTree, ThreadPath)
    assert all(found.find(kind) is None for kind in kinds) == (not of_effects)


def test_an_effect_comes_after_what_it_needs():
    order = [entry.name for entry in closure([effect("bearing_life"), effect("dynamic_elasticity")])]
    assert order == ["coupler", "kinetostatics", "bearing_life", "pressure", "elasticity", "dynamic_elasticity"]


@pytest.mark.parametrize(("stiffness", "wanted", "verdict"), [
    (1e3, ["max_lag"], "Estimated share that vibration adds to the lag is large ("),
    (1e8, ["max_lag"], "dynamic_elasticity: rightly left out"),
    (1e8, ["max_lag", "floquet"], "dynamic_elasticity: wanted, but will not matter"),
    (1e3, ["max_lag", "floquet"], "dynamic_elasticity: matters"),
])  # fmt: skip
def test_a_rule_says_whether_an_effect_matters_here(stiffness, wanted, verdict):
    """The rule of section 9 for E2, estimated from the designs: max|lag''/nu^2|/max|lag| against 1/300."""
    bare = family("rssr")
    full = extended(bare, wanted)
    matrix = designs(full, 4)
    matrix[:, full.parameter_names.index("stiffness")] = stiffness
    words = [finding.words for finding in findings(bare, full, matrix, wanted)]
    assert any(line.startswith(verdict) for line in words), words


def test_links_without_a_mass_get_no_advice_about_their_speed():
    """Their unevenness would be 0/0: no line, and no warning of numpy (which fails a test)."""
    bare = family("heddle")
    full = extended(bare, ["max_abs_drive_torque"])
    matrix = designs(full, 4)
    for name in [p.name for p in full.parameters if p.name not in bare.parameter_names and p.name != "speed"]:
        matrix[:, full.parameter_names.index(name)] = 0.0
    words = [finding.words for finding in findings(bare, full, matrix, ["max_abs_drive_torque"])]
    assert words and not any("unevenness" in line for line in words)


def test_a_large_axial_force_is_said_where_nobody_asks_for_it():
    bare = family("rssr")
    full = extended(bare, ["psi"])
    words = [finding.words for finding in findings(bare, full, designs(full, 4), ["psi"])]
    (found,) = [line for line in words if line.startswith("Axial force is large (")]
    assert float(found.split("(")[1].split(" ")[0]) > 0.05
    assert found.endswith(" of the coupler force, not below 0.05); ask for `pressure`")


def test_effects_of_members_are_told_by_their_names_with_their_shares_of_the_cost():
    """What a relation is made of counts; a member that another drives has no forces that could be asked for."""
    driven = {"family": "rssr", "driver": "y.psi"}
    members = {"x": {"family": "slider_crank", "ratio": 2}, "y": "rssr", "z": driven}
    bare = family(sweep.machine(members, {"t": {"torque": ["x", "y"]}}))
    full = extended(bare, ["max_t"])
    rows = tree(bare, ["max_t"], 64.0)
    names = [name for name, *_ in rows if not name.startswith(" ")]
    assert names == ["motion", "x.slider_kinetostatics", "y.kinetostatics"]
    assert sum(int(share.split()[0]) for *_, share in rows if share) == pytest.approx(100, abs=2)
    out = left_out(bare, ["max_t"])
    assert {"x.pressure", "y.friction", "z.pressure"} <= set(out)
    assert not {"x.slider_kinetostatics", "y.coupler", "z.kinetostatics", "z.friction"} & set(out)
    matrix = np.array([[p.default or 0.0 for p in full.parameters]] * 4)
    for m in full.members:
        matrix[:, m.columns] = designs(m.family, 4)
    judged = {one.name: one.wanted for one in findings(bare, full, matrix, ["max_t"])}
    assert judged["y.kinetostatics"] and not judged["z.pressure"]
    assert "z.kinetostatics" not in judged
    # The speed is that of the shaft with x and y and its flywheel: a member alone would be told a wrong unevenness.
    assert not any("speed_fluctuation" in name for name in judged)
    alone = family(sweep.machine({"x": "slider_crank", "y": "rssr"}))
    full = extended(alone, ["x.max_force_b"])
    matrix = np.array([[p.default or 0.0 for p in full.parameters]] * 4)
    for m in full.members:
        matrix[:, m.columns] = designs(m.family, 4)
    assert any("speed_fluctuation" in one.name for one in findings(alone, full, matrix, ["x.max_force_b"]))


def test_the_finger_says_that_the_coupler_cannot_spin_freely():
    (finger,) = [p for p in effect("coupler").inputs if p.name == "finger"]
    assert finger.text.startswith("The coupler cannot spin freely")


def test_every_rule_of_negligibility_that_has_a_number_is_applied():
    """Where a scene has all inputs, each effect but those without a rule in section 9 is judged."""
    for name in ("rssr", "rssp", "guide"):
        bare = family(name)
        every = [o.name for placed in applicable(bare) for o in placed.outputs]
        full = extended(bare, every)
        judged = {finding.name for finding in findings(bare, full, designs(full, 4), every)}
        without = {
            "tool",
            "tip_tool",
            "shaking",
            "pressure_extrema",
            "sliding_bearings",
            "rolling_bearings",
            "bearing_life",
        }
        assert judged == {placed.name for placed in applicable(bare)} - without


def test_the_command_lists_and_explains():
    listing = CliRunner().invoke(main, ["effects"])
    assert listing.exit_code == 0
    assert all(name in listing.output for name in NAMES)
    one = CliRunner().invoke(main, ["effects", "friction"])
    assert "rho(L)" in one.output and "mu_a" in one.output and "kinetostatics" in one.output
    wrong = CliRunner().invoke(main, ["effects", "frction"])
    assert wrong.exit_code == 2
    assert "did you mean 'friction'?" in wrong.output


def test_the_index_of_the_page_says_what_every_effect_of_a_group_is():
    (row,) = [line for line in page().splitlines() if line.startswith("| [sliding_bearings, rolling_bearings,")]
    assert "sliding bearings of the rocker; rolling bearings of the rocker; utilisation of the sliding" in row


def test_the_page_names_every_output_and_input_once_for_all_effects_that_share_it():
    """Names in one row share their stem; reductions of outputs per pose are not listed."""
    named = set()
    any_place = {(place.sign, place.name) for entry in map(effect, NAMES) for place in places_of(entry)}
    rows = re.findall(r"^(?:\| (?=`)|Common inputs: )([^|]+)(?: \| [^|]+ \| [^|]+ \||\.)$", page(), re.MULTILINE)
    for cell in re.findall(r"`([^`]+)`", "\n".join(rows)):
        first, *others = cell.split(", ")
        names = {first, *others, *(re.sub(r"_[xyz]{1,2}$", "", first) + other for other in others)}
        named |= names | {x.replace(f"_{sign}", f"_{own}", 1) for x in names for sign, own in any_place}
    for entry in map(effect, NAMES):
        reductions = {o.name for o in entry.design_result.outputs} if entry.design_result else set()
        assert {o.name for o in entry.outputs} | {p.name for p in every_input(entry)} <= named, entry.name
        rest = {re.sub(r"^((phi_)?(max_abs|max|min)|range|rms)_", "", name) for name in reductions - named}
        assert rest <= {o.name for o in entry.outputs}, entry.name


def test_an_effect_says_the_unit_of_all_it_takes_and_gives():
    words = CliRunner().invoke(main, ["effects", "friction"]).output
    for name, unit in (("m_crank", "t"), ("j_rocker_xx.*_zz", r"t\*mm\^2"), ("mu_b", "1"), ("load_support_d1", "N")):
        assert re.search(rf"^  {name} +{unit} ", words, re.MULTILINE), name
