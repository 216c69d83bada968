"""The routes to design outputs of a machine: its members' own, and general reductions where members meet.

A member that the main shaft drives turn by turn is asked by itself, by its own exact routes; only what depends on
several members, or on a gear between, is searched for on the poses of the whole machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.boxes import box_route
from sweep.evaluation.route import Part, Route
from sweep.families.base import Accuracy, Array, Columns, Work
from sweep.families.capabilities import Assembly
from sweep.families.members import Machine, Member
from sweep.families.relations import Reading, Timing
from sweep.quantities.names import error_of, is_place
from sweep.reductions.box import box
from sweep.reductions.catalogue import output, quantity
from sweep.reductions.dimensions import size
from sweep.reductions.margins import NAMES as MARGINS
from sweep.reductions.margins import TRANSMISSION, combined, margins, with_transmission
from sweep.reductions.sampling import TWO_PI, pose_columns
from sweep.reductions.work import group_ns

SLOPE = 1e-5  # rad, for the slope that says what the error of an angle does to a value there


def machine_routes(machine: Machine, wanted: Sequence[str], accuracy: Accuracy) -> tuple[list[Route], list[str]]:
    """Return routes of members, margins and timings,
    and the names that are left to general reductions over the machine.
    """
    from sweep.evaluation.routes import routes

    found: list[Route] = []
    left: list[str] = []
    own: dict[str, list[str]] = {}
    margin: list[str] = []
    for name in dict.fromkeys(wanted):
        member = machine.split(name)
        timing = next((t for t in machine.timings if t.name == name), None)
        if member is not None and is_alone(member[0]) and not is_of_point(machine, name):
            own.setdefault(member[0].name, []).append(member[1])
        elif name in (*MARGINS, TRANSMISSION):
            margin.append(name)
        elif size(machine, name) is not None:
            left.append(name)
        elif (extent := box(machine, name)) is not None:
            found.append(box_route(machine, extent, accuracy))
        elif timing is not None:
            found.append(_timing(machine, timing, accuracy))
        elif quantity(machine, name) is not None:
            left.append(name)
        else:
            output(machine, name)  # an unknown name ends here, with the nearest known one
            allowed = "an output made of poses: this member's crank does not turn with the main shaft"
            raise InputError("output", name, allowed, f"design outputs of {machine.name}")
    for m in machine.members:
        for inner in routes(m.family, own.get(m.name, ()), accuracy):
            names = tuple(f"{m.name}.{name}" for name in inner.outputs)
            run = partial(_of_member, m, inner)
            found.append(Route(f"{m.name}: {inner.name}", names, inner.ns_per_design, run, order=inner.order))
    if margin:
        cost = sum(group_ns(m.family, "margin", (), accuracy) for m in machine.members)
        found.append(Route("margins", tuple(margin), cost, partial(_margins, machine), order=(Work.QUICK, 0)))
    return found, left


def is_alone(member: Member) -> bool:
    """Return whether the member turns with the main shaft, so that its extrema over a turn are those of its family."""
    return member.driver is None and member.ratio == 1


def is_of_point(machine: Machine, name: str) -> bool:
    """Return whether a dotted name is about a point in the machine's frame, which the member alone does not know."""
    found, member = quantity(machine, name), machine.split(name)
    assert member is not None
    return found is not None and bool(found.of) and member[0].own(found.of) not in member[0].family.pose_output


