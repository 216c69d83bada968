"""A fault of each sort, and for `make test-long` a tenth of the suite; ``make test-faults`` tries all of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.faults.ground import Ground, Kind, Outcome
from tests.faults.suite import KINDS, Row, tried, verdict

TENTH = 0.1
# One trial each, of one study: damage, two at a time, kernels.  Kills, signals and full disks are tried by
# tests/run/test_faults.py, and here, at every stage of a run, by the long test.
QUICK = ("flipped chunk", "two runs in one folder", "kernel that raises")


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Ground:
    return Ground(tmp_path_factory.mktemp("ground"))


def sound(kind: Kind, count: int, ground: Ground, folder: Path) -> None:
    row = tried(kind, count, ground, folder)
    assert not row.lost and not row.wrong, "\n".join([*row.lost, *row.wrong])


@pytest.mark.parametrize("name", QUICK)
def test_nothing_finished_is_lost_and_nothing_is_silently_wrong_after(
    name: str, ground: Ground, tmp_path: Path
) -> None:
    (kind,) = (kind for kind in KINDS if kind.name == name)
    sound(kind, 1, ground, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_nothing_is_lost_or_silently_wrong_after_a_tenth_of_the_suite(
    kind: Kind, ground: Ground, tmp_path: Path
) -> None:
    sound(kind, max(1, round(TENTH * kind.count)), ground, tmp_path)


def test_a_lost_or_changed_file_is_seen_by_the_suite(ground: Ground, tmp_path: Path) -> None:
    """Negative control: the suite that finds no losses would find these."""
    designs = ground.swept(ground.plain, tmp_path)
    chunks = sorted(designs.glob("part-*"))
    before = {path.name: path.read_bytes() for path in chunks}
    chunks[0].unlink()
    chunks[1].write_bytes(chunks[1].read_bytes()[:-1] + b"x")
    found = ground.settled(ground.plain, designs, before, Outcome())
    assert {line.split()[0] for line in found.lost} >= {chunks[0].name, chunks[1].name}
    assert f"{chunks[1].name} differs" in found.wrong
    line = verdict([Row(KINDS[0], [found])])
    assert line.startswith("1 faults of 1 kinds: ") and " 0 finished" not in line
