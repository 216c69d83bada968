"""Entry of an effect in the register: outputs, inputs, cost, and rule of negligibility."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from sweep.costs import nanoseconds
from sweep.effects.scene import Scene
from sweep.families import NAMES as FAMILY_NAMES
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Parameter
from sweep.families.capabilities import JointRecords, OutputLink, ToolPoint
from sweep.families.curve_features import Bends
from sweep.families.link_tree import LinkTree
from sweep.families.names import ends_in_digit

REGISTER: Mapping[str, Mapping[str, Mapping[str, Any]]] = tomllib.loads(
    Path(__file__).parent.with_suffix(".toml").read_text(encoding="utf-8")
)
_TEXTS = ("key", "title", "equation", "called_for", "negligible")


def about(kind: str, family: str = "") -> dict[str, Any]:
    """Return the name and the texts of an effect in the register, as arguments of :class:`Effect`.

    ``family`` is the name of the only family with the effect, if it is one of those that are made for each of some.

    Raises
    ------
    TypeError
        if the register lacks a text of the effect.
    """
    tables = "of_families" if family else "effects"
    table = REGISTER[tables][kind]
    texts = about(table["as"]) if "as" in table else {}
    texts |= {key: table[key] for key in _TEXTS if key in table}
    if "formulas" in table:
        texts["formulas"] = tuple(table["formulas"].splitlines())
    if missing := [key for key in (*_TEXTS, "formulas") if key not in texts]:
        raise TypeError(f"sweep/effects.toml: [{tables}.{kind}] lacks {', '.join(missing)}")
    if family:
        return texts | {"name": f"{family}_{kind}", "title": f"{texts['title']}: {find_family(family).title}"}
    return texts | {"name": kind}


ON_LINE, ON_COUPLER, ON_TIP = 0, 1, 2  # places of a tool, in the order of Effect.tool_inputs

# Loads to which a curve over the turn can be added.
CURVED = ("load_torque", "load_force", "tool_force", "tool_force_x", "tool_force_y", "tool_force_z")
# Inputs in [loads] of a study; all others except the speed are in [bodies].
STUDY_LOADS = (
    *CURVED,
    "pierce_force",
    "pierce_at",
    "pierce_sense",
    "resisting_torque",
    "motor_slope",
    "thread_tension",
)

ComputeFunction: TypeAlias = Callable[[Scene, frozenset[str]], Columns]


@dataclass(frozen=True)
class DesignResult:
    """Outputs of an effect per design instead of per pose: of a whole-turn effect, or in closed form.

    ``run(scene, wanted, accuracy)`` gets a scene of a single crank angle, whose ``on_grid`` samples whole turns; it
    returns the wanted outputs, perhaps their ``err_``, and ``status``.  ``block`` is the number of designs per call:
    small if it needs hundreds of poses of each, larger if it needs a few poses many times.
    """

    outputs: tuple[Output, ...]
    run: Callable[[Scene, frozenset[str], Accuracy], Columns]
    block: int = 32


@dataclass(frozen=True)
class Advice:
    """Estimate of whether an effect matters, from a few designs: the measured quantity and its threshold."""

    quantity: str
    values: Array  # (n,) of the designs with an estimate
    threshold: float
    unit: str = ""  # of the values, in words

    @classmethod
    def of_turning(cls, quantity: str, values: Array, threshold: float, unit: str = "") -> Advice | None:
        """Drop the designs whose values are not finite over the whole turn; None if no design is left."""
        known = values[np.isfinite(values)]
        return cls(quantity, known, threshold, unit) if known.size else None

    @property
    def worst(self) -> float:
        """Largest value, of the design where the effect matters most."""
        return float(self.values.max())

    @property
    def negligible(self) -> bool:
        """Whether the effect matters for none of the designs."""
        return self.worst < self.threshold


AdviceFunction: TypeAlias = Callable[[Scene], Advice | None]


def largest(compute: ComputeFunction, name: str, quantity: str, threshold: float, unit: str = "") -> AdviceFunction:
    """Rule of negligibility by the largest magnitude of the output ``name`` over the turn, called ``quantity``."""

    def advise(scene: Scene) -> Advice | None:
        found = np.abs(np.asarray(compute(scene, frozenset({name}))[name], np.float64))
        return Advice.of_turning(quantity, found.max(axis=1), threshold, unit)

    return advise


def tool_place(family: Family) -> int | None:
    """Find the place of a tool on a family with joint records: ON_LINE, ON_COUPLER or ON_TIP; else None."""
    if family.find(JointRecords) is None:
        return None
    point = family.find(ToolPoint)
    if point is not None:
        return ON_COUPLER if point.direction is None else ON_LINE
    return None if family.find(OutputLink) is None else ON_TIP


@dataclass(frozen=True)
class Effect:
    """An effect; ``compute(scene, wanted)`` returns the wanted outputs (n, m) and ``status`` (n, m).

    Outputs without an equation have that of the effect.
    ``whole_turn`` effects couple different crank angles: they sample the turn themselves, whatever poses are wanted.
    ``even_crank`` effects need a crank that turns evenly, so later stages of a chain do not have them. ``takes_load``
    is the key of the effect that returns the load of a chain's later stages; without it their load is ignored.
    ``may_drive_nothing`` means that later stages are massless unless their bodies are given, so that none of their
    inputs is required, and stages without known loads may follow. ``requires`` is the capability that a family must
    have, ``followers`` are the kinds of follower that the effect covers, ``tool_inputs`` are further inputs for a tool
    on the coupler that moves along a line, for one that moves freely, and for one at the tip of a rocker. ``least`` are
    pose outputs whose smallest value over the turn matters, such as a life, not the largest
    (:func:`sweep.effects.wanted.expanded`). ``tree`` is the tree of links of the only family with this effect, if any;
    ``carried_at`` is the place of a tool that a family must have, if any. ``only_for`` maps an input to the outputs
    that need it, if not all do: it is no input where none of these is wanted. ``bends`` are the kinks of outputs'
    curves. ``rates`` maps a quantity to its derivative by the crank angle, see
    :class:`~sweep.families.capabilities.Rates`. ``advise`` is the rule of negligibility: ``advise(scene)`` applies it
    to some designs over a turn and returns None if none of them turns.
    """

    key: str
    name: str
    title: str
    equation: str
    formulas: tuple[str, ...]
    outputs: tuple[Output, ...]
    compute: ComputeFunction
    called_for: str
    negligible: str
    needs: tuple[str, ...] = ()
    inputs: tuple[Parameter, ...] = ()
    whole_turn: bool = False
    even_crank: bool = False
    takes_load: str = ""
    may_drive_nothing: bool = False
    design_result: DesignResult | None = None
    advise: AdviceFunction | None = None
    requires: type = JointRecords
    tool_inputs: tuple[tuple[Parameter, ...], ...] = ((), (), ())
    least: tuple[str, ...] = ()
    followers: tuple[str, ...] = ("rocker", "slider")
    tree: LinkTree | None = None
    carried_at: int | None = None
    only_for: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    bends: tuple[Bends, ...] = ()
    rates: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        whole = self.design_result
        object.__setattr__(self, "outputs", self._stated(self.outputs))
        if whole is not None:
            object.__setattr__(self, "design_result", replace(whole, outputs=self._stated(whole.outputs)))

    def _stated(self, outputs: tuple[Output, ...]) -> tuple[Output, ...]:
        return tuple(o if o.equation else replace(o, equation=self.equation) for o in outputs)

    def inputs_of(self, family: Family) -> tuple[Parameter, ...]:
        """List the inputs for a family, with those of a tool if the family has a place for one."""
        place = tool_place(family)
        return self.inputs if place is None else (*self.inputs, *self.tool_inputs[place])

    def serves(self, family: Family) -> bool:
        """Whether the family meets the effect's requirements and has a follower that the effect covers."""
        joints = family.find(JointRecords)
        follows = joints is None or joints.follower in self.followers
        own = self.tree is None or family.find(LinkTree) is self.tree
        own = own and self.carried_at in (None, tool_place(family))
        return family.find(self.requires) is not None and follows and own

    def advice(self, scene: Scene) -> Advice | None:
        """Apply the rule of negligibility to designs over a turn; None without a rule, or where none turns."""
        return None if self.advise is None else self.advise(scene)

    @property
    def design_outputs(self) -> tuple[Output, ...]:
        """Outputs per design."""
        return self.design_result.outputs if self.design_result else ()

    @cached_property
    def families(self) -> tuple[str, ...]:
        """Names of the register's families that have the effect."""
        return tuple(name for name in FAMILY_NAMES if self.serves(find_family(name)))

    @property
    def ns_per_pose(self) -> float:
        """Measured time of all pose outputs together [ns], without the motion; 0 if there are none."""
        return nanoseconds("effects", self.name) if self.outputs else 0.0

    @property
    def ns_per_design(self) -> float:
        """Measured time of all design outputs together [ns]; 0 if there are none."""
        return nanoseconds("effects_design", self.name) if self.design_result is not None else 0.0


