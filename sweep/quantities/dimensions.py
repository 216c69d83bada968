"""Sizes computed from the dimensions alone: shortest link, link ratio, arm ratio, distance of pivots.

No pose is needed.  Each size is the minimum or maximum of smooth *pieces*, so that limits on it have exact gradients:
every piece stays on its side of a bound.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations, permutations
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sweep.costs import nanoseconds
from sweep.effects import input_names
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step, Work, of_family
from sweep.families.capabilities import Dimensions, skeleton_of
from sweep.families.machines.machine import Machine

DesignFunction: TypeAlias = Callable[[Any], Any]
"""Function of designs (n, P), real or complex, that returns one number per design, (n,)."""

LEAST_LINK = Output("least_link", "length", "length of the shortest moving link")
LINK_RATIO = Output("link_ratio", "1", "length of the shortest moving link over that of the longest")
ARM_RATIO = Output(
    "arm_ratio", "1",
    "largest distance of a point that a link carries from a joint of that link, over the distance of its two joints",
)  # fmt: skip
PIVOT_DISTANCE = Output("pivot_distance", "length", "least distance between the centres of two bearings in the frame")
SIZE = Output("size", "length", "largest length of the mechanism, offsets by magnitude")
ALL = (LEAST_LINK, LINK_RATIO, ARM_RATIO, PIVOT_DISTANCE)

ROUNDINGS = 16.0 * 2.0**-53  # a few products, a sum and a root


def near_unit_size(family: Family, designs: Array) -> tuple[Array, NDArray[np.int32]]:
    """Scale all lengths of the designs near 1 by powers of two; return the designs and the exponents (n,).

    The scaling prevents overflow and is exact.
    """
    lengths = [k for k, p in enumerate(family.parameters) if p.unit == "length"]
    _, exponent = np.frexp(np.abs(designs[:, lengths]).max(axis=1, initial=0.0))
    scaled = designs.copy()
    scaled[:, lengths] = np.ldexp(designs[:, lengths], -exponent[:, None])
    return scaled, exponent


@dataclass(frozen=True)
class MechanismSize:
    """A size of a family: the minimum (``least``) or maximum of its pieces, which are squares if ``squared``.

    Squares are smooth where a length vanishes.
    """

    output: Output
    least: bool
    squared: bool
    pieces: tuple[DesignFunction, ...]

    def values(self, family: Family, designs: Array) -> Array:
        """Size of every design, (n,).

        Lengths are scaled near 1 by a power of two first, so that nothing overflows.
        """
        scaled, exponent = near_unit_size(family, designs)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            each = np.stack([piece(scaled) for piece in self.pieces])
        found = each.min(axis=0) if self.least else each.max(axis=0)
        found = np.sqrt(found) if self.squared else found
        return np.asarray(np.ldexp(found, exponent) if self.output.unit == "length" else found, np.float64)


@dataclass(frozen=True)
class _Part:
    """A stage's or member's family with its parameter columns and the prefix and suffix of its names."""

    family: Family
    columns: NDArray[np.intp]
    member: str = ""
    stage: str = ""

    def of(self, piece: DesignFunction) -> DesignFunction:
        """Piece of the part as a function of the whole design."""
        return partial(of_columns, piece, self.columns)


def of_columns(piece: DesignFunction, columns: slice | NDArray[np.intp], designs: Any) -> Any:
    """Evaluate a piece of a part of the mechanism on the part's parameter columns."""
    return piece(designs[:, columns])


@of_family
def sizes(family: Family) -> dict[str, MechanismSize]:
    """All sizes of a family by name: of the whole, of every member and of every stage."""
    groups: dict[tuple[str, str], list[_Part]] = {}
    for part in _parts(family):
        for key in dict.fromkeys((("", ""), (part.member, ""), (part.member, part.stage))):
            groups.setdefault(key, []).append(part)
    return {
        size.output.name: size
        for (member, stage), parts in groups.items()
        for of in ALL
        if (size := _size(of, member, stage, parts)) is not None
    }


def dimension_step(family: Family) -> Step | None:
    """Step that computes all sizes; None for a family without sizes."""
    found = sizes(family)
    if not found:
        return None

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        columns: Columns = {"status": np.zeros(len(designs), np.uint8)}
        for name in wanted & found.keys():
            values = found[name].values(family, designs)
            exact = not found[name].squared and found[name].output.unit == "length"
            columns |= {name: values, f"err_{name}": values * (0.0 if exact else ROUNDINGS)}
        return columns

    provides = tuple(one.output for one in found.values())
    return Step("sizes", provides, run, work=Work.PARAMETERS, cost=lambda accuracy: nanoseconds("work", "size"))


