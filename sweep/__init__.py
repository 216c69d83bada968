"""linksweep: parameter sweeps and optimum design of the linkages of textile and sewing machines."""

from __future__ import annotations

from sweep.engine import run
from sweep.errors import InputError, LinksweepError, StudyError
from sweep.poses import evaluate
from sweep.store import is_complete, load
from sweep.summaries import summarise

__all__ = ["InputError", "LinksweepError", "StudyError", "evaluate", "is_complete", "load", "run", "summarise"]
