"""linksweep: parameter sweeps and optimum design of the linkages of textile and sewing machines."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sweep._kernels import check_kernels
from sweep.errors import IncompleteWarning, InputError, LinksweepError, LinksweepWarning, StudyError

if TYPE_CHECKING:
    from sweep.dataset.comparison import compare
    from sweep.dataset.reading import scan
    from sweep.dataset.store import is_complete, load
    from sweep.dataset.verification import verify
    from sweep.engine.run import run
    from sweep.evaluation import thread
    from sweep.evaluation.cyclogram import cyclogram
    from sweep.evaluation.joints import joints
    from sweep.evaluation.loads import rod
    from sweep.evaluation.mechanism import mechanism
    from sweep.evaluation.poses import evaluate
    from sweep.evaluation.summaries import summarise
    from sweep.exchange.export import export
    from sweep.exchange.points import from_points
    from sweep.families import machine
    from sweep.synthesis.mechanisms import synthesise

__all__ = [
    "IncompleteWarning",
    "InputError",
    "LinksweepError",
    "LinksweepWarning",
    "StudyError",
    "compare",
    "cyclogram",
    "evaluate",
    "export",
    "from_points",
    "is_complete",
    "joints",
    "load",
    "machine",
    "mechanism",
    "plot",
    "rod",
    "run",
    "scan",
    "summarise",
    "synthesise",
    "thread",
    "verify",
]

check_kernels()

# Imported when first used, so that the command line answers at once: numba alone takes a quarter of a second.
_HOMES = {
    "compare": "sweep.dataset.comparison",
    "cyclogram": "sweep.evaluation.cyclogram",
    "evaluate": "sweep.evaluation.poses",
    "export": "sweep.exchange.export",
    "from_points": "sweep.exchange.points",
    "is_complete": "sweep.dataset.store",
    "joints": "sweep.evaluation.joints",
    "load": "sweep.dataset.store",
    "machine": "sweep.families",
    "mechanism": "sweep.evaluation.mechanism",
    "rod": "sweep.evaluation.loads",
    "run": "sweep.engine.run",
    "scan": "sweep.dataset.reading",
    "summarise": "sweep.evaluation.summaries",
    "synthesise": "sweep.synthesis.mechanisms",
    "verify": "sweep.dataset.verification",
}
_MODULES = {"plot": "sweep.plot", "thread": "sweep.evaluation.thread"}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        globals()[name] = import_module(_MODULES[name])
    elif name in _HOMES:
        globals()[name] = getattr(import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, *_MODULES})
