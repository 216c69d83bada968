"""``evaluate``: the motion of given designs, one row per pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sweep.effects import elsewhere, extended, input_names, offered
from sweep.errors import InputError, nearest
from sweep.evaluation.tables import design_matrix, numbers, wanted_names
from sweep.families import family as find_family
from sweep.families.base import Angles, Family
from sweep.reductions.catalogue import output_names

if TYPE_CHECKING:
    import pandas as pd

    from sweep.evaluation.tables import Table


def evaluate(
    family: str | Sequence[str], table: Table, want: str | Sequence[str], phi: ArrayLike | None = None
) -> pd.DataFrame:
    """Pose outputs of mechanisms at given crank angles, one row per pose, in the order of the input.

    Parameters
    ----------
    family : "rssr", "guide", ... or a list of them for a chain
    table : DataFrame or mapping with a column per parameter [one length unit, rad]; missing ``branch`` means +1
    want : names of pose outputs (see ``sweep families``)
    phi : crank angles [rad]; without it the table must have a column ``phi``

    Returns
    -------
    DataFrame
        the wanted columns and ``status``; with ``phi=`` preceded by ``design`` (row of the table) and ``phi``,
        otherwise indexed like the table.  Where a value is nan, ``status`` says why (see :mod:`kernels.status`).

    Raises
    ------
    InputError
        for an unknown name or a bad value, with column and row.
    """
    import pandas as pd

    bare = find_family(family).precise()
    mechanism = extended(bare, wanted_names(want, f"pose outputs of {bare.name}"))
    wanted = pose_wants(mechanism, want)
    extra = () if phi is not None else ("phi",)
    matrix, extras = design_matrix(mechanism, table, extra, unused=input_names(bare))
    if phi is None:
        if "phi" not in extras:
            raise InputError("phi", None, "a column phi, or the argument phi=", f"table of {mechanism.name}")
        columns = mechanism.poses(matrix, Angles.of(np.ascontiguousarray(extras["phi"])[:, None]), frozenset(wanted))
        index = table.index if isinstance(table, pd.DataFrame) else None
        return pd.DataFrame({name: columns[name].ravel() for name in [*wanted, "status"]}, index=index)

    grid = np.atleast_1d(numbers(phi, "phi", "phi, position")).ravel()
    if not np.isfinite(grid).all():
        position = int(np.argmin(np.isfinite(grid)))
        raise InputError("phi", float(grid[position]), "a finite number", f"phi, position {position}")
    columns = mechanism.poses(matrix, Angles.of(grid[None, :]), frozenset(wanted))
    head = {"design": np.repeat(np.arange(len(matrix)), grid.size), "phi": np.tile(grid, len(matrix))}
    return pd.DataFrame(head | {name: columns[name].ravel() for name in [*wanted, "status"]})


def pose_wants(mechanism: Family, want: str | Sequence[str]) -> list[str]:
    """The wanted names without repetition; an unknown one is an error that names the nearest."""
    wanted = wanted_names(want, f"pose outputs of {mechanism.name}")
    for name in wanted:
        if name not in mechanism.pose_names and name != "status":
            known = ", ".join(mechanism.pose_names)
            guess = nearest(name, [*mechanism.pose_names, *(o.name for o in offered(mechanism))])
            guess = elsewhere(mechanism, name) or guess
            if name in output_names(mechanism):
                guess = f"; {name} is one of a whole turn, ask `summarise`"
            raise InputError("want", name, f"{known}{guess}", f"pose outputs of {mechanism.name}")
    return [name for name in wanted if name != "status"]
