"""Choice and execution of the routes to design outputs: own steps, effects, general reductions, members, composed ones.

A composed output, and an output of a machine's member, calls `design_outputs` for the outputs that it needs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import TWO_PI, Status
from sweep import costs
from sweep.errors import InputError
from sweep.evaluation import route
from sweep.evaluation.route import Route, Window, check_window, general_route, own_route
from sweep.evaluation.statuses import explained
from sweep.families.base import Accuracy, Array, Columns, Family, Interval, March, Stage, Step, Work, of_family
from sweep.families.capabilities import Assembly
from sweep.families.machines.machine import Machine
from sweep.families.machines.relations import EventValue
from sweep.families.names import error_of, is_place
from sweep.families.parts import Member
from sweep.numerics.records import Indices
from sweep.quantities.kinds import Extent, GeneralRoute, LargestLength, Margin, Negative, Quantity, TimingOf, group_of
from sweep.quantities.resolve import resolve
from sweep.reductions.margins import NAMES as MARGINS
from sweep.reductions.margins import LoopMargin, combined, margin_suffixes, margins
from sweep.reductions.sampling import on_closed_turn
from sweep.reductions.steps import NO_JUMPS, applying_step, beyond_motion, group_ns
from sweep.reductions.turn import margin_group

# Statuses with which some outputs are missing or rough, but others are still useful.
PARTIAL = (
    st.OK, st.NOT_OSCILLATING, st.NOT_CONVERGED, st.NO_DWELL, st.JAMMED, st.NOT_LINEAR, st.SINGULAR, st.INVALID_INPUT,
    st.NO_EVENT, st.NEVER, st.TWICE, st.TANGENT, st.WRONG_SIDE, st.WRONG_WAY, st.NO_FRAME,
    st.NO_TRIANGLE, st.NO_WINDOW,
)  # fmt: skip
GOES_ON = np.isin(np.arange(256), PARTIAL)
GOES_ON_STUCK = np.isin(np.arange(256), (*PARTIAL, st.NOT_ROTATABLE))  # a crank that does not turn has its margin

Compose: TypeAlias = Callable[[Array, Columns], route.Composed]
"""Function that composes an output from designs (n, P) and the columns of other outputs."""


def design_outputs(
    family: Family,
    designs: Array,
    wanted: Sequence[str],
    accuracy: Accuracy,
    window: Window = None,
) -> Columns:
    """Compute design outputs of a design matrix, cheap routes first; non-rotatable designs skip the costly ones.

    Parameters
    ----------
    family : any family or chain
    designs : (n, P) matrix with the columns of ``family.parameters``
    wanted : names of design outputs
    accuracy : dense grid or refined
    window : see `summarise`

    Returns
    -------
    Columns
        each wanted name (n,), its ``err_`` if ``accuracy.target`` is set, and ``status``: of several causes the first

    Raises
    ------
    InputError
        for an unknown name, or a window that is no part of the stroke.
    """
    check_window(window)
    family = on_closed_turn(family)
    designs, n = np.ascontiguousarray(designs), len(designs)
    status = np.zeros(n, np.uint8)
    columns: Columns = {}
    turns = not isinstance(family.domain, Interval)
    steps = routes(family, wanted, accuracy)
    # Refinement detects a dead point between samples, a plain grid does not.
    decided = accuracy.samples is None or any(step.general == "margin" for step in steps) or not margin_suffixes(family)
    with np.errstate(all="ignore"):  # values beyond float64 get a status below
        for step in steps:
            if step.general and not decided:  # quicker outputs such as the margin are computed by now
                status, decided = np.where(status == st.OK, _turning(family, designs, accuracy), status), True
            # A follower that turns fully lacks limit positions or a dwell, but has extrema; one that jams still moves.
            goes_on = GOES_ON_STUCK if step.stuck else GOES_ON
            alive = np.flatnonzero(goes_on[status]) if status.any() else None  # None means all
            rows = designs if alive is None or alive.size == n else designs[alive]
            results = step.run(rows, accuracy, window)
            for name in with_errors(step.outputs, accuracy):
                columns[name] = _spread(results[name], alive, n)
                if turns and is_place(name):  # np.mod returns 2 pi for a tiny negative angle
                    columns[name] = np.where(columns[name] == TWO_PI, 0.0, columns[name])
            step_status = results["status"].astype(np.uint8)
            if alive is None:
                status = step_status
            else:
                status[alive] = np.where(status[alive] == st.OK, step_status, status[alive])
        if not turns:
            status[status == st.NOT_ROTATABLE] = st.NOT_ASSEMBLED  # an interval has no turning crank
        asked_for = {name: columns[name] for name in with_errors(wanted, accuracy)}
        return explained(asked_for | {"status": status}, dict.fromkeys(wanted))


def _turning(family: Family, designs: Array, accuracy: Accuracy) -> Status:
    """Status of the margin; that of a machine comes from its members' own steps."""
    if isinstance(family, Machine):
        results = _margins(family, designs, accuracy, None)
    else:
        results = margin_group(family, designs, (), accuracy)
    return results["status"].astype(np.uint8)


