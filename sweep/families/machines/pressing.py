"""The presser foot of a machine on a feed's rack, by the angle of the main shaft; docs/foot.md.

A foot has a history: it is marched over its own turns, on the rack of the member alone.  So it has no pose outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI, Array, Status
from sweep.errors import InputError, choices
from sweep.families.base import Accuracy, Columns, Family, Output, Parameter, Step, Work
from sweep.families.capabilities import PresserFoot
from sweep.families.machines.relations import NONE_HERE, Relation
from sweep.families.names import is_place
from sweep.families.parts import Member

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

RACK, ON_RACK = "feed", "feed_foot"
SPEED = {"omega": "speed"}  # the name in threads, whose value the scene provides


@dataclass(frozen=True)
class Pressing(Relation):
    """A foot that the rack of a member lifts.

    Parameters
    ----------
    name : prefix of the names of parameters and outputs
    rack : the member
    lifted : number of parameters of the member's own family
    foot : the march
    of_foot : parameters of the foot
    """

    rack: str
    lifted: int
    foot: PresserFoot
    of_foot: tuple[Parameter, ...]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the foot."""
        return self.of_foot

    @property
    def by_output_of_foot(self) -> Mapping[str, Output]:
        """Design outputs, by their names in the family of the foot alone."""
        return {o.name: replace(o, name=self.named(o.name), text=f"{self.name}: {o.text}") for o in self.foot.outputs}

    def named(self, output: str) -> str:
        """Return the machine's name of an output of the foot; an angle is named like that of an event."""
        return f"phi_{self.name}_{output.removeprefix('phi_')}" if is_place(output) else f"{self.name}_{output}"

    def marched(self, machine: Machine, designs: Array, nodes: int) -> tuple[Columns, Array, Array]:
        """March the foot: columns of the march, path of the rack, and angle (n,) of both at 0 of the main shaft."""
        m, first = machine.member(self.rack), machine.parameter_names.index(self.parameters[0].name)
        own = np.hstack([m.designs(designs)[:, : self.lifted], designs[:, first : first + len(self.parameters)]])
        columns, path, _, _ = self.foot.march(own, nodes, m.ratio)
        return columns, path, m.ratio * m.phase(designs)

    def step(self, machine: Machine) -> Step:
        """Make the machine's step to the outputs of the foot."""

        def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
            columns, _, ahead = self.marched(machine, designs, self.foot.nodes)
            # With more nodes interpolated curvature errs less, and rounding in it more.  Its error changes its sign
            # within a cell: where one other march errs alike, a second rarely does.
            others = [columns]
            if accuracy.target is not None:
                others = [self.marched(machine, designs, k * self.foot.nodes)[0] for k in (2, 3)]
            status: Status = np.array(columns["status"], np.uint8)
            found: Columns = {}
            for own, name in ((own, o.name) for own, o in self.by_output_of_foot.items() if o.name in wanted):
                value, *finer = (np.asarray(x[own], np.float64) for x in (columns, *others))
                status[(status == st.OK) & np.isnan(value)] = st.NO_EVENT
                found[name] = np.mod(value - ahead, TWO_PI) if is_place(own) else value
                away = [np.abs(value - np.nan_to_num(other, nan=np.inf)) for other in finer]
                found[f"err_{name}"] = 5.0 * np.max(away, axis=0)
            return found | {"status": status}

        outputs = tuple(self.by_output_of_foot.values())
        return Step(f"foot {self.name}", outputs, run, work=Work.LONG, cost=lambda accuracy: 2e6)


def read_pressing(
    name: str, table: Mapping[str, Any], members: Mapping[str, Member], find: Callable[[str | Sequence[str]], Family]
) -> Pressing:
    """Read a relation ``press``: the member whose rack lifts the foot.

    Raises
    ------
    InputError
        for another key, an unknown member, one without such a rack, or a rack that does not rise once per turn.
    """
    where, given = f"machine.relations.{name}", table["press"]
    if len(table) != 1:
        raise InputError(name, dict(table), "press alone", where)
    if given not in members:
        racks = choices(str(given), (m.name for m in members.values() if m.family.name == RACK))
        raise InputError("press", given, f"a member of the family {RACK}: {racks or NONE_HERE}", where)
    m = members[given]
    if m.family.name != RACK:
        raise InputError("press", given, f"a member of the family {RACK}; {given} is of {m.family.name}", where)
    if m.driver is not None:
        raise InputError("press", given, f"a rack that the main shaft drives, not {'.'.join(m.driver)}", where)
    if m.ratio not in (1, -1):
        raise InputError("press", given, f"a rack with ratio 1 or -1: {given} rises {abs(m.ratio)} times a turn", where)
    alone, lifted = find(ON_RACK), len(m.family.parameters)
    parameters = tuple(
        replace(p, name=f"{name}_{SPEED.get(p.name, p.name)}", text=f"{name}: {p.text}")
        for p in alone.parameters[lifted:]
    )
    return Pressing(name, given, lifted, alone.the(PresserFoot), parameters)
