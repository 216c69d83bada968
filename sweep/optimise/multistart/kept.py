"""Finished parts of a search in a file, from which a stopped run resumes and ends with the same answer."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sweep.dataset.files import metadata, write_atomically
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.survey import Survey


class Kept:
    """Finished parts of a search by name, as JSON; without a path they are kept in memory only.

    Parameters
    ----------
    path : path of the file
    key : hash of everything that the search depends on; parts of a search with another key are discarded
    """

    def __init__(self, path: Path | None = None, key: str = "") -> None:
        self.path, self.key, self.parts = path, key, dict[str, Any]()
        try:
            content = json.loads(path.read_bytes()) if path is not None and path.is_file() else {}
            self.parts = content["parts"] if content.get("key") == key else {}
        except (ValueError, KeyError, AttributeError):  # damaged: start again
            self.parts = {}

    def note(self, name: str, part: Any) -> None:
        """Keep a finished part."""
        self.parts[name] = part
        if self.path is not None:
            write_atomically(self.path, json.dumps({"key": self.key, "parts": self.parts}).encode())

    def forget(self) -> None:
        """Remove the file of a finished search."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def noted(result: Result) -> dict[str, Any]:
    """Return a result as a dict that JSON can store."""
    return asdict(result) | {"design": result.design.tolist()}


def result_of(part: dict[str, Any]) -> Result:
    """Return the result stored as a dict."""
    return Result(**part | {"design": np.array(part["design"], np.float64), "active": tuple(part["active"])})


def survey_of(content: dict[str, Any]) -> Survey:
    """Return the survey stored as a dict."""
    return Survey(**content | {"kinds": tuple(tuple(kind) for kind in content["kinds"])})


def read_survey(path: Path) -> Survey | None:
    """Return the survey of a search from its ``_optimum.parquet``, or None without one."""
    content = metadata(path).get(b"search")
    return None if content is None else survey_of(json.loads(content))
