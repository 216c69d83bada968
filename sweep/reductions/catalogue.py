"""What can be asked of a design: the names of design outputs of any family, their units and definitions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from sweep.effects import elsewhere, offered
from sweep.errors import InputError, nearest
from sweep.families.base import Accuracy, Family, Output, Step
from sweep.families.chain import Chain, Stage
from sweep.reductions.extrema import Mode, Request
from sweep.reductions.margins import margin_suffixes
from sweep.reductions.sampling import is_angle_of_follower
from sweep.reductions.size import SIZE, lengths, size_step
from sweep.reductions.travel import certified_travel

REDUCTIONS = {
    "max_abs": "largest magnitude over one turn of",
    "phi_max_abs": "crank angle of the largest magnitude of",
    "max": "largest value over one turn of",
    "min": "smallest value over one turn of",
    "range": "largest minus smallest value over one turn of",
    "rms": "root mean square over one turn of",
}
_MODES: dict[str, tuple[Mode, ...]] = {
    "max_abs": (0,),
    "phi_max_abs": (0,),
    "max": (1,),
    "min": (-1,),
    "range": (1, -1),
    "rms": (),
}
MARGIN_TEXTS = {
    "rotatable": ("1", "whether the links reach over the whole turn"),
    "margin": ("1", "smallest cos^2(pressure angle) over one turn; negative if the crank does not turn fully"),
    "max_pressure_angle": ("rad", "largest pressure angle over one turn"),
}

STAY = Output("window_angle", "rad", "crank angle over which the position lies in the window of the stroke: its dwell")


@dataclass(frozen=True)
class Way:
    """One design output and the general route to it."""

    output: Output
    kind: Literal["margin", "limits", "reduction", "mean"]
    base: str  # the name without what it is taken of: "margin", "swing", "max_abs" ...
    of: str = ""  # pose output of a reduction, or position of the limits
    suffix: str = ""  # stage number, for margins and limits

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Which extrema of the pose output it is made of."""
        return _MODES.get(self.base, (1, -1))

    @property
    def locates(self) -> bool:
        """Whether a crank angle is wanted."""
        return self.base in ("phi_max_abs", "phi_ext", "phi_fold", "phi0", "stroke_ratio")

    def requests(self, windowed: bool) -> tuple[Request, ...]:
        """The extrema it is made of; a window concerns the deviation across a line only."""
        return tuple(Request(self.of, mode, windowed and is_deviation(self.of), self.locates) for mode in self.modes)


def is_deviation(pose: str) -> bool:
    """Whether a window of the stroke limits what counts of this pose output."""
    return re.fullmatch(r"dev\d*", pose) is not None


def is_position(family: Family, pose: str) -> bool:
    """Whether the pose output is the position of a follower."""
    return pose == family.position or is_angle_of_follower(pose) or re.fullmatch(r"s\d+", pose) is not None


def steps_of(family: Family) -> tuple[Step, ...]:
    """The family's own routes, and those that are made for it here."""
    made = (size_step(family), certified_travel(family))
    return (*family.steps, *(step for step in made if step is not None))


def own_steps(family: Family, name: str) -> list[tuple[Step, Output, Stage | None]]:
    """The family's own routes to an output, and those of a chain's first stage, which turns as if it were alone."""
    found: list[tuple[Step, Output, Stage | None]] = [
        (step, o, None) for step in steps_of(family) for o in step.provides if o.name == name
    ]
    if isinstance(family, Chain) and name.endswith("1"):
        stage = family.stages[0]
        found += [
            (step, o, stage) for step in stage.family.steps for o in step.provides if o.name == name.removesuffix("1")
        ]
    return found


def applying_step(family: Family, name: str, accuracy: Accuracy) -> tuple[Step, Stage | None] | None:
    """The cheapest own route to an output that serves this accuracy."""
    able = [(step, stage) for step, _, stage in own_steps(family, name) if step.applies(accuracy.of(name))]
    return min(able, key=lambda pair: pair[0].cost(accuracy), default=None)