def _spread(values: NDArray[np.generic], rows: Indices | None, n: int) -> NDArray[np.generic]:
    """Expand values of some rows, or of all, to a whole column; False or nan in the other rows."""
    if rows is None or rows.size == n:
        return values
    column: NDArray[np.generic] = np.zeros(n, np.bool_) if values.dtype == np.bool_ else np.full(n, np.nan)
    column[rows] = values
    return column


def with_errors(wanted: Sequence[str], accuracy: Accuracy) -> list[str]:
    """List the wanted names, followed by those of their errors if a target is set."""
    return [*wanted, *map(error_of, wanted)] if accuracy.target is not None else list(wanted)


def routes(
    family: Family, wanted: Sequence[str], accuracy: Accuracy, windowed: bool = False, jumps: frozenset[str] = NO_JUMPS
) -> tuple[Route, ...]:
    """Choose the routes to the wanted outputs, in order; each can be run by `design_outputs` alone.

    With ``windowed`` the estimated times are those with a window, with ``jumps`` those of designs in which these pose
    outputs jump.

    Raises
    ------
    InputError
        for an unknown name, or an accuracy that the family's domain or the output does not support.
    """
    cached, key, prices = _known(family), (tuple(wanted), accuracy, windowed, jumps), costs.table()
    if key not in cached or cached[key][0] is not prices:
        cached[key] = prices, _routes(family, wanted, accuracy, windowed, jumps)
    return cached[key][1]


@of_family
def _known(family: Family) -> dict[tuple[Any, ...], tuple[Any, tuple[Route, ...]]]:
    """Cache of routes with the table of costs they were estimated by: every chunk of a sweep asks for the same."""
    return {}


def _routes(
    family: Family, wanted: Sequence[str], accuracy: Accuracy, windowed: bool, jumps: frozenset[str]
) -> tuple[Route, ...]:
    if isinstance(family.domain, March) and accuracy.target is not None:
        allowed = "samples=: a pose depends on those before it, so values exist on the grid that is marched only"
        raise InputError("accuracy", accuracy.target, allowed, f"design outputs of {family.name}")
    quantities = {name: resolve(family, name) for name in dict.fromkeys(wanted)}
    selected: list[Route] = []
    if isinstance(family, Machine):
        selected, quantities = _of_members(family, quantities, accuracy, windowed, jumps)
    own_steps = {name: applying_step(family, name, accuracy) for name in quantities}
    # The margin of a whole chain needs all stages: the first stage alone would reject designs before the others.
    chain_margin = any(own_steps[n] is None and isinstance(q, Margin) and not q.stage for n, q in quantities.items())
    steps: dict[tuple[str, int], tuple[Step, Stage, list[str]]] = {}
    groups: dict[tuple[GeneralRoute, str], list[str]] = {}
    for name, quantity in quantities.items():
        step, group = own_steps[name], group_of(family, quantity)
        if isinstance(quantity, Negative | Extent | TimingOf):
            selected.append(_composed(family, quantity, accuracy, windowed, jumps))
        elif step is not None and not (chain_margin and group == "margin"):
            steps.setdefault((step[0].name, step[1].number), (*step, []))[2].append(name)
        elif group is not None:
            # Each effect by itself: one that jams or leaves its range does not affect the others.
            effect = beyond_motion(family, quantity.of).name
            groups.setdefault((group, effect), []).append(name)
        else:
            raise _unserved(family, name, accuracy)
    selected += [own_route(step, stage, tuple(names), accuracy, jumps) for step, stage, names in steps.values()]
    selected += [general_route(family, *key, tuple(names), accuracy, windowed, jumps) for key, names in groups.items()]
    stuck = {name for name, quantity in quantities.items() if _of_stuck(quantity)}
    selected = [replace(chosen, stuck=chosen.stuck or stuck.issuperset(chosen.outputs)) for chosen in selected]
    return tuple(sorted(selected, key=lambda chosen: (*chosen.order, chosen.name)))


