"""Everything one run of the study found: its tables, kept as Parquet, from which the pages and figures are made."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

ABOUT = "about.json"
# Written by `make bench-peers`, in an environment of its own, if ever.
PEERS = ("peers", "loads", "peer_loads")


@dataclass(frozen=True)
class Measured:
    """The tables of one run.

    Parameters
    ----------
    machine, smoke, regions : what the times depend on; whether all is rough; regions of crank-rockers and their texts
    families, effects : error and time of every family and effect of the register
    whole : one small study from its file to its optimum
    marks : what was to be reached, and what was
    positions, exact, work, outputs, storage, digits, targets : the crank-rocker in depth
    oracle, worst : errors against the 25-digit tables, and the largest that a search has found
    peers, loads, peer_loads : other programs, None where `make bench-peers` has not been run
    """

    machine: str
    smoke: bool
    regions: tuple[tuple[str, str], ...]
    families: pd.DataFrame
    effects: pd.DataFrame
    whole: pd.DataFrame
    marks: pd.DataFrame
    positions: pd.DataFrame
    exact: pd.DataFrame
    work: pd.DataFrame
    outputs: pd.DataFrame
    storage: pd.DataFrame
    digits: pd.DataFrame
    targets: pd.DataFrame
    oracle: pd.DataFrame
    worst: pd.DataFrame
    peers: pd.DataFrame | None = None
    loads: pd.DataFrame | None = None
    peer_loads: pd.DataFrame | None = None

    def tables(self) -> Iterator[tuple[str, pd.DataFrame]]:
        """Yield the tables that this study measures, by name."""
        return ((name, getattr(self, name)) for name in _own_tables())

    def write(self, folder: Path) -> None:
        """Keep the tables; those of other programs have been written by their own command."""
        folder.mkdir(parents=True, exist_ok=True)
        about = {"machine": self.machine, "smoke": self.smoke, "regions": self.regions}
        (folder / ABOUT).write_text(json.dumps(about, indent=1), encoding="utf-8")
        for name, table in self.tables():
            table.to_parquet(folder / f"{name}.parquet", index=False)

    @classmethod
    def read(cls, folder: Path) -> Measured:
        """Return what :meth:`write` kept, with the tables of other programs where they lie beside it."""
        import pandas as pd

        about = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        regions = tuple((name, text) for name, text in about["regions"])
        own: dict[str, Any] = {name: pd.read_parquet(folder / f"{name}.parquet") for name in _own_tables()}
        return cls(about["machine"], about["smoke"], regions, **own, **others(folder))


def others(folder: Path) -> dict[str, pd.DataFrame]:
    """Return tables of other programs that lie in the folder, by name."""
    import pandas as pd

    files = {name: folder / f"{name}.parquet" for name in PEERS}
    return {name: pd.read_parquet(file) for name, file in files.items() if file.exists()}


def _own_tables() -> list[str]:
    return [field.name for field in fields(Measured)][3 : -len(PEERS)]
