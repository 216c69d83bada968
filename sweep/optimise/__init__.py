"""The optimiser: minimises an objective under limits by quadratic programs in epigraph form, with exact gradients."""

from __future__ import annotations

import scipy.linalg  # noqa: F401 (its BLAS is limited below only once it is loaded)
from threadpoolctl import threadpool_limits

from sweep.optimise.front.pareto import pareto
from sweep.optimise.front.study import front_study
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.kept import read_survey
from sweep.optimise.multistart.multistart import explore, minimise, optimum
from sweep.optimise.multistart.survey import Survey
from sweep.optimise.problem.on_locus import on_locus
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.posing import compile_descents
from sweep.optimise.study import optimise_study

__all__ = [
    "Problem",
    "Result",
    "Survey",
    "compile_descents",
    "explore",
    "front_study",
    "minimise",
    "on_locus",
    "optimise_study",
    "optimum",
    "pareto",
    "read_survey",
]

# Worker processes use one BLAS thread; more threads here would change the sums, and so the last bits of a search.
threadpool_limits(limits=1, user_api="blas")
