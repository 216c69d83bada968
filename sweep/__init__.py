"""linksweep: parameter sweeps and optimum design of the linkages of textile and sewing machines."""

from __future__ import annotations

from sweep.errors import InputError, LinksweepError, StudyError
from sweep.poses import evaluate

__all__ = ["InputError", "LinksweepError", "StudyError", "evaluate"]
