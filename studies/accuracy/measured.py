"""Results of one run of the study: its tables, kept as Parquet, from which pages and figures are made."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

ABOUT = "about.json"
# Written by `make bench-peers` in an environment of its own, optionally.
PEERS = "peers"


@dataclass(frozen=True)
class Measured:
    """The tables of one run.

    Parameters
    ----------
    machine, smoke : conditions of the times; whether all values are rough
    families, regions, effects : error and time of every family, of the crank-rocker's own regions, of every effect
    whole : one small study from its file to its optimum
    marks : targets and measured values
    peers : another program on planar four-bars, None if `make bench-peers` has not been run
    """

    machine: str
    smoke: bool
    families: pd.DataFrame
    regions: pd.DataFrame
    effects: pd.DataFrame
    whole: pd.DataFrame
    marks: pd.DataFrame
    peers: pd.DataFrame | None = None

    def write(self, folder: Path) -> None:
        """Write the tables, except that of another program, which its own command has written."""
        folder.mkdir(parents=True, exist_ok=True)
        about = {"machine": self.machine, "smoke": self.smoke}
        (folder / ABOUT).write_text(json.dumps(about, indent=1), encoding="utf-8")
        for name in _tables():
            getattr(self, name).to_parquet(folder / f"{name}.parquet", index=False)

    @classmethod
    def read(cls, folder: Path) -> Measured:
        """Read the tables of :meth:`write`, and the table of another program if it exists."""
        import pandas as pd

        about = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        own = {name: pd.read_parquet(folder / f"{name}.parquet") for name in _tables()}
        return cls(about["machine"], about["smoke"], **own, peers=peers_in(folder))


def peers_in(folder: Path) -> pd.DataFrame | None:
    """Read the table of another program in the folder, or return None."""
    import pandas as pd

    file = folder / f"{PEERS}.parquet"
    return pd.read_parquet(file) if file.exists() else None


def _tables() -> list[str]:
    return [field.name for field in fields(Measured) if field.name not in ("machine", "smoke", PEERS)]
