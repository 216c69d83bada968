"""The register of the tables of a study file, and the capabilities that its readers ask the mechanism for."""

from __future__ import annotations

import pytest

from sweep.families import NAMES, family
from sweep.families.capabilities import LimitLocus
from sweep.families.chain import driven_guide
from sweep.study.tables import READERS, REQUIRED_TABLES, TABLES
from sweep.synthesis import LOCI

# The reader of [mechanism] reads these too: a file has one or the other.
BESIDE_THE_MECHANISM = {"machine", "relations"}


def test_every_table_that_messages_list_has_a_reader_and_every_reader_a_table():
    assert {table for table, _ in READERS} | BESIDE_THE_MECHANISM == set(TABLES)
    assert len(set(TABLES)) == len(TABLES)
    assert set(REQUIRED_TABLES) <= set(TABLES)


def test_no_reader_is_called_twice():
    readers = [read for _, read in READERS]
    assert len(set(readers)) == len(readers)


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
