"""The forms of a requirement, and the link lengths that meet it: one `Locus` per form; docs/synthesis.md.

The admissible arcs are the crank angles phi1 for which a locus has a point that satisfies the side condition.

A study with [locus] prescribes design outputs of stage 1, or of the only stage: swing (rssr) or stroke (rssp), phi0 and
phi_ext, the place on the locus.  Links and branch that meet them exactly follow (`OnLocus`), so every design of the
sweep satisfies these limits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels import synthesis as kernels
from kernels.synthesis import acceptance
from kernels.types import TWO_PI, Status
from sweep.errors import InputError, nearest
from sweep.evaluation.tables import Table, design_matrix, refuse_rows
from sweep.families import family as find_family
from sweep.families.base import Array, Columns, Parameter
from sweep.numerics.records import Mask

ARC_ENDS = 8

Range: TypeAlias = tuple[str, Callable[[Array], Mask]]  # allowed values in words, and where they hold
RANGES: Mapping[str, Range] = {
    "swing": ("an angle below one turn, or its negative", lambda x: (x != 0.0) & (np.abs(x) < TWO_PI)),
    "stroke": ("a length, positive or negative, not zero", lambda x: x != 0.0),
    "phi0": ("an angle between 0 and 360 deg", lambda x: (x > 0.0) & (x < TWO_PI)),
}
UPWARDS: Range = ("a positive length (a mirrored mechanism whose crank turns back does the rest)", lambda x: x > 0.0)
PRESCRIBED = {**RANGES, "stroke": UPWARDS}  # in a study
ANY_PLACE: Range = ("an angle from 0 to 360 deg", lambda x: (x >= 0.0) & (x <= TWO_PI))


class LocusSolutions(NamedTuple):
    """Mechanisms of a requirement: the design matrix, and per row its status and the failed acceptance test, (n,) each.

    ``phi1`` (not reduced to one turn) and ``start`` are the crank angle and the follower's position at the extended
    limit, ``phi0`` the crank angle from there to the folded one.
    """

    designs: Array
    status: Status
    failed: Status
    phi1: Array
    start: Array
    phi0: Array


@dataclass(frozen=True)
class Locus:
    """One form of a requirement on the motion of a follower.

    ``chosen_by`` is the column that distinguishes this form from the others of its family; ``kernel`` computes designs
    and the fields of `LocusSolutions` in ``gives``.  ``arc_ends`` computes the possible ends of arcs of phi1, at most
    ARC_ENDS, nan for missing ones; None if unknown.
    """

    family: str
    parameters: tuple[Parameter, ...]
    chosen_by: str
    kernel: Callable[..., None]
    gives: tuple[str, ...]
    arc_ends: Callable[[Array, Array], None] | None = None

    @property
    def name(self) -> str:
        """Name of the table in messages."""
        return f"requirement of {self.family}"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Columns of the requirement in order."""
        return tuple(p.name for p in self.parameters)

    @property
    def has_roots(self) -> bool:
        """Whether a requirement has two solutions, which ``root`` distinguishes."""
        return "root" in self.parameter_names

    def read(self, table: Table) -> Array:
        """Return the checked requirement matrix.

        Raises
        ------
        InputError
            for a missing or misspelt column, a bad number, a swing or stroke of zero, angles outside one turn.
        """
        matrix, _ = design_matrix(self, table)
        for name, values in zip(self.parameter_names, matrix.T, strict=True):
            if name in RANGES:
                allowed, holds = RANGES[name]
                refuse_rows(~holds(values), values, name, allowed)
        return matrix

    def solve(self, matrix: Array) -> LocusSolutions:
        """Compute the mechanisms of (n, P) requirements; with phi1 these may be complex128, for exact gradients."""
        n, names = len(matrix), ({"psi1": "start", "s1": "start"}.get(name, name) for name in self.parameter_names)
        columns = dict(zip(names, matrix.T, strict=True))
        status, failed = np.empty(n, np.uint8), np.empty(n, np.uint8)
        designs = np.empty((n, len(find_family(self.family).parameters)), matrix.dtype)
        results = {name: np.empty(n, matrix.dtype) for name in self.gives}
        roots = [np.ascontiguousarray(columns["root"])] if self.has_roots else []
        self.kernel(matrix, *roots, status, failed, designs, *results.values())
        columns |= results
        return LocusSolutions(designs, status, failed, columns["phi1"], columns["start"], columns["phi0"])


