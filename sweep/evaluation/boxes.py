"""The route to the box of a mechanism: from the largest and smallest coordinates of its joints."""

from __future__ import annotations

from functools import partial

import numpy as np

from sweep.evaluation.route import Part, Route
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.quantities.names import error_of
from sweep.reductions.box import ROUNDING, Box


def box_route(family: Family, box: Box, accuracy: Accuracy) -> Route:
    """Return the route to one box; it costs what the extrema do that it is made of."""
    from sweep.evaluation.routes import routes

    cost = sum(route.ns_per_design for route in routes(family, box.asked, accuracy))
    return Route(f"box {box.output.name}", (box.output.name,), cost, partial(_extent, family, box))


def _extent(family: Family, box: Box, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    from sweep.evaluation.summaries import design_outputs

    found = design_outputs(family, designs, box.asked, accuracy, None)
    still = [np.asarray(piece(designs), np.float64) for piece in box.still]
    ends = []
    errors: Array = np.zeros(len(designs))
    for which, take in ((0, np.maximum), (1, np.minimum)):
        names = [pair[which] for pair in box.reductions]
        values = [np.asarray(found[name], np.float64) for name in names]
        ends.append(take.reduce([*values, *still]))  # nan where a joint's extremum is: its status says why
        if accuracy.target is not None:
            errors = errors + np.maximum.reduce([np.asarray(found[error_of(name)], np.float64) for name in names])
    name = box.output.name
    columns: Columns = {name: ends[0] - ends[1], "status": found["status"]}
    if accuracy.target is not None:
        columns[error_of(name)] = errors + 4.0 * ROUNDING * np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    return columns
