"""What curves over a turn hold between any even samples: fast waves, narrow peaks, kinks at angles known beforehand.

A family says so by capabilities; a chain, a machine and a family with loads make theirs of those of their parts.  The
searches for extrema, means and events begin with samples that are dense enough, and cut the turn where it switches.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from kernels.types import TWO_PI, Array
from sweep.families.base import Angles, Columns, Family, Stage, floats
from sweep.families.capabilities import Assembly, DesignMap
from sweep.families.parts import Member
from sweep.numerics.curves import PER_GAP

NARROWEST = 1e-9  # angles [rad] that are nearer to each other are one
SAMPLES_PER_WAVE = 32.0  # of a mechanism: they tell its order and the fifteen next multiples of that

T = TypeVar("T")
Feature = TypeVar("Feature", "Waves", "Switches", "Singular")
SingularCurve: TypeAlias = Callable[[Array, Angles], Array]


@dataclass(frozen=True)
class Waves:
    """How many waves, or turns of the fastest part, one turn of the crank holds: ``count(designs)``, (n,).

    A wave as fast as the samples stand would look like a constant to all of them.  ``of`` names the pose outputs that
    have these waves; None: all of them.
    """

    count: DesignMap
    of: frozenset[str] | None = None


@dataclass(frozen=True)
class Singular:
    """A smooth function of the crank angle that is positive where the motion is regular, beside those of `Assembly`.

    Near a complex zero of it lies a narrow peak, whose width is the distance of that zero from the real angles.
    ``curve(designs, angles, found)`` gives its values, (n, m), from the pose outputs ``needs``.  As the motion has to
    exist all over the turn, what it is where the links do not reach does not count.  ``of`` names the pose outputs that
    have the peak; None: all of them.
    """

    curve: Callable[[Array, Angles, Columns], Array]
    needs: tuple[str, ...] = ()
    of: frozenset[str] | None = None

    @classmethod
    def where_small(cls, *names: str) -> Singular:
        """Make the sum of the squares of pose outputs: where they nearly vanish something turns or moves at once."""

        def curve(designs: Array, angles: Angles, found: Columns) -> Array:
            values = np.stack(floats(found, *names))
            # To one size by a power of two: the square of a determinant of large lengths leaves float64.
            power = np.frexp(np.fmax.reduce(np.abs(values), axis=(0, 2)))[1]
            squared: Array = np.square(np.ldexp(values, -power[:, None])).sum(axis=0)
            return squared

        return cls(curve, names)


@dataclass(frozen=True)
class Switches:
    """Crank angles, known beforehand, at which outputs have a kink or a jump: ``angles(designs)``, (n, k) [rad].

    They are the ends of a law's phases, or the points of a table of loads.  ``of`` names the pose outputs that switch
    there; None: all of them may.
    """

    angles: DesignMap
    of: frozenset[str] | None = None


@dataclass(frozen=True)
class Crossing:
    """Outputs jump where the pose output ``of`` passes ``level(designs)``, (n,), in designs that it ``matters`` for.

    A tool that pierces is loaded from there to its turning point: perhaps for less of the turn than two samples span.
    ``felt`` names the pose outputs that may jump.
    """

    of: str
    level: DesignMap
    matters: Callable[[Array], NDArray[np.bool_]]
    felt: frozenset[str]


@dataclass(frozen=True)
class Bends:
    """Smooth functions of the crank angle at whose zeros the pose outputs ``of`` have kinks, jumps or narrow peaks.

    ``curves(designs, angles)`` gives their values, (n, m, q).  A bearing's load changes its formula where the load
    along the shaft passes a share of that across it, friction turns where a joint stops, and what a bearing permits
    has a narrow peak where nothing acts along the shaft.  Of ``squares``, which are never negative, the places count
    where they nearly vanish: the direction of a velocity turns at once there.  With ``zero`` the outputs vanish where
    the functions do, and are nowhere negative: the pressure of a contact goes like a root of its force.
    """

    of: frozenset[str]
    curves: Callable[[Array, Angles], Array]
    squares: bool = False
    zero: bool = False


@dataclass(frozen=True)
class Smooth:
    """A dear pose output that is smooth all over the turn: the length of the vector that the outputs ``parts`` make.

    A number is its own only part.
    """

    of: str
    parts: tuple[str, ...]


def _about(family: Family, kind: type[Feature], outputs: Collection[str]) -> list[Feature]:
    """Return what a family says of that kind about one of some pose outputs, or about all."""
    return [known for known in family.every(kind) if known.of is None or not known.of.isdisjoint(outputs)]


def waves(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """How many waves of some pose outputs one turn holds at least, (n,)."""
    most = np.ones(len(designs))
    for fast in _about(family, Waves, outputs):
        count = np.abs(fast.count(designs))
        most = np.fmax(most, np.where(np.isfinite(count), count, 1.0))
    return most


def switching(family: Family, outputs: Collection[str]) -> list[Switches]:
    """Return what tells at which crank angles one of some pose outputs switches."""
    return _about(family, Switches, outputs)


def switches(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """Angles at which one of some pose outputs switches, in [0, 2 pi), (n, k); 0 for what is no number."""
    every = [np.zeros((len(designs), 0)), *(known.angles(designs) for known in switching(family, outputs))]
    angles = np.mod(np.concatenate(every, axis=1), TWO_PI)
    return np.where(np.isfinite(angles), angles, 0.0)


def crossings(family: Family, outputs: Collection[str]) -> list[Crossing]:
    """Return what tells where one of some pose outputs jumps as another one passes a level."""
    return [known for known in family.every(Crossing) if not known.felt.isdisjoint(outputs)]


def crossed(family: Family, designs: Array, outputs: Collection[str]) -> NDArray[np.bool_]:
    """Which designs have one of some pose outputs that jumps where another one passes a level, (n,)."""
    found: NDArray[np.bool_] = np.zeros(len(designs), np.bool_)
    for known in crossings(family, outputs):
        found = found | known.matters(designs)
    return found


def samples_of_waves(family: Family, designs: Array) -> Array:
    """Return so many even samples of a turn that the waves of a mechanism are resolved, (n,); 0 where it has none.

    Curves of a planet that turns m times have orders about multiples of m and none between.  Too few samples fold the
    higher ones onto lower orders and show nothing at their own highest, so they seem to resolve the curve.
    """
    count = waves(family, designs, ())
    return np.where(count > 1.0, SAMPLES_PER_WAVE * count, 0.0)


def least_samples(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """Return even samples of a turn, (n,), of which some lie on each wave and between known angles; inf if it jumps."""
    angles = np.sort(switches(family, designs, outputs), axis=1)
    gaps = np.diff(np.concatenate([angles, angles[:, :1] + TWO_PI], axis=1), axis=1)
    narrowest = np.where(gaps > NARROWEST, gaps, TWO_PI).min(axis=1, initial=TWO_PI)
    least = PER_GAP * np.maximum(TWO_PI / narrowest, waves(family, designs, outputs))
    least = np.maximum(least, samples_of_waves(family, designs))
    return np.where(crossed(family, designs, outputs), np.inf, least)


def bends(family: Family, output: str) -> tuple[Bends, ...]:
    """Return what tells at which crank angles curves of a pose output bend."""
    return tuple(known for known in family.every(Bends) if output in known.of)


def singular(family: Family, outputs: Collection[str]) -> list[Singular]:
    """Return what tells where one of some pose outputs has a narrow peak, beside the discriminants."""
    return _about(family, Singular, outputs)


def singular_curves(family: Family, outputs: Collection[str]) -> Sequence[SingularCurve]:
    """Functions of designs (n, P) and angles whose complex zeros are the singularities of some pose outputs."""
    found = [partial(_measured, family, known) for known in singular(family, outputs)]
    discriminants = [loop.discriminant for loop in family.every(Assembly)]
    if set(outputs) <= set(discriminants):
        # They are smooth where they vanish, and go on where the links do not reach.
        return [partial(_where_reached, curve) for curve in found]
    return [*(partial(_measured, family, Singular(_only, (name,))) for name in discriminants), *found]


def _where_reached(curve: SingularCurve, designs: Array, angles: Angles) -> Array:
    """Values of a curve, 1 for designs whose links do not reach at one of the angles."""
    values = curve(designs, angles)
    return np.where(np.isnan(values).any(axis=1, keepdims=True), 1.0, values)


def _only(designs: Array, angles: Angles, found: Columns) -> Array:
    """One pose output that is needed."""
    (value,) = (np.asarray(values, np.float64) for name, values in found.items() if name != "status")
    return value


def _measured(family: Family, known: Singular, designs: Array, angles: Angles) -> Array:
    found = family.poses(designs, angles, frozenset(known.needs)) if known.needs else {}
    return known.curve(designs, angles, {name: found[name] for name in known.needs})


def of_table(phi: Sequence[float], of: frozenset[str]) -> Switches:
    """Switches of pose outputs at the points of a table that all designs share."""
    angles = np.array(phi, np.float64)
    return Switches(lambda designs: np.tile(angles, (len(designs), 1)), of)


def of_order(order: int, of: frozenset[str]) -> Waves:
    """Waves of pose outputs under a Fourier series of that order."""
    return Waves(lambda designs: np.full(len(designs), float(order)), of)


def of_stages(stages: Sequence[Stage]) -> list[object]:
    """Return what the stages of a chain bring in: waves multiply; the switches of stage 1 are at known angles."""
    first = stages[0]
    found: list[object] = [
        Switches(partial(on_part, first.designs, known.angles)) for known in first.family.every(Switches)
    ]
    for stage in stages:
        for known in stage.family.every(Singular):
            if known.needs or stage is first:
                names = {name: f"{name}{stage.number}" for name in known.needs}
                found.append(Singular(partial(_renamed, stage.designs, names, known.curve), tuple(names.values())))
    if any(stage.family.every(Waves) for stage in stages):
        found.append(Waves(partial(_of_chain, tuple(stages))))
    return found


def of_members(members: Sequence[Member], sums: frozenset[str]) -> list[object]:
    """Return what the members of a machine bring in: their ratios, and the switches of those that the shaft drives.

    ``sums`` are the pose outputs that are sums over members, and feel what an output of one of them does.
    """
    found: list[object] = [Waves(partial(_of_member, tuple(members)))]
    for m in members:
        if m.driver is None:
            found += [
                Switches(partial(_on_shaft, m, known.angles), _named(m, known.of, sums))
                for known in m.family.every(Switches)
            ]
            found += [
                Waves(partial(_geared, m, known.count), _named(m, known.of, sums))
                for known in m.family.every(Waves)
                if known.of is not None
            ]
        found += [_of_part(m, known, sums) for known in m.family.every(Crossing)]
        found += [_of_shaft(m, known) for known in m.family.every(Bends) if m.driver is None]
        for known in m.family.every(Singular):
            if known.needs:
                names = {name: f"{m.name}.{name}" for name in known.needs}
                found.append(Singular(partial(_renamed, m.designs, names, known.curve), tuple(names.values())))
            elif m.driver is None:
                found.append(Singular(partial(_turned, m, known.curve), of=_named(m, known.of, sums)))
    return found


def _of_part(member: Member, known: Crossing, sums: frozenset[str]) -> Crossing:
    level, matters = partial(on_part, member.designs, known.level), partial(on_part, member.designs, known.matters)
    return Crossing(f"{member.name}.{known.of}", level, matters, _named(member, known.felt, sums) or frozenset())


def _named(member: Member, names: frozenset[str] | None, sums: frozenset[str]) -> frozenset[str] | None:
    """Names of a member's pose outputs in the machine, and the sums over members; None for all stays None."""
    return None if names is None else frozenset(f"{member.name}.{name}" for name in names) | sums


