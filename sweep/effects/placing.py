"""Where an effect stands: at a family, or at one stage of a chain, whose number its inputs and outputs carry."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

from sweep.effects.base import Driven, Effect, Scene
from sweep.families.base import Angles, Array, Family, Output
from sweep.families.chain import Chain
from sweep.numerics.curves import Curve
from sweep.quantities.names import at_stage


@dataclass(frozen=True)
class Placed:
    """An effect at the stage of index ``stage``; the outputs of the last stage also stand without its number."""

    entry: Effect
    stage: int = 0
    number: str = ""
    last: bool = False

    @property
    def name(self) -> str:
        """Name of the effect with the stage's number."""
        return f"{self.entry.name}{self.number}"

    def narrowed(self, wanted: Iterable[str]) -> Placed:
        """Return the effect with what the wanted ones of its outputs need: an input for others alone is left out,
        and so are those others.
        """
        only_for, names = self.entry.only_for, {self.own[name] for name in wanted if name in self.own}
        left = {name for name, outputs in only_for.items() if names.isdisjoint(outputs)}
        if not left:
            return self
        gone = {o for name in left for o in only_for[name]}
        whole = self.entry.design_result
        entry = replace(
            self.entry,
            inputs=tuple(p for p in self.entry.inputs if p.name not in left),
            outputs=tuple(o for o in self.entry.outputs if o.name not in gone),
            design_result=whole and replace(whole, outputs=tuple(o for o in whole.outputs if o.name not in gone)),
            only_for={name: outputs for name, outputs in only_for.items() if name not in left},
        )
        return replace(self, entry=entry)

    @property
    def pose_outputs(self) -> tuple[Output, ...]:
        """Pose outputs under all the names they have."""
        return self._numbered(self.entry.outputs)

    @property
    def design_outputs(self) -> tuple[Output, ...]:
        """Design outputs under all the names they have."""
        return self._numbered(self.entry.design_result.outputs if self.entry.design_result else ())

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Pose and design outputs."""
        return (*self.pose_outputs, *self.design_outputs)

    @cached_property
    def own(self) -> dict[str, str]:
        """The effect's own names of its outputs by the names they have here."""
        names = [o.name for o in (*self.entry.outputs, *_design(self.entry))]
        found = {f"{name}{self.number}": name for name in names}
        return found | {name: name for name in names} if self.last else found

    def _numbered(self, outputs: tuple[Output, ...]) -> tuple[Output, ...]:
        if not self.number:
            return outputs
        numbered = tuple(o.of_stage(int(self.number)) for o in outputs)
        return (*numbered, *outputs) if self.last else numbered


def _design(entry: Effect) -> tuple[Output, ...]:
    return entry.design_result.outputs if entry.design_result else ()


def stages_of(family: Family) -> tuple[tuple[Family, str], ...]:
    """Return the stages of a chain with their numbers; a family alone is one stage without a number."""
    if isinstance(family, Chain):
        return tuple((stage.family, str(stage.number)) for stage in family.stages)
    return ((family, ""),)


def first_scene(
    family: Family,
    designs: Array,
    angles: Angles,
    given: dict[str, Array],
    curves: Mapping[str, Curve] = MappingProxyType({}),
) -> Scene:
    """Return the scene of a family, or of a chain's first stage with those behind it.

    ``given`` are the inputs by name, each (n,), ``curves`` what adds to some of them over the turn.
    """
    if not isinstance(family, Chain):
        return Scene(family, designs, angles, {"speed_change": 0.0 * designs[:, 0]} | given, curves=curves)
    still = {"speed_change": 0.0 * designs[:, 0]}
    crank = still | {name: given[f"{name}1"] for name in ("speed", "speed_change") if f"{name}1" in given}
    parts = []
    for stage in family.stages:
        number = str(stage.number)
        own = {plain: x for name, x in given.items() if (plain := at_stage(name, number))}
        over = {plain: x for name, x in curves.items() if (plain := at_stage(name, number))}
        parts.append((stage.family, stage.designs(designs), own | crank, over))
    after = tuple(
        Driven(bare, matrix, designs[:, stage.kappa], designs[:, stage.offset], own, over)
        for stage, (bare, matrix, own, over) in zip(family.stages[1:], parts[1:], strict=True)
    )
    bare, matrix, own, over = parts[0]
    return Scene(bare, matrix, angles, own, after, curves=over)
