"""Meaning of the names of design outputs, decided here only: ``resolve`` returns a typed quantity."""

from __future__ import annotations

from dataclasses import replace

from sweep.effects import elsewhere, extended, offered
from sweep.effects.wanted import names_of_effects
from sweep.errors import InputError, listed, nearest
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.base import Event, Family, Interval, Output, Turn
from sweep.families.capabilities import Assembly
from sweep.families.chain import Chain, own_outputs
from sweep.families.machines.machine import Machine
from sweep.families.machines.relations import EventValue, Timing
from sweep.families.names import parts, without_minus
from sweep.families.parts import Member
from sweep.families.reduction import prefixes, reduction_of, split
from sweep.quantities import kinds
from sweep.quantities.box import NAMES as BOXES
from sweep.quantities.box import boxes
from sweep.quantities.dimensions import SIZE, lengths, sizes

MARGIN_TEXTS = {
    "rotatable": ("1", "whether the links reach over the whole turn"),
    "margin": ("1", "cos^2 of the worst pressure angle over one turn; below 0 the linkage jams"),
    "max_pressure_angle": ("rad", "largest pressure angle over one turn"),
    "least_transmission_angle": ("rad", "least transmission angle over one turn: 90 degrees less the pressure angle"),
}

STAY = Output("window_angle", "rad", "crank angle over which the position lies in the window of the stroke: its dwell")


def resolve(family: Family, name: str) -> kinds.Quantity:
    """Resolve the name of a design output of a family, a chain or a machine to a typed quantity.

    Raises
    ------
    InputError
        if there is no such output; the message gives the nearest name.
    """
    known: dict[str, kinds.Quantity] = family.derived.setdefault(resolve, {})  # a sweep asks the same for every chunk
    if name not in known:
        found = find(family, name)
        if found is None:
            raise _unknown(family, name)
        known[name] = found
    return known[name]


def output(family: Family, name: str) -> Output:
    """Name, unit and definition of a design output; raises as `resolve` for an unknown name."""
    return resolve(family, name).output


def find(family: Family, name: str) -> kinds.Quantity | None:
    """Resolve a name as `resolve` does; None for an unknown name."""
    of = without_minus(name)
    if of:
        inner = find(family, of)
        if inner is None:
            return None
        text = f"negative of {of}: {inner.output.text}"
        return kinds.Negative(replace(inner.output, name=name, text=text), inner)
    if isinstance(family, Machine):
        found = _of_machine(family, name)
    else:
        stays = name == STAY.name and isinstance(family.domain, Turn)
        found = kinds.WindowAngle(STAY, of=family.position) if stays else _margin(family, name)
        found = found or _limit(family, name) or _event(family, name) or _reduction(family, name)
        found = found or _from_dimensions(family, name)
    own = _own(family, name)
    if own is None or found is None:
        return found or own
    return replace(found, output=own.output)  # the family's own definition takes precedence


def _own(family: Family, name: str) -> kinds.OwnOutput | None:
    """Find the output among the family's own steps, or those of a chain's first stage, which turns alone."""
    found = ((o, stage) for _, o, stage in own_outputs(family, family.steps) if o.name == name)
    return next((kinds.OwnOutput(o, of_part=bool(stage.number)) for o, stage in found), None)


def _from_dimensions(family: Family, name: str) -> kinds.Quantity | None:
    box = boxes(family).get(name)
    if box is not None:
        return kinds.Extent(box.output, box)
    size = sizes(family).get(name)
    if size is not None:
        return kinds.Dimension(size.output, size)
    if name == SIZE.name and lengths(family):
        return kinds.LargestLength(SIZE, lengths(family))
    return None


def _of_machine(machine: Machine, name: str) -> kinds.Quantity | None:
    member = machine.split(name)
    if member is not None:
        return _of_member(machine, name, *member)
    timing = next((t for t in machine.timings if t.name == name), None)
    if timing is not None:
        return _timing(machine, timing)
    # A machine has no limit positions of its own, only its members have.
    found = _margin(machine, name) or _event(machine, name) or _reduction(machine, name)
    if isinstance(found, kinds.Reduced) and machine.split(found.of) is not None:
        part, _, pose = found.of.partition(".")
        right = f"{part}.{name.removesuffix(found.of)}{pose}"
        raise InputError(
            "output", name, f"{right}: a member's outputs begin with its name", "design outputs of machine"
        )
    return found or _from_dimensions(machine, name)


