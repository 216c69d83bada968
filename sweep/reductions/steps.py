"""A family's own steps to design outputs: choice by accuracy, costs, and proofs of maxima, travel included."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from kernels import status as st
from sweep.costs import nanoseconds
from sweep.errors import InputError
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Stage, Step, Work, of_family
from sweep.families.capabilities import Assembly, CrankRockerLoop, GuidedPoint
from sweep.families.chain import own_outputs
from sweep.families.machines.machine import Machine
from sweep.families.reduction import REDUCTIONS, reduction_of
from sweep.families.rssr import proven_columns
from sweep.quantities.dimensions import dimension_step, size_step
from sweep.quantities.kinds import GeneralRoute, Reduced, Request, WindowAngle, is_windowed, requests
from sweep.quantities.resolve import resolve
from sweep.reductions.extrema import true_extrema
from sweep.reductions.fused import curve_of
from sweep.reductions.margins import margin_suffixes, own_step
from sweep.reductions.panels import has_kinks

MOST_CELLS = 1000  # enclosures of one design before its proof is given up
ORDERS = 3  # highest order of derivative that the proof covers


def certified_travel(family: Family) -> Step | None:
    """Make the step that proves maxima of a guided point's travel and deviation; None for other families."""
    stages = family.stages
    guided = stages[-1].family.find(GuidedPoint)
    if guided is None or any(s.family.find(CrankRockerLoop) is None for s in stages):
        return None
    curves = proven_curves(family, guided)
    outputs = [
        known.output(family.pose_output[name], family.domain)
        for name in curves
        for known in REDUCTIONS
        if known.name == "max_abs"
    ]
    return Step(
        "certified maxima", tuple(outputs), partial(_proven, family, stages, guided), lambda accuracy: accuracy.certify,
        Work.PROOF, certifies=True, cost=lambda accuracy: len(stages) * nanoseconds("work", "certified travel"),
    )  # fmt: skip


def proven_curves(family: Family, guided: GuidedPoint) -> dict[str, tuple[int, int]]:
    """Pose outputs whose maxima can be proven.

    Each maps to 0 for the travel along the line or 1 for the deviation across it, and the order of derivative.
    """
    curves: dict[str, tuple[int, int]] = {}
    for order, name in enumerate(family.derivatives(family.position, ORDERS)):
        if order > 0:
            curves[name] = (0, order)
        if name in guided.across:
            curves[guided.across[name]] = (1, order)
    return curves


def _proven(
    family: Family,
    stages: tuple[Stage, ...],
    guided: GuidedPoint,
    designs: Array,
    wanted: frozenset[str],
    accuracy: Accuracy,
) -> Columns:
    from kernels.families.rssr.certify import InSeries, certify_maxima  # here, so that only proofs wait for the import

    assert accuracy.target is not None
    n = len(designs)
    loops = [stage.family.the(CrankRockerLoop).matrix(stage.designs(designs)) for stage in stages]
    coupled = [designs[:, s.kappa : s.kappa + 2] for s in stages if s.kappa is not None]
    joined = np.reshape(coupled, (len(stages) - 1, n, 2))
    shares = guided.shares(stages[-1].designs(designs))
    known = proven_curves(family, guided)
    names = [name for name in known if wanted & {f"max_abs_{name}", f"phi_max_abs_{name}"}]
    locate = any(f"phi_max_abs_{name}" in wanted for name in names)
    requests = [Request(name, 0) for name in names]
    found, searched = true_extrema(family, designs, requests, accuracy.target, locate=locate)
    value = np.stack([found[request].value for request in requests])
    phi = np.stack([found[request].phi for request in requests])
    status, error = np.tile(searched, (len(names), 1)), np.full(value.shape, np.nan)
    certify_maxima(
        InSeries(np.stack(loops), joined, shares), np.array([known[name] for name in names], np.int64), accuracy.target,
        MOST_CELLS, status, value, phi, error, np.empty(n),
    )  # fmt: skip
    columns: Columns = {"status": searched.copy()}
    for j, name in enumerate(names):
        peak = found[requests[j]]
        searched_at = (peak.phi, peak.err_phi)
        columns |= proven_columns(name, wanted, accuracy.target, (value[j], error[j]), phi[j], searched_at)
        columns["status"] = np.where(columns["status"] == st.OK, status[j], columns["status"])
    return columns


@of_family
def steps_of(family: Family) -> tuple[Step, ...]:
    """List the family's own steps and the general ones made here."""
    made = (size_step(family), dimension_step(family), certified_travel(family))
    return (*family.steps, *(step for step in made if step is not None))


@of_family
def _own_outputs(family: Family) -> tuple[tuple[Step, Output, Stage], ...]:
    return tuple(own_outputs(family, steps_of(family)))