def certified_names(family: Family) -> tuple[str, ...]:
    """Outputs whose maxima can be proven, those of a chain's first stage included."""
    names = [o.name for step in steps_of(family) if step.certifies for o in step.provides]
    if isinstance(family, Chain):
        names += [f"{o.name}1" for step in family.stages[0].family.steps if step.certifies for o in step.provides]
    return tuple(names)


def proofs(certify: bool | Sequence[str]) -> tuple[bool, tuple[str, ...]]:
    """What ``certify=`` asks for, as ``certify`` and ``proven`` of `Accuracy`."""
    if isinstance(certify, bool):
        return certify, ()
    names = (certify,) if isinstance(certify, str) else tuple(dict.fromkeys(certify))
    return bool(names), names


def is_proven(family: Family, name: str, accuracy: Accuracy) -> bool:
    """Whether the error of an output is a proven bound."""
    return accuracy.of(name).certify and name in certified_names(family) and not name.startswith("phi_")


def check_certifiable(family: Family, wanted: Sequence[str], accuracy: Accuracy) -> None:
    """Refuse a proof for what has none.

    Exact outputs need no proof; limit positions, margins and means are no maxima that a search could miss a peak of.
    Where ``accuracy.proven`` names outputs, it is they that must have one.

    Raises
    ------
    InputError
        for an unknown name, if an extremum is wanted that is searched for on poses, or if no wanted maximum can be
        proven; the message names those that can.
    """
    names = certified_names(family)
    known = ", ".join(name for name in names if not name.startswith("phi_")) or "none"
    allowed = f"a proof of the maxima that have one; of {family.name}: {known}"
    for name in accuracy.proven:
        if name not in names or name not in wanted:
            raise InputError(
                "certify", name, f"{allowed}, as far as they are wanted", f"design outputs of {family.name}"
            )
    for name in accuracy.proven or wanted:
        output(family, name)  # unknown names end here
        way = general_way(family, name)
        if applying_step(family, name, accuracy) is None and way is not None and way.kind == "reduction":
            raise InputError(
                "certify", True, f"{allowed}; not of {name}: name those to prove", f"design outputs of {family.name}"
            )
    if not set(names) & set(wanted):
        raise InputError("certify", True, f"{allowed}; none of them is wanted", f"design outputs of {family.name}")


def general_way(family: Family, name: str) -> Way | None:
    """How the name is computed from poses alone, or None if it names nothing."""
    if name == STAY.name:
        return Way(STAY, "limits", STAY.name, family.position)
    return _margin_way(family, name) or _limit_way(family, name) or _reduction_way(family, name)


def output(family: Family, name: str) -> Output:
    """Unit and definition of a design output.

    Raises
    ------
    InputError
        if the family has no such output; the message gives the nearest name.
    """
    for _, found, stage in own_steps(family, name):
        return replace(found, name=name, text=f"stage 1: {found.text}") if stage else found
    way = general_way(family, name)
    if way is None:
        names = output_names(family)
        known = "max_abs_x, phi_max_abs_x, max_x, min_x, range_x, rms_x of a pose output x, or one of "
        special = ", ".join(n for n in names if not n.startswith(tuple(f"{r}_" for r in REDUCTIONS)))
        of_effects = [o.name for o in offered(family)]
        near = nearest(name, [*names, *of_effects, *(f"{base}_{x}" for x in of_effects for base in REDUCTIONS)])
        if name in family.pose_names:
            near = f"; {name} is one of a single pose, ask `evaluate`"
        known = f"{known}{special}, and those of effects (sweep effects)" if of_effects else f"{known}{special}"
        near = elsewhere(family, name) or near
        raise InputError("output", name, f"{known}{near}", f"design outputs of {family.name}")
    return way.output


