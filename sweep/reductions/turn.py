"""General routes to design outputs over one turn: margins, limit positions, reductions of pose outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import TWO_PI, Status
from sweep.errors import MissingInput
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.numerics.records import Indices, Mask, put
from sweep.quantities.kinds import LimitPosition, Margin, Quantity, Reduced, Request, WindowAngle, requests
from sweep.quantities.resolve import STAY, resolve
from sweep.reductions.extrema import true_extrema
from sweep.reductions.fused import sampled_maxima
from sweep.reductions.margins import combined, margin_suffixes, margins
from sweep.reductions.sampling import DESIGN_STATUS, Extremum, blocks, sample_turn, variable
from sweep.reductions.window import Window, window_angle

Extrema: TypeAlias = dict[Request, Extremum]

END_TARGET = 1e-12  # of the ends of the stroke that a window angle is measured from


def margin_group(family: Family, designs: Array, names: Sequence[str], accuracy: Accuracy) -> Columns:
    """Compute rotatability, margins and pressure angles by name; without names the status of all stages.

    In a machine "needle.2" is a stage of a member, "needle." its weakest one.
    """
    asked = {name: one for name in names if isinstance(one := resolve(family, name), Margin)}
    known = margin_suffixes(family)
    members = {f"{one.stage.rpartition('.')[0]}." for one in asked.values() if "." in one.stage}
    if members:
        suffixes = tuple(s for s in known if any(s.startswith(member) for member in members))
    else:
        stages = [known.index(one.stage) if one.stage else len(known) - 1 for one in asked.values()]
        suffixes = known[: max(stages, default=len(known) - 1) + 1]
    valued = any(one.kind == "margin" for one in asked.values())
    found, status = margins(family, designs, suffixes, accuracy, valued)
    columns: Columns = {"status": status}
    for name, one in asked.items():
        if one.stage not in found:
            found[one.stage] = combined(found[s] for s in suffixes if s.startswith(one.stage))
        values = found[one.stage].columns()
        columns |= {name: values[one.kind], f"err_{name}": values[f"err_{one.kind}"]}
    return columns


def limits_and_reductions(
    family: Family,
    designs: Array,
    names: Sequence[str],
    accuracy: Accuracy,
    part: tuple[float, float] | None = None,
) -> Columns:
    """Compute limit positions and extrema of pose outputs over one turn, on samples or refined.

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family
    names : reductions and limit positions
    accuracy : dense grid or refined
    part : the window of the stroke for deviations

    Returns
    -------
    Columns
        the names and ``err_<name>`` (nan on samples), each (n,), and ``status``
    """
    asked = [resolve(family, name) for name in names]
    windowed = part is not None
    stays = {name: one for name, one in zip(names, asked, strict=True) if isinstance(one, WindowAngle)}
    others = {name: one for name, one in zip(names, asked, strict=True) if name not in stays}
    wanted = list(dict.fromkeys(r for one in others.values() for r in requests(family, one, windowed)))
    status = np.zeros(len(designs), np.uint8)
    found: Extrema = {}

    def search(some: Sequence[Request], window: Window | None = None) -> None:
        more, now = _extrema(family, designs, [r for r in some if r not in found], accuracy, window)
        found.update(more)
        np.copyto(status, now, where=status == st.OK)

    for position in dict.fromkeys(family.follower(r.pose) for r in wanted if r.windowed):
        search([Request(position, 1), Request(position, -1)])
        inside = [r for r in wanted if r.windowed and family.follower(r.pose) == position]
        search(inside, _window(position, found, accuracy, part))
    search(wanted)
    columns: Columns = {}
    for name, one in others.items():
        columns[name], columns[f"err_{name}"] = _value(family, designs, one, found, windowed)
    # Next to a limit position an angle changes far more than the position: these ends are found to more digits.
    finer = accuracy if accuracy.target is None else replace(accuracy, target=min(accuracy.target, END_TARGET))
    for name, stay in stays.items():
        stroke, now = _extrema(family, designs, requests(family, stay, windowed), finer, None)
        angle, err = window_angle(family, designs, _window(stay.of, stroke, finer, part))
        if accuracy.target is not None:  # ends that miss their finer target may be good enough for the angle
            now[(now == st.NOT_CONVERGED) & (err <= accuracy.target)] = st.OK
        np.copyto(status, now, where=status == st.OK)
        columns[name], columns[f"err_{name}"] = angle, err
    return columns | {"status": status}


def _window(position: str, found: Extrema, accuracy: Accuracy, part: tuple[float, float] | None) -> Window:
    """Make the window of a follower whose limit positions are found."""
    if part is None:
        raise MissingInput("window", f"two fractions of the stroke, as {STAY.name} is wanted", "design outputs")
    most, least = found[Request(position, 1)], found[Request(position, -1)]
    err = np.maximum(most.err, least.err) if accuracy.target is not None else np.zeros(most.value.size)
    return Window.of_stroke(position, least.value, most.value, np.where(np.isfinite(most.value), err, np.nan), part)


def _extrema(
    family: Family, designs: Array, requests: Sequence[Request], accuracy: Accuracy, window: Window | None
) -> tuple[Extrema, Status]:
    if not requests:
        return {}, np.zeros(len(designs), np.uint8)
    if accuracy.samples is not None:
        found, status = sampled_extrema(family, designs, requests, accuracy.samples, window)
    else:
        assert accuracy.target is not None
        found, status = true_extrema(family, designs, requests, accuracy.target, window=window)
    # An angle that makes full turns has no extrema, but what was searched together with it has.
    turning = np.flatnonzero(status == st.NOT_OSCILLATING)
    groups = _apart_from_angles(family, requests)
    if turning.size and len(groups) > 1:
        part = None if window is None else window.only(turning)
        for some in groups:
            for request, extremum in _extrema(family, designs[turning], some, accuracy, part)[0].items():
                put(found[request], turning, extremum)
    return found, status


def _apart_from_angles(family: Family, asked: Sequence[Request]) -> list[list[Request]]:
    """Group the requests: those of each angle that wraps, and all others together."""
    groups: dict[str, list[Request]] = {}
    for request in asked:
        groups.setdefault(request.pose if family.pose_output[request.pose].wraps else "", []).append(request)
    return list(groups.values())


def sampled_extrema(
    family: Family, designs: Array, requests: Sequence[Request], samples: int, window: Window | None = None
) -> tuple[Extrema, Status]:
    """Compute extrema on a grid of ``samples`` equidistant crank angles from 0; nan where the status is not OK.

    Errors are not estimated (nan).  A window without a sample in it gives NOT_CONVERGED.
    """
    n = len(designs)
    found = {request: Extremum.unknown(n) for request in requests}
    status = np.zeros(n, np.uint8)
    names = list(dict.fromkeys([*(r.pose for r in requests), *([window.position] if window is not None else [])]))
    quick = sampled_maxima(family, designs, tuple(requests), samples)
    unsure = np.ones(n, np.bool_)
    for request, most in quick.items():
        found[request].value[:], unsure = most, np.isnan(most)
    rest = [request for request in requests if request not in quick]
    for pending, asked in ((np.flatnonzero(unsure), list(requests)), (np.flatnonzero(~unsure), rest)):
        for rows in blocks(pending, samples, len(names)) if asked else ():
            columns, worst, winds = sample_turn(family, designs[rows], samples, names)
            state = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, DESIGN_STATUS[worst]).astype(np.uint8)
            good = state == st.OK
            status[rows] = state
            if not good.all():
                rows, columns = rows[good], {name: values[good] for name, values in columns.items()}
            for request in asked:
                lacking = _best_samples(rows, columns, request, samples, window, found[request])
                status[lacking] = st.NOT_CONVERGED
    return found, status


def _best_samples(
    rows: Indices, columns: dict[str, Array], request: Request, samples: int, window: Window | None, found: Extremum
) -> Indices:
    """Write the extreme sample of designs and its crank angle; return the designs without a sample in the window."""
    allowed = None
    if window is not None and request.windowed:
        allowed = window.holds(rows, columns[window.position])
    best, column = np.empty(rows.size), np.empty(rows.size, np.int64)
    scan.best_sample(columns[request.pose], request.mode, allowed, best, column)
    found.value[rows] = -best if request.mode == -1 else best
    found.phi[rows] = np.where(column < 0, np.nan, column * (TWO_PI / samples))
    return rows[column < 0]


def _value(family: Family, designs: Array, one: Quantity, found: Extrema, windowed: bool) -> tuple[Array, Array]:
    """Compute a design output and its error from its extrema."""
    first, *others = (found[r] for r in requests(family, one, windowed))
    match one:
        case Reduced(reduction=reduction) if reduction.place:
            return variable(family, designs, first.phi, first.err_phi)
        case Reduced() if not others:
            return first.value, first.err
        case Reduced() | LimitPosition(kind="stroke"):
            (least,) = others
            return first.value - least.value, first.err + least.err
        case LimitPosition():
            (least,) = others
            outward = _extended_is_largest(family, designs, one.of)
            return _limit(one, family.pose_output[one.of].wraps, first, least, outward)
        case _:
            raise TypeError(f"{one.output.name} is not made of extrema")


def _extended_is_largest(family: Family, designs: Array, position: str) -> Mask:
    """Whether the largest position is the extended one, with crank and coupler in line outward (3.2)."""
    sign = family.outward_sign(position)
    if not sign:
        return np.ones(len(designs), np.bool_)
    return designs[:, family.parameter_names.index(sign)] > 0.0


def _limit(one: LimitPosition, wraps: bool, most: Extremum, least: Extremum, outward: Mask) -> tuple[Array, Array]:
    """Compute a quantity of the two limit positions; ``wraps`` for a position that is an angle.

    ``outward`` (n,) tells where the largest position is the extended one.
    """
    kind, cycle = one.kind, TWO_PI / one.cycles
    ext = Extremum(*(np.where(outward, a, b) for a, b in zip(most, least, strict=True)))
    fold = Extremum(*(np.where(outward, b, a) for a, b in zip(most, least, strict=True)))
    if kind in ("ext", "fold"):
        end = ext if kind == "ext" else fold
        return _principal(end.value) if wraps else end.value, end.err
    if kind in ("phi_ext", "phi_fold"):
        end = ext if kind == "phi_ext" else fold
        return end.phi, end.err_phi
    if kind == "swing":
        return fold.value - ext.value, ext.err + fold.err
    phi0, err_phi0 = np.mod(fold.phi - ext.phi, cycle), ext.err_phi + fold.err_phi
    if kind == "phi0":
        return phi0, err_phi0
    assert kind == "stroke_ratio"
    return phi0 / (cycle - phi0), err_phi0 * cycle / (cycle - phi0) ** 2


def _principal(angle: Array) -> Array:
    """Reduce an angle to (-pi, pi], the range of atan2."""
    return angle - TWO_PI * np.ceil((angle - np.pi) / TWO_PI)
