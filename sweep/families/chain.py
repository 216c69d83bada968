"""Several families in series as one `Family`: numbered parameters, composed derivatives, outputs of every stage."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from kernels.chains.links import chain_rule, input_angle
from kernels.status import OK
from kernels.types import Array
from sweep.errors import InputError
from sweep.families.base import Angles, Columns, Family, Output, Parameter, Stage, Step, Turn
from sweep.families.capabilities import Assembly, DesignMap, GuidedPoint, LimitLocus, OutputLink
from sweep.families.curve_features import of_stages, on_part
from sweep.families.frames import Frame, can_be_placed, stage_frames
from sweep.families.names import ends_in_digit
from sweep.families.poses import blocks

BLOCK = 16384  # poses per block: about ten arrays (1.3 MB) stay in the caches; half or four times this is slower


@dataclass(frozen=True, repr=False)
class Chain(Family):
    """A family of stages in series; the output angle of each stage drives the crank of the next."""

    stages: tuple[Stage, ...] = ()

    def frames(self, designs: Array) -> list[Frame]:
        """Return the frames of all stages in that of the first."""
        return stage_frames(self.stages, designs)

    @cached_property
    def positions(self) -> Mapping[str, str]:
        """The last stage's position, then those of all stages under their numbers."""
        return {self.position: ""} | {f"{s.family.position}{s.number}": str(s.number) for s in self.stages}

    def outward_sign(self, position: str) -> str:
        """Return the sign parameter of the stage with this position."""
        stage = self.positions[position]
        own = self.stages[int(stage) - 1].family.outward if stage else ""
        return own and f"{own}{stage}" if stage else self.outward

    @cached_property
    def _precise(self) -> Family:
        """The chain with the most accurate poses its stages have."""
        if self.precise_poses is None:
            return self
        return replace(self, poses=self.precise_poses, stages=_precise(self.stages))


@dataclass
class _Plan:
    """Plan of a call: outputs needed from each stage, and derivatives that are composed by the chain rule."""

    order: int = 0
    needed: list[set[str]] = field(default_factory=list)
    composed: list[list[str]] = field(default_factory=list)  # of the last stage: derivatives 1..k of one output
    source: dict[str, tuple[int, str]] = field(default_factory=dict)  # name -> stage index, own name
    sizes: dict[str, tuple[str, ...]] = field(default_factory=dict)  # magnitudes of composed vectors


def driven_guide(family: Family) -> tuple[Stage, Stage] | None:
    """Return both stages of a chain in which a crank-rocker drives a guided point; None for any other family.

    The crank-rocker is one whose limit positions can be prescribed (`LimitLocus`).
    """
    if len(family.stages) != 2:
        return None
    first, last = family.stages
    if first.family.find(LimitLocus) is None or last.family.find(GuidedPoint) is None:
        return None
    return first, last


def own_outputs(family: Family, steps: Sequence[Step]) -> Iterator[tuple[Step, Output, Stage]]:
    """Yield the outputs of a family's own steps; of a chain also those of its first stage, which turns as if alone."""
    yield from ((step, o, family.whole) for step in steps for o in step.provides)
    if isinstance(family, Chain):
        first = family.stages[0]
        yield from ((step, o.of_stage(first.number), first) for step in first.family.steps for o in step.provides)


def chain(families: tuple[Family, ...]) -> Chain:
    """Make the chain of families, each driven by the previous one.

    Parameters and the stages' own outputs have the stage number as suffix; outputs of the last stage also exist without
    a number, unless they end in a digit; their derivatives are with respect to phi of stage 1.

    Raises
    ------
    InputError
        if a stage other than the last has no output angle (a slider cannot drive a crank), or has several loops.
    """
    place = f"chain {[f.name for f in families]}"
    for number, family in enumerate(families, start=1):
        allowed = ""
        if not isinstance(family.domain, Turn):
            allowed = f"a family over a closed turn; {family.name} is evaluated over {family.domain.text}"
        elif number < len(families) and len(family.every(Assembly)) > 1:
            allowed = f"a family of one loop; {family.name} moves one link by two cranks, so put it last"
        elif number < len(families) and not family.pose_output[family.position].wraps:
            allowed = f"a family with an output angle psi; {family.name} has {family.position}, which drives no crank"
        if allowed:
            raise InputError(f"stage {number}", family.name, allowed, place)
    stages, parameters = _numbered(families)
    last = families[-1]
    outputs = [_with_respect_to_chain(o, last) for o in last.pose_outputs if not ends_in_digit(o.name)]
    for stage in stages:
        outputs += [
            o.of_stage(stage.number)
            for o in stage.family.pose_outputs
            if stage.number == 1 or not _is_rate(o, stage.family)
        ]
    named = {o.name: o for o in outputs}
    own = {f"{name}1": f"{derivative}1" for name, derivative in families[0].derivative_of.items()}
    return Chain(
        name="+".join(f.name for f in families),
        title=" driving ".join(f.title for f in families),
        parameters=parameters,
        position=last.position,
        pose_outputs=tuple(outputs),
        poses=partial(_poses, stages, named, {}),
        derivative_of=dict(last.derivative_of) | own,
        outward=last.outward and f"{last.outward}{len(families)}",
        uses_phi=families[0].uses_phi,
        analytic=all(f.analytic for f in families),
        points={name: at for name, at in last.points.items() if not ends_in_digit(name)},
        capabilities=(
            *(_loop(stage, loop) for stage in stages for loop in stage.family.every(Assembly)),
            *(OutputLink(partial(on_part, stages[-1].designs, link.origin)) for link in last.every(OutputLink)),
            *of_stages(stages),
        ),
        dear={
            f"{name}{s.number}": (f"{what}{s.number}", ns) for s in stages for name, (what, ns) in s.family.dear.items()
        }
        | dict(last.dear),
        example={f"{name}{s.number}": x for s in stages for name, x in s.family.example.items()},
        precise_poses=partial(_poses, _precise(stages), named, {}) if any(f.precise_poses for f in families) else None,
        stages=stages,
    )


