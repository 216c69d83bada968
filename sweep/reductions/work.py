"""What kind of work a general route is, and how long it takes by the table of costs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.costs import nanoseconds
from sweep.families.base import Accuracy, Family, Work
from sweep.families.capabilities import Assembly
from sweep.families.chain import Chain, stages_of
from sweep.families.members import Machine
from sweep.reductions.fused import curve_of
from sweep.reductions.margins import margin_suffixes, own_step
from sweep.reductions.request import Request
from sweep.reductions.steps import step_ns
from sweep.reductions.turn import Group, quantities

# Poses per design on average: of a margin, a mean, an event, of a search without its peaks, per refined extremum.
POSES_MARGIN = 64.0
POSES_MEAN = 110.0
POSES_EVENT = 340.0
POSES_SEARCH = 180.0
POSES_PEAK = 30.0
POSES_PLACE = 240.0  # of a place after a fused search: nine precise poses take as long as so many others


def group_ns(family: Family, group: Group, names: Sequence[str], accuracy: Accuracy) -> float:
    """Return the estimated time of a general route [ns per design], made of measured times of poses and of searches."""
    stages, pose = _stages(family), pose_ns(family)
    if group == "margin":
        return sum(_margin_ns(family, suffix, accuracy) for suffix in margin_suffixes(family))
    asked = quantities(family, names)
    if group == "events":
        return POSES_EVENT * pose + nanoseconds("work", "event") * len(asked)
    requests = {r for one in asked for r in one.requests(family, False)}
    # What effects add is paid once per effect and pose, and far outweighs the motion.
    effects = sum(dict(family.dear[one.of] for one in asked if one.of in family.dear).values())
    if accuracy.samples is not None or group == "means":
        scans = len(asked) if group == "means" else len(requests)
        return (accuracy.samples or POSES_MEAN) * (pose + nanoseconds("work", "scan") * scans + effects)
    assert accuracy.target is not None
    quick = {request for request in requests if curve_of(family, request, False) is not None}
    fused = _stages(family) * nanoseconds("work", "fused extremum") * len(quick)
    fused += POSES_PLACE * pose * sum(request.place for request in quick)
    if quick == requests:
        return fused
    peaks = (0.5 - np.log10(accuracy.target) / 16.0) * len(requests - quick)
    own = nanoseconds("work", "search") + nanoseconds("work", "peak") * peaks
    return float(fused + stages * own + (POSES_SEARCH + POSES_PEAK * peaks) * (pose + effects))


def _margin_ns(family: Family, suffix: str, accuracy: Accuracy) -> float:
    """Return the estimated time of the margin of a stage, which all stages before it drive."""
    if isinstance(family, Machine):
        name, own = suffix.split(".")
        return _margin_ns(family.member(name).family, own, accuracy)
    found = own_step(family, suffix, accuracy)
    loop = next((loop for loop in family.every(Assembly) if loop.stage == suffix), None)
    if found is None and loop is not None and curve_of(family, Request(loop.discriminant, -1), True) is not None:
        return int(suffix) * nanoseconds("work", "fused extremum")
    if found is None:
        *driving, last = stages_of(family)[: int(suffix or 1)]
        return nanoseconds("margins", last.family.name) + POSES_MARGIN * sum(pose_ns(s.family) for s in driving)
    step, stage = found
    return step_ns(stage.family if stage else family, step, accuracy)


def _stages(family: Family) -> int:
    if isinstance(family, Machine):
        return sum(_stages(member.family) for member in family.members)
    return len(family.stages) if isinstance(family, Chain) else 1


def pose_ns(family: Family) -> float:
    """Return the estimated time of the motion of a pose: of a chain or a machine that of all its stages and members."""
    if isinstance(family, Machine):
        return sum(pose_ns(member.family) for member in family.members)
    if isinstance(family, Chain):
        return sum(pose_ns(stage.family) for stage in family.stages)
    return nanoseconds("poses", family.name)


def group_order(family: Family, group: Group, names: Sequence[str]) -> tuple[Work, int]:
    """Place of a general route among others: what shows that a design does not turn first, then the fewest extrema."""
    asked = quantities(family, names)
    effects = list(dict.fromkeys(effect for effect, _ in family.dear.values()))
    effect = next((family.dear[one.of][0] for one in asked if one.of in family.dear), None)
    if effect is not None:
        return Work.EFFECT, effects.index(effect)
    first = {"margin": 0, "means": 1, "events": 2}
    extrema = {r for one in asked for r in one.requests(family, False)} if group not in first else ()
    return Work.SEARCH, first.get(group, 2 + len(extrema))