def _of_stuck(quantity: Quantity) -> bool:
    """Whether a quantity says something of a design whose crank does not turn: a margin, or its negative."""
    return isinstance(quantity, Margin) or (isinstance(quantity, Negative) and _of_stuck(quantity.inner))


def _unserved(family: Family, name: str, accuracy: Accuracy) -> InputError:
    if isinstance(family, Machine):
        allowed = "an output made of poses: this member's crank does not turn with the main shaft"
    elif accuracy.samples is not None:
        allowed = "another accuracy: this output is only computed with accuracy=, not on samples"
    else:
        allowed = "another accuracy: this output is only computed on samples, not with accuracy="
    return InputError("output", name, allowed, f"design outputs of {family.name}")


def _composed(
    family: Family, quantity: Negative | Extent | TimingOf, accuracy: Accuracy, windowed: bool, jumps: frozenset[str]
) -> Route:
    """Make the route of a composed output; its time is that of the outputs it is composed of."""
    name, lowest = quantity.output.name, (Work.SEARCH, 0)
    operands: Sequence[str]
    compose: Compose
    match quantity:
        case Negative(inner=inner):
            operands = (inner.output.name,)
            title, compose = f"negative of {operands[0]}", partial(route.negative, operands[0])
        case Extent(box=box):
            operands, title, compose = box.asked, f"box {name}", partial(route.extent, box)
        case TimingOf(timing=timing):
            # each place of a timing is a search of its own
            operands, lowest = timing.places, (Work.LONG, 0)
            if isinstance(timing, EventValue):
                assert isinstance(family, Machine)
                title, compose = f"value {name}", partial(route.value_at, family, timing)
            else:
                title, compose = f"timing {name}", partial(route.difference, timing)
    components = routes(family, operands, accuracy, windowed, jumps)
    cost = sum(component.ns_per_design for component in components)
    # Not before the outputs it is composed of: the margin of non-rotatable designs would be left out.
    order = max([lowest, *(component.order for component in components)])
    whole_turn = isinstance(quantity, Extent)  # an extent is about the whole motion; the window is for deviations only
    return Route(title, (name,), cost, partial(_run_composed, family, name, operands, compose, whole_turn), order=order)


def _run_composed(
    family: Family, name: str, operands: Sequence[str], compose: Compose, whole_turn: bool,
    designs: Array, accuracy: Accuracy, window: Window,
) -> Columns:  # fmt: skip
    columns = design_outputs(family, designs, operands, accuracy, None if whole_turn else window)
    value, error, status = compose(designs, columns)
    return {name: value, error_of(name): error, "status": status}


