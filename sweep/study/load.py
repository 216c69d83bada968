"""``load_study``: from TOML to a checked :class:`Study`, or every fault of the file at once."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sweep.study.faults import Faults
from sweep.study.lines import key_lines
from sweep.study.machine import flattened
from sweep.study.model import OutputSection
from sweep.study.reading import Reading
from sweep.study.study import Study
from sweep.study.tables import READERS, REQUIRED_TABLES, TABLES
from sweep.study.tables.accuracy import accuracy_table
from sweep.study.tables.bodies import Besides
from sweep.study.toml import read_toml, toml_text


def load_study(path: str | Path, smoke: bool = False) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path : a study.toml, or the folder that holds one
    smoke : lay smoke.toml, which lies beside it and holds only the keys that differ, over it

    Raises
    ------
    StudyError
        lists every fault with file, line, key, value and what is allowed.
    """
    file = Path(path)
    file = file / "study.toml" if file.is_dir() else file
    beside = file.with_name("smoke.toml")
    files = [file, beside] if smoke else [file]
    read = {f.name: read_toml(f) for f in files}
    places = {f.name: key_lines(toml_text(f)) for f in files}
    data = merged(read[file.name], read[beside.name]) if smoke else read[file.name]
    return _build(data, file, read, places)


def study_from_data(data: Mapping[str, Any], path: str | Path) -> Study:
    """Return the study of ``Study.data`` (as a dataset's _plan.json keeps it); ``path`` is what messages name.

    Raises
    ------
    StudyError
        as :func:`load_study`.
    """
    return _build(data, Path(path), {Path(path).name: data})


def with_accuracy(study: Study, target: float | None = None, certify: bool | Sequence[str] | None = None) -> Study:
    """Return the same study with its extrema refined to another relative error,
    or with or without the proof of its maxima.

    Raises
    ------
    StudyError
        if the target is not between 1e-14 and 0.1, or what is wanted cannot be proven.
    """
    setting = accuracy_table(study.accuracy)
    if target is not None:
        setting = {"target": target} | {key: setting[key] for key in ("certify",) if key in setting}
    if certify is not None:
        setting["certify"] = certify if isinstance(certify, bool) else list(certify)
    return study_from_data(study.data | {"accuracy": setting}, study.path)


def merged(base: Mapping[str, Any], over: Mapping[str, Any], key: tuple[str, ...] = ()) -> dict[str, Any]:
    """Lay one file's tables over another's, key by key.

    [accuracy], [objective] and whatever stands as value or values of a parameter replace what they cover: half of one
    and half of the other would be neither.
    """
    result = copy.deepcopy(dict(base))
    for name, new in over.items():
        old = result.get(name)
        if not isinstance(old, dict) or not isinstance(new, dict) or (*key, name) in (("accuracy",), ("objective",)):
            result[name] = copy.deepcopy(new)
        elif {"value", "values"}.isdisjoint({*old, *new}):
            result[name] = merged(old, new, (*key, name))
        else:
            result[name] = copy.deepcopy(new)
    return result


def _build(
    data: Mapping[str, Any],
    path: Path,
    files: Mapping[str, Mapping[str, Any]],
    places: Mapping[str, Mapping[str, int]] = MappingProxyType({}),
) -> Study:
    members = data.get("machine")
    data = flattened(data, members)
    faults = Faults({name: flattened(content, members) for name, content in files.items()}, places)
    for name in data:
        if name not in TABLES:
            faults.unknown((name,), [t for t in TABLES if t not in data], "table")
    for name in REQUIRED_TABLES:
        if name not in data:
            faults.missing((name,), f"a table [{name}]")
    reading = Reading(data, path, faults)
    for _, read in READERS:
        read(reading)
    reading.raise_faults()
    defaults = {
        "accuracy": accuracy_table(reading.fields["accuracy"]),
        "output": reading.get(OutputSection).model_dump(),
    }
    loads = reading.get(Besides).inlined
    if loads:
        defaults["loads"] = copy.deepcopy(loads)
    return Study(path=path, data=copy.deepcopy(dict(data)) | defaults, **reading.fields)
