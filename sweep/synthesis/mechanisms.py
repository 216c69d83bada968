"""``synthesise``: mechanisms for a table of requirements, each with the result of its acceptance tests.

Slotted links for a wanted crank angle between the limit positions follow from (8) of docs/slotted.md.  Five-links can
replace crank-rockers with the same limit positions, with two revolutes at the crank pin.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from kernels import status as st
from kernels.families import five_link, rssr
from kernels.families.slotted import crank_of_phi0
from kernels.synthesis import acceptance
from kernels.types import TWO_PI
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, in_radians, plain_names
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import Sheet, Table, design_matrix, index_of, parameter_units, refuse_rows
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Array, Parameter
from sweep.synthesis.locus import FAMILIES, Locus, LocusSolutions, locus, unknown_family

_LIMITS = ("phi_ext", "phi_fold", "psi_ext", "psi_fold", "swing", "phi0", "margin", "max_pressure_angle")
_EXACT = Accuracy(target=1e-12)
LIMITS_APART = 1e-7  # half of the allowed error of a limit position [rad]; both are accurate to 1e-9


CENTRAL_SLOT = Sheet(
    "slotted",
    (
        Parameter("phi0", "angle", "crank angle of the shorter stroke, below 180 deg"),
        Parameter("e", "length", "common perpendicular"),
        Parameter("f", "length", "offset of the crank plane", default=0.0),
        Parameter("alpha", "angle", "angle from the crank axis to the driven axis", default=0.0),
    ),
)


def central_slots(table: Table) -> pd.DataFrame:
    """Return fork slots with s = 0 for a wanted crank angle between the limit positions, one row per row of the table.

    Parameters
    ----------
    table : DataFrame or mapping with phi0 [rad], the crank angle of the shorter stroke, below pi; e; f and alpha (0)

    Returns
    -------
    DataFrame
        the parameters of ``slotted``; ``phi_ext phi_fold psi_ext psi_fold swing phi0`` of the mechanism found, where
        extended is the larger psi, so that ``phi0`` is the wanted angle or 2 pi minus it; ``margin`` (1),
        ``max_pressure_angle`` (0) and ``status``: OK, or NOT_ADMISSIBLE if both axes meet at the driven pivot or
        alpha is a right angle.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, a phi0 outside (0, pi).
    """
    matrix, _ = design_matrix(CENTRAL_SLOT, table)
    phi0, e, f, alpha = matrix.T.copy()
    refuse_rows(~((phi0 > 0.0) & (phi0 < np.pi)), phi0, "phi0", "an angle between 0 and pi")
    status, a = np.empty(len(matrix), np.uint8), np.empty(len(matrix))
    crank_of_phi0(phi0, e, f, alpha, status, a)
    slotted = find_family("slotted")
    given = {"a": a, "e": e, "f": f, "alpha": alpha}
    columns: dict[str, object] = {p.name: given.get(p.name, p.default or 0.0) for p in slotted.parameters}
    frame = pd.DataFrame(columns, index=index_of(table, len(matrix)))
    alive = np.flatnonzero(status == st.OK)
    turn = design_outputs(slotted, frame.to_numpy()[alive], list(_LIMITS), _EXACT)
    status[alive] = turn["status"]
    for name in _LIMITS:
        values = np.full(len(matrix), np.nan)
        values[alive] = turn[name]
        frame[name] = values
    frame["status"] = status
    limits = dict.fromkeys(_LIMITS, "rad") | {"margin": "1"}
    frame.attrs["units"] = parameter_units(slotted.parameters) | limits
    return frame


def synthesise(
    family: str, table: Table, *, max_pressure_angle: float | None = None, angles: AngleUnit | None = None
) -> pd.DataFrame:
    """Mechanisms that meet requirements, one row per solution, in the order of the table.

    Parameters
    ----------
    family : "rssr", "rssp" or "slotted"
    table : DataFrame or mapping, one length unit, rad.  ``rssr``: swing, phi0, e, f, g, alpha and either phi1 (the
        place on the locus: crank angle of the extended position) or psi1 (rocker angle there); or phi1, c and
        direction = atan2(g, e) instead of e and g.  ``rssp``: stroke, f, alpha and phi0 with either phi1 or e; or,
        without phi0, e and the place s1 where the stroke begins.  ``slotted``: phi0, e, f and alpha of a fork slot with
        s = 0 (:func:`sweep.synthesis.mechanisms.central_slots` says what it returns).
        Swing and stroke are signed, folded minus extended.  Where psi1 or e is given there are two solutions, told
        apart by ``root``; without such a column both are returned, one row each.
    max_pressure_angle : limit for test (v) [rad]; none if not given
    angles : the unit of the angles given, "rad" or "deg", as of :func:`sweep.evaluate`; results are in rad

    Returns
    -------
    DataFrame
        the parameters of the family; the limit positions ``phi_ext phi_fold`` [rad in 0 ... 2 pi), ``psi_ext psi_fold``
        or ``s_ext s_fold``; ``swing`` or ``stroke`` (signed) and ``phi0``; ``margin`` and ``max_pressure_angle``;
        ``failed``, the first acceptance test not passed ("" or point, side, crank, branch, rotation, pressure angle;
        what they mean: :data:`kernels.synthesis.acceptance.MEANING`), and ``status``: OK, NOT_ADMISSIBLE,
        NOT_ROTATABLE, UNDECIDABLE or LIMIT_EXCEEDED.  Lengths are nan where there is no mechanism, and kept where only
        test (iv) or (v) failed.  Indexed like the table; two solutions of a row share its index, and ``root`` is shown.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, a swing or stroke of zero, angles outside one turn.

    Examples
    --------
    >>> import sweep
    >>> task = {"swing": [0.785, 1.047], "phi0": 3.403, "phi1": 0.0, "e": 100.0, "f": 0.0, "g": 10.0, "alpha": 1.047}
    >>> sweep.synthesise("rssr", task)[["a", "b", "c", "branch", "failed", "status"]].round(2)
           a       b       c  branch failed  status
    0  12.59  246.56  159.28    -1.0              0
    1  18.51  173.10   92.09    -1.0              0
    """
    if max_pressure_angle is not None and angles == "deg":
        max_pressure_angle = np.radians(max_pressure_angle)
    if max_pressure_angle is not None and not 0.0 < max_pressure_angle <= 0.5 * np.pi:
        raise InputError("max_pressure_angle", max_pressure_angle, "an angle between 0 and pi/2", "synthesise")
    if family == CENTRAL_SLOT.name:  # its mechanisms lie on no locus
        return central_slots(in_radians(CENTRAL_SLOT, table, angles))
    if family not in FAMILIES:
        raise unknown_family(family, (*FAMILIES, CENTRAL_SLOT.name))
    form = locus(family, plain_names(table))
    table = in_radians(form, table, angles)
    matrix = form.read(table)
    index = index_of(table, len(matrix))
    if form.has_roots and "root" not in table:
        matrix = np.repeat(matrix, 2, axis=0)
        matrix[:, -1] = np.tile([1.0, -1.0], len(matrix) // 2)
        index = index.repeat(2)
    solved = form.solve(matrix)
    amplitude = matrix[:, 0]
    columns: dict[str, object] = dict(zip(find_family(family).parameter_names, solved.designs.T, strict=True))
    if form.has_roots:
        columns["root"] = matrix[:, -1]
    columns |= _limits(form, solved, amplitude)
    columns |= _verdict(family, solved, max_pressure_angle)
    frame = pd.DataFrame(columns, index=index)
    frame.attrs["units"] = _units(form)
    return frame


def _units(form: Locus) -> dict[str, str]:
    """Return the units of the columns that have one, by the letter of the output: an angle psi, a displacement s."""
    mechanism, amplitude = find_family(form.family), form.parameter_names[0]
    letter, unit = mechanism.position, mechanism.pose_output[mechanism.position].unit
    angles = dict.fromkeys(("phi_ext", "phi_fold", "phi0", "max_pressure_angle"), "rad")
    limits = dict.fromkeys((f"{letter}_ext", f"{letter}_fold", amplitude), unit)
    root = {"root": "1"} if form.has_roots else {}
    return parameter_units(mechanism.parameters) | root | limits | angles | {"margin": "1"}


def _limits(form: Locus, solved: LocusSolutions, amplitude: Array) -> dict[str, object]:
    letter, name = find_family(form.family).position, form.parameter_names[0]
    exists = solved.status == st.OK
    phi1, start = (np.where(exists, x, np.nan) for x in (solved.phi1, solved.start))
    return {
        "phi_ext": phi1 % TWO_PI,
        "phi_fold": (phi1 + solved.phi0) % TWO_PI,
        f"{letter}_ext": start,
        f"{letter}_fold": start + amplitude,
        name: amplitude,
        "phi0": solved.phi0,
    }


def _verdict(family: str, solved: LocusSolutions, limit: float | None) -> dict[str, object]:
    """Return tests (iv) and (v) of the mechanisms that passed the first three."""
    status, failed = solved.status.copy(), solved.failed.copy()
    alive = np.flatnonzero(status == st.OK)
    margin, angle = np.full(len(status), np.nan), np.full(len(status), np.nan)
    turn = design_outputs(find_family(family), solved.designs[alive], ["margin", "max_pressure_angle"], _EXACT)
    turning = turn["status"].astype(np.uint8)
    margin[alive], angle[alive], status[alive] = turn["margin"], turn["max_pressure_angle"], turning
    failed[alive[turning != st.OK]] = acceptance.ROTATION
    if limit is not None:
        steep = (status == st.OK) & (angle > limit)
        status[steep], failed[steep] = st.LIMIT_EXCEEDED, acceptance.PRESSURE
    words = pd.Categorical.from_codes(failed.astype(np.int8), pd.Index(acceptance.NAMES))
    return {"margin": margin, "max_pressure_angle": angle, "failed": words, "status": status}


def five_links_with_limits(table: Table, h: float) -> pd.DataFrame:
    """Return five-links with the same limit positions of the rocker as crank-rockers; (10) of docs/five_link.md.

    Swing, phi0 and stroke ratio are those of the crank-rocker; crank and coupler change with h, all other links stay.

    Parameters
    ----------
    table : crank-rockers, a b c e f g alpha branch, one row each; synthesis gives such tables
    h : common perpendicular of the two revolutes, in the table's unit of length

    Returns
    -------
    pandas.DataFrame
        the columns of ``five_link`` and ``status``: OK, NOT_ADMISSIBLE if no five-link has these limits, or has them on
        two assembly modes, NOT_ROTATABLE or UNDECIDABLE if its crank does not turn fully; otherwise the status of the
        crank-rocker.  Links of a missing five-link are nan.  Indexed like the table.

    Raises
    ------
    InputError
        for a table that is no table of crank-rockers.
    """
    designs, _ = design_matrix(find_family("rssr"), table)
    n = len(designs)
    rssr_status, limits = np.empty(n, np.uint8), np.empty((n, len(rssr.LIMIT_NAMES)))
    rssr.limits(designs, rssr_status, limits, None)
    ext, fold = (np.ascontiguousarray(limits[:, rssr.LIMIT_NAMES.index(name)]) for name in ("psi_ext", "psi_fold"))
    five_link_status, a, b = np.empty(n, np.uint8), np.empty(n), np.empty(n)
    five_link.with_limits_of(designs, ext, fold, np.full(n, float(h)), five_link_status, a, b)
    status = np.where(rssr_status == st.OK, five_link_status, rssr_status)
    matrix = np.column_stack(
        [a, b, designs[:, 2:7], np.full(n, float(h)), np.zeros(n), designs[:, 7], np.ones(n)]
    )  # fmt: skip
    alive = np.flatnonzero(status == st.OK)
    turning = design_outputs(find_family("five_link"), matrix[alive], ["psi_ext", "psi_fold"], Accuracy(target=1e-9))
    status[alive] = turning["status"]
    # the stroke may end elsewhere than at the two places found, if they belong to different assembly modes
    places: Array = np.column_stack([turning["psi_ext"], turning["psi_fold"]])
    offsets = places - np.column_stack([ext, fold])[alive]
    defect = alive[(np.abs(np.sin(0.5 * offsets)) > LIMITS_APART).any(axis=1)]
    status[defect], matrix[defect, :2] = st.NOT_ADMISSIBLE, np.nan
    frame = pd.DataFrame(matrix, index_of(table, n), list(find_family("five_link").parameter_names))
    frame["status"] = status
    frame.attrs["units"] = parameter_units(find_family("five_link").parameters)
    return frame