_SWING = Parameter("swing", "angle", "rocker angle from the extended to the folded position, with its sign")
_STROKE = Parameter("stroke", "length", "slider path from the extended to the folded position, with its sign")
_PHI0 = Parameter("phi0", "angle", "crank angle from the extended to the folded position")
_PHI1 = Parameter("phi1", "angle", "crank angle of the extended position: the place on the locus")
_PSI1 = Parameter("psi1", "angle", "rocker angle of the extended position")
_S1 = Parameter("s1", "length", "slider at the extended position")
_E = Parameter("e", "length", "common perpendicular of the two axes")
_F = Parameter("f", "length", "offset of the crank plane along the crank axis")
_G = Parameter("g", "length", "offset of the rocker plane along the rocker axis")
_ALPHA = Parameter("alpha", "angle", "angle between the axes")
_C = Parameter("c", "length", "rocker", positive=True)
_DIRECTION = Parameter("direction", "angle", "atan2(g, e): how the offsets of the two axes are to each other")
_ROOT = Parameter("root", "sign", "which of the two solutions", choices=(-1.0, 1.0), default=1.0)

LOCI = (
    Locus("rssr", (_SWING, _PHI0, _PHI1, _E, _F, _G, _ALPHA), "phi1", kernels.rssr_on_locus, ("start",),
          kernels.rssr_arc_ends),
    Locus("rssr", (_SWING, _PHI0, _PSI1, _E, _F, _G, _ALPHA, _ROOT), "psi1", kernels.rssr_at_direction, ("phi1",)),
    Locus("rssr", (_SWING, _PHI0, _PHI1, _C, _F, _DIRECTION, _ALPHA), "direction", kernels.rssr_of_size, ("start",)),
    Locus("rssp", (_STROKE, _PHI0, _PHI1, _F, _ALPHA), "phi1", kernels.rssp_on_locus, ("start",),
          kernels.rssp_arc_ends),
    Locus("rssp", (_STROKE, _S1, _E, _F, _ALPHA), "s1", kernels.rssp_at_place, ("phi0", "phi1")),
    Locus("rssp", (_STROKE, _PHI0, _E, _F, _ALPHA, _ROOT), "e", kernels.rssp_at_offset, ("start", "phi1")),
)  # fmt: skip


FAMILIES = tuple(dict.fromkeys(form.family for form in LOCI))


def unknown_family(family: object, known: tuple[str, ...]) -> InputError:
    """Make the error about a family that a synthesis does not know."""
    return InputError("family", family, f"{' or '.join(known)}{nearest(str(family), known)}", "synthesis")


def locus(family: str, names: tuple[str, ...]) -> Locus:
    """Return the form of a requirement that its column names select.

    Raises
    ------
    InputError
        if the family has no locus or the columns select no form.
    """
    of_family = [form for form in LOCI if form.family == family]
    if not of_family:
        raise unknown_family(family, FAMILIES)
    selected = [form for form in of_family if form.chosen_by in names]
    # A column shared with another selected form selects nothing.
    selected = [x for x in selected if not any(x.chosen_by in y.parameter_names for y in selected if y != x)]
    if not selected or len({form.chosen_by for form in selected} - {"e"}) > 1:
        forms = "; or ".join(", ".join(form.parameter_names) for form in of_family)
        raise InputError("columns", ", ".join(names), forms, "requirement")
    return selected[0]


def locus_designs(family: str, columns: Table) -> tuple[Columns, Status]:
    """Return parameters of mechanisms that meet requirements, as design columns for studies and optimisers.

    Parameters
    ----------
    family : "rssr" or "rssp"
    columns : the requirement, one array or number per column [one length unit, rad]; see `LOCI`

    Returns
    -------
    columns : one (n,) array per parameter of the family, ``branch`` among them
    status : (n,) OK; NOT_ADMISSIBLE (lengths nan) if one of the acceptance tests (i)-(iii) fails.  Whether the crank
        turns and its margin are left to the family's own limits.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, a swing or stroke of zero, angles outside one turn.

    Notes
    -----
    Measured: 0.13 us per candidate for ``rssr`` on its locus.
    """
    form = locus(family, tuple(str(name) for name in columns))
    solved = form.solve(form.read(columns))
    names = find_family(family).parameter_names
    return dict(zip(names, solved.designs.T, strict=True)), solved.status


