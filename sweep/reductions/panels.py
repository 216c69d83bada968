"""True extrema of curves with kinks and jumps: panels of a turn, halved wherever the curve may have its maximum.

Friction changes its direction where a joint stops turning.  There loads jump or have a kink, and between two such
places a curve may rise and fall within a hundredth of a radian.  So the turn is cut where the followers reverse, which
are roots of known functions, and into even panels between.  On each panel a polynomial interpolates the poses; a panel
whose polynomial plus its error bound stays below the highest pose is discarded.  The others are halved until the poses
of both halves agree with the polynomial before (docs/internals/extrema.md).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Array, Family
from sweep.families.curve_features import Bends, Singular, Smooth, about
from sweep.numerics.chebyshev import NODES
from sweep.numerics.panel_search import AGAIN, NARROWEST, PANELS, CurveValues, Top, climbed, fitted, measured, places
from sweep.numerics.records import Indices
from sweep.quantities.kinds import Request
from sweep.reductions import sampling
from sweep.reductions.resolution import MATTERS, ends, nearest, zeros
from sweep.reductions.rounding import (
    ALONE,
    CANCELLED,
    order_of,
    plain,
    rounding_by_pieces,
    shaken,
    shaken_anywhere,
    singular_share,
)

VANISHED = 1e-4  # share of the size below which a root counts as a zero: of a cube root of forces of 1e-12
STEADY = 10.0 * AGAIN  # times EPS of a value: largest error claimed for a curve that is constant but for rounding


def has_kinks(family: Family, request: Request, jumps: bool = False) -> bool:
    """Whether an extremum is searched on panels; with ``jumps`` all curves of these designs may jump."""
    output = family.pose_output[request.pose]
    return (output.kinks or output.jumps or jumps) and not (output.wraps or request.windowed)


def extrema(
    family: Family, designs: Array, requests: Sequence[Request], target: float, locate: bool
) -> tuple[dict[Request, sampling.Extremum], Status]:
    """Compute extrema over one turn of curves with kinks and jumps.

    Parameters
    ----------
    family, designs : the (n, P) design matrix
    requests : requested extrema
    target : relative accuracy; of a place [rad]
    locate : whether all crank angles are wanted

    Returns
    -------
    extrema : values are suprema: beside a jump the limit from its higher side
    status : (n,) OK; status of the turn's poses; NOT_CONVERGED where an error exceeds both the target and the rounding
        of the poses
    """
    n = len(designs)
    found = {request: sampling.Extremum.unknown(n) for request in requests}
    status: Status = np.zeros(n, np.uint8)
    for rows in sampling.blocks(np.arange(n), 2 * PANELS * NODES, len(requests)):
        for some in _cut_alike(family, requests):
            now = _block(family.precise(), designs, rows, target, {request: found[request] for request in some}, locate)
            status[rows] = np.where(status[rows] == st.OK, now, status[rows])
    return found, status


def _cut_alike(family: Family, requests: Sequence[Request]) -> list[list[Request]]:
    """Group the requests whose curves are cut at the same crank angles."""
    groups: dict[tuple[Bends, ...], list[Request]] = {}
    for request in requests:
        groups.setdefault(tuple(about(family, Bends, (request.pose,))), []).append(request)
    return list(groups.values())


def _block(
    family: Family, designs: Array, rows: Indices, target: float, found: dict[Request, sampling.Extremum], locate: bool
) -> Status:
    """Search the curves of some designs; fill ``found`` and return their status."""
    guards = sampling.discriminants(family)
    names = list(dict.fromkeys([*(request.pose for request in found), *guards]))
    row, low, high = _cut(family, designs[rows], names[0])
    poses, each = sampling.pose_columns(family, designs[rows[row]], places(low, high), names)
    status = sampling.worst_of_pieces(row, each, rows.size)
    good = status[row] == st.OK
    if not good.any():
        return status
    row, low, high = row[good], low[good], high[good]
    for request, answer in found.items():
        values = poses[request.pose][good]
        if family.pose_output[request.pose].wraps:
            start = sampling.pose_columns(family, designs[rows], np.zeros((rows.size, 1)), [request.pose])[0]
            values, winds = sampling.unwrapped(row, values, start[request.pose][row, 0])
            status[row[winds]] = st.NOT_OSCILLATING
        panels = fitted(row, low, high, values, request.mode)
        curves = _curves(family, designs[rows], request.pose, status)
        top, size = climbed(curves, panels, rows.size, request.mode, target, locate or request.place)
        dead = {name: poses[name][good] for name in (guards[1:] if family.precise_poses else guards)}
        rounding = rounding_by_pieces(dead, row, top.row) * np.abs(top.value)
        lost = np.zeros(top.row.size, np.bool_)  # no correct digit next to a singularity
        if about(family, Singular, (request.pose,)):
            near = nearest(family, designs[rows[top.row]], (request.pose,), MATTERS)
            order = np.full(top.row.size, order_of(family, request.pose))
            share = singular_share(near, top.phi, order)
            rounding, lost = rounding + share * np.abs(top.value), share >= 1.0
            output = family.pose_output[request.pose]
            if plain(family) and not (output.kinks or output.jumps):
                # Terms of what vanishes may be far larger than its values, and all poses share constants of a turn.
                moved = shaken(family, designs[rows[top.row]], top.phi, request.pose)
                rounding = np.maximum(rounding, CANCELLED * moved)
        # the range of a constant curve is rounding, which no target can refer to
        allowed = np.maximum(target * size[top.row], STEADY * EPS * np.abs(top.value))
        if request.mode == -1:
            _vanish(family, designs[rows], request.pose, top, size)
            if any(len(known.parts) > 1 and known.of == request.pose for known in family.every(Smooth)):
                # A magnitude is not below 0, however steep the zero that it passes.
                np.minimum(top.err, -top.value, out=top.err, where=top.value <= 0.0)
        jumps = family.pose_output[request.pose].jumps
        if jumps:  # piecewise constant: a polynomial only adds rounding
            beside = top.phi[:, None] + NARROWEST * np.array([-1.0, 0.0, 1.0])  # it may jump at the place itself
            near_by, _ = sampling.pose_columns(family, designs[rows[top.row]], beside, [request.pose])
            heights = measured(near_by[request.pose], request.mode)
            side = np.abs(heights - top.value[:, None]).argmin(axis=1)
            top = top._replace(value=np.take_along_axis(heights, side[:, None], axis=1)[:, 0])
        # A count may flicker where rounding decides: it is as a pose has it, and its error says what no pose excludes.
        late = np.flatnonzero(lost | ((top.err > allowed) & (top.err > rounding) & (not jumps)))
        off = shaken_anywhere(family, designs[rows[top.row[late]]], top.phi[late], request.pose)
        noise = off >= ALONE * size[top.row[late]]
        top.err[late[noise]] = np.maximum(top.err[late], off)[noise]
        late = late[~noise]
        status[top.row[late]] = np.where(status[top.row[late]] == st.OK, st.NOT_CONVERGED, status[top.row[late]])
        at = rows[top.row]
        answer.value[at] = 0.0 - top.value if request.mode == -1 else top.value
        answer.phi[at], answer.err[at], answer.err_phi[at] = np.mod(top.phi, TWO_PI), top.err + rounding, top.err_phi
    return status


def _curves(family: Family, designs: Array, pose: str, status: Status) -> CurveValues:
    """Poses of the designs as curves; poses without a value set the ``status`` (n,) of their design, in place."""

    def curves(row: Indices, phi: Array, middle: Array) -> Array:
        found = np.empty(phi.shape)
        for some in sampling.blocks(np.arange(row.size), phi.shape[1]):
            poses, each = sampling.pose_columns(family, designs[row[some]], phi[some], [pose])
            found[some] = sampling.continued(family, pose, poses[pose], middle[some])
            lost, at = np.nonzero(each)
            status[row[some[lost]]] = sampling.DESIGN_STATUS[each[lost, at]]
        return found

    return curves


def _vanish(family: Family, designs: Array, pose: str, top: Top, size: Array) -> None:
    """Set the minimum to 0, in place, for curves with a known zero, like the square root of a squared distance."""
    row, phi = zeros(family, designs, pose)
    values, _ = sampling.pose_columns(family, designs[row], phi[:, None], [pose])
    passes = values[pose][:, 0] <= VANISHED * size[row]  # at a jump the function changes its sign without a zero
    first = np.full(len(designs), np.inf)
    np.minimum.at(first, row[passes], np.mod(phi[passes], TWO_PI))
    at = np.flatnonzero(first[top.row] < np.inf)
    top.phi[at], top.value[at], top.err[at], top.err_phi[at] = first[top.row[at]], 0.0, 0.0, NARROWEST


def _cut(family: Family, designs: Array, output: str) -> tuple[Indices, Array, Array]:
    """Design index and ends of the first panels for curves of a pose output."""
    edges = ends(family, designs, PANELS, PANELS * NODES, output)
    low, high = edges[:, :-1], edges[:, 1:]
    row, column = np.nonzero(high - low > NARROWEST)
    return row, low[row, column], high[row, column]
