"""The routes to design outputs: a family's own steps, effects, and general reductions, all run in the same way."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from sweep import costs
from sweep.errors import InputError
from sweep.evaluation.boxes import box_route
from sweep.evaluation.members import machine_routes
from sweep.evaluation.negatives import negative_route
from sweep.evaluation.route import Part, Route
from sweep.families.base import Accuracy, Array, Columns, Family, Step, Work
from sweep.families.chain import Stage
from sweep.families.derived import of_family
from sweep.families.domain import March
from sweep.families.members import Machine
from sweep.quantities.names import at_stage, error_of, without_minus
from sweep.quantities.reduction import reduction_of
from sweep.reductions.box import box
from sweep.reductions.catalogue import output, quantity
from sweep.reductions.events import event_outputs
from sweep.reductions.means import mean_squares
from sweep.reductions.precise import sharpen_maxima
from sweep.reductions.steps import applying_step, step_ns, steps_of
from sweep.reductions.turn import Group, limits_and_reductions, margin_group
from sweep.reductions.work import group_ns, group_order


def routes(family: Family, wanted: Sequence[str], accuracy: Accuracy) -> tuple[Route, ...]:
    """Return what will be computed and how, in order; each route's outputs can be asked of `design_outputs` alone.

    Raises
    ------
    InputError
        for an unknown name, or an accuracy that the family's domain or the output does not serve.
    """
    known, key, prices = _known(family), (tuple(wanted), accuracy), costs.table()
    if key not in known or known[key][0] is not prices:
        known[key] = prices, _routes(family, wanted, accuracy)
    return known[key][1]


@of_family
def _known(family: Family) -> dict[tuple[tuple[str, ...], Accuracy], tuple[Any, tuple[Route, ...]]]:
    """Return the memory of `routes`, with the prices they have: it is asked the same for every chunk of a sweep."""
    return {}


def _routes(family: Family, wanted: Sequence[str], accuracy: Accuracy) -> tuple[Route, ...]:
    _check_domain(family, accuracy)
    found = [negative_route(family, name, accuracy) for name in dict.fromkeys(wanted) if without_minus(name)]
    wanted = [name for name in wanted if not without_minus(name)]
    if isinstance(family, Machine):
        of_members, wanted = machine_routes(family, wanted, accuracy)
        found += of_members
    steps: dict[tuple[str, int], tuple[Step, Stage | None, list[str]]] = {}
    groups: dict[tuple[Group, str], list[str]] = {}
    asked = {name: (applying_step(family, name, accuracy), quantity(family, name)) for name in dict.fromkeys(wanted)}
    # The margin of a whole chain asks all stages: a first one judged by itself would take its designs from the others.
    together = any(
        own is None and one is not None and one.route == "margin" and not one.stage for own, one in asked.values()
    )
    for name, (own, one) in asked.items():
        extent = box(family, name)
        if extent is not None:
            found.append(box_route(family, extent, accuracy))
            continue
        if own is not None and not (together and one is not None and one.route == "margin"):
            step, stage = own
            steps.setdefault((step.name, stage.number if stage else 0), (step, stage, []))[2].append(name)
        elif one is not None:
            about_position: Group = "limits" if one.of in family.positions else "reductions"
            general: Group = {"margin": "margin", "mean": "means", "event": "events"}.get(one.route, about_position)  # type: ignore[assignment]
            # Each effect by itself: one that jams or leaves its range takes nothing from the others.
            effect = family.dear.get(one.of, ("", 0.0))[0]
            groups.setdefault((general, effect), []).append(name)
        else:
            output(family, name)  # unknown names end here, with the nearest known one
            allowed = "another accuracy: this output is only computed " + (
                "with accuracy=, not on samples" if accuracy.samples is not None else "on samples, not with accuracy="
            )
            raise InputError("output", name, allowed, f"design outputs of {family.name}")
    found += [_own(family, step, stage, tuple(names), accuracy) for step, stage, names in steps.values()]
    found += [_general(family, *key, tuple(names), accuracy) for key, names in groups.items()]
    return tuple(sorted(found, key=lambda route: (*route.order, route.name)))


def _check_domain(family: Family, accuracy: Accuracy) -> None:
    if isinstance(family.domain, March) and accuracy.target is not None:
        allowed = "samples=: a pose depends on those before it, so values exist on the grid that is marched only"
        raise InputError("accuracy", accuracy.target, allowed, f"design outputs of {family.name}")


def _own(family: Family, step: Step, stage: Stage | None, outputs: tuple[str, ...], accuracy: Accuracy) -> Route:
    name = f"stage {stage.number}: {step.name}" if stage else step.name
    owner = stage.family if stage else family
    place = [own.name for own in steps_of(owner)].index(step.name)
    run, cost = partial(_run_step, family, step, stage, outputs), step_ns(owner, step, accuracy)
    return Route(name, outputs, cost, run, order=(step.work, place), columns=stage.columns.stop if stage else None)


def _general(family: Family, general: Group, effect: str, outputs: tuple[str, ...], accuracy: Accuracy) -> Route:
    run = partial(_run_general, family, general, outputs)
    cost = group_ns(family, general, outputs, accuracy)
    order = group_order(family, general, outputs)
    return Route(f"{general} {effect}".rstrip(), outputs, cost, run, general, order)


def _run_general(
    family: Family, general: Group, outputs: tuple[str, ...], designs: Array, accuracy: Accuracy, window: Part
) -> Columns:
    if general == "margin":
        return margin_group(family, designs, outputs, accuracy)
    if general == "means":
        return mean_squares(family, designs, outputs, accuracy)
    if general == "events":
        return event_outputs(family, designs, outputs, accuracy)
    return limits_and_reductions(family, designs, outputs, accuracy, window)


def _run_step(
    family: Family, step: Step, stage: Stage | None, outputs: tuple[str, ...], designs: Array, accuracy: Accuracy,
    window: Part,
) -> Columns:  # fmt: skip
    own = {name: at_stage(name, str(stage.number)) if stage else name for name in outputs}
    part, mechanism = (stage.designs(designs), stage.family) if stage else (designs, family)
    found = step.run(part, frozenset(own.values()), accuracy)
    if accuracy.target is not None:
        for plain in own.values():
            # A step that serves a target promises it; one that estimates its error says so itself.
            found.setdefault(error_of(plain), accuracy.target * np.abs(np.asarray(found[plain], np.float64)))
            # The poses of an effect come from the same solution of the whole turn: they are wrong alike.
            if not accuracy.certify and step.work is not Work.EFFECT:
                _sharpen(mechanism, step, part, plain, found, accuracy.target)
    return {"status": found["status"]} | {
        key: found[own_key]
        for name, plain in own.items()
        for key, own_key in ((name, plain), (error_of(name), error_of(plain)))
        if own_key in found
    }


def _sharpen(family: Family, step: Step, designs: Array, name: str, columns: Columns, target: float) -> None:
    """Take a step's maxima that rounding left less accurate than was asked from the family's precise poses."""
    place = f"{family.domain.name}_{name}"
    located = any(o.name == place for o in step.provides)
    found = reduction_of(family, name)
    if found is None or found[0].modes != (0,) or not located or family.precise_poses is None:
        return
    sharpen_maxima(family, step, designs, found[1].name, name, columns, target)
