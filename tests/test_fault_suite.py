"""A tenth of the suite of faults; ``make test-faults`` tries all of them and prints the table."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.faults.ground import Ground, Kind, Outcome
from tests.faults.suite import KINDS, Row, tried, verdict

TENTH = 0.1


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Ground:
    return Ground(tmp_path_factory.mktemp("ground"))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_nothing_finished_is_lost_and_nothing_is_silently_wrong_after(
    kind: Kind, ground: Ground, tmp_path: Path
) -> None:
    row = tried(kind, max(1, round(TENTH * kind.count)), ground, tmp_path)
    assert not row.lost and not row.wrong, "\n".join([*row.lost, *row.wrong])


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