def output_names(family: Family) -> tuple[str, ...]:
    """All design outputs worth listing: the family's own, margins, limit positions, reductions of every pose output."""
    names = [o.name for step in family.steps for o in step.provides]
    suffixes = margin_suffixes(family)
    if suffixes:
        names += MARGIN_TEXTS
    if isinstance(family, Chain):
        names += [f"{o.name}1" for step in family.stages[0].family.steps for o in step.provides]
        names += [f"{base}{suffix}" for suffix in suffixes for base in MARGIN_TEXTS]
    names += [*limit_names(family, family.position, ""), STAY.name]
    names += [SIZE.name] if lengths(family) else []
    if isinstance(family, Chain):
        for stage in family.stages:
            names += limit_names(family, f"{stage.family.position}{stage.number}", str(stage.number))
    names += [f"{base}_{pose}" for pose in family.pose_names for base in REDUCTIONS]
    return tuple(dict.fromkeys(names))


def limit_names(family: Family, position: str, suffix: str) -> list[str]:
    """Names made of the two limit positions of a follower."""
    if position not in family.pose_names:
        return []
    letter = position.removesuffix(suffix) if suffix else position
    amplitude = "swing" if letter == "psi" else "stroke"
    bases = (f"{letter}_ext", f"{letter}_fold", amplitude, "phi_ext", "phi_fold", "phi0", "stroke_ratio")
    return [f"{base}{suffix}" for base in bases]


def _margin_way(family: Family, name: str) -> Way | None:
    match = re.fullmatch(r"(rotatable|margin|max_pressure_angle)(\d*)", name)
    if match is None:
        return None
    base, suffix = match.groups()
    suffixes = margin_suffixes(family)
    if not suffixes or (suffix and suffix not in suffixes):
        return None
    unit, text = MARGIN_TEXTS[base]
    if suffix:
        text = f"stage {suffix}: {text}"
    elif len(suffixes) > 1:
        text = f"{text}; of all stages the weakest"
    return Way(Output(name, unit, text), "margin", base, suffix=suffix)


def _limit_way(family: Family, name: str) -> Way | None:
    stages = [(family.position, "")]
    if isinstance(family, Chain):
        stages += [(f"{s.family.position}{s.number}", str(s.number)) for s in family.stages]
    for position, suffix in stages:
        if name not in limit_names(family, position, suffix):
            continue
        base = name.removesuffix(suffix) if suffix else name
        unit = next(o.unit for o in family.pose_outputs if o.name == position)
        units = {"phi_ext": "rad", "phi_fold": "rad", "phi0": "rad", "stroke_ratio": "1"}
        first, second = limit_order(family, suffix)
        texts = {
            "phi_ext": f"crank angle of the extended position, where {position} is {first}",
            "phi_fold": f"crank angle of the folded position, where {position} is {second}",
            "phi0": "crank angle from the extended to the folded position, in [0, 2 pi)",
            "stroke_ratio": "phi0/(2 pi - phi0)",
            "swing": f"{position} at the folded minus the extended position, where it is {first}",
            "stroke": f"largest minus smallest {position} over one turn",
        }
        where = f"extended position: the {first}" if base.endswith("_ext") else f"folded position: the {second}"
        text = texts.get(base, f"{position} in the {where}")
        return Way(Output(name, units.get(base, unit), text), "limits", base, position, suffix)
    return None


def limit_order(family: Family, suffix: str) -> tuple[str, str]:
    """How the extended and the folded position are told apart, in words."""
    names = family.parameter_names
    branch = f"branch{suffix}" if f"branch{suffix}" in names else f"branch{_last(family)}"
    if branch in names:
        return f"largest (smallest if {branch} = -1)", f"smallest (largest if {branch} = -1)"
    return "largest", "smallest"


def _last(family: Family) -> str:
    return str(len(family.stages)) if isinstance(family, Chain) else ""


def _reduction_way(family: Family, name: str) -> Way | None:
    for base, text in REDUCTIONS.items():
        if not name.startswith(f"{base}_"):
            continue
        of = name.removeprefix(f"{base}_")
        pose = next((o for o in family.pose_outputs if o.name == of), None)
        if pose is not None:
            unit = "rad" if base == "phi_max_abs" else pose.unit
            of_turn = Output(name, unit, f"{text} {pose.name}: {pose.text}", pose.equation, pose.jumps)
            return Way(of_turn, "mean" if base == "rms" else "reduction", base, pose.name)
    return None