def _timing(machine: Machine, timing: Timing | EventValue) -> kinds.TimingOf:
    """Resolve a timing; raise unless its places are crank angles of extrema or events."""
    begins = f"{machine.domain.name}_"
    others = [t.name for t in machine.timings]
    for place in timing.places:
        angle = place not in others and place.rpartition(".")[2].startswith(begins)
        if not angle or find(machine, place) is None:
            known = [name for name in output_names(machine) if name.rpartition(".")[2].startswith(begins)]
            kind = "value" if isinstance(timing, EventValue) else "timing"
            allowed = f"a crank angle that is a design output, {begins}...{nearest(place, known)}"
            raise InputError(kind, place, allowed, f"machine.relations.{timing.name}")
    return kinds.TimingOf(timing.output, timing)


def check_timings(machine: Family) -> None:
    """Raise if any timing of the machine refers to something else than crank angles."""
    for timing in machine.timings if isinstance(machine, Machine) else ():
        resolve(extended(machine, [timing.name]), timing.name)


def _of_member(machine: Machine, name: str, member: Member, own: str) -> kinds.Quantity | None:
    """Resolve a dotted name in the machine's terms."""
    point, found = _of_point(machine, member, own), find(member.family, own)
    if found is None:
        return point
    named = replace(found.output, name=name, text=f"{member.name}: {found.output.text}")
    named = point.output if point else named
    if kinds.group_of(member.family, found) is not None:
        placed = replace(found, of=found.of and f"{member.name}.{found.of}", stage=f"{member.name}.{found.stage}")
        cycles = machine.cycles(member)
        if isinstance(placed, kinds.LimitPosition) and placed.kind in ("phi0", "stroke_ratio") and cycles > 1:
            placed = replace(placed, cycles=cycles)
            named = replace(named, text=f"{named.text}, with 2 pi/{cycles}, a turn of its crank, for 2 pi")
        return replace(placed, output=named)
    match found:
        case kinds.Extent() | kinds.Dimension():
            whole = _from_dimensions(machine, name)
            return replace(whole, output=named) if whole is not None else kinds.OwnOutput(named, of_part=True)
        case kinds.LargestLength(lengths=longest):
            return kinds.LargestLength(named, tuple(f"{member.name}.{length}" for length in longest))
        case _:
            return point or kinds.OwnOutput(named, of_part=True)


def _of_point(machine: Machine, member: Member, own: str) -> kinds.Reduced | None:
    """Resolve a reduction of a machine's pose output, such as a coordinate in its frame, under a member's name."""
    for reduction, rest in split(own, machine.domain):
        pose = machine.pose_output.get(f"{member.name}.{rest}")
        if pose is not None:
            named = replace(reduction.output(pose, machine.domain), name=f"{member.name}.{own}")
            return kinds.Reduced(named, reduction, of=pose.name)
    return None


def event_names(family: Family, event: Event) -> tuple[str, str]:
    """Names of an event's two design outputs: place of the first occurrence, and count."""
    return f"{family.domain.name}_{event.name}", f"count_{event.name}"


def _event(family: Family, name: str) -> kinds.EventPlace | kinds.EventCount | None:
    for event in family.events:
        place, count = event_names(family, event)
        of = family.pose_output[event.of]
        if name == place:
            text = f"{family.domain.text} at which {event.text}"
            return kinds.EventPlace(Output(name, family.domain.unit, text, of.equation), event, of=event.of)
        if name == count:
            text = f"how often {event.text}"
            return kinds.EventCount(Output(name, "1", text, of.equation, jumps=True), event, of=event.of)
    return None


def limit_names(family: Family, position: str, stage: str) -> dict[str, str]:
    """Names of the quantities of a follower's two limit positions, each with its kind."""
    pose = family.pose_output.get(position)
    if pose is None:
        return {}
    amplitude = "swing" if pose.wraps else "stroke"
    names: tuple[str, ...] = ("ext", "fold", amplitude, *kinds.PLACES)
    if not isinstance(family.domain, Turn):
        names = (amplitude,)  # an interval has no extended position, and no angle between the limits
    return {f"{pose.base}_{kind}{stage}" if kind in ("ext", "fold") else f"{kind}{stage}": kind for kind in names}


