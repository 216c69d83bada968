"""``summarise``: design outputs of given designs, one row per design; docs/extrema.md."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.effects import inputs_beside
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, in_radians, plain_names
from sweep.evaluation.loads import Loads
from sweep.evaluation.poses import query_of
from sweep.evaluation.route import Route
from sweep.evaluation.routes import design_outputs, routes, with_errors
from sweep.evaluation.statuses import meanings
from sweep.evaluation.tables import Table, design_matrix, frame_of, index_of, kept_columns, plain_columns
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import DEFAULT_TARGET, Accuracy, Domain, March
from sweep.families.names import error_of
from sweep.quantities.resolve import output, output_names
from sweep.reductions.steps import check_certifiable, proofs

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Route", "design_outputs", "output", "output_names", "routes", "summarise"]

DEFAULT_SAMPLES = 720  # for a march, whose accuracy cannot be chosen
FINEST_TARGET = 1e-14
MOST_SAMPLES = 2**20
FEWEST_SAMPLES = 8


def summarise(
    family: Mechanism,
    table: Table,
    want: str | Sequence[str],
    *,
    samples: int | None = None,
    accuracy: float | None = None,
    certify: bool | Sequence[str] = False,
    window: tuple[float, float] | None = None,
    keep: bool | str | Sequence[str] = False,
    status_text: bool = False,
    angles: AngleUnit | None = None,
    loads: Loads | None = None,
) -> pd.DataFrame:
    """Return design outputs of mechanisms, one row per design, in the order of the input.

    Parameters
    ----------
    family : "rssr", "guide", ..., a list of them for a chain, or a table of members by name for a machine
    table : DataFrame or mapping with a column per parameter [one length unit, rad], and per input of the effects that
        ``want`` needs; missing ``branch`` means +1.  Texts such as "20 g", quantities of pint and columns headed like
        ``m_crank [g]`` are converted to mm, t, s, N; bare numbers beside them are taken in these units
    want : names of design outputs: ``rotatable``, ``margin``, ``stroke``, ``max_abs_d2s`` ... (see ``sweep families``),
        ``max_force_d``, ``rms_drive_torque``, ``unevenness`` ... (see ``sweep effects``); a list, or one text between
        commas; the name of an effect, as ``friction``, stands for its outputs
    samples : number of crank angles of a dense grid, on which extrema are taken
    accuracy : true extrema, refined to this relative error; 1e-8 if neither is given.  A family whose poses depend on
        earlier ones (a march) has no true extrema: 720 samples if neither is given
    certify : prove that no peak of the wanted maxima, or of the named ones, was missed (docs/extrema.md, section 5);
        their ``err_`` are then bounds instead of estimates
    window : ``max_abs_dev`` and the other extrema of ``dev`` use only poses whose position lies between these
        fractions of the stroke, measured from its smallest position; by default, and for ``rms_dev``, the whole turn
    keep : columns of the table to be repeated at the front of the result: names, or True for all
    status_text : add a column ``status_text``, the meaning of ``status`` in words
    angles : unit of angles in ``table``, "rad" or "deg"; a header such as ``alpha [deg]`` gives that of one column.
        By default it is rad, and a parameter above 2 pi raises.  Results are in rad
    loads : loads over the turn, by the input to which each is added (``load_torque``, ``tool_force2``): a pair (crank
        angles [rad], values), joined by periodic monotone cubics, or ``{"mean": m, "cos": [...], "sin": [...]}``

    Returns
    -------
    DataFrame
        the wanted columns in order, with ``accuracy`` an ``err_<name>`` for each (estimate of its absolute error, same
        unit), and ``status``; indexed like the table.  Where a value is nan, ``status`` says why (see
        :mod:`kernels.status`); a maximum that ``certify`` could not prove keeps the searched value, with NOT_CONVERGED
        and nan as its error.  ``attrs["units"]`` names the unit of each output; "length" is that of the table.

    Raises
    ------
    InputError
        for an unknown name or a bad value, with column and row; for ``certify`` with a maximum that cannot be proven;
        for angles that look like degrees.

    Examples
    --------
    >>> import sweep
    >>> crank_rocker = {"a": [10.0, 12.0], "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0}
    >>> crank_rocker |= {"alpha [deg]": 60.0}
    >>> found = sweep.summarise("rssr", crank_rocker, "margin, max_abs_d2psi")
    >>> found[["margin", "max_abs_d2psi", "status"]].round(4)
       margin  max_abs_d2psi  status
    0  0.3793         0.6276       0
    1  0.3026         0.8978       0
    >>> found.attrs["units"]["margin"]
    '1'
    """
    bare = find_family(family)
    mechanism, wanted, units = query_of(bare, want, loads, "design")
    chosen = chosen_accuracy(mechanism.domain, samples, accuracy, certify)
    if certify:
        check_certifiable(mechanism, wanted, chosen, window is not None)
    given = table
    table = plain_columns(table)
    others = inputs_beside(bare, plain_names(table))
    table = in_radians(mechanism, table, angles, others)
    matrix, _ = design_matrix(mechanism, table, unused=others)
    columns = design_outputs(mechanism, matrix, wanted, chosen, window)
    computed: dict[str, Any] = {name: columns[name] for name in (*with_errors(wanted, chosen), "status")}
    if status_text:
        computed["status_text"] = np.array(meanings(columns["status"]), dtype=object)
    repeated = kept_columns(given, keep, computed, len(matrix))
    index = index_of(given, len(matrix))
    result = frame_of(repeated | computed, index, copy=bool(repeated))  # the arrays made here are not shared
    errors = {error_of(name): unit for name, unit in units.items() if error_of(name) in computed}
    result.attrs["units"] = {**units, **errors}
    return result


def chosen_accuracy(
    domain: Domain, samples: int | None, accuracy: float | None, certify: bool | Sequence[str] = False
) -> Accuracy:
    if isinstance(domain, March) and samples is None and accuracy is None:
        samples = DEFAULT_SAMPLES
    if samples is not None and accuracy is not None:
        raise InputError("samples", samples, "either samples= or accuracy=, not both", "summarise")
    if not isinstance(certify, (bool, str)) and not (
        isinstance(certify, Sequence) and all(isinstance(name, str) for name in certify)
    ):
        raise InputError("certify", certify, "True, False, or names of maxima", "summarise")
    if samples is not None and certify:
        raise InputError("certify", certify, "accuracy=, not samples=: a grid proves nothing", "summarise")
    if samples is not None:
        if not (isinstance(samples, Real) and FEWEST_SAMPLES <= samples <= MOST_SAMPLES and int(samples) == samples):
            raise InputError("samples", samples, f"a whole number from {FEWEST_SAMPLES} to {MOST_SAMPLES}", "summarise")
        return Accuracy(samples=int(samples))
    target = DEFAULT_TARGET if accuracy is None else accuracy
    if not (isinstance(target, Real) and FINEST_TARGET <= target <= 0.1):
        raise InputError("accuracy", accuracy, f"a relative error from {FINEST_TARGET:g} to 0.1", "summarise")
    prove, proven = proofs(certify)
    return Accuracy(target=float(target), certify=prove, proven=proven)