def _precise(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    return tuple(replace(stage, family=stage.family.precise()) for stage in stages)


def loop_of_part(loop: Assembly, named: Callable[[str], str], part: DesignMap) -> Assembly:
    """Return the loop of a stage or member as one of the whole: with the names there, and the designs of the part."""
    end = loop.end and (named(loop.end[0]), partial(on_part, part, loop.end[1]))
    scale = partial(on_part, part, loop.scale)
    return Assembly(named(loop.discriminant), named(loop.pressure_angle), scale, named(loop.stage), end)


def _loop(stage: Stage, loop: Assembly) -> Assembly:
    # rates are those of the whole chain, which carry no number: only a last stage names one
    rates = {o.name for o in stage.family.pose_outputs if _is_rate(o, stage.family)}
    return loop_of_part(loop, lambda name: name if name in rates else f"{name}{stage.number}", stage.designs)


def _numbered(families: tuple[Family, ...]) -> tuple[tuple[Stage, ...], tuple[Parameter, ...]]:
    stages: list[Stage] = []
    parameters: list[Parameter] = []
    for number, family in enumerate(families, start=1):
        start = len(parameters)
        parameters += [
            replace(p, name=f"{p.name}{number}", text=f"stage {number}: {p.text}") for p in family.parameters
        ]
        stage = Stage(number, family, slice(start, len(parameters)))
        if number > 1:
            stage = replace(stage, kappa=len(parameters), offset=len(parameters) + 1)
            sense = f"sense of the coupling: phi of stage {number} = kappa{number} * psi of stage {number - 1} + offset"
            angle = f"angle between the crank of stage {number} and the rocker of stage {number - 1}"
            parameters += [
                Parameter(f"kappa{number}", "sign", sense, default=1.0, choices=(-1.0, 1.0)),
                Parameter(f"offset{number}", "angle", angle, default=0.0),
            ]
        stages.append(stage)
    if len(families) > 1 and can_be_placed(families):
        for k, stage in enumerate(stages[1:], start=1):
            stages[k] = replace(stage, shift=len(parameters), turn=len(parameters) + 1)
            n, on = stage.number, f"on the output axis of stage {stage.number - 1}"
            parameters += [
                Parameter(
                    f"shift{n}",
                    "length",
                    f"place of the origin of stage {n} {on}, from z = 0 of it",
                    default=0.0,
                    places=True,
                ),
                Parameter(f"turn{n}", "angle", f"angle of x of stage {n} {on}, from x of that", default=0.0),
            ]
    return tuple(stages), tuple(parameters)


def _is_rate(output: Output, family: Family) -> bool:
    return bool(output.parts) or output.name in family.derivative_of.values()


def _with_respect_to_chain(output: Output, last: Family) -> Output:
    if not _is_rate(output, last):
        return output
    return replace(output, text=f"{output.text}, with respect to phi of stage 1")


def _plan(stages: tuple[Stage, ...], outputs: Mapping[str, Output], wanted: frozenset[str]) -> _Plan:
    last = stages[-1].family
    plan = _Plan(needed=[set() for _ in stages])
    plan.sizes = {name: parts for name in wanted if (parts := outputs[name].parts) and not outputs[name].stage}
    chains: dict[str, list[str]] = {}
    for name in wanted.difference(plan.sizes).union(*plan.sizes.values()):
        output = outputs[name]
        if output.stage:
            plan.source[name] = int(output.stage) - 1, output.own
            continue
        plan.source[name] = len(stages) - 1, name
        derivatives = last.orders(name)
        if derivatives:
            chains[derivatives[0]] = max(chains.get(derivatives[0], []), derivatives, key=len)
    plan.composed = list(chains.values())
    plan.order = max((len(names) for names in plan.composed), default=0)
    for index, own in plan.source.values():
        plan.needed[index].add(own)
    for names in plan.composed:
        plan.needed[-1].update(names)
    deepest = max((index for index, _ in plan.source.values()), default=len(stages) - 1)
    del plan.needed[deepest + 1 :]
    for k, stage in enumerate(stages[:deepest]):
        plan.needed[k] |= driving_names(stage.family, stages[k + 1].family)
        plan.needed[k] |= set(stage.family.derivatives(stage.family.position, plan.order)[1:])
    return plan


def driving_names(family: Family, driven: Family) -> set[str]:
    """Names of a stage's outputs that determine the next input angle: cosine and sine if it has them."""
    angle = family.position
    turned = {f"cos_{angle}", f"sin_{angle}"}
    if not turned <= set(family.pose_names):
        return {angle}
    return turned | {angle} if driven.uses_phi else turned


def _poses(
    stages: tuple[Stage, ...],
    outputs: Mapping[str, Output],
    plans: dict[frozenset[str], _Plan],
    designs: Array,
    angles: Angles,
    wanted: frozenset[str],
) -> Columns:
    """Compute the wanted pose outputs and status, in blocks so that intermediate arrays stay in the cache.

    ``plans`` caches plans by the wanted names: the optimiser asks for the same names of one design at a time.
    """
    plan = plans.get(wanted)
    if plan is None:
        plan = plans[wanted] = _plan(stages, outputs, wanted)
    shape = (designs.shape[0], angles.cos.shape[1])
    if shape[0] * shape[1] <= BLOCK:
        return _block(stages, plan, designs, angles, wanted)
    dtype = np.result_type(designs, angles.cos)
    columns: Columns = {name: np.empty(shape, dtype) for name in wanted}
    columns["status"] = np.empty(shape, np.uint8)
    for rows, poses in blocks(shape, BLOCK):
        for name, values in _block(stages, plan, designs[rows], angles.part(rows, poses), wanted).items():
            columns[name][rows, poses] = values
    return columns


def _block(stages: tuple[Stage, ...], plan: _Plan, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted outputs of all stages for one block, composing derivatives by the chain rule."""
    results: list[dict[str, Any]] = []
    inner: list[Any] = []  # derivatives of the angle that drives the present stage
    status = np.zeros((designs.shape[0], angles.cos.shape[1]), np.uint8)
    for k, needed in enumerate(plan.needed):
        stage = stages[k]
        is_last = k == len(stages) - 1
        if k > 0:
            kappa = np.ascontiguousarray(designs[:, stage.kappa])
            driving = stages[k - 1].family.position
            angles = drive(results[-1], driving, kappa, np.ascontiguousarray(designs[:, stage.offset]))
        result: dict[str, Any] = stage.family.poses(stage.designs(designs), angles, frozenset(needed))
        np.copyto(status, result["status"], where=status == OK)
        results.append(result)
        if plan.order == 0:
            continue
        composed = plan.composed if is_last else [stage.family.derivatives(stage.family.position, plan.order)[1:]]
        if k > 0:
            for names in composed:
                outer: list[Any] = [result[name] for name in names]
                padding: list[Any] = [None] * (3 - len(names))
                chain_rule(kappa, *inner[: len(names)], *padding, *outer, *padding)
        if not is_last:
            inner = [result[name] for name in composed[0]]
    columns: Columns = {name: results[index][own] for name, (index, own) in plan.source.items()}
    columns |= {name: magnitude(columns, parts) for name, parts in plan.sizes.items()}
    return {name: columns[name] for name in wanted} | {"status": status}


def magnitude(columns: Mapping[str, Any], parts: tuple[str, ...]) -> Any:
    """Return the magnitude of a vector, (n, m), from the names of its components."""
    return np.sqrt(sum(columns[part] ** 2 for part in parts))


def drive(result: dict[str, Any], angle: str, kappa: Array, offset: Array) -> Angles:
    """Compute the input angles of the stage driven by ``result``, from ``angle`` or its cosine and sine."""
    shape = result["status"].shape
    # a family that needs cos and sin only gets nan as angle
    phi: Array = np.broadcast_to(np.float64(np.nan), shape)
    if angle in result:
        phi = kappa[:, None] * result[angle] + offset[:, None]
    if f"cos_{angle}" not in result:
        return Angles.of(phi)
    cos = np.empty(shape, np.result_type(result[f"cos_{angle}"], offset))
    sin = np.empty_like(cos)
    input_angle(kappa, offset, result[f"cos_{angle}"], result[f"sin_{angle}"], cos, sin)
    return Angles(phi, cos, sin)