def own_steps(family: Family, name: str) -> list[tuple[Step, Output, Stage]]:
    """List the steps to an output, including those of a chain's first stage, which turns as if it were alone."""
    return [found for found in _own_outputs(family) if found[1].name == name]


def applying_step(family: Family, name: str, accuracy: Accuracy) -> tuple[Step, Stage] | None:
    """Find the step to an output that serves this accuracy; there is one at most (tests/run/test_costs.py)."""
    able = ((step, stage) for step, _, stage in own_steps(family, name) if step.applies(accuracy.of(name)))
    return next(able, None)


NO_JUMPS: frozenset[str] = frozenset()


def step_ns(family: Family, step: Step, accuracy: Accuracy, jumps: frozenset[str] = NO_JUMPS) -> float:
    """Estimate the time of a family's own step [ns per design]; ``jumps`` as for `group_ns`."""
    if step.cost is not None:
        jumping = any(name in jumps for name, (effect, _) in family.dear.items() if effect == step.name)
        return step.cost(accuracy) + (step.jump_ns if jumping else 0.0)
    row = f"{family.name}: {step.name}"
    return nanoseconds("steps", row) + nanoseconds("samples", row) * (accuracy.samples or 0)


def certified_names(family: Family) -> tuple[str, ...]:
    """List the outputs whose maxima can be proven, including those of a chain's first stage."""
    return tuple(o.name for step, o, _ in _own_outputs(family) if step.certifies)


def place_names(family: Family) -> set[str]:
    """Names of the proven maxima's places, whose errors stay estimates."""
    return {name for name in certified_names(family) if (found := reduction_of(family, name)) and found[0].place}


def proofs(certify: bool | Sequence[str]) -> tuple[bool, tuple[str, ...]]:
    """Convert the argument ``certify=`` to ``certify`` and ``proven`` of `Accuracy`."""
    if isinstance(certify, bool):
        return certify, ()
    names = (certify,) if isinstance(certify, str) else tuple(dict.fromkeys(certify))
    return bool(names), names


def is_proven(family: Family, name: str, accuracy: Accuracy) -> bool:
    """Whether the error of an output is a proven bound."""
    return accuracy.of(name).certify and name in certified_names(family) and name not in place_names(family)


def check_certifiable(family: Family, wanted: Sequence[str], accuracy: Accuracy, windowed: bool = False) -> None:
    """Raise if a wanted proof is not possible.

    Exact outputs need no proof; limit positions, margins and means are no maxima, so a search misses no peak of theirs.
    If ``accuracy.proven`` names outputs, these must have a proof.  With ``windowed`` some outputs count in a part of
    the stroke only, but a proof covers the whole turn.

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
    where = f"design outputs of {family.name}"
    for name in accuracy.proven:
        if name not in names or name not in wanted:
            raise InputError("certify", name, f"{allowed}, as far as they are wanted", where)
    for name in accuracy.proven or wanted:
        found = resolve(family, name)  # unknown names end here
        if not isinstance(found, Reduced) or not found.extreme:
            continue
        cut = windowed and is_windowed(family, found)
        if cut or applying_step(family, name, accuracy) is None:
            why = f"{name} in a window" if cut else name
            raise InputError("certify", True, f"{allowed}; not of {why}: name those to prove", where)
    if not set(names) & set(wanted):
        raise InputError("certify", True, f"{allowed}; none of them is wanted", where)


# Poses per design on average: for a margin, a mean, an event, a search without its peaks, a refined extremum.
POSES_MARGIN = 64.0
POSES_MEAN = 110.0
POSES_EVENT = 340.0
POSES_SEARCH = 180.0
POSES_PEAK = 30.0
# An extremum of a curve with kinks, on panels: friction and loads of bearings were measured at 1700 to 4400 poses, an
# equivalent load at 6000 to 11000; and the panels themselves [ns].
POSES_PANELS, PANELS_NS = 2500.0, 150_000.0
POSES_PLACE = 240.0  # for a place after a fused search: nine precise poses take as long as this many others


class Beyond(NamedTuple):
    """Effect or relation that a pose output needs beyond the motion ("" for none), its order and cost [ns per pose]."""

    name: str = ""
    order: tuple[Work, int] = (Work.EFFECT, 0)
    ns: float = 0.0


EVENTS = 1e4  # ns per pose: angles of events are found once per design, in some milliseconds


def beyond_motion(family: Family, pose: str) -> Beyond:
    """Return the effect or the machine's relation that computes a pose output."""
    return _beyond(family).get(pose, Beyond())


