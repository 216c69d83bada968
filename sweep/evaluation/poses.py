"""``evaluate``: pose outputs of given designs, one row per pose."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kernels.types import TWO_PI
from sweep.effects import elsewhere, extended, inputs_beside, offered
from sweep.effects.wanted import expanded
from sweep.errors import InputError, MissingInput, nearest
from sweep.evaluation.angles import AngleUnit, grid_in_radians, in_radians, plain_names
from sweep.evaluation.loads import Loads, curves_of
from sweep.evaluation.statuses import explained, meanings
from sweep.evaluation.tables import Table, design_matrix, frame_of, kept_columns, numbers, plain_columns, wanted_names
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Angles, Domain, Family, March
from sweep.quantities.resolve import output, output_names

if TYPE_CHECKING:
    import pandas as pd


def evaluate(
    family: Mechanism,
    table: Table,
    want: str | Sequence[str],
    phi: ArrayLike | None = None,
    *,
    keep: bool | str | Sequence[str] = False,
    status_text: bool = False,
    angles: AngleUnit | None = None,
    loads: Loads | None = None,
) -> pd.DataFrame:
    """Return pose outputs of mechanisms at given crank angles, one row per pose, in the order of the input.

    Parameters
    ----------
    family : "rssr", "guide", ..., a list of them for a chain, or a table of members by name for a machine
    table : DataFrame or mapping with a column per parameter [one length unit, rad]; missing ``branch`` means +1; units
        as of :func:`sweep.summarise`
    want : names of pose outputs (see ``sweep families``), in a list or in one text between commas; the name of an
        effect stands for all its pose outputs
    phi : crank angles [rad], one or a plain list of them, for every design; without it the table must have a column
        ``phi``, and with it none.  A family over an interval takes values of its own variable here, or in a column of
        that name; a family whose poses depend on earlier ones (a march) takes equal steps of one turn from 0, in order
    keep : columns of the table to be repeated at the front of the result: names, or True for all
    status_text : add a column ``status_text``, the meaning of ``status`` in words
    angles : unit of angles in ``table`` and ``phi``, "rad" or "deg"; a header such as ``alpha [deg]`` gives that of one
        column.  By default it is rad, and values that look like degrees raise: a parameter above 2 pi, crank angles
        whose largest is a whole or half number between 4 pi and 720.  Results are in rad
    loads : loads over the turn, as for `summarise`

    Returns
    -------
    DataFrame
        the wanted columns and ``status``; with ``phi=`` preceded by ``design`` (row of the table, from 0) and ``phi``.
        Each row has the index label of its design.  Where a value is nan, ``status`` says why (see
        :mod:`kernels.status`).  ``attrs["units"]`` names the unit of each output; "length" is that of the table.

    Raises
    ------
    InputError
        for an unknown name or a bad value, with column and row; for angles that look like degrees.

    Examples
    --------
    >>> import sweep
    >>> crank_rocker = {"a": [10.0, 12.0], "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0}
    >>> crank_rocker |= {"alpha [deg]": 60.0}
    >>> sweep.evaluate("rssr", crank_rocker, "psi, dpsi", phi=[0.0, 90.0], angles="deg").round(4)
       design     phi     psi    dpsi  status
    0       0  0.0000 -1.5027 -0.1602       0
    1       0  1.5708 -2.0241 -0.2706       0
    2       1  0.0000 -1.4108 -0.2124       0
    3       1  1.5708 -2.0680 -0.3104       0
    """
    import pandas as pd

    bare = find_family(family).precise()
    mechanism, wanted, units = query_of(bare, want, loads, "pose")
    given = table
    table = plain_columns(table)
    others = inputs_beside(bare, plain_names(table))
    table = in_radians(mechanism, table, angles, others, mechanism.domain)
    phi = None if phi is None else grid_in_radians(mechanism.domain, phi, angles)
    variable = mechanism.domain.name
    extra = () if phi is not None else (variable,)
    matrix, extras = design_matrix(mechanism, table, extra, unused=others)
    index = given.index if isinstance(given, pd.DataFrame) else None
    if phi is None:
        _check_column(mechanism, extras)
        at, head, repeats = extras[variable][:, None], {}, 1
    else:
        if variable in map(str, table):
            allowed = f"either phi= for every design, or a column {variable}, not both"
            raise InputError(variable, "a column", allowed, f"table of {mechanism.name}")
        grid = values_of_the_variable(mechanism.domain, phi)
        at, repeats = grid[None, :], grid.size
        head = {"design": np.repeat(np.arange(len(matrix)), repeats), variable: np.tile(grid, len(matrix))}
        index = None if index is None else index.repeat(repeats)
    with np.errstate(all="ignore"):  # values beyond float64 get a status below
        columns = explained(mechanism.poses(matrix, Angles.of(at), frozenset(wanted)), wanted)
    made = head | {name: columns[name].ravel() for name in [*wanted, "status"]}
    if status_text:
        made["status_text"] = np.array(meanings(made["status"]), dtype=object)
    result = frame_of(made, index, copy=False)  # the arrays are not shared
    if kept := kept_columns(given, keep, made, len(matrix)):
        inputs = pd.DataFrame(kept).loc[np.repeat(np.arange(len(matrix)), repeats)].set_axis(result.index)
        result = pd.concat([inputs, result], axis=1)
    result.attrs["units"] = {variable: mechanism.domain.unit, **units}
    return result


class Query(NamedTuple):
    """A query to a mechanism: its family with the effects that it needs, the names in order, their units."""

    family: Family
    wanted: tuple[str, ...]
    units: Mapping[str, str]


def query_of(family: Family, want: str | Sequence[str], loads: Loads | None, kind: Literal["pose", "design"]) -> Query:
    """Make the query for pose outputs of a family with precise poses, or for design outputs of a family."""
    given = wanted_names(want, f"{kind} outputs of {family.name}")
    # Requests without loads are looked at once.
    cache: dict[tuple[str, ...], Query] = family.derived.setdefault(query_of, {})
    if (key := (kind, *given)) in cache and not loads:
        return cache[key]
    names = expanded(family, given, poses=kind == "pose")
    mechanism = extended(family, names, curves_of(family, loads))
    if kind == "pose":
        units = {name: mechanism.pose_output[name].unit for name in pose_wants(mechanism, names)}
    else:
        units = {name: output(mechanism, name).unit for name in names if name != "status"}
    query = Query(mechanism, tuple(units), units)
    if not loads:
        cache[key] = query
    return query


def values_of_the_variable(domain: Domain, phi: ArrayLike) -> NDArray[np.float64]:
    """Return the argument ``phi=`` as a 1-D array of finite values, those of a march equal steps of one turn from 0."""
    grid = numbers(phi, "phi", "phi, position")
    if grid.ndim > 1:
        raise InputError("phi", f"shape {grid.shape}", "one angle, or a plain list of angles for every design", "phi")
    grid = np.atleast_1d(grid)
    if not np.isfinite(grid).all():
        position = int(np.argmin(np.isfinite(grid)))
        raise InputError("phi", float(grid[position]), "a finite number", f"phi, position {position}")
    if isinstance(domain, March):
        _check_steps(grid)
    return grid


def _check_steps(grid: NDArray[np.float64]) -> None:
    """Raise if crank angles are not equal steps of one turn from 0, in order."""
    if not grid.size:
        raise InputError("phi", "no angle", "equal steps of one turn from 0: a pose depends on those before it", "phi")
    steps = np.arange(grid.size) * (TWO_PI / grid.size)
    off = np.abs(grid - steps) > 1e-12 * TWO_PI
    if off.any():
        k = int(np.argmax(off))
        allowed = f"equal steps of one turn from 0, here {steps[k]:.6g}: a pose depends on those before it"
        raise InputError("phi", float(grid[k]), allowed, f"phi, position {k}")


def _check_column(mechanism: Family, extras: Container[str]) -> None:
    """Raise for a table without a column of the variable, and for any table of a march."""
    if isinstance(mechanism.domain, March):
        allowed = "the argument phi=, equal steps of one turn from 0: a pose depends on those before it"
        raise InputError("phi", "a column", allowed, f"table of {mechanism.name}")
    variable = mechanism.domain.name
    if variable not in extras:
        allowed = f"a column {variable}, or the argument phi="
        raise MissingInput(variable, allowed, f"table of {mechanism.name}")


def pose_wants(mechanism: Family, want: str | Sequence[str]) -> list[str]:
    """Return the wanted names without repetition; raise for an unknown one, with the nearest name."""
    wanted = wanted_names(want, f"pose outputs of {mechanism.name}")
    for name in wanted:
        if name not in mechanism.pose_names and name != "status":
            allowed = ", ".join(mechanism.pose_names)
            guess = nearest(name, [*mechanism.pose_names, *(o.name for o in offered(mechanism))])
            guess = elsewhere(mechanism, name) or guess
            if name in output_names(mechanism):
                guess = f"; {name} is an output of a whole turn: ask `summarise`"
            if name in (*mechanism.parameter_names, mechanism.domain.name):
                guess = f"; {name} is a column of the table, keep= repeats it in the result"
            raise InputError("want", name, f"{allowed}{guess}", f"pose outputs of {mechanism.name}")
    return [name for name in wanted if name != "status"]
