"""Extrema over the turn of chains whose stages are fused into one kernel, :mod:`kernels.chains`.

A family that can only be the last stage of a chain is treated as a chain of one stage: a guide whose crank is the main
shaft.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from kernels import chains
from kernels import status as st
from kernels.chains.curves import MARGIN
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Array, Family
from sweep.families.capabilities import Assembly, DesignMap, FusedOutput, InSeries, constant
from sweep.families.chain import Chain
from sweep.numerics.records import Indices, Mask
from sweep.quantities.kinds import Request
from sweep.reductions.peak_search import TIE
from sweep.reductions.refine import SHRINK, Peaks, confirmed, polished
from sweep.reductions.sampling import Extremum, pose_columns, turn

sampling_tables = lru_cache(chains.sampling_tables)

Opened: TypeAlias = tuple[Array, Status, Array]
Answer: TypeAlias = tuple[Extremum, Status, Mask]


@dataclass(frozen=True)
class FusedCurve:
    """Curve over the crank angle of a fused chain.

    Parameters
    ----------
    family, request : the chain, and the requested extremum
    forms : fused forms of the stages that the curve needs
    order : order of the derivative, or MARGIN
    made_of : coefficients of the curve, from the last stage's designs
    scale : factor of the kernel's values, from the chain's designs; None for 1
    """

    family: Family
    request: Request
    forms: tuple[InSeries, ...]
    order: int
    made_of: DesignMap
    scale: DesignMap | None = None

    def mean(self, designs: Array, target: float) -> tuple[Array, Array, Status, Mask]:
        """Compute root mean squares over the turn, their errors, status and undecided designs, as `extrema` does."""
        n, (given, made_of, along) = len(designs), self.given(designs, None)
        status, found = np.empty(n, np.uint8), np.empty((2, n))
        chains.mean_squares(_chained(self.forms), self.order, along)(
            *given, sampling_tables(), made_of, target, status, found
        )
        undecided = status == chains.OPEN
        return found[0], found[1], np.where(undecided, st.OK, status).astype(np.uint8), undecided

    def opened(self, designs: Array) -> Opened:
        """Compute the part that all curves of a chain share.

        It consists of the designs in the kernels' form, the status of the first stage, and the distance of its nearest
        singularity.
        """
        n, designs = len(designs), np.ascontiguousarray(designs)
        opening, distance = np.empty(n, np.uint8), np.empty(n)
        opens = self.forms[0].opening
        assert opens is not None
        if (matrix := self.forms[0].matrix) is not None:
            designs = matrix(designs)
        opens(designs, opening, distance)
        return designs, opening, distance

    def given(self, designs: Array, opened: Opened | None) -> tuple[Opened, Array, bool]:
        """Return the opened designs, the curve's coefficients, and whether the part across a line is zero."""
        stage = self.family.stages[len(self.forms) - 1]
        made_of = np.ascontiguousarray(self.made_of(designs[:, stage.columns]))
        # Positions along and across a line are often wanted together: they share a kernel, which saves compiling.
        return opened or self.opened(designs), made_of, self.order >= 1 and not made_of[:, 1].any()


def together(curve: FusedCurve, requests: Sequence[Request]) -> tuple[FusedCurve, ...]:
    """Choose the curves of the requests that share samples with one, which is among them, in the order of `extrema`.

    Both modes of a curve share samples, and so do the largest magnitudes of its first two derivatives.
    """
    request, order, slopes = curve.request, curve.order, curve.family.derivative_of
    if request.mode != 0:
        other = replace(curve, request=request._replace(mode=-request.mode))
    elif order in (1, 2) and not request.place:
        pose = (
            slopes.get(request.pose, "") if order == 1 else next((x for x in slopes if slopes[x] == request.pose), "")
        )
        other = replace(curve, request=request._replace(pose=pose), order=3 - order)
    else:
        other = curve
    if other is curve or other.request not in requests:
        return (curve,)
    return (curve, other) if curve.order <= other.order else (other, curve)


