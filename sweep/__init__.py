"""linksweep: parameter sweeps and optimum design of the linkages of textile and sewing machines.

- ``evaluate`` computes poses of designs, ``summarise`` numbers of a whole turn, ``mechanism`` binds one design.
- ``run`` computes a study file into a folder; ``load``, ``scan``, ``verify``, ``compare`` read such folders.
- ``synthesise`` and ``from_points`` find dimensions; ``plot``, ``joints``, ``export`` show a design.
- ``machine`` puts several mechanisms on one shaft; ``cyclogram``, ``thread``, ``rod`` belong to machines and loads.

Numbers are in one unit of length (mm) and rad; texts such as ``"40 mm"`` carry their unit.  `sweep families` and
`sweep effects` on the command line list the names; docs/tutorial.md is the way in.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sweep._kernels import check_kernels
from sweep.errors import IncompleteWarning as IncompleteWarning
from sweep.errors import InputError as InputError
from sweep.errors import LinksweepError as LinksweepError
from sweep.errors import LinksweepWarning as LinksweepWarning
from sweep.errors import StudyError as StudyError
from sweep.errors import nearest as _nearest

if TYPE_CHECKING:
    from sweep.dataset.comparison import compare as compare
    from sweep.dataset.reading import scan as scan
    from sweep.dataset.store import is_complete as is_complete
    from sweep.dataset.store import load as load
    from sweep.dataset.verification import verify as verify
    from sweep.engine.run import run as run
    from sweep.evaluation import thread as thread
    from sweep.evaluation.cyclogram import cyclogram as cyclogram
    from sweep.evaluation.joints import joints as joints
    from sweep.evaluation.loads import rod as rod
    from sweep.evaluation.mechanism import mechanism as mechanism
    from sweep.evaluation.poses import evaluate as evaluate
    from sweep.evaluation.summaries import summarise as summarise
    from sweep.exchange.export import export as export
    from sweep.exchange.points import from_points as from_points
    from sweep.families import machine as machine
    from sweep.synthesis.mechanisms import synthesise as synthesise

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

__all__ = sorted(
    ["IncompleteWarning", "InputError", "LinksweepError", "LinksweepWarning", "StudyError", *_HOMES, *_MODULES]
)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        globals()[name] = import_module(_MODULES[name])
    elif name in _HOMES:
        globals()[name] = getattr(import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{_nearest(name, __all__)}")
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, *_MODULES})
