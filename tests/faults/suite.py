"""All kinds of faults, how often each is tried, and the table of what was lost."""

from __future__ import annotations

import random
import shutil
import zlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests.faults.damage import DAMAGE
from tests.faults.disks import DISKS
from tests.faults.ground import Ground, Kind, Outcome
from tests.faults.kills import KILLS, SIGNALS
from tests.faults.others import OTHERS

KINDS: list[Kind] = [*KILLS, *SIGNALS, *DISKS, *DAMAGE, *OTHERS]
WIDTH = 100  # letters of a last line that are shown


@dataclass(frozen=True)
class Row:
    """What the trials of one kind have come to."""

    kind: Kind
    outcomes: list[Outcome]

    @property
    def lost(self) -> list[str]:
        return [line for one in self.outcomes for line in one.lost]

    @property
    def wrong(self) -> list[str]:
        return [line for one in self.outcomes for line in one.wrong]

    def line(self) -> str:
        codes = Counter(one.code for one in self.outcomes if one.code is not None)
        ended = " ".join(f"{code}:{number}" for code, number in sorted(codes.items()))
        said = next((one.said for one in self.outcomes if one.said and one.code not in (0, 4)), "")
        head = f"{self.kind.name:40} {len(self.outcomes):5} {len(self.lost):5} {len(self.wrong):5}  {ended:18}"
        return f"{head} {said if len(said) <= WIDTH else '...' + said[-WIDTH:]}".rstrip()


HEAD = f"{'kind':40} {'count':>5} {'lost':>5} {'wrong':>5}  {'exit codes':18} last line of one of them"


def tried(kind: Kind, count: int, ground: Ground, folder: Path) -> Row:
    """So many trials of a kind; the moments are those of its name."""
    moments = random.Random(zlib.crc32(kind.name.encode()))
    outcomes = []
    for number in range(count):
        place = folder / f"{zlib.crc32(kind.name.encode())}-{number}"
        place.mkdir()
        outcomes.append(kind.trial(ground, place, moments))
        if not outcomes[-1].lost and not outcomes[-1].wrong:
            shutil.rmtree(place)
    return Row(kind, outcomes)


def verdict(rows: Iterable[Row]) -> str:
    """The last line of the table."""
    rows = list(rows)
    trials, lost, wrong = (sum(len(part) for part in parts) for parts in zip(
        *((row.outcomes, row.lost, row.wrong) for row in rows), strict=True))  # fmt: skip
    return f"{trials} faults of {len(rows)} kinds: {lost} finished things lost, {wrong} things wrong"
