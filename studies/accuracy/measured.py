"""Everything one run of the study found: its tables, kept as Parquet, from which the pages and figures are made."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

ABOUT = "about.json"
# Written by `make bench-peers`, in an environment of its own, if ever.
PEERS = "peers"


@dataclass(frozen=True)
class Measured:
    """The tables of one run.

    Parameters
    ----------
    machine, smoke : what the times depend on; whether all is rough
    families, regions, effects : error and time of every family, of the crank-rocker's own regions, of every effect
    whole : one small study from its file to its optimum
    marks : what was to be reached, and what was
    peers : another program on planar four-bars, None where `make bench-peers` has not been run
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
        """Keep the tables; that of another program has been written by its own command."""
        folder.mkdir(parents=True, exist_ok=True)
        about = {"machine": self.machine, "smoke": self.smoke}
        (folder / ABOUT).write_text(json.dumps(about, indent=1), encoding="utf-8")
        for name in _tables():
            getattr(self, name).to_parquet(folder / f"{name}.parquet", index=False)

    @classmethod
    def read(cls, folder: Path) -> Measured:
        """Read what :meth:`write` kept, with the table of another program where it lies beside it."""
        import pandas as pd

        about = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        own = {name: pd.read_parquet(folder / f"{name}.parquet") for name in _tables()}
        return cls(about["machine"], about["smoke"], **own, peers=peers_in(folder))


def peers_in(folder: Path) -> pd.DataFrame | None:
    """Read the table of another program that lies in the folder, if any."""
    import pandas as pd

    file = folder / f"{PEERS}.parquet"
    return pd.read_parquet(file) if file.exists() else None


def _tables() -> list[str]:
    return [field.name for field in fields(Measured) if field.name not in ("machine", "smoke", PEERS)]
