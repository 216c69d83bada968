"""A family's own routes to design outputs, the one that serves an accuracy, and what can be proven."""

from __future__ import annotations

from collections.abc import Sequence

from sweep.costs import nanoseconds
from sweep.families.base import Accuracy, Family, Output, Step
from sweep.families.chain import Chain, Stage
from sweep.quantities.names import at_stage
from sweep.quantities.reduction import reduction_of
from sweep.reductions.dimensions import dimension_step
from sweep.reductions.size import size_step
from sweep.reductions.travel import certified_travel

# A family has no hash; it is kept with its steps, so that its identity stays its own.
_KNOWN: dict[int, tuple[Family, tuple[Step, ...]]] = {}
_MOST_KNOWN = 64


def steps_of(family: Family) -> tuple[Step, ...]:
    """Return the family's own routes, and those that are made for it here, which takes half a millisecond once."""
    known = _KNOWN.get(id(family))
    if known is None:
        made = (size_step(family), dimension_step(family), certified_travel(family))
        known = family, (*family.steps, *(step for step in made if step is not None))
        if len(_KNOWN) >= _MOST_KNOWN:
            _KNOWN.clear()
        _KNOWN[id(family)] = known
    return known[1]


def own_steps(family: Family, name: str) -> list[tuple[Step, Output, Stage | None]]:
    """Return the family's own routes to an output, and those of a chain's first stage,
    which turns as if it were alone.
    """
    found: list[tuple[Step, Output, Stage | None]] = [
        (step, o, None) for step in steps_of(family) for o in step.provides if o.name == name
    ]
    if isinstance(family, Chain) and (own := at_stage(name, "1")):
        stage = family.stages[0]
        found += [(step, o, stage) for step in stage.family.steps for o in step.provides if o.name == own]
    return found


def applying_step(family: Family, name: str, accuracy: Accuracy) -> tuple[Step, Stage | None] | None:
    """Return the own route to an output that serves this accuracy; there is one at most (tests/test_costs.py)."""
    able = ((step, stage) for step, _, stage in own_steps(family, name) if step.applies(accuracy.of(name)))
    return next(able, None)


def step_ns(family: Family, step: Step, accuracy: Accuracy) -> float:
    """Return the estimated time of a family's own step [ns per design]."""
    if step.cost is not None:
        return step.cost(accuracy)
    row = f"{family.name}: {step.name}"
    return nanoseconds("steps", row) + nanoseconds("samples", row) * (accuracy.samples or 0)


def certified_names(family: Family) -> tuple[str, ...]:
    """Return outputs whose maxima can be proven, those of a chain's first stage included."""
    names = [o.name for step in steps_of(family) if step.certifies for o in step.provides]
    if isinstance(family, Chain):
        names += [f"{o.name}1" for step in family.stages[0].family.steps if step.certifies for o in step.provides]
    return tuple(names)


def place_names(family: Family) -> set[str]:
    """Return names of the proven maxima's places, whose errors stay estimates."""
    return {name for name in certified_names(family) if (found := reduction_of(family, name)) and found[0].place}


def proofs(certify: bool | Sequence[str]) -> tuple[bool, tuple[str, ...]]:
    """Return what ``certify=`` asks for, as ``certify`` and ``proven`` of `Accuracy`."""
    if isinstance(certify, bool):
        return certify, ()
    names = (certify,) if isinstance(certify, str) else tuple(dict.fromkeys(certify))
    return bool(names), names


def is_proven(family: Family, name: str, accuracy: Accuracy) -> bool:
    """Return whether the error of an output is a proven bound."""
    return accuracy.of(name).certify and name in certified_names(family) and name not in place_names(family)
