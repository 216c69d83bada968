"""What the search for wrong answers asks about: every family, chain and effect, and random designs of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import NAMES as EFFECTS
from sweep.effects import effect, extended
from sweep.families import NAMES, family
from sweep.families.base import Angles, Array, Columns, Family, March
from sweep.reductions.sampling import on_closed_turn
from tests.support.turn_designs import guided_four_bars

CHAINS = ("rssr+guide", "rssr+rssp", "rssr+rssr", "four_bar+slider_crank")
# Several members on one shaft, with a distance between two of them and whatever else is asked of them.
MACHINES: dict[str, tuple[dict[str, object], tuple[str, ...]]] = {
    "machine": (
        {"needle": ["rssr", "guide"], "looper": {"family": "rssr", "ratio": 2, "tip": [30.0, 1.0, -2.0]}},
        ("clearance", "needle.d2s", "looper.d2psi", "looper.dtip_x"),
    ),
    "machine of a cam": (
        {"needle": "slider_crank", "thread": {"family": "cam", "ratio": -3}},
        ("clearance", "needle.d2s", "thread.d2s"),
    ),
    "machine with friction": (
        {"needle": "slider_crank", "looper": {"family": "swivel", "ratio": -2}},
        ("clearance", "looper.drive_torque_friction", "looper.force_b"),
    ),
    "machine of a driven member": (
        {
            "looper": {"family": "rssr", "ratio": -2, "tip": [3.0, 1.0, 0.0]},
            "arm": {"family": "four_bar", "driver": "looper.psi", "offset": 0.8},
        },
        ("clearance", "arm.d2psi", "arm.d2x_m", "arm.d2y_m", "arm.dpsi"),
    ),
}
KINDS = ("ordinary", "wide", "edge", "tiny", "long", "peaky")
PEAKS = 1440  # poses of a turn by which a design is called peaky
WALK = 60
LOOK = 360  # poses that tell whether a random design moves all the way
PHI = 2.0 * np.pi * (np.arange(LOOK) + 0.37) / LOOK


@dataclass(frozen=True)
class Subject:
    """A mechanism with its outputs, and a regular design of it."""

    name: str
    family: Family
    own: int  # parameters of the bare family, the others are inputs of effects
    outputs: tuple[str, ...]
    centre: Array


def all_at_once(full: Family) -> Family:
    """Return the family with poses that compute all outputs of whatever group is asked for: few kernels to compile."""
    groups: dict[str, frozenset[str]] = {}
    for name in full.pose_names:
        key = full.dear.get(name, ("", 0.0))[0]
        groups[key] = groups.get(key, frozenset()) | {name}

    def whole(poses: Callable[..., Columns]) -> Callable[..., Columns]:
        def found(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
            keys = {full.dear.get(name, ("", 0.0))[0] for name in wanted} | {""}
            columns = poses(designs, angles, frozenset().union(*(groups.get(key, frozenset()) for key in keys)))
            return {name: columns[name] for name in (*wanted, "status")}

        return found

    precise = None if full.precise_poses is None else whole(full.precise_poses)
    return replace(full, poses=whole(full.poses), precise_poses=precise)


def subjects() -> dict[str, Callable[[], Subject]]:
    """Return how each subject is made, by its name."""
    made: dict[str, Callable[[], Subject]] = {}
    for name in (*NAMES, *CHAINS):
        if not isinstance(family(name).domain, March):
            made[name] = lambda name=name: _bare(name)
    for name in EFFECTS:
        if effect(name).outputs:
            made[name] = lambda name=name: _effect(name)
    for name in MACHINES:
        made[name] = lambda name=name: _machine(name)
    return made


def _bare(name: str) -> Subject:
    full = family(name)
    return Subject(name, full, len(full.parameters), full.pose_names, _centre(name, full))


def _effect(name: str) -> Subject:
    entry = effect(name)
    bare = family(entry.families[0])
    outputs = tuple(o.name for o in entry.outputs)
    full = extended(bare, outputs)
    return Subject(name, full, len(bare.parameters), outputs, ordinary(full, 1)[0])


def _machine(name: str) -> Subject:
    members, outputs = MACHINES[name]
    points = [f"{member}.{'tip' if 'tip' in str(how) else _POINTS[_family_of(how)]}" for member, how in members.items()]
    full = extended(family(sweep.machine(members, {"clearance": {"distance": points}})), outputs)
    centre = np.zeros(len(full.parameters))
    for member, how in members.items():
        part = family(_family_of(how))
        names = [p for p in full.parameter_names if p.startswith(f"{member}.")]
        own = extended(part, [o.removeprefix(f"{member}.") for o in outputs if o.startswith(f"{member}.")])
        values = dict(zip(own.parameter_names, _regular(own), strict=True))
        for p in names:
            at = full.parameter_names.index(p)
            default = full.parameters[at].default
            centre[at] = values.get(p.removeprefix(f"{member}."), 0.0 if default is None else default)
    return Subject(name, full, len(full.parameters), outputs, centre)


_POINTS = {"slider_crank": "c", "swivel": "p", "cam": "r", "rssr+guide": "point", "four_bar": "m"}


def _family_of(how: object) -> str:
    """Return the name of a member's family, or chain."""
    named = how["family"] if isinstance(how, dict) else how
    return named if isinstance(named, str) else "+".join(named)


