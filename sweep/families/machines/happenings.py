"""Crank angles of a machine's events at which the paths of its threads change."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kernels.status import OK
from kernels.types import Array
from sweep.errors import InputError, choices
from sweep.families.base import Angles, Event, of_family
from sweep.families.curve_features import Bends, Switches, of_table
from sweep.families.machines.crossings import SAMPLES, Moment, Poses, moved
from sweep.families.machines.thread_balance import ThreadBalance
from sweep.families.machines.thread_way import PHI

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

MOST = 65536  # designs whose events are cached

Happening = Event | Moment


def happenings(machine: Machine) -> dict[str, Happening]:
    """Return the events and moments at which paths of threads change, by name."""
    every = _every(machine)
    threads = machine.every(ThreadBalance)
    return {name: every[name] for thread in threads for name in thread.happens if name in every}


def check_happenings(machine: Machine) -> None:
    """Raise if a thread changes at something that is no event, or at an event of a thread that changes at events.

    Raises
    ------
    InputError
        with the thread and the nearest right name.
    """
    every = _every(machine)
    threads = machine.every(ThreadBalance)
    changing = {output.name for thread in threads if thread.happens for output in thread.outputs}
    for thread in threads:
        place = f"machine.relations.{thread.name}"
        for name in thread.happens:
            key = next((key for key in ("feeding", "drawing") if name in getattr(thread, key)), "thread")
            if name not in every:
                raise InputError(key, name, f"events and moments: {choices(name, every)}", place)
            if (of := getattr(every[name], "of", "")) in changing:
                allowed = f"events of what does not change at events itself, as {of} does"
                raise InputError(key, name, allowed, place)


def _every(machine: Machine) -> dict[str, Happening]:
    found: dict[str, Happening] = {r.name: r for r in machine.relations if isinstance(r, Moment)}
    return found | {event.name: event for event in machine.events}


def event_angles(machine: Machine, designs: Array) -> tuple[dict[str, Any], NDArray[np.uint8]]:
    """Find the crank angles of the events by ``phi_NAME``, (n, 1), and status (n,); complex for complex designs.

    The angles of a design are cached: a search needs its poses many times.
    """
    known: dict[bytes, Array] = machine.derived.setdefault(event_angles, {})
    columns, events = _columns(machine), happenings(machine)
    given = np.ascontiguousarray(designs[:, columns].real)
    # The rows of a design's panels are adjacent: it is looked up once.
    other = np.append(True, (given[1:] != given[:-1]).any(axis=1))[: len(given)]
    first = np.flatnonzero(other)
    rows = [row.tobytes() for row in given[first]]
    new = {row: k for k, row in enumerate(rows) if row not in known}
    if new:
        if len(known) + len(new) > MOST:
            known.clear()
            new = {row: k for k, row in enumerate(rows)}
        angles = _search(machine, events, np.ascontiguousarray(designs[first[list(new.values())]].real))
        known.update(zip(new, angles, strict=True))
    table = np.array([known[row] for row in rows]).reshape(len(rows), len(events) + 1)[np.cumsum(other) - 1]
    phi: Any = table[:, :-1]
    if np.iscomplexobj(designs) and designs.imag.any():
        names = [event.of if isinstance(event, Event) else next(iter(event.rates)) for event in events.values()]
        phi = moved(machine, designs, phi, names)
    return {f"phi_{name}": phi[:, [k]] for k, name in enumerate(events)}, table[:, -1].astype(np.uint8)


def bends_of_threads(machine: Machine) -> list[Bends]:
    """List the bends of tensions and rates of threads between events."""
    threads = [r for r in machine.every(ThreadBalance) if r.bent]
    return [Bends(frozenset(f"{r.name}_{name}" for name in r.bent), partial(_bending, machine, r)) for r in threads]


def _bending(machine: Machine, thread: ThreadBalance, designs: Array, angles: Angles) -> Array:
    names = frozenset(f"{thread.name}_{name}" for name in ("surplus", "velocity"))
    own = names.intersection(output.name for output in thread.outputs)
    places = frozenset(name for name in thread.needs(own) if not name.startswith("phi_"))
    found = {PHI: angles.phi} | machine.poses(designs, angles, places)  # the machine of the events has no threads
    found |= event_angles(machine, designs)[0] if thread.happens else {}
    found |= {p.name: designs[:, [machine.parameter_names.index(p.name)]] for p in thread.parameters}
    curves: Array = thread.bending(found | thread.compute(found, own))
    return curves


def switches_of_threads(machine: Machine) -> list[Switches]:
    """List the switches of threads' curves: events, and points of the table of the allowed excess."""
    threads = machine.every(ThreadBalance)
    tables = [of_table(r.allowed.phi, frozenset({f"{r.name}_excess"})) for r in threads if r.allowed]
    of = frozenset(output.name for thread in threads for output in thread.outputs)
    return [*tables, Switches(partial(_switches, machine), of)] if happenings(machine) else tables


def _switches(machine: Machine, designs: Array) -> Array:
    return np.concatenate(list(event_angles(machine, designs)[0].values()), axis=1)


@of_family
def _columns(machine: Any) -> NDArray[np.intp]:
    """Columns of the members, shafts and relations that the events depend on."""
    needs: set[str] = set()
    for event in happenings(machine).values():
        of = {event.of} if isinstance(event, Event) else set(event.rates)
        made = [r for r in machine.relations if not of.isdisjoint(o.name for o in r.outputs)]
        needs |= of.union(*(r.needs(frozenset(of)) for r in made), (p.name for r in made for p in r.parameters))
    names = {name.partition(".")[0] for name in needs}
    for m in reversed(machine.members):
        if m.name in names and m.driver is not None:
            names.add(m.driver[0])
        if m.name in names and m.mount is not None:
            names.update(p.name for p in m.mount.shaft.parameters)
    return np.flatnonzero([name.partition(".")[0] in names for name in machine.parameter_names])


def _search(machine: Machine, events: dict[str, Happening], designs: Array) -> Array:
    """Find the event angles of each design, and the first status that is not OK, (n, k + 1)."""
    poses = Poses(machine, machine.precise(), designs)
    found, status = [], np.zeros(len(designs), np.uint8)
    names = [
        {event.of} if isinstance(event, Event) else {*event.rates, *event.rates.values()} for event in events.values()
    ]
    poses.samples(sorted(set().union(*names)), SAMPLES)  # all outputs at once
    for name, event in events.items():
        if isinstance(event, Event):
            now, phi = poses.first(event.of, event.level, 1.0 if event.rising else -1.0)
        else:
            columns: dict[str, Any] = dict(
                event.read(machine, designs, event.find(poses, SAMPLES, frozenset()), frozenset())
            )
            now, phi = columns["status"], columns[f"phi_{name}"]
        status = np.where(status == OK, now, status)
        found.append(phi)
    return np.column_stack([*found, status])
