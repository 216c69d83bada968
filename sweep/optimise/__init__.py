"""The optimiser: smallest objective under limits, by quadratic programs on its epigraph form, exact gradients."""

from __future__ import annotations

from sweep.optimise.certificate import Result
from sweep.optimise.eliminate import on_locus
from sweep.optimise.front import front_study
from sweep.optimise.optimum import optimum
from sweep.optimise.pareto import pareto
from sweep.optimise.problem import Problem
from sweep.optimise.solve import explore, minimise
from sweep.optimise.study import optimise_study, read_survey
from sweep.optimise.survey import Survey

__all__ = [
    "Problem",
    "Result",
    "Survey",
    "explore",
    "front_study",
    "minimise",
    "on_locus",
    "optimise_study",
    "optimum",
    "pareto",
    "read_survey",
]