def _regular(full: Family) -> Array:
    """Return a regular design of a member: as of a chain or family alone, with inputs of its effects."""
    return ordinary(full, 1)[0] if full.dear else _centre(full.name, full)


def _centre(name: str, full: Family) -> Array:
    parts = name.split("+")
    values: dict[str, float] = {}
    for k, part in enumerate(parts, start=1):
        own = dict(family(part).example)
        if k > 1 and part == "guide":
            own = dict(zip(family(part).parameter_names, guided_four_bars(1, 3)[0], strict=True))
        values |= {f"{p}{k}" if len(parts) > 1 else p: v for p, v in own.items()}
    default = {p.name: p.default if p.default is not None else 0.0 for p in full.parameters}
    return np.array([values.get(p.name, default[p.name]) for p in full.parameters])


def moves(subject: Subject, designs: Array) -> Array:
    """Return whether the mechanism exists all over the turn or interval, (n,)."""
    closed = on_closed_turn(subject.family)
    phi = np.tile(PHI, (len(designs), 1))
    with np.errstate(all="ignore"):
        status = np.asarray(closed.poses(designs, Angles.of(phi), frozenset(subject.outputs))["status"])
    return (status == st.OK).all(axis=1)


def random_designs(subject: Subject, kind: str, n: int, seed: int) -> Array:
    """Return up to n designs of a kind that move all the way."""
    random = np.random.default_rng(seed)
    if kind == "peaky":
        return _peaky(subject, n, random)
    found = np.empty((0, subject.centre.size))
    for _ in range(12):
        more = _spread(subject, kind, 4 * n, random)
        if kind == "edge":
            more = _towards_edge(subject, more, random)
        more = more[moves(subject, more)]
        found = np.concatenate([found, more])
        if len(found) >= n:
            break
    return found[:n]


