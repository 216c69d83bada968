"""Features of curves that even samples may miss: fast waves, narrow peaks, kinks at known angles.

Families declare them by capabilities; a chain, a machine and a family with loads derive theirs from their parts.  The
searches for extrema, means and events start with sufficiently dense samples, and cut the turn where curves switch.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias, TypeVar

import numpy as np

from kernels.types import TWO_PI, Array
from sweep.families.base import Angles, Columns, Family, Stage, floats
from sweep.families.capabilities import Assembly, DesignMap
from sweep.families.parts import Member
from sweep.numerics.curves import PER_GAP, with_jumps
from sweep.numerics.records import Indices, Mask
from sweep.numerics.singularities import Discriminant, singularities

NARROWEST = 1e-9  # angles [rad] closer than this count as one
SAMPLES_PER_WAVE = 32.0  # of a mechanism: they resolve its order and the next fifteen multiples
BROAD = 0.1  # width [rad] of peaks that the coarsest grids of a turn show

T = TypeVar("T")
Feature = TypeVar("Feature", "Waves", "Switches", "Singular", "Crossing", "Bends")
SingularCurve: TypeAlias = Callable[[Array, Angles], Array]


@dataclass(frozen=True)
class Waves:
    """Number of waves, or turns of the fastest part, per turn of the crank: ``count(designs)``, (n,).

    A wave as fast as the samples would look constant on all of them.  ``of`` names the pose outputs with these waves;
    None: all.
    """

    count: DesignMap
    of: frozenset[str] | None = None


@dataclass(frozen=True)
class Singular:
    """A smooth function of the crank angle that is positive where the motion is regular, besides those of `Assembly`.

    Near a complex zero of it there is a narrow peak, whose width is the distance of that zero from the real angles.
    ``curve(designs, angles, found)`` returns its values, (n, m), from the pose outputs ``needs``.  Since the motion has
    to exist over the whole turn, its values where the links do not reach do not matter.  ``of`` names the pose outputs
    with the peak; None: all.
    """

    curve: Callable[[Array, Angles, Columns], Array]
    needs: tuple[str, ...] = ()
    of: frozenset[str] | None = None

    @classmethod
    def where_small(cls, *names: str) -> Singular:
        """Sum of the squares of pose outputs, near whose zeros a link turns or moves abruptly."""

        def curve(designs: Array, angles: Angles, found: Columns) -> Array:
            values = np.stack(floats(found, *names))
            # Scaled by a power of two: the square of a determinant of large lengths would overflow.
            power = np.frexp(np.fmax.reduce(np.abs(values), axis=(0, 2)))[1]
            squared: Array = np.square(np.ldexp(values, -power[:, None])).sum(axis=0)
            return squared

        return cls(curve, names)


@dataclass(frozen=True)
class Switches:
    """Known crank angles at which outputs have a kink or a jump: ``angles(designs)``, (n, k) [rad].

    They are the ends of a law's phases, or the points of a table of loads.  ``of`` names the pose outputs that switch
    there; None: possibly all.
    """

    angles: DesignMap
    of: frozenset[str] | None = None


@dataclass(frozen=True)
class Crossing:
    """Jump where the pose output ``passing`` passes ``level(designs)``, (n,), in designs where it ``matters``.

    A tool that pierces is loaded from there to its turning point, perhaps for less of the turn than the spacing of two
    samples.  ``of`` names the pose outputs that may jump.
    """

    passing: str
    level: DesignMap
    matters: Callable[[Array], Mask]
    of: frozenset[str]


@dataclass(frozen=True)
class Bends:
    """Smooth functions of the crank angle at whose zeros the pose outputs ``of`` have kinks, jumps or narrow peaks.

    ``curves(designs, angles)`` returns their values, (n, m, q).  For example, a bearing's load changes its formula
    where the axial load exceeds a share of the radial one, friction reverses where a joint stops, and the permissible
    value of a bearing has a narrow peak where no axial load acts.  In the entry of an effect ``of`` are its own names,
    and ``curves(scene)`` gets a scene.  ``squares`` are non-negative functions, whose near
    zeros count: the direction of a velocity changes abruptly there.  With ``zero`` the outputs are non-negative and
    vanish at the zeros: the pressure of a contact goes like a root of its force.
    """

    of: frozenset[str]
    curves: Callable[..., Array]
    squares: bool = False
    zero: bool = False


@dataclass(frozen=True)
class Smooth:
    """An expensive pose output that is smooth over the whole turn: the length of the vector with components ``parts``.

    A scalar is its only component.
    """

    of: str
    parts: tuple[str, ...]


def about(family: Family, kind: type[Feature], outputs: Collection[str]) -> list[Feature]:
    """List the features of a kind that concern one of the given pose outputs, or all outputs."""
    return [known for known in family.every(kind) if known.of is None or not known.of.isdisjoint(outputs)]


def waves(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """Return the number of waves per turn of the given pose outputs, at least 1, (n,)."""
    most = np.ones(len(designs))
    for fast in about(family, Waves, outputs):
        count = np.abs(fast.count(designs))
        most = np.fmax(most, np.where(np.isfinite(count), count, 1.0))
    return most


def switches(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """Angles at which one of the given pose outputs switches, in [0, 2 pi), (n, k); 0 for invalid ones."""
    every = [np.zeros((len(designs), 0)), *(known.angles(designs) for known in about(family, Switches, outputs))]
    angles = np.mod(np.concatenate(every, axis=1), TWO_PI)
    return np.where(np.isfinite(angles), angles, 0.0)


def crossed(family: Family, designs: Array, outputs: Collection[str]) -> Mask:
    """Whether a design has a crossing at which one of the given pose outputs jumps, (n,)."""
    found: Mask = np.zeros(len(designs), np.bool_)
    for known in about(family, Crossing, outputs):
        found = found | known.matters(designs)
    return found


def samples_of_waves(family: Family, designs: Array) -> Array:
    """Return a number of even samples of a turn that resolves the waves of a mechanism, (n,); 0 without waves.

    Curves of a planet that turns m times have orders about multiples of m and none between.  Too few samples alias the
    higher orders onto lower ones, and show nothing at their own highest orders, so that they seem to resolve the curve.
    """
    count = waves(family, designs, ())
    return np.where(count > 1.0, SAMPLES_PER_WAVE * count, 0.0)


def samples_of_peaks(curves: Sequence[Discriminant], n: int) -> Array:
    """Return a number of even samples several of which lie in the narrowest peak, (n,); 0 for broad ones.

    ``curves`` are those of `Singular`: a link that turns abruptly has a peak of kinetic energy there.
    """
    width = singularities([partial(_reached, curve) for curve in curves], n).rho.min(axis=1)
    return np.where(width < BROAD, PER_GAP * TWO_PI / width, 0.0)


def least_samples(family: Family, designs: Array, outputs: Collection[str]) -> Array:
    """Return a number of even samples that resolves waves, peaks and gaps between angles, (n,); see `with_jumps`."""
    angles = np.sort(switches(family, designs, outputs), axis=1)
    gaps = np.diff(np.concatenate([angles, angles[:, :1] + TWO_PI], axis=1), axis=1)
    narrowest = np.where(gaps > NARROWEST, gaps, TWO_PI).min(axis=1, initial=TWO_PI)
    least = PER_GAP * np.maximum(TWO_PI / narrowest, waves(family, designs, outputs))
    least = np.maximum(least, samples_of_waves(family, designs))

    def peak(known: Singular, rows: Indices, phi: Array) -> Array:
        return measured(family, known, designs[rows], Angles.of(phi))

    peaks = [partial(peak, known) for known in about(family, Singular, outputs)]
    least = np.maximum(least, samples_of_peaks(peaks, len(designs)))
    return with_jumps(least, crossed(family, designs, outputs))


def singular_curves(family: Family, outputs: Collection[str]) -> Sequence[SingularCurve]:
    """List functions of designs (n, P) and angles whose complex zeros are the singularities of the pose outputs.

    A function that concerns several outputs is the same object for each of them.
    """
    every: dict[Singular, SingularCurve] = family.derived.setdefault(singular_curves, {})

    def curve_of(known: Singular) -> SingularCurve:
        return every.setdefault(known, partial(measured, family, known))

    found = [curve_of(known) for known in about(family, Singular, outputs)]
    discriminants = [loop.discriminant for loop in family.every(Assembly)]
    if set(outputs) <= set(discriminants):
        # Discriminants are smooth where they vanish, and defined where the links do not reach.
        return [partial(_where_reached, curve) for curve in found]
    return [*(curve_of(Singular(_only, (name,))) for name in discriminants), *found]


def _where_reached(curve: SingularCurve, designs: Array, angles: Angles) -> Array:
    return _present(curve(designs, angles))


def _reached(curve: Discriminant, rows: Indices, phi: Array) -> Array:
    return _present(curve(rows, phi))


def _present(values: Array) -> Array:
    """Values of a curve, 1 for designs whose links do not reach at one of the angles."""
    return np.where(np.isnan(values).any(axis=1, keepdims=True), 1.0, values)


def _only(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the only pose output among the columns."""
    (value,) = (np.asarray(values, np.float64) for name, values in found.items() if name != "status")
    return value


