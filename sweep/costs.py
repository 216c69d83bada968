"""Measured computing times: the one table, sweep/costs.toml, which ``make bench`` measures and writes.

The times determine the estimated duration of a study, the number of designs per chunk and the size of batches.  They
affect no computed value: the order of routes is fixed by :class:`sweep.families.base.Work`, and a resumed run keeps
the chunks of its folder.  So new times leave finished data valid.
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

poses : of a family, per pose: its position with all its derivatives
margins : of a family without an own step for margins, per design: the margin over its poses, rotatable or not
steps : of a family's own step, "family: step", per design
samples : of a step that loops over samples, per design and sample, in addition to ``steps``
effects : of an effect, per pose, all its pose outputs together, without the motion that it needs
effects_design : of an effect, per design, all its design outputs together
work : work that belongs to no family: searches, fits, parameters
"""

# Times assumed for a family, an effect or a search that is not measured yet: high rather than low, so that a study
# is cut into more and smaller chunks than needed and its time is not underestimated.
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
    """Return the time of a row in a section of the table [ns]; the assumed time where the table has no such row."""
    return table().get(kind, {}).get(name, UNMEASURED[kind])


@lru_cache
def table() -> Mapping[str, Mapping[str, float]]:
    """Read the table of the file, by section."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))