@of_family
def _beyond(family: Family) -> dict[str, Beyond]:
    effects = list(dict.fromkeys(effect for effect, _ in family.dear.values()))
    found = {name: Beyond(what, (Work.EFFECT, effects.index(what)), ns) for name, (what, ns) in family.dear.items()}
    for number, relation in enumerate(family.relations if isinstance(family, Machine) else ()):
        for name in (output.name for output in relation.outputs):
            needs = relation.needs(frozenset((name,)))
            ns = sum(dict(family.dear[one] for one in needs if one in family.dear).values())
            if any(one.startswith("phi_") for one in needs):
                # after the routes that find events, and their limits
                found[name] = Beyond(relation.name, (Work.LONG, len(family.steps) + number), ns + EVENTS)
            elif ns:
                found[name] = Beyond(relation.name, (Work.EFFECT, len(effects) + number), ns)
            else:  # poses of several members: after all outputs of single members
                found[name] = Beyond("of relations", (Work.SEARCH, len(family.pose_names)), 0.0)
    return found


def group_ns(
    family: Family, group: GeneralRoute, names: Sequence[str], accuracy: Accuracy, windowed: bool = False,
    jumps: frozenset[str] = NO_JUMPS,
) -> float:  # fmt: skip
    """Estimate the time of a general route [ns per design] from measured times of poses and of searches.

    ``jumps`` are pose outputs that jump in these designs, which are searched on panels like those with kinks.
    """
    stages, pose = len(_stages(family)), pose_ns(family)
    if group == "margin":
        return sum(_margin_ns(family, suffix, accuracy) for suffix in margin_suffixes(family))
    asked = [resolve(family, name) for name in names]
    if group == "events":
        return POSES_EVENT * pose + nanoseconds("work", "event") * len(asked)
    requested = {r for one in asked for r in requests(family, one, windowed)}
    # The cost of effects counts once per effect and pose, and far outweighs the motion.
    effects = sum({(name, ns): ns for name, _, ns in (beyond_motion(family, one.of) for one in asked)}.values())
    if accuracy.samples is not None or group == "means":
        scans = len(asked) if group == "means" else len(requested)
        return (accuracy.samples or POSES_MEAN) * (pose + nanoseconds("work", "scan") * scans + effects)
    assert accuracy.target is not None
    quick = {r for r in requested if not r.windowed and curve_of(family, r, False) is not None}
    fused = stages * nanoseconds("work", "fused extremum") * len(quick)
    fused += POSES_PLACE * pose * sum(request.place for request in quick)
    # The ends of a window are found as events are.
    cuts = sum(r.windowed for r in requested) + sum(isinstance(one, WindowAngle) for one in asked)
    fused += (POSES_EVENT * pose + nanoseconds("work", "event")) * cuts
    kinked = [request for request in requested - quick if has_kinks(family, request, request.pose in jumps)]
    fused += len(kinked) * (PANELS_NS + POSES_PANELS * (pose + effects))
    smooth = len(requested - quick) - len(kinked)
    if not smooth:
        return fused
    peaks = (0.5 - np.log10(accuracy.target) / 16.0) * smooth
    own = nanoseconds("work", "search") + nanoseconds("work", "peak") * peaks
    return float(fused + stages * own + (POSES_SEARCH + POSES_PEAK * peaks) * (pose + effects))


def _margin_ns(family: Family, suffix: str, accuracy: Accuracy) -> float:
    """Estimate the time of the margin of a stage, which all stages before it drive."""
    if isinstance(family, Machine):
        name, own = suffix.split(".")
        return _margin_ns(family.member(name).family, own, accuracy)
    found = own_step(family, suffix, accuracy)
    loop = next((loop for loop in family.every(Assembly) if loop.stage == suffix), None)
    if found is None and loop is not None and curve_of(family, Request(loop.discriminant, -1), True) is not None:
        return int(suffix) * nanoseconds("work", "fused extremum")
    if found is None:
        *driving, last = family.stages[: int(suffix or 1)]
        return nanoseconds("margins", last.family.name) + POSES_MARGIN * sum(pose_ns(s.family) for s in driving)
    step, stage = found
    return step_ns(stage.family, step, accuracy)


def _stages(family: Family) -> list[Family]:
    """List the families of the stages of a chain, or of all members of a machine."""
    mechanisms = [member.family for member in family.members] if isinstance(family, Machine) else [family]
    return [stage.family for mechanism in mechanisms for stage in mechanism.stages]


def pose_ns(family: Family) -> float:
    """Estimate the time of a pose's motion [ns]: of a chain or a machine the sum over stages and members."""
    return sum(nanoseconds("poses", stage.name) for stage in _stages(family))


def group_order(family: Family, group: GeneralRoute, names: Sequence[str]) -> tuple[Work, int]:
    """Order of a general route: routes that detect non-rotatable designs first, then those with the fewest extrema."""
    asked = [resolve(family, name) for name in names]
    beyond = next((found for one in asked if (found := beyond_motion(family, one.of)).name), None)
    if beyond is not None:
        return beyond.order
    first = {"margin": 0, "means": 1, "events": 2}
    extrema = {r for one in asked for r in requests(family, one, False)} if group not in first else ()
    return Work.SEARCH, first.get(group, 2 + len(extrema))
