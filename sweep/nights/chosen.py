"""Which studies a night computes, and in which order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sweep.dataset import store
from sweep.errors import InputError, StudyError
from sweep.nights.records import read_night
from sweep.study import Study, load_study

FILE = "study.toml"


@dataclass(frozen=True)
class Chosen:
    """A study of the night; ``study`` is None where its file has faults, which ``fault`` tells."""

    name: str
    path: Path
    study: Study | None
    fault: str = ""


def chosen(places: Iterable[Path], smoke: bool) -> list[Chosen]:
    """Return the studies in these places: study files, folders with one, or folders of such folders.

    Raises
    ------
    InputError
        if there is no study, or two have one name: each has a folder of its name in the night.
    """
    places = list(places)
    found: list[Chosen] = []
    for path in [path for place in places for path in _files(place)]:
        try:
            study = load_study(path, smoke=smoke)
            one = Chosen(study.name, path, study)
        except StudyError as error:
            one = Chosen(path.parent.name, path, None, str(error))
        twin = next((other for other in found if other.name == one.name), None)
        if twin is not None:
            raise InputError("study", one.name, f"one study of a name, {twin.path} has it already", str(path))
        found.append(one)
    if not found:
        raise InputError("studies", ", ".join(map(str, places)), f"study files, or folders with a {FILE}", "nightly")
    return found


def _files(place: Path) -> list[Path]:
    if place.is_file():
        return [place]
    return [place / FILE] if (place / FILE).is_file() else sorted(place.glob(f"*/{FILE}"))


def in_order(studies: Sequence[Chosen], earlier: Sequence[Path]) -> list[Chosen]:
    """Sort the studies: what was cut off or not begun in the last night comes first, the rest in the order given.

    Parameters
    ----------
    studies : of this night
    earlier : folders of nights, the newest first; one that was killed has no record, then its datasets tell
    """
    if not earlier:
        return list(studies)
    last = earlier[0]
    record = read_night(last)

    def late(one: Chosen) -> bool:
        if record is not None:
            return one.name in record.studies and record.studies[one.name].state in ("cut", "waiting")
        return not store.is_complete(last / one.name / store.DESIGNS)

    return sorted(studies, key=lambda one: not late(one))
