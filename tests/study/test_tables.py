"""The register of the tables of a study file, and the capabilities that their readers ask the mechanism for."""

from __future__ import annotations

from dataclasses import fields

import pytest

from sweep.errors import StudyError
from sweep.families import NAMES, family
from sweep.families.capabilities import LimitLocus
from sweep.families.chain import driven_guide
from sweep.study import study_from_data
from sweep.study.tables import REQUIRED_TABLES, TABLES, Sections
from sweep.synthesis.locus import LOCI


def test_every_table_has_a_word_and_the_shape_of_those_whose_keys_are_fixed_is_read():
    fixed = [name for name, table in TABLES.items() if table.model is not None]
    assert set(REQUIRED_TABLES) <= set(TABLES)
    assert sorted(field.name for field in fields(Sections)) == sorted(fixed)
    shapes = [model for table in TABLES.values() for model in (table.model, table.each) if model is not None]
    assert len(set(shapes)) == len(shapes)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_that_is_no_table_is_one_fault_of_that_table(name, tmp_path):
    rest = {"study": {"name": "x"}, "mechanism": {"family": "rssr"}, "design": {}}
    with pytest.raises(StudyError) as caught:
        study_from_data({**rest, name: 7}, tmp_path / "study.toml")
    assert sum(f" {name} = 7; allowed: " in fault for fault in caught.value.faults) == 1


@pytest.mark.parametrize("name", NAMES)
def test_limit_locus_is_offered_by_exactly_the_families_that_have_loci(name):
    entry = family(name)
    offered = entry.find(LimitLocus)
    assert (offered is not None) == any(way.family == name for way in LOCI)
    if offered is not None:
        ways = [way for way in LOCI if way.family == name]
        assert {way.parameter_names[0] for way in ways} == {offered.travel}
        assert bool(offered.sized) == any(way.chosen_by == "direction" for way in ways)
        assert set(offered.sized) <= set(entry.parameter_names)


def test_only_a_crank_rocker_that_drives_a_guided_point_is_a_driven_guide():
    stages = driven_guide(family(["rssr", "guide"]))
    assert stages is not None
    assert [stage.number for stage in stages] == [1, 2]
    others = ["guide", "rssr", ["rssr", "rssr"], ["rssr", "rssp"], ["four_bar", "guide"], ["rssr", "rssr", "guide"]]
    assert [driven_guide(family(other)) for other in others] == [None] * len(others)


def test_arcs_are_offered_for_the_ways_by_the_place_on_the_locus():
    assert [way.chosen_by for way in LOCI if way.arc_ends is not None] == ["phi1", "phi1"]
