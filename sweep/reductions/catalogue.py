"""What can be asked of a design: the names of design outputs of any family, their units and definitions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from sweep.effects import elsewhere, offered
from sweep.errors import InputError, nearest
from sweep.families.base import Accuracy, Family, Output
from sweep.families.capabilities import Assembly
from sweep.families.chain import Chain
from sweep.families.domain import Interval, Turn
from sweep.families.members import Machine, Member
from sweep.quantities.names import parts, without_minus
from sweep.quantities.reduction import Mode, prefixes, reduction_of, split
from sweep.reductions.box import NAMES as BOXES
from sweep.reductions.box import box, boxes
from sweep.reductions.dimensions import sizes
from sweep.reductions.events import event_names
from sweep.reductions.extrema import Request
from sweep.reductions.size import SIZE, lengths
from sweep.reductions.steps import applying_step, certified_names, own_steps, place_names

MARGIN_TEXTS = {
    "rotatable": ("1", "whether the links reach over the whole turn"),
    "margin": ("1", "smallest cos^2(pressure angle) over one turn; negative if the crank does not turn fully"),
    "max_pressure_angle": ("rad", "largest pressure angle over one turn"),
    "least_transmission_angle": ("rad", "least transmission angle over one turn: 90 degrees less the pressure angle"),
}
BOTH_EXTREMA: tuple[Mode, ...] = (1, -1)
PLACES = ("phi_ext", "phi_fold", "phi0", "stroke_ratio")

STAY = Output("window_angle", "rad", "crank angle over which the position lies in the window of the stroke: its dwell")


@dataclass(frozen=True)
class Quantity:
    """A design output and what it is made of where no own route of the family gives it.

    Parameters
    ----------
    output : name, unit, definition
    route : the general route that computes it
    kind : what is taken: "margin", "swing", "max_abs" ...
    of : the pose output that it is taken of: of a reduction, or the position of the limits
    stage : the number of the stage, for margins and limit positions of a chain
    modes : the extrema of ``of`` that it is made of
    locates : whether it is, or needs, a value of the domain's variable
    """

    output: Output
    route: Literal["margin", "limits", "reduction", "mean", "event"]
    kind: str
    of: str = ""
    stage: str = ""
    modes: tuple[Mode, ...] = BOTH_EXTREMA
    locates: bool = False

    def requests(self, family: Family, windowed: bool) -> tuple[Request, ...]:
        """Return the extrema it is made of; a window concerns deviations across a line only."""
        inside = windowed and family.pose_output[self.of].windowed
        return tuple(Request(self.of, mode, inside, self.locates) for mode in self.modes)


def check_certifiable(family: Family, wanted: Sequence[str], accuracy: Accuracy, windowed: bool = False) -> None:
    """Refuse a proof for what has none.

    Exact outputs need no proof; limit positions, margins and means are no maxima that a search could miss a peak of.
    Where ``accuracy.proven`` names outputs, it is they that must have one.  With ``windowed`` some outputs count in a
    part of the stroke only; what is proven is the whole turn.

    Raises
    ------
    InputError
        for an unknown name, if an extremum is wanted that is searched for on poses, or if no wanted maximum can be
        proven; the message names those that can.
    """
    names = certified_names(family)
    places = place_names(family)
    known = ", ".join(name for name in names if name not in places) or "none"
    allowed = f"a proof of the maxima that have one; of {family.name}: {known}"
    for name in accuracy.proven:
        if name not in names or name not in wanted:
            raise InputError(
                "certify", name, f"{allowed}, as far as they are wanted", f"design outputs of {family.name}"
            )
    for name in accuracy.proven or wanted:
        output(family, name)  # unknown names end here
        found = quantity(family, name)
        if found is None or found.route != "reduction":
            continue
        cut = windowed and family.pose_output[found.of].windowed
        if cut or applying_step(family, name, accuracy) is None:
            why = f"{name} in a window" if cut else name
            raise InputError(
                "certify", True, f"{allowed}; not of {why}: name those to prove", f"design outputs of {family.name}"
            )
    if not set(names) & set(wanted):
        raise InputError("certify", True, f"{allowed}; none of them is wanted", f"design outputs of {family.name}")


def quantity(family: Family, name: str) -> Quantity | None:
    """Return what a name stands for where it is computed from poses alone; None where it stands for nothing."""
    if isinstance(family, Machine):
        member = family.split(name)
        if member is not None:
            return _of_member(member[0], quantity(member[0].family, member[1])) or _of_point(family, *member)
        return _margin(family, name) or _event(family, name) or _reduction(family, name)
    if name == STAY.name and isinstance(family.domain, Turn):
        return Quantity(STAY, "limits", STAY.name, family.position)
    return _margin(family, name) or _limit(family, name) or _event(family, name) or _reduction(family, name)


def _event(family: Family, name: str) -> Quantity | None:
    for event in family.events:
        place, count = event_names(family, event)
        of = family.pose_output[event.of]
        if name == place:
            found = Output(name, family.domain.unit, f"{family.domain.text} at which {event.text}", of.equation)
            return Quantity(found, "event", "event", event.of, modes=(), locates=True)
        if name == count:
            found = Output(name, "1", f"how often {event.text}", of.equation, jumps=True)
            return Quantity(found, "event", "count", event.of, modes=())
    return None


def _of_member(member: Member, found: Quantity | None) -> Quantity | None:
    """Return a member's quantity as one of the machine."""
    if found is None:
        return None
    of = found.of and f"{member.name}.{found.of}"
    return replace(found, output=_dotted(member, found.output), of=of, stage=f"{member.name}.{found.stage}")


