"""Settings of real machines at the moment A, as their service and adjusting instructions give them [mm]."""

from __future__ import annotations

from typing import Any, NamedTuple

from sweep.errors import choices
from sweep.quantities.limits import Limit
from sweep.study.file import Key, StudyFile


class Setting(NamedTuple):
    """What instructions of a machine ask for, least and most [mm]; None is not asked."""

    source: str
    rise: tuple[float, float] | None = None
    clearance: tuple[float, float] | None = None
    above_eye: tuple[float, float] | None = None
    reach: tuple[float, float] | None = None
    back_height: tuple[float, float] | None = None


# `reach` is what manuals measure as the looper's gauge, at its far end.  A single value has a band of 0.1 mm, ours.
SETTINGS = {
    "juki-mo-104d": Setting("Juki MO-104D, overlock", clearance=(0.01, 0.1), back_height=(-0.2, 0.2)),
    "janome-213d": Setting("Janome MyLock 213D, overlock", clearance=(0.0, 0.05)),
    "pfaff-4772": Setting("Pfaff coverlock 4772, overlock and cover stitch", clearance=(0.0, 0.05)),
    "juki-mf-7200d": Setting("Juki MF-7200D, cover stitch", clearance=(0.0, 0.05)),
    "janome-1200d": Setting("Janome 1200D, overlock with chain looper", clearance=(0.0, 0.05), reach=(1.5, 1.8)),
    "union-special-56500r": Setting("Union Special 56500R, chain stitch", reach=(3.1, 3.3)),
    "duerkopp-adler-838": Setting(
        "Duerkopp Adler 838, hook", rise=(2.4, 2.6), clearance=(0.02, 0.1), above_eye=(1.4, 1.6)
    ),
    "duerkopp-adler-867": Setting("Duerkopp Adler 867, hook", rise=(1.9, 2.1), clearance=(0.0, 0.1)),
    "pfaff-1243": Setting("Pfaff 1243, hook", rise=(2.0, 2.4), clearance=(0.05, 0.1), above_eye=(0.8, 1.0)),
    "juki-lu-2210n-7": Setting("Juki LU-2210N-7, hook", rise=(1.8, 2.2), above_eye=(1.2, 1.6)),
    "janome-1600p": Setting("Janome 1600P, hook", rise=(1.9, 2.1), clearance=(0.0, 0.1)),
}


def limits_of_settings(file: StudyFile) -> list[Limit]:
    """Return the limits of every relation that names the settings of a machine, and report a name that is none."""
    found = []
    for relation, name in _named(file.data.get("relations")).items():
        key: Key = ("relations", relation, "settings")
        setting = SETTINGS.get(name) if isinstance(name, str) else None
        if setting is None:
            file.faults.value(key, name, choices(str(name), SETTINGS))
            continue
        bounds = {what: ends for what, ends in setting._asdict().items() if what != "source" and ends is not None}
        found += [Limit(f"{relation}_{what}", *ends) for what, ends in bounds.items()]
    return found


def _named(relations: Any) -> dict[str, Any]:
    tables = relations.items() if isinstance(relations, dict) else ()
    return {name: table["settings"] for name, table in tables if isinstance(table, dict) and "settings" in table}