def _of_members(
    machine: Machine, quantities: dict[str, Quantity], accuracy: Accuracy, windowed: bool, jumps: frozenset[str]
) -> tuple[list[Route], dict[str, Quantity]]:
    """Make the routes of single members and of the machine's margins; also return the remaining quantities.

    A member that the main shaft drives turn by turn is computed alone, by its own exact routes; only quantities that
    depend on several members, or on a gear between them, are searched for on the poses of the whole machine.
    """
    remaining: dict[str, Quantity] = {}
    outputs_of: dict[str, list[str]] = {m.name: [] for m in machine.members}
    margin: list[str] = []
    for name, quantity in quantities.items():
        member = machine.split(name)
        independent = isinstance(quantity, LargestLength)  # independent of the member's drive
        if member is not None and (independent or (member[0].alone and not _is_of_point(member[0], quantity))):
            outputs_of[member[0].name].append(member[1])
        elif isinstance(quantity, Margin) and member is None:
            margin.append(name)
        else:
            remaining[name] = quantity
    selected: list[Route] = []
    for m in machine.members:
        for inner in routes(m.family, outputs_of[m.name], accuracy, windowed, frozenset(map(m.own, jumps))):
            names = tuple(f"{m.name}.{name}" for name in inner.outputs)
            run = partial(_of_member, m, inner)
            title, cost = f"{m.name}: {inner.name}", inner.ns_per_design
            selected.append(Route(title, names, cost, run, order=inner.order, stuck=inner.stuck))
    if margin:
        cost = sum(group_ns(m.family, "margin", (), accuracy) for m in machine.members)
        run = partial(_margins, machine)
        selected.append(Route("margins", tuple(margin), cost, run, order=(Work.QUICK, 0), stuck=True))
    return selected, remaining


def _is_of_point(member: Member, quantity: Quantity) -> bool:
    """Whether a quantity belongs to a point in the machine's frame, which the member alone does not know."""
    return bool(quantity.of) and member.own(quantity.of) not in member.family.pose_output


def _by_itself(m: Member, outputs: Sequence[str], designs: Array, accuracy: Accuracy, window: Window) -> Columns:
    """Compute outputs of a member's family; only once where the member is the same in all designs."""
    member_designs = m.designs(designs)
    identical = len(member_designs) > 1 and bool((member_designs[1:] == member_designs[0]).all())
    columns = design_outputs(m.family, member_designs[:1] if identical else member_designs, outputs, accuracy, window)
    return {name: np.repeat(values, len(member_designs)) for name, values in columns.items()} if identical else columns


def _of_member(m: Member, inner: Route, designs: Array, accuracy: Accuracy, window: Window) -> Columns:
    """Run a member's own route, and rename its outputs for the machine."""
    results, phase = _by_itself(m, inner.outputs, designs, accuracy, window), m.phase(designs)
    columns: Columns = {"status": results["status"]}
    for name in inner.outputs:
        dotted = f"{m.name}.{name}"
        columns[dotted] = results[name]
        if accuracy.target is not None:
            columns[error_of(dotted)] = results[error_of(name)]
    for name in filter(is_place, inner.outputs):  # from the member's crank to the main shaft
        at_crank = np.asarray(columns[f"{m.name}.{name}"], np.float64)
        columns[f"{m.name}.{name}"] = np.mod(at_crank - phase, TWO_PI)
    return columns


def _margins(machine: Machine, designs: Array, accuracy: Accuracy, window: Window) -> Columns:
    """Compute the margin of the weakest member; a member driven by another is tested at the angles that it gets."""
    status = np.zeros(len(designs), np.uint8)
    found: list[LoopMargin] = []
    for m in machine.members:
        loops = tuple(loop.stage for loop in machine.every(Assembly) if m.own(loop.stage) or loop.stage == f"{m.name}.")
        if not loops:
            continue
        if m.driver is None:  # its crank turns fully with any gear ratio
            columns = _by_itself(m, MARGINS, designs, accuracy, None)
            found.append(LoopMargin.of(columns, accuracy))
            member_status = columns["status"]
        else:
            driven, member_status = margins(machine, designs, loops, accuracy)
            found += driven.values()
        status = np.where(status == st.OK, member_status, status).astype(np.uint8)
    return combined(found).columns() | {"status": status}