def extrema(
    curves: tuple[FusedCurve, ...], designs: Array, target: float, opened: Opened | None = None
) -> list[Answer]:
    """Compute one extremum of every design, or two that share their samples.

    Parameters
    ----------
    curves : one; one in both modes; or without ``place`` the first and the second derivative of one
    designs : (n, P) matrix of the whole chain
    target : relative accuracy
    opened : result of `FusedCurve.opened` for these designs and any curve of the chain, if it is known

    Returns
    -------
    extremum : of each curve, nan where the status is not OK or the search is undecided
    status : (n,) OK or NOT_ROTATABLE
    undecided : (n,) where a slower search is needed
    """
    first, of_order = curves[0], {curve.order: curve for curve in curves}
    n, (given, made_of, along) = len(designs), first.given(designs, opened)
    # The place depends on which of several peaks is the highest.
    tie = TIE if first.request.place else -1.0
    modes = np.array([curve.request.mode for curve in curves])
    status, found = np.empty((modes.size, n), np.uint8), np.empty((6, modes.size, n))
    chains.find_extrema(_chained(first.forms), tuple(of_order), along)(
        *given, sampling_tables(), made_of, modes, target, tie, status, found
    )
    value, phi, err, err_phi, scale, spacing = found.reshape(6, -1)
    many = np.concatenate([designs] * modes.size) if modes.size > 1 else designs
    if first.scale is not None:
        factor = first.scale(many)
        value, err, scale = value * factor, err * factor, scale * factor
    extremum, codes = Extremum(value, phi, err, err_phi), status.ravel()
    rounded = np.flatnonzero(codes == chains.ROUNDED)
    if rounded.size:
        which, distinct = rounded // n, tuple(of_order.values())
        number = np.array([list(of_order).index(curve.order) for curve in curves])[which]
        # The errors of the largest and the least value add up in a range.
        allowed = np.where(modes[which] == 0, 1.0, 0.5) * target * scale[rounded]
        _confirm(distinct, number, modes[which], many, extremum, rounded, allowed, spacing[rounded])
    if first.request.place:
        top = np.flatnonzero((codes == st.OK) | (codes == chains.ROUNDED))
        slope, known = first.family.derivative_of[first.request.pose], (phi[top], err_phi[top])
        places, err_phi[top] = polished(first.family, many[top], slope, *known)
        phi[top] = np.mod(places, TWO_PI)
    undecided = status == chains.OPEN
    # A discriminant is defined also where the links do not reach; the slower search computes it there.
    if first.order == MARGIN:
        undecided |= status == st.NOT_ROTATABLE
    status = np.where(undecided | (status == chains.ROUNDED), st.OK, status).astype(np.uint8)
    each = (Extremum(*(column[k * n : (k + 1) * n] for column in extremum)) for k in range(modes.size))
    return list(zip(each, status, undecided, strict=True))


def _confirm(
    curves: tuple[FusedCurve, ...], number: Indices, modes: Indices, designs: Array, found: Extremum, rows: Indices,
    tolerance: Array, spacing: Array,
) -> None:  # fmt: skip
    """Replace extrema that rounding may have moved too far by those of precise poses, in place.

    ``number`` is that of the curve, by rows, as are ``modes``.
    """
    precise, designs, phi, blur = curves[0].family.precise(), designs[rows], found.phi[rows], found.err[rows]
    later = [x for x in precise.every(Assembly) if x.stage and 2 <= int(x.stage) <= len(curves[0].forms)]
    poses = [curve.request.pose for curve in curves]

    def evaluated(active: Indices, phi: Array, beside: Sequence[str] = ()) -> tuple[Array, dict[str, Array]]:
        columns, _ = pose_columns(precise, designs[active], phi, list(dict.fromkeys([*poses, *beside])))
        return np.choose(number[active, None], [columns[pose] for pose in poses]), columns

    def precisely(active: Indices, phi: Array) -> tuple[Array, Array]:
        """Give values, and their relative change due to the rounded input angles of the later stages' precise poses."""
        values, columns = evaluated(active, phi[:, None], [loop.discriminant for loop in later])
        amplified = np.ones(active.size)
        for loop in later:
            amplified += np.abs(loop.scale(designs[active]) / columns[loop.discriminant][:, 0])
        return values[:, 0], 4.0 * EPS * amplified

    def sample(active: Indices, phi: Array) -> Array:
        return sign[active, None] * evaluated(active, phi)[0]

    here, behind = precisely(np.arange(rows.size), phi)
    sign = np.where(modes != 0, modes, np.where(here < 0.0, -1.0, 1.0))
    height = np.where(modes != 0, modes * found.value[rows], np.abs(found.value[rows]))
    peaks = Peaks(phi.copy(), height, found.err_phi[rows], blur, height, spacing, SHRINK * spacing)
    peaks = confirmed(sample, peaks, tolerance, np.full(rows.size, np.inf), blur, sign * here)
    found.value[rows] = np.where(modes < 0, -peaks.height, peaks.height)
    found.phi[rows], found.err_phi[rows] = np.mod(peaks.phi, TWO_PI), peaks.err_phi
    moved = np.flatnonzero(peaks.phi != phi)
    if moved.size:
        _, behind[moved] = precisely(moved, peaks.phi[moved])
    found.err[rows] = peaks.err_height + behind * np.abs(peaks.height)