def _of_point(machine: Machine, member: Member, own: str) -> Quantity | None:
    """Return a reduction of a coordinate in the machine's frame, which the member's family does not know."""
    for reduction, rest in split(own, machine.domain):
        pose = machine.pose_output.get(f"{member.name}.{rest}")
        if pose is not None:
            found = reduction.output(pose, machine.domain)
            route: Literal["reduction", "mean"] = "reduction" if reduction.modes else "mean"
            named = replace(found, name=f"{member.name}.{own}")
            return Quantity(named, route, reduction.kind, pose.name, "", reduction.modes, reduction.place)
    return None


def _dotted(member: Member, found: Output) -> Output:
    return replace(found, name=f"{member.name}.{found.name}", text=f"{member.name}: {found.text}")


def output(family: Family, name: str) -> Output:
    """Return the unit and definition of a design output.

    Raises
    ------
    InputError
        if the family has no such output; the message gives the nearest name.
    """
    of = without_minus(name)
    if of:
        found = output(family, of)
        return replace(found, name=name, text=f"negative of {of}: {found.text}")
    if isinstance(family, Machine):
        member = family.split(name)
        if member is not None:
            point = _of_point(family, *member)
            return point.output if point else _dotted(member[0], output(member[0].family, member[1]))
        timing = next((t for t in family.timings if t.name == name), None)
        if timing is not None:
            return timing.output
    for _, found, stage in own_steps(family, name):
        return found.of_stage(stage.number) if stage else found
    extent = box(family, name)
    if extent is not None:
        return extent.output
    asked = quantity(family, name)
    if asked is None:
        raise InputError("output", name, _known(family, name), f"design outputs of {family.name}")
    return asked.output


def _known(family: Family, name: str) -> str:
    """Return words for an unknown name: what there is, and the nearest."""
    names = output_names(family)
    grammar = prefixes(family.domain)
    special = ", ".join(n for n in names if not n.startswith(grammar))
    words = f"{', '.join(f'{prefix}x' for prefix in grammar)} of a pose output x, or one of {special}"
    of_effects = [o.name for o in offered(family)]
    near = nearest(name, [*names, *of_effects, *(f"{prefix}{x}" for x in of_effects for prefix in grammar)])
    if name in family.pose_names:
        near = f"; {name} is one of a single pose, ask `evaluate`"
    if name in BOXES and isinstance(family, Chain):
        near = (
            f"; {name} is one of a stage, as {name}1: the frames of several stages stand to each other in no known way"
        )
        near += ", of a machine's members they do"
    if of_effects:
        words += ", and those of effects (sweep effects)"
    return words + (elsewhere(family, name) or near)