def _peaky(subject: Subject, n: int, random: np.random.Generator) -> Array:
    """Return designs with the narrowest peaks of a random walk that climbs the largest magnitude over the median."""
    designs = random_designs(subject, "wide", n, int(random.integers(1 << 30)))
    names = [o for o in subject.outputs if o in subject.family.derivative_of.values()] or list(subject.outputs)
    full, phi = on_closed_turn(subject.family), 2.0 * np.pi * (np.arange(PEAKS) + 0.37) / PEAKS

    def score(given: Array) -> Array:
        with np.errstate(all="ignore"):
            found = full.poses(given, Angles.of(np.tile(phi, (len(given), 1))), frozenset(names))
        high = [np.abs(np.asarray(found[name])) for name in names]
        peak = np.max([y.max(axis=1) / (np.median(y, axis=1) + 1e-300 + 1e-9 * y.max(axis=1)) for y in high], axis=0)
        return np.where((np.asarray(found["status"]) == st.OK).all(axis=1), peak, -1.0)

    free = [k for k, p in enumerate(subject.family.parameters) if p.choices is None and p.unit != "count"]
    best = score(designs) if len(designs) else np.zeros(0)
    for k in range(WALK if len(designs) else 0):
        tried = designs.copy()
        step = 10.0 ** -(0.5 + 3.0 * k / WALK)
        tried[:, free] *= 1.0 + step * random.normal(size=(len(designs), len(free)))
        tried[:, free] += 0.1 * step * random.normal(size=(len(designs), len(free)))
        for column, p in enumerate(subject.family.parameters):
            if p.positive or p.not_negative:
                tried[:, column] = np.abs(tried[:, column])
        now = score(tried)
        better = now > best
        designs[better], best[better] = tried[better], now[better]
    return designs


def _spread(subject: Subject, kind: str, n: int, random: np.random.Generator) -> Array:
    designs = np.tile(subject.centre, (n, 1))
    width = {"ordinary": 0.15, "wide": 0.8, "edge": 0.8, "tiny": 0.15, "long": 0.3}[kind]
    if subject.own < subject.centre.size:
        width *= 0.5
    lengths = []
    for k, p in enumerate(subject.family.parameters):
        if p.choices is not None:
            designs[:, k] = random.choice(p.choices, n)
            continue
        if p.unit == "count":  # teeth and the like: whole numbers, or the turn does not close
            designs[:, k] = np.rint(designs[:, k] + random.integers(0, 5, n))
            continue
        inner = k < subject.own
        if inner and p.unit == "length" and p.positive:
            lengths.append(k)
        factor = np.exp(random.uniform(-1.0, 1.0, n) * (width if inner else 0.7))
        if inner and p.unit == "angle":
            designs[:, k] += random.uniform(-1.0, 1.0, n) * width
        else:
            designs[:, k] *= factor
            if inner and not p.positive and not p.not_negative and kind in ("wide", "edge"):
                designs[:, k] *= random.choice([-1.0, 1.0], n)
    if kind == "tiny" and lengths:
        one = lengths[0]
        designs[:, one] *= 10.0 ** random.uniform(-5.0, -1.0, n)
    if kind == "long" and len(lengths) > 1:
        stretched = 10.0 ** random.uniform(0.5, 4.0, n)
        pair = random.permutation(lengths)[:2]
        # Two long links that nearly balance each other: the difference of both stays as it was.
        designs[:, pair[1]] += designs[:, pair[0]] * (stretched - 1.0)
        designs[:, pair[0]] *= stretched
    return designs


def _towards_edge(subject: Subject, designs: Array, random: np.random.Generator) -> Array:
    """Return designs between one that moves and one that does not, at 1e-2 to 1e-10 of the way before the edge."""
    good = designs[moves(subject, designs)]
    bad = _spread(subject, "wide", len(good), random)
    away = ~moves(subject, bad)
    good, bad = good[away], bad[away]
    choices = [k for k, p in enumerate(subject.family.parameters) if p.choices is not None or p.unit == "count"]
    bad[:, choices] = good[:, choices]
    low, high = np.zeros(len(good)), np.ones(len(good))
    for _ in range(40 if len(good) else 0):
        middle = 0.5 * (low + high)
        inside = moves(subject, good + middle[:, None] * (bad - good))
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    share = low * (1.0 - 10.0 ** random.uniform(-10.0, -2.0, len(good)))
    return good + share[:, None] * (bad - good)


__all__ = ["KINDS", "Subject", "all_at_once", "moves", "random_designs", "subjects", "sweep"]
