"""Five-links in place of crank-rockers: the same limit positions, with two revolutes at the crank pin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from kernels.families import five_link, rssr
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix, parameter_units
from sweep.families import family
from sweep.families.base import Accuracy

if TYPE_CHECKING:
    import pandas as pd

    from sweep.evaluation.tables import Table


def five_links_with_limits(table: Table, h: float) -> pd.DataFrame:
    """Return five-links whose rocker stands still where that of a crank-rocker does; (10) of docs/five_link.md.

    The limit positions, so swing, phi0 and stroke ratio, are those of the crank-rocker; crank and coupler change with
    h, all other links stay.

    Parameters
    ----------
    table : crank-rockers, a b c e f g alpha branch, one row each; synthesis gives such tables
    h : common perpendicular of the two revolutes, in the table's unit of length

    Returns
    -------
    pandas.DataFrame
        the columns of ``five_link`` and ``status``: OK, NOT_ADMISSIBLE where no five-link has these limits,
        NOT_ROTATABLE or UNDECIDABLE where its crank does not turn fully; otherwise why the crank-rocker has no limits.
        Links that were not found are nan.

    Raises
    ------
    InputError
        for a table that is no table of crank-rockers.
    """
    import pandas as pd

    designs, _ = design_matrix(family("rssr"), table)
    n = len(designs)
    state, limits = np.empty(n, np.uint8), np.empty((n, len(rssr.LIMIT_NAMES)))
    rssr.limits(designs, state, limits, None)
    ext, fold = (np.ascontiguousarray(limits[:, rssr.LIMIT_NAMES.index(name)]) for name in ("psi_ext", "psi_fold"))
    found, a, b = np.empty(n, np.uint8), np.empty(n), np.empty(n)
    five_link.with_limits_of(designs, ext, fold, np.full(n, float(h)), found, a, b)
    status = np.where(state == st.OK, found, state)
    matrix = np.column_stack(
        [a, b, designs[:, 2:7], np.full(n, float(h)), np.zeros(n), designs[:, 7], np.ones(n)]
    )  # fmt: skip
    there = np.flatnonzero(status == st.OK)
    turning = design_outputs(family("five_link"), matrix[there], ["margin"], Accuracy(target=1e-9))
    status[there] = turning["status"]
    frame = pd.DataFrame(matrix, columns=list(family("five_link").parameter_names))
    frame["status"] = status
    frame.attrs["units"] = parameter_units(family("five_link").parameters)
    return frame