def measured(family: Family, known: Singular, designs: Array, angles: Angles) -> Array:
    """Values of a singular's curve, (n, m)."""
    found = family.poses(designs, angles, frozenset(known.needs)) if known.needs else {}
    return known.curve(designs, angles, {name: found[name] for name in known.needs})


def of_table(phi: Sequence[float], of: frozenset[str]) -> Switches:
    """Switches of pose outputs at the points of a table that all designs share."""
    angles = np.array(phi, np.float64)
    return Switches(lambda designs: np.tile(angles, (len(designs), 1)), of)


def of_order(order: int, of: frozenset[str]) -> Waves:
    """Waves of pose outputs under a Fourier series of the given order."""
    return Waves(lambda designs: np.full(len(designs), float(order)), of)


def of_stages(stages: Sequence[Stage]) -> list[object]:
    """List the features of a chain: waves of stages multiply; switches of stage 1 are at known angles."""
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
    """List the features of a machine: ratios of its members, and switches of members driven by the shaft.

    ``sums`` are the pose outputs that are sums over members, and share the features of their terms.
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
        found += [
            replace(
                known, of=frozenset(f"{m.name}.{name}" for name in known.of), curves=partial(_turned, m, known.curves)
            )
            for known in m.family.every(Bends)
            if m.driver is None
        ]
        for known in m.family.every(Singular):
            if known.needs:
                names = {name: f"{m.name}.{name}" for name in known.needs}
                found.append(Singular(partial(_renamed, m.designs, names, known.curve), tuple(names.values())))
            elif m.driver is None:
                found.append(Singular(partial(_turned, m, known.curve), of=_named(m, known.of, sums)))
    return found


def _of_part(member: Member, known: Crossing, sums: frozenset[str]) -> Crossing:
    level, matters = partial(on_part, member.designs, known.level), partial(on_part, member.designs, known.matters)
    return Crossing(f"{member.name}.{known.passing}", level, matters, _named(member, known.of, sums) or frozenset())


def _named(member: Member, names: frozenset[str] | None, sums: frozenset[str]) -> frozenset[str] | None:
    """Names of a member's pose outputs in the machine, and the sums over members; None for all stays None."""
    return None if names is None else frozenset(f"{member.name}.{name}" for name in names) | sums


def _geared(member: Member, count: DesignMap, designs: Array) -> Array:
    return abs(member.ratio) * count(member.designs(designs))


def _turned(member: Member, curves: Callable[..., Array], designs: Array, angles: Angles, *found: Columns) -> Array:
    """Functions of a member driven by the main shaft, at angles of the main shaft."""
    phase = member.phase(designs)
    return curves(member.designs(designs), Angles.of(member.ratio * angles.phi + phase[:, None]), *found)


def on_part(part: Callable[[Array], Array], of_design: Callable[[Array], T], designs: Array) -> T:
    """Evaluate a function of a stage's or member's designs on designs of the whole."""
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