@dataclass(frozen=True)
class PlacedEffect:
    """An effect at the stage of index ``stage``; outputs of the last stage can also be named without its number."""

    entry: Effect
    stage: int = 0
    number: str = ""
    last: bool = False

    @property
    def name(self) -> str:
        """Name of the effect with the stage's number."""
        return f"{self.entry.name}{self.number}"

    def narrowed(self, wanted: Iterable[str]) -> PlacedEffect:
        """Leave out inputs that no wanted output needs, and the outputs that need them."""
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
        """Pose outputs under all their names."""
        return self._numbered(self.entry.outputs)

    @property
    def design_outputs(self) -> tuple[Output, ...]:
        """Design outputs under all their names."""
        return self._numbered(self.entry.design_outputs)

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Pose and design outputs."""
        return (*self.pose_outputs, *self.design_outputs)

    @cached_property
    def own(self) -> dict[str, str]:
        """Map from the names of the outputs here to the effect's own names."""
        names = [o.name for o in (*self.entry.outputs, *self.entry.design_outputs)]
        found = {f"{name}{self.number}": name for name in names}
        return found | {name: name for name in names if self._stands_alone(name)}

    @property
    def rates(self) -> dict[str, str]:
        """Derivatives by the crank angle among the outputs, under all their names."""
        of = {high: low for low, high in self.entry.rates.items()}
        return {name.replace(own, of[own]): name for name, own in self.own.items() if own in of}

    def _numbered(self, outputs: tuple[Output, ...]) -> tuple[Output, ...]:
        if not self.number:
            return outputs
        numbered = (o.of_stage(int(self.number)) for o in outputs)
        return (*numbered, *(o for o in outputs if self._stands_alone(o.name)))

    def _stands_alone(self, name: str) -> bool:
        return self.last and not (self.number and ends_in_digit(name))


def no_poses(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return only the motion's status, for an effect without pose outputs."""
    return {"status": scene.status()}