def lengths(family: Family) -> tuple[str, ...]:
    """Names of the parameters that are lengths of the mechanism; placements and inputs of effects are left out."""
    others = set(input_names(family)) | {p.name for p in family.parameters if p.places}
    if isinstance(family, Machine):
        others |= {p.name for relation in family.relations for p in relation.parameters}
    return tuple(p.name for p in family.parameters if p.unit == "length" and p.name not in others)


def size_step(family: Family) -> Step | None:
    """Route to ``size``; None where no parameter is a length."""
    if not any(p.unit == "length" and not p.places for p in family.parameters):
        return None

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        n, columns = len(designs), [family.parameter_names.index(name) for name in lengths(family)]
        found: Columns = {name: np.abs(designs[:, columns]).max(axis=1) for name in wanted & {SIZE.name}}
        return found | {f"err_{SIZE.name}": np.zeros(n), "status": np.zeros(n, np.uint8)}

    return Step("size", (SIZE,), run, work=Work.PARAMETERS, cost=lambda accuracy: nanoseconds("work", "size"))


def _parts(family: Family) -> Iterator[_Part]:
    if isinstance(family, Machine):
        for m in family.members:
            first = m.columns.start
            for part in _parts(m.family):
                yield _Part(part.family, part.columns + first, f"{m.name}.", part.stage)
        return
    for stage in family.stages:
        if any(p.unit == "length" for p in stage.family.parameters):  # a family without lengths has no size
            yield _Part(stage.family, np.arange(stage.columns.start, stage.columns.stop), stage=stage.tail)


def _size(of: Output, member: str, stage: str, parts: list[_Part]) -> MechanismSize | None:
    """Size over several parts together; None where they have no pieces."""
    pieces = tuple(part.of(piece) for part in parts for piece in _PIECES[of.name](part.family))
    if not pieces:
        return None
    where = (f"{member.rstrip('.')}: " if member else "") + (f"stage {stage}: " if stage else "")
    named = Output(f"{member}{of.name}{stage}", of.unit, f"{where}{of.text}")
    squared = of in (ARM_RATIO, PIVOT_DISTANCE)
    return MechanismSize(named, of is not ARM_RATIO, squared, pieces)


def _links(family: Family) -> list[DesignFunction]:
    """Lengths of the moving links; an optional link of length 0 counts as the longest regular link."""
    found: list[DesignFunction] = []
    for dimensions in family.every(Dimensions):
        always = [partial(_length, _columns(family, names)) for names in dimensions.links]
        found += always
        found += [partial(_present, _columns(family, (name,)), tuple(always)) for name in dimensions.optional]
    return found


def _ratios(family: Family) -> list[DesignFunction]:
    return [partial(_quotient, one, other) for one, other in permutations(_links(family), 2)]


def _arms(family: Family) -> list[DesignFunction]:
    """Squared distances of a carried point from both joints of its link, over the squared distance of the joints."""
    return [
        partial(_arm, _columns(family, arm.point), _columns(family, arm.link), share)
        for dimensions in family.every(Dimensions)
        for arm in dimensions.arms
        for share in (0.0, 1.0)
    ]


def _pivots(family: Family) -> list[DesignFunction]:
    """Squared distances between the centres of all pairs of fixed axes."""
    return [
        partial(_apart, one.at, other.at)
        for one, other in combinations([f for f in skeleton_of(family).fixed.values() if f.kind == "axis"], 2)
    ]


_PIECES: dict[str, Callable[[Family], list[DesignFunction]]] = {
    LEAST_LINK.name: _links, LINK_RATIO.name: _ratios, ARM_RATIO.name: _arms, PIVOT_DISTANCE.name: _pivots,
}  # fmt: skip


def _columns(family: Family, names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(family.parameter_names.index(name) for name in names)


def _length(columns: tuple[int, ...], designs: Any) -> Any:
    if len(columns) == 1:
        found = designs[:, columns[0]]
        return np.where(found.real < 0.0, -found, found)
    return np.sqrt(sum(designs[:, k] ** 2 for k in columns))


def _present(columns: tuple[int, ...], others: tuple[DesignFunction, ...], designs: Any) -> Any:
    found = _length(columns, designs)
    there = np.stack([other(designs) for other in others])
    longest = np.take_along_axis(there, there.real.argmax(axis=0)[None, :], axis=0)[0]
    return np.where(found.real == 0.0, longest, found)


def _quotient(one: DesignFunction, other: DesignFunction, designs: Any) -> Any:
    return one(designs) / other(designs)


def _arm(point: tuple[int, ...], link: tuple[int, ...], share: float, designs: Any) -> Any:
    size = sum(designs[:, k] ** 2 for k in link)
    others = (*link, *[None] * (len(point) - len(link)))
    apart = [designs[:, p] - (0.0 if k is None else share * designs[:, k]) for p, k in zip(point, others, strict=True)]
    return sum(x**2 for x in apart) / size


def _apart(one: DesignFunction, other: DesignFunction, designs: Any) -> Any:
    return ((one(designs) - other(designs)) ** 2).sum(axis=1)