def output_names(family: Family) -> tuple[str, ...]:
    """Return all design outputs worth listing:
    the family's own, margins, limit positions, reductions of every pose output.
    """
    if isinstance(family, Machine):
        dotted = [f"{m.name}.{name}" for m in family.members for name in output_names(m.family)]
        own = [o.name for relation in family.relations for o in relation.outputs]
        reductions = [f"{prefix}{name}" for name in own for prefix in prefixes(family.domain)]
        events = [name for event in family.events for name in event_names(family, event)]
        whole = [name for name in (*sizes(family), *boxes(family)) if "." not in name]
        return (*dotted, *MARGIN_TEXTS, *whole, *(t.name for t in family.timings), *events, *reductions)
    names = [o.name for step in family.steps for o in step.provides]
    assemblies = family.every(Assembly)
    if assemblies:
        names += MARGIN_TEXTS
    if isinstance(family, Chain):
        names += [f"{o.name}1" for step in family.stages[0].family.steps for o in step.provides]
        names += [f"{base}{loop.stage}" for loop in assemblies for base in MARGIN_TEXTS]
    names += [name for position, stage in family.positions.items() for name in limit_names(family, position, stage)]
    names += [name for event in family.events for name in event_names(family, event)]
    names += [STAY.name] if isinstance(family.domain, Turn) else []
    names += [SIZE.name] if lengths(family) else []
    names += [*sizes(family), *boxes(family)]
    names += [f"{prefix}{pose}" for pose in family.pose_names for prefix in prefixes(family.domain)]
    return tuple(dict.fromkeys(names))


def limit_names(family: Family, position: str, stage: str) -> dict[str, str]:
    """Return names made of the two limit positions of a follower, and what each is."""
    pose = family.pose_output.get(position)
    if pose is None:
        return {}
    amplitude = "swing" if pose.wraps else "stroke"
    kinds: tuple[str, ...] = ("ext", "fold", amplitude, *PLACES)
    if not isinstance(family.domain, Turn):
        kinds = (amplitude,)  # an interval has no extended position, and no angle between the limits
    return {f"{pose.base}_{kind}{stage}" if kind in ("ext", "fold") else f"{kind}{stage}": kind for kind in kinds}


def _margin(family: Family, name: str) -> Quantity | None:
    _, base, stage = parts(name)
    loops = family.every(Assembly)
    if base not in MARGIN_TEXTS or not loops or (stage and stage not in [loop.stage for loop in loops]):
        return None
    unit, text = MARGIN_TEXTS[base]
    if stage:
        text = f"stage {stage}: {text}"
    elif len(loops) > 1:
        text = f"{text}; of the stage where it is worst"
    return Quantity(Output(name, unit, text), "margin", base, stage=stage)


def _limit(family: Family, name: str) -> Quantity | None:
    for position, stage in family.positions.items():
        kind = limit_names(family, position, stage).get(name)
        if kind is None:
            continue
        unit = family.pose_output[position].unit
        over = f"the whole range of {family.domain.name}" if isinstance(family.domain, Interval) else "one turn"
        units = {"phi_ext": "rad", "phi_fold": "rad", "phi0": "rad", "stroke_ratio": "1"}
        first, second = limit_order(family, position)
        texts = {
            "ext": f"{position} in the extended position: the {first}",
            "fold": f"{position} in the folded position: the {second}",
            "phi_ext": f"crank angle of the extended position, where {position} is {first}",
            "phi_fold": f"crank angle of the folded position, where {position} is {second}",
            "phi0": "crank angle from the extended to the folded position, in [0, 2 pi)",
            "stroke_ratio": "phi0/(2 pi - phi0)",
            "swing": f"{position} at the folded minus the extended position, where it is {first}",
            "stroke": f"largest minus smallest {position} over {over}",
        }
        found = Output(name, units.get(kind, unit), texts[kind])
        return Quantity(found, "limits", kind, position, stage, locates=kind in PLACES)
    return None


def limit_order(family: Family, position: str) -> tuple[str, str]:
    """Return how the extended and the folded position are told apart, in words."""
    sign = family.outward_sign(position)
    if sign:
        return f"largest (smallest if {sign} = -1)", f"smallest (largest if {sign} = -1)"
    return "largest", "smallest"


def _reduction(family: Family, name: str) -> Quantity | None:
    found = reduction_of(family, name)
    if found is None:
        return None
    reduction, pose = found
    if family.domain.kind not in reduction.domains:
        raise InputError(
            "output", name, f"no {reduction.name} over an {family.domain.kind} of the {family.domain.text}",
            f"design outputs of {family.name}",
        )  # fmt: skip
    route: Literal["reduction", "mean"] = "reduction" if reduction.modes else "mean"
    of_turn = reduction.output(pose, family.domain)
    return Quantity(of_turn, route, reduction.kind, pose.name, pose.stage, reduction.modes, reduction.place)
