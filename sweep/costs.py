"""What things take in time: the one table, sweep/costs.toml, which ``make bench`` measures and writes.

The figures say how long a study will take, how many designs a chunk holds and how many of them are worked on at once.
They decide no value: the order in which routes are taken is fixed by :class:`sweep.families.base.Work`, and a run that
is resumed keeps the cut of its folder.  So new figures leave finished data valid.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Literal

TABLE = Path(__file__).with_suffix(".toml")

Kind = Literal["poses", "margins", "steps", "samples", "effects", "effects_design", "work"]
"""The sections of the table, all in nanoseconds on one core.

poses : of a family, per pose: its position with all derivatives that it gives
margins : of a family without an own step for it, per design: the margin over its poses, also of what does not turn
steps : of a family's own step, "family: step", per design
samples : of a step that works through the samples, per design and sample, besides what ``steps`` says
effects : of an effect, per pose, all its pose outputs together, without the motion that it needs
effects_design : of an effect, per design, all its design outputs together
work : what belongs to no family: searches, fits, parameters
"""

# What is assumed of a family, an effect or a search until it is measured: dear rather than cheap, so that a study is
# cut into more and smaller chunks than it needs, and its time is not underestimated.
UNMEASURED: Mapping[Kind, float] = {
    "poses": 500.0,
    "margins": 20_000.0,
    "steps": 20_000.0,
    "samples": 0.0,
    "effects": 500.0,
    "effects_design": 200_000.0,
    "work": 5000.0,
}


def nanoseconds(kind: Kind, name: str) -> float:
    """Return the measured time of something in a section of the table; what is assumed where it has no row there."""
    return table().get(kind, {}).get(name, UNMEASURED[kind])


@lru_cache
def table() -> Mapping[str, Mapping[str, float]]:
    """Return the table as it stands in the file, by section."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))
