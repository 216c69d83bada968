"""Places on a member that relations and tools are about: joints of every stage, points of its output link, axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from kernels.types import Array
from sweep.families.capabilities import Coordinates, DesignMap, OutputLink, Points, Skeleton
from sweep.families.names import ends_in_digit

if TYPE_CHECKING:
    from sweep.families.frames import Frame
    from sweep.families.parts import Member, Stage

AXES = "xyz"


class Site(NamedTuple):
    """A point or direction of one stage.

    ``stage`` is its place among the stages, from 0; one of the others says what it is made of: ``moving`` pose outputs
    of the member, ``fixed`` designs of the stage, ``on_link`` a point that turns with the output link.  A ``free``
    vector is a direction.
    """

    stage: int
    moving: Coordinates | None = None
    fixed: DesignMap | None = None
    on_link: tuple[float, float, float] | None = None
    free: bool = False


def sites_of(member: Member) -> dict[str, Site]:
    """Return the sites of a member by name: joints of a chain's stage have its number, those of the last one need none.

    ``line_axis`` is the direction of the fixed axis or line ``line``.
    """
    found: dict[str, Site] = {}
    stages = getattr(member.family, "stages", ())
    families = [stage.family for stage in stages] or [member.family]
    for k, family in enumerate(families):
        for name, at in ((name, at) for points in family.every(Points) for name, at in points.at.items()):
            for number in _numbers(stages, k, name):
                x, y, z = (one and f"{one}{number}" for one in at)
                found[f"{name}{number}"] = Site(k, moving=(x, y, z))
        for name, fixed in ((name, at) for skeleton in family.every(Skeleton) for name, at in skeleton.fixed.items()):
            for number in _numbers(stages, k, name):
                found[f"{name}{number}"] = Site(k, fixed=fixed.at)
                if fixed.axis is not None:
                    found[f"{name}{number}_axis"] = Site(k, fixed=fixed.axis, free=True)
    found |= {name: Site(len(families) - 1, on_link=at) for name, at in member.carried}
    return found


def _numbers(stages: Sequence[Stage], k: int, *names: str) -> list[str]:
    """Return what can stand behind names of the stage of index k: its number, in the last one also nothing."""
    if not stages:
        return [""]
    bare = k + 1 == len(stages) and not any(map(ends_in_digit, names))
    return [str(k + 1)] + [""] * bare


def links_of(member: Member) -> dict[str, tuple[str, str]]:
    """Return the links of a member as segments, the names of two sites each, where both ends have places."""
    found, known = {}, member.sites
    stages = getattr(member.family, "stages", ())
    families = [stage.family for stage in stages] or [member.family]
    for k, family in enumerate(families):
        for link in (link for skeleton in family.every(Skeleton) for link in skeleton.links):
            for number in _numbers(stages, k, link.name, *link.joints[:2]):
                ends = [f"{joint}{number}" for joint in link.joints[:2]]
                if len(ends) == 2 and set(ends) <= known.keys():
                    found[f"{link.name}{number}".replace(" ", "_")] = (ends[0], ends[1])
    return found


def made_of(member: Member, site: Site) -> set[str]:
    """Return the pose outputs of the member that a site's coordinates are made of."""
    if site.on_link is not None:
        return {member.family.position}
    return {name for name in site.moving or () if name}


def coordinates(
    member: Member, name: str, frames: Sequence[Frame | None], designs: Array, result: Mapping[str, Any]
) -> dict[str, Any]:
    """Return coordinates or components of a site in the machine's frame, (n, m) or (n, 1)."""
    site = member.sites[name]
    frame = frames[site.stage]
    assert frame is not None
    own = member.designs(designs)
    stages: tuple[Stage, ...] = getattr(member.family, "stages", ())
    if site.on_link is not None:
        link = member.family.find(OutputLink)
        assert link is not None
        local: list[Any] = link.carried(own, result[member.family.position], site.on_link)
    elif site.fixed is not None:
        at = site.fixed(stages[site.stage].designs(own) if stages else own)
        local = [at[:, [k]] for k in range(3)]
    else:
        local = [result[one] if one else 0.0 for one in site.moving or ()]
    placed = frame.turned(local) if site.free else frame.placed(local)
    return {f"{name}_{axis}": part for axis, part in zip(AXES, placed, strict=True)}