def curve_of(family: Family, request: Request, anywhere: bool, mean: bool = False) -> FusedCurve | None:
    """Fused curve of a request; None where there is none.

    ``anywhere`` is that of `sweep.reductions.extrema.true_extrema`: then the smallest discriminant of a later stage.
    """
    forms = _forms(family)
    # A family that can drive another stage has its own steps for largest magnitudes, but not for a ``mean``.
    if forms is None or (len(forms) == 1 and forms[0].form.turn is not None and request.mode == 0 and not mean):
        return None
    if anywhere:
        return _least_discriminant(family, forms, request)
    output, last = family.pose_output[request.pose], family.stages[-1]
    if output.stage not in ("", str(last.number)) or (request.place and request.pose not in family.derivative_of):
        return None
    # Derivatives with a stage number are not with respect to the crank angle of the chain.
    curve: FusedOutput | None = forms[-1].curves.get(output.base)
    if curve is None or (output.stage and curve.order > 0):
        return None
    return FusedCurve(family, request, forms, curve.order, curve.made_of)


def _least_discriminant(family: Family, forms: tuple[InSeries, ...], request: Request) -> FusedCurve | None:
    if request.mode != -1:
        return None
    loop = next((loop for loop in family.every(Assembly) if loop.discriminant == request.pose), None)
    number = int(loop.stage) if loop is not None and loop.stage else 1
    if loop is None or number == 1:
        return None
    return FusedCurve(family, request, forms[:number], MARGIN, constant(0.0, 0.0, 0.0), loop.scale)


def sampled_maxima(family: Family, designs: Array, requests: tuple[Request, ...], samples: int) -> dict[Request, Array]:
    """Largest magnitudes on a grid of equidistant crank angles, for the requests that one fused kernel serves.

    Each is (n,), nan where a discriminant on the grid is not surely positive: poses then determine the status.
    """
    forms = _forms(family) if isinstance(family, Chain) else None
    wanted = {} if forms is None else {r: name for r in requests if (name := _component(family, forms, r)) is not None}
    if forms is None or not wanted:
        return {}
    angles, n = turn(samples), len(designs)
    components = ("x1", "x2", "x3", "y0", "y1", "y2")
    out = {name: np.empty(n) if name in wanted.values() else None for name in components}
    least = np.empty((n, len(forms)))
    chains.dense_maxima(_chained(forms))(
        np.ascontiguousarray(designs), angles.cos[0], angles.sin[0], least, *out.values()
    )
    unsure = ~np.all(least > 0.0, axis=1)
    found = {}
    for request, name in wanted.items():
        most = out[name]
        assert most is not None
        found[request] = np.where(unsure, np.nan, most)
    return found


def _component(family: Family, forms: tuple[InSeries, ...], request: Request) -> str | None:
    output = family.pose_output[request.pose]
    plain = request.mode == 0 and not request.place and not request.windowed and not output.stage
    return forms[-1].components.get(output.base) if plain else None


def _forms(family: Family) -> tuple[InSeries, ...] | None:
    """Fused forms of a chain's stages; None for any other family, and for poses of higher precision.

    Precise poses decide where rounding matters, so a family without them is not searched this way.
    """
    if family.precise_poses is None or family.poses is family.precise_poses:
        return None
    forms = [stage.family.find(InSeries) for stage in family.stages]
    known = tuple(form for form in forms if form is not None)
    fits = len(known) == len(forms) and known[0].opening is not None
    if len(forms) == 1:
        return known if fits else None
    drives = all(form.form.turn is not None for form in known[:-1]) and all(form.matrix is None for form in known)
    return known if fits and drives else None


def _chained(forms: tuple[InSeries, ...]) -> chains.Chained:
    return chains.chained(tuple(form.form for form in forms))
