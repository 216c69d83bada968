"""What a search has found so far, in a file: a run that was stopped goes on there, and ends with the same answer."""

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
    """Parts of a search by their names, as JSON; without a path they are kept in memory alone.

    Parameters
    ----------
    path : of the file
    key : what the search depends on: parts of a search with another key are forgotten
    """

    def __init__(self, path: Path | None = None, key: str = "") -> None:
        self.path, self.key, self.parts = path, key, dict[str, Any]()
        try:
            content = json.loads(path.read_bytes()) if path is not None and path.is_file() else {}
            self.parts = content["parts"] if content.get("key") == key else {}
        except (ValueError, KeyError, AttributeError):  # damaged: the search begins anew
            self.parts = {}

    def note(self, name: str, part: Any) -> None:
        """Keep a part that is over."""
        self.parts[name] = part
        if self.path is not None:
            write_atomically(self.path, json.dumps({"key": self.key, "parts": self.parts}).encode())

    def forget(self) -> None:
        """Remove the file: the search is over."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def noted(result: Result) -> dict[str, Any]:
    """Return a result as JSON takes it."""
    return asdict(result) | {"design": result.design.tolist()}


def result_of(part: dict[str, Any]) -> Result:
    """Return the result that was noted."""
    return Result(**part | {"design": np.array(part["design"], np.float64), "active": tuple(part["active"])})


def survey_of(content: dict[str, Any]) -> Survey:
    """Return the survey that was noted."""
    return Survey(**content | {"kinds": tuple(tuple(kind) for kind in content["kinds"])})


def read_survey(path: Path) -> Survey | None:
    """Return what the starts of a search found, from its ``_optimum.parquet``; None without one."""
    content = metadata(path).get(b"search")
    return None if content is None else survey_of(json.loads(content))