def _of_member(m: Member, inner: Route, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    """Return what a member's own route gives, under the machine's names;
    computed once where no design varies the member.
    """
    from sweep.evaluation.summaries import design_outputs

    own = m.designs(designs)
    once = len(own) > 1 and bool((own[1:] == own[0]).all())
    found = design_outputs(m.family, own[:1] if once else own, inner.outputs, accuracy, window)
    phase = designs[:, m.columns.stop]
    columns: Columns = {"status": found["status"]}
    for name in inner.outputs:
        dotted = f"{m.name}.{name}"
        columns[dotted] = found[name]
        if accuracy.target is not None:
            columns[error_of(dotted)] = found[error_of(name)]
    if once:
        columns = {name: np.repeat(values, len(own)) for name, values in columns.items()}
    for name in filter(is_place, inner.outputs):  # from the member's crank to the main shaft
        at_crank = np.asarray(columns[f"{m.name}.{name}"], np.float64)
        columns[f"{m.name}.{name}"] = np.mod(at_crank - phase, TWO_PI)
    return columns


def _margins(machine: Machine, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    """Return the margin of the weakest member;
    a member that another drives has to assemble at the angles that it gets.
    """
    from sweep.evaluation.summaries import design_outputs

    status = np.zeros(len(designs), np.uint8)
    columns: Columns = {}
    suffixes: list[str] = []
    for m in machine.members:
        loops = tuple(loop.stage for loop in machine.every(Assembly) if m.own(loop.stage) or loop.stage == f"{m.name}.")
        if not loops:
            continue
        if is_alone(m):
            found = design_outputs(m.family, m.designs(designs), MARGINS, accuracy, None)
            now, none = found["status"], np.zeros(len(designs))
            for name in MARGINS:
                columns[f"{name}{m.name}"] = found[name]
                columns[f"{error_of(name)}{m.name}"] = found.get(error_of(name), none)
            suffixes.append(m.name)
        else:
            found = margins(machine, designs, loops, accuracy)
            now = found.pop("status")
            columns |= found
            suffixes += loops
        status = np.where(status == st.OK, now, status).astype(np.uint8)
    return with_transmission(combined(columns, tuple(suffixes)), ("",)) | {"status": status}


def _timing(machine: Machine, timing: Timing | Reading, accuracy: Accuracy) -> Route:
    from sweep.evaluation.routes import routes

    both = routes(machine, timing.places, accuracy)
    cost, order = sum(route.ns_per_design for route in both), max(route.order for route in both)
    if isinstance(timing, Reading):
        return Route(f"value {timing.name}", (timing.name,), cost, partial(_value, machine, timing), order=order)
    return Route(f"timing {timing.name}", (timing.name,), cost, partial(_difference, machine, timing), order=order)


def _value(machine: Machine, reading: Reading, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    """Return a pose output at a crank angle that the design gives;
    its error is that of the angle, by the slope there.
    """
    from sweep.evaluation.summaries import design_outputs

    place = reading.places[0]
    found = design_outputs(machine, designs, reading.places, accuracy, window)
    phi = np.asarray(found[place], np.float64)
    known = np.isfinite(phi)
    near = np.where(known, phi, 0.0)[:, None] + SLOPE * np.array([0.0, -1.0, 1.0])
    poses, at = pose_columns(machine, designs, near, [reading.of.name])
    values = np.where(known[:, None], poses[reading.of.name], np.nan)
    status = np.where(found["status"] == st.OK, at[:, 0], found["status"]).astype(np.uint8)
    columns: Columns = {reading.name: np.where(status == st.OK, values[:, 0], np.nan), "status": status}
    if accuracy.target is not None:
        slope = np.abs(values[:, 2] - values[:, 1]) / (2.0 * SLOPE)
        columns[error_of(reading.name)] = slope * np.asarray(found[error_of(place)], np.float64)
    return columns


def _difference(machine: Machine, timing: Timing, designs: Array, accuracy: Accuracy, window: Part) -> Columns:
    from sweep.evaluation.summaries import design_outputs

    found = design_outputs(machine, designs, timing.places, accuracy, window)
    first, second = (np.asarray(found[name], np.float64) for name in timing.places)
    apart = second - first
    columns: Columns = {timing.name: apart - TWO_PI * np.ceil((apart - np.pi) / TWO_PI), "status": found["status"]}
    if accuracy.target is not None:
        errors = [np.asarray(found[error_of(name)], np.float64) for name in timing.places]
        columns[error_of(timing.name)] = errors[0] + errors[1]
    return columns
