"""The route to the negative of a design output: what is made small where the output is to be large."""

from __future__ import annotations

from functools import partial

import numpy as np

from sweep.evaluation.route import Part, Route
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.quantities.names import by_magnitude, error_of, without_minus


def negative_route(family: Family, name: str, accuracy: Accuracy) -> Route:
    """Return the route to the negative of the output that ``name`` is about."""
    from sweep.evaluation.routes import routes

    of = without_minus(name)
    cost = sum(route.ns_per_design for route in routes(family, [of], accuracy))
    return Route(f"negative of {of}", (name,), cost, partial(_negative, family, name))


def _negative(family: Family, name: str, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    from sweep.evaluation.summaries import design_outputs

    of = without_minus(name)
    found = design_outputs(family, designs, [of], accuracy, window)
    values = np.asarray(found[of], np.float64)
    columns: Columns = {name: -np.abs(values) if by_magnitude(of) else -values, "status": found["status"]}
    if accuracy.target is not None:
        columns[error_of(name)] = found[error_of(of)]
    return columns
