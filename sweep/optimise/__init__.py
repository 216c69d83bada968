"""The optimiser: minimises an objective under limits by quadratic programs in epigraph form, with exact gradients."""

from __future__ import annotations

import scipy.linalg  # noqa: F401 (its BLAS is limited below only once it is loaded)
from threadpoolctl import threadpool_limits

from sweep.optimise.front.pareto import pareto as pareto
from sweep.optimise.front.study import front_study as front_study
from sweep.optimise.local.kkt import Result as Result
from sweep.optimise.multistart.multistart import explore as explore
from sweep.optimise.multistart.multistart import minimise as minimise
from sweep.optimise.multistart.multistart import optimum as optimum
from sweep.optimise.multistart.survey import Survey as Survey
from sweep.optimise.multistart.survey import read_survey as read_survey
from sweep.optimise.problem.on_locus import on_locus as on_locus
from sweep.optimise.problem.statement import Problem as Problem
from sweep.optimise.starts.posing import compile_descents as compile_descents
from sweep.optimise.study import optimise_study as optimise_study

# Worker processes use one BLAS thread; more threads here would change the sums, and so the last bits of a search.
threadpool_limits(limits=1, user_api="blas")