def admissible_arcs(family: str, requirement: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return the arcs of phi1 on which test (i), the side condition, holds; (4) and (10) of docs/synthesis.md.

    Parameters
    ----------
    family : "rssr" or "rssp"
    requirement : the columns of the locus with phi1, except phi1 itself; one number each [one length unit, rad]

    Returns
    -------
    list of (from, to)
        open intervals in ascending order, 0 <= from < 2 pi, from < to <= from + 2 pi; empty if there are none

    Raises
    ------
    InputError
        for a missing or misspelt column or a bad number, or a requirement by direction, whose arcs are not known.
    """
    if "phi1" in requirement:
        raise InputError("phi1", requirement["phi1"], "no phi1: its arcs are what is asked for", "requirement")
    form = locus(family, (*requirement, "phi1"))
    row = form.read({**requirement, "phi1": 0.0})
    if form.arc_ends is None:
        known = [other for other in LOCI if other.family == form.family and other.arc_ends is not None]
        allowed = "; or ".join(", ".join(n for n in other.parameter_names if n != "phi1") for other in known)
        raise InputError("columns", ", ".join(requirement), allowed, "requirement")
    ends = np.full((1, ARC_ENDS), np.nan)
    form.arc_ends(row, ends)
    boundaries = np.unique(ends[np.isfinite(ends)])
    following = np.append(boundaries[1:], boundaries[0] + TWO_PI)
    # One place each; the middle of an arc of a symmetric locus may be on the rocker axis.
    places = np.repeat(row, boundaries.size, axis=0)
    places[:, form.parameter_names.index("phi1")] = 0.6 * boundaries + 0.4 * following
    failed = form.solve(places).failed
    inside = (failed != acceptance.SIDE) & (failed != acceptance.NO_POINT)
    arcs: list[tuple[float, float]] = []
    for start, end, good in zip(boundaries.tolist(), following.tolist(), inside.tolist(), strict=True):
        if good and arcs and arcs[-1][1] == start:
            arcs[-1] = (arcs[-1][0], end)
        elif good:
            arcs.append((start, end))
    if len(arcs) > 1 and arcs[-1][1] == arcs[0][0] + TWO_PI:
        arcs[-1] = (arcs[-1][0], arcs[0][1] + TWO_PI)
        arcs.pop(0)
    return arcs


# The crank angle of the extended position is phi1 in the synthesis and phi_ext as a design output.
_PLACE = ("phi1", "phi_ext")


@dataclass(frozen=True)
class OnLocus:
    """The stage whose links follow from its limit positions: its family, and its number as text ("" without a chain).

    ``told_by`` is the column that selects the form of the requirement: phi1, or direction for a given rocker length.
    """

    family: str
    number: str
    told_by: str = _PLACE[0]

    @cached_property
    def way(self) -> Locus:
        """Form of the requirement that gives the place as a crank angle."""
        return locus(self.family, (self.told_by,))

    @cached_property
    def prescribed(self) -> tuple[Parameter, ...]:
        """Prescribed design outputs, as columns of a design space."""
        parameters = find_family(self.family).parameter_names
        outputs = [p for p in self.way.parameters if p.name not in parameters]
        return tuple(Parameter(self.outside(p.name), p.unit, p.text) for p in outputs)

    @cached_property
    def made(self) -> tuple[str, ...]:
        """Parameters that follow: a, b, c and branch, of a slider-crank also e."""
        inputs = self.way.parameter_names
        return tuple(f"{name}{self.number}" for name in find_family(self.family).parameter_names if name not in inputs)

    def allowed(self, name: str, values: Array) -> str | None:
        """Return the allowed range of a prescribed output if values [mm, rad] lie outside of it; otherwise None."""
        words, holds = PRESCRIBED.get(name.removesuffix(self.number), ANY_PLACE)
        return None if holds(values).all() else words

    def links(self, columns: Mapping[str, Array]) -> tuple[dict[str, Array], Status]:
        """Return the parameters in ``made``, (n,) each, and the status of each design.

        Parameters
        ----------
        columns : (n,) arrays by name, with the prescribed outputs and parameters that the locus needs [mm, rad]

        Returns
        -------
        columns : nan if the status is not OK
        status : OK, or NOT_ADMISSIBLE if the place on the locus gives no mechanism with the prescribed outputs
        """
        form = self.way
        solved = form.solve(form.read({name: columns[self.outside(name)] for name in form.parameter_names}))
        return self.links_of(solved), solved.status

    def links_of(self, solved: LocusSolutions) -> dict[str, Array]:
        """Return the parameters in ``made`` from mechanisms of this stage alone."""
        parameters = find_family(self.family).parameter_names
        return {name: solved.designs[:, parameters.index(name.removesuffix(self.number))] for name in self.made}

    def outside(self, name: str) -> str:
        """Return the name of a column of the requirement in a study."""
        return f"{_PLACE[1] if name == _PLACE[0] else name}{self.number}"