def _margin(family: Family, name: str) -> kinds.Margin | None:
    _, base, stage = parts(name)
    loops = family.every(Assembly)
    if base not in MARGIN_TEXTS or not loops or (stage and stage not in [loop.stage for loop in loops]):
        return None
    unit, text = MARGIN_TEXTS[base]
    if stage:
        text = f"stage {stage}: {text}"
    elif len(loops) > 1:
        text = f"{text}; of the stage where it is worst"
    elif isinstance(family, Chain):
        text = f"{text}; of stage {loops[0].stage}, the only one with a coupler"
    return kinds.Margin(Output(name, unit, text), base, stage=stage)


def _limit(family: Family, name: str) -> kinds.LimitPosition | None:
    # At constant speed the times of both strokes have the ratio of the angles: two names for one ratio.
    plain = name.replace("time_ratio", "stroke_ratio")
    for position, stage in family.positions.items():
        kind = limit_names(family, position, stage).get(plain)
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
        return kinds.LimitPosition(found, kind, of=position, stage=stage)
    return None


def limit_order(family: Family, position: str) -> tuple[str, str]:
    """Words for the extended and the folded position: which one has the largest and which the smallest value."""
    sign = family.outward_sign(position)
    if sign:
        return f"largest (smallest if {sign} = -1)", f"smallest (largest if {sign} = -1)"
    return "largest", "smallest"


def _reduction(family: Family, name: str) -> kinds.Reduced | None:
    found = reduction_of(family, name)
    if found is None:
        return None
    reduction, pose = found
    if family.domain.kind not in reduction.domains:
        raise InputError(
            "output", name, f"no {reduction.name} over an {family.domain.kind} of the {family.domain.text}",
            f"design outputs of {family.name}",
        )  # fmt: skip
    return kinds.Reduced(reduction.output(pose, family.domain), reduction, of=pose.name, stage=pose.stage)


def output_names(family: Family) -> tuple[str, ...]:
    """List design outputs: the family's own, margins, limit positions, reductions of every pose output."""
    if isinstance(family, Machine):
        dotted = [f"{m.name}.{name}" for m in family.members for name in output_names(m.family)]
        own = [o.name for relation in family.relations for o in relation.outputs]
        reductions = [f"{prefix}{name}" for name in own for prefix in prefixes(family.domain)]
        events = [name for event in family.events for name in event_names(family, event)]
        whole = [name for name in (*sizes(family), *boxes(family)) if "." not in name]
        made = [o.name for step in family.steps for o in step.provides]
        return (*dotted, *MARGIN_TEXTS, *whole, *made, *(t.name for t in family.timings), *events, *reductions)
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


def _unknown(family: Family, name: str) -> InputError:
    """Error for an unknown name; a dotted name is checked by the member's family."""
    of = without_minus(name)
    if of:
        return _unknown(family, of)
    member = family.split(name) if isinstance(family, Machine) else None
    if member is not None:
        return _unknown(member[0].family, member[1])
    return InputError("output", name, _known(family, name), f"design outputs of {family.name}")


def _known(family: Family, name: str) -> str:
    """List the known names for a message about an unknown one, and suggest the nearest."""
    names = output_names(family)
    grammar = prefixes(family.domain)
    special = listed(n for n in names if not n.startswith(grammar))
    words = f"{', '.join(f'{prefix}x' for prefix in grammar)} of a pose output x, or one of {special}"
    of_effects = [o.name for o in offered(family)]
    near = nearest(name, [*names, *of_effects, *(f"{prefix}{x}" for x in of_effects for prefix in grammar)])
    if effects := [effect for effect in names_of_effects(family) if effect.endswith(f"_{name}")]:
        near = f"; {name} is the effect {min(effects, key=len)} here"
    if name in family.pose_names:
        extremes = ", ".join(f"{prefix}{name}" for prefix in grammar if not prefix.startswith(f"{family.domain.name}_"))
        near = f"; {name} is an output of a single pose: ask `evaluate`, or for one of {extremes}"
    if name in family.parameter_names:
        near = f"; {name} is a parameter: a dataset has it, and keep= repeats it in a result"
    if name in BOXES and isinstance(family, Chain):
        near = f"; {name} exists for a stage, as {name}1, and for a machine"
    if of_effects:
        words += ", and those of effects (sweep effects)"
    return words + (elsewhere(family, name) or _of_families(name) + near)


def _of_families(name: str) -> str:
    """Say which families have a design output of their own that another one does not know."""
    others = [
        other for other in map(find_family, NAMES) if any(o.name == name for step in other.steps for o in step.provides)
        or any(name in limit_names(other, position, stage) for position, stage in other.positions.items())
    ]  # fmt: skip
    return f"; {name} is an output of {listed(other.name for other in others)}" if others else ""