def _geared(member: Member, count: DesignMap, designs: Array) -> Array:
    found: Array = abs(member.ratio) * count(member.designs(designs))
    return found


def _of_shaft(member: Member, known: Bends) -> Bends:
    names = frozenset(f"{member.name}.{name}" for name in known.of)
    return Bends(names, partial(_turned, member, known.curves), known.squares, known.zero)


def _turned(member: Member, curves: Callable[..., Array], designs: Array, angles: Angles, *found: Columns) -> Array:
    """Functions of a member that the main shaft drives, at angles of the main shaft."""
    phase = member.phase(designs)
    return curves(member.designs(designs), Angles.of(member.ratio * angles.phi + phase[:, None]), *found)


def on_part(part: Callable[[Array], Array], of_design: Callable[[Array], T], designs: Array) -> T:
    """Return a function of the designs of a stage or a member for those of the whole."""
    return of_design(part(designs))


def _renamed(
    part: Callable[[Array], Array], names: dict[str, str], curve: Callable[[Array, Angles, Columns], Array],
    designs: Array, angles: Angles, found: Columns,
) -> Array:  # fmt: skip
    return curve(part(designs), angles, {own: found[name] for own, name in names.items()})


def _of_chain(stages: tuple[Stage, ...], designs: Array) -> Array:
    total = np.ones(len(designs))
    for stage in stages:
        total = total * waves(stage.family, stage.designs(designs), ())
    return total


def _of_member(members: tuple[Member, ...], designs: Array) -> Array:
    total: dict[str, Array] = {}
    for m in members:
        own: Array = abs(m.ratio) * waves(m.family, m.designs(designs), ())
        total[m.name] = own if m.driver is None else own * total[m.driver[0]]
    most: Array = np.maximum.reduce([np.ones(len(designs)), *total.values()])
    return most


def _on_shaft(member: Member, angles: DesignMap, designs: Array) -> Array:
    """Angles of the main shaft at which a member's crank passes its switches."""
    own = angles(member.designs(designs)) - member.phase(designs)[:, None]
    turns = TWO_PI * np.arange(abs(member.ratio))
    every: Array = (own[:, :, None] + turns) / member.ratio
    return every.reshape(len(designs), own.shape[1] * turns.size)
