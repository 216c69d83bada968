"""Selection of pose outputs: motion curves worth plotting over the turn, and joint coordinates for drawings."""

from __future__ import annotations

from sweep.families.base import Family
from sweep.families.capabilities import Assembly
from sweep.families.machines.machine import Machine
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.relations import Relation
from sweep.families.machines.shaking import Shaking
from sweep.families.sites import AXES


def motion_curves(family: Family) -> tuple[str, ...]:
    """List position and derivatives, deviations, pressure angles; of a machine those of its members, and relations."""
    if isinstance(family, Machine):
        members = [f"{m.name}.{name}" for m in family.members for name in m.family.derivatives(m.family.position, 2)]
        relations = [r for r in family.relations if r.outputs and _has_loads(family, r)]
        return (*members, *(r.outputs[0].name for r in relations))
    deviations = [o.name for o in family.pose_outputs if o.windowed and not o.stage]
    loops = [loop.pressure_angle for loop in family.every(Assembly)]
    return (*family.derivatives(family.position, 3), *deviations, *loops)


def _has_loads(machine: Machine, relation: Relation) -> bool:
    """Whether the members have the loads that a relation needs, which a scene may leave out."""
    if not isinstance(relation, Shaking | ShaftTorque):
        return True
    needed = relation.needs(frozenset({relation.outputs[0].name}))
    return needed <= {*machine.pose_names, *machine.parameter_names}


def joint_curves(family: Family) -> tuple[str, ...]:
    """List the joint coordinates, of every stage in its own frame, of a machine's points in the machine's frame."""
    if isinstance(family, Machine):
        return tuple(f"{m.name}.{point}_{axis}" for m in family.members for point in m.points for axis in AXES)
    return tuple(f"{name}{s.tail}" for s in family.stages for at in s.family.points.values() for name in at if name)
