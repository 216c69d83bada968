"""``joints``: coordinates of the joints of a mechanism, stage by stage and member by member."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kernels.status import OK
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, grid_in_radians, in_radians
from sweep.evaluation.poses import values_of_the_variable
from sweep.evaluation.tables import Table, one_design
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Angles, Array, Family
from sweep.families.capabilities import Link, OutputLink, skeleton_of
from sweep.families.chain import Chain, drive, driving_names
from sweep.families.frames import WHOLE, Frame
from sweep.families.machines.machine import Machine
from sweep.families.parts import Member
from sweep.families.sites import AXES, TIP

if TYPE_CHECKING:
    import pandas as pd

UNITS = {"phi": "rad", "x": "length", "y": "length", "z": "length"}


@dataclass(frozen=True)
class Part:
    """One stage of one member with its joints over the crank angles.

    Parameters
    ----------
    member, stage : names; empty where there is only one
    frame : frame of the coordinates: "machine", that of a chain's first stage, or the family's own
    family, design : the stage's own family and its parameters, (P,)
    phi : angle of the driving shaft, (m,)
    crank, position : the stage's own crank angle and its output, the angle or displacement of its follower, (m,)
    joints : paths by name, (m, 3) each, fixed joints too
    axes : unit vectors of axes and slides, by fixed joint
    kinds : "axis", "slide" or "point", by fixed joint
    links : the links, with the joints that they connect
    status : (m,)
    shift : displacement of its frame beside other frames, in a scene that holds several
    """

    member: str
    stage: str
    frame: str
    family: Family
    design: Array
    phi: Array
    crank: Array
    position: Array
    joints: Mapping[str, Array]
    axes: Mapping[str, Array]
    kinds: Mapping[str, str]
    links: tuple[Link, ...]
    status: NDArray[np.uint8]
    shift: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def label(self) -> str:
        """Member and stage in words; the family's name where there is only one."""
        words = [self.member, f"stage {self.stage}" if self.stage else ""]
        return " ".join(word for word in words if word) or self.family.name

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the stage's own design, by name."""
        return dict(zip(self.family.parameter_names, self.design.tolist(), strict=True))


@dataclass(frozen=True)
class _Place:
    """Names of a stage, and its frame relative to the frame of the coordinates."""

    member: str = ""
    stage: str = ""
    frame: str = ""
    placed: Frame = WHOLE
    tip: Array | None = None


def joints(mechanism: Mechanism, design: Table, phi: ArrayLike, *, angles: AngleUnit | None = None) -> pd.DataFrame:
    """Return joint coordinates of every stage and member of one design, fixed pivots included.

    Parameters
    ----------
    mechanism : a family's name, a list of them for a chain, a table of members for a machine
    design : the parameters of one design, in one length unit and rad
    phi : angles of the driving shaft [rad], one or a plain list; over an interval values of its variable, of a march
        equal steps of one turn from 0
    angles : unit of the given angles, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    DataFrame
        one row per joint and angle, in the order member, stage, joint, angle; joints of fixed points first:

        ========== ==================================================================================
        member     name of the machine's member; empty for a family or a chain
        stage      number of the stage in a chain; empty where there is one stage
        frame      "machine" where x, y, z are in the machine's frame; else the stage or family of the frame
        joint      name of the joint as on the page of its family; ``tip`` is that of a member
        kind       "fixed" or "moving"
        phi        angle of the driving shaft [rad]
        x, y, z    coordinates [length unit of the design]; nan where the pose does not exist
        status     reason of a nan, see :mod:`kernels.status`
        ========== ==================================================================================

        All stages of a chain are given in the frame of the first one; where a family has no output axis for the next
        stage, each stage keeps its own frame.  ``attrs["units"]`` names the units.

    Raises
    ------
    InputError
        for a table of several designs, a faulty parameter, an angle that is no finite number.

    Examples
    --------
    >>> import sweep
    >>> found = sweep.joints("four_bar", {"a": 1.0, "b": 3.0, "c": 3.0, "e": 3.0}, [0.0])
    >>> found.loc[found["joint"] == "d", ["kind", "x", "y", "z"]].values.tolist()
    [['fixed', 3.0, 0.0, 0.0]]
    """
    import pandas as pd

    columns: dict[str, list[Any]] = {
        name: [] for name in ("member", "stage", "frame", "joint", "kind", "phi", "x", "y", "z", "status")
    }
    family = find_family(mechanism)
    phi = grid_in_radians(family.domain, phi, angles)
    for part in parts(mechanism, in_radians(family, design, angles), phi):
        m = part.phi.size
        for name, path in part.joints.items():
            fixed = name in part.kinds
            head = (part.member, part.stage, part.frame, name, "fixed" if fixed else "moving")
            for column, value in zip(columns, head, strict=False):
                columns[column] += [value] * m
            for column, values in (("phi", part.phi), *zip("xyz", path.T, strict=True)):
                columns[column] += values.tolist()
            columns["status"] += ([OK] * m) if fixed else part.status.tolist()
    table = pd.DataFrame(columns)
    table.attrs["units"] = dict(UNITS)
    return table


def parts(mechanism: Mechanism, design: Table, phi: ArrayLike) -> list[Part]:
    """List the stages of a mechanism with their joints, by member and stage; arguments as of `joints`."""
    family = find_family(mechanism).precise()
    matrix = one_design(family, design)
    angles = values_of_the_variable(family.domain, phi)
    given = Angles.of(np.ascontiguousarray(angles[None, :]))
    if isinstance(family, Machine):
        return [part for member in family.members for part in _of_member(family, member, matrix, given)]
    if not any(skeleton_of(stage.family).links or stage.family.points for stage in family.stages):
        raise InputError("mechanism", family.name, "a mechanism that has joints", "joints")
    return list(_of_stages(family, matrix, given, angles, _places(family, matrix)))


def _places(family: Family, matrix: Array) -> list[_Place]:
    """List names and frames of the stages of a mechanism: in the frame of the first stage, if a chain defines it."""
    stages = family.stages
    if not isinstance(family, Chain):
        return [_Place(frame=family.name)]
    names = [f"stage {stage.number} ({stage.family.name})" for stage in stages]
    if not stages[-1].is_placed:
        return [_Place("", str(stage.number), name) for stage, name in zip(stages, names, strict=True)]
    placed = zip(stages, family.frames(matrix), strict=True)
    return [_Place("", str(stage.number), names[0], frame) for stage, frame in placed]


def _of_member(machine: Machine, member: Member, matrix: Array, angles: Angles) -> Iterator[Part]:
    driving = angles.phi
    if member.driver is not None:
        name = ".".join(member.driver)
        (driving,) = machine.values(matrix, angles, name)
    crank = Angles.of(np.ascontiguousarray(member.ratio * driving + member.phase(matrix)))
    places = []
    for stage, frame in zip(member.family.stages, member.frames(matrix), strict=True):
        label = f"{member.name} stage {stage.tail} ({stage.family.name})"
        places.append(_Place(member.name, stage.tail, *(("machine", frame) if frame else (label,))))
    if member.tip is not None:
        tip = np.array([member.column(matrix, f"{axis}_tip")[0] for axis in AXES])
        places[-1] = replace(places[-1], tip=tip)
    return _of_stages(member.family, member.designs(matrix), crank, angles.phi[0], places)


def _of_stages(family: Family, matrix: Array, angles: Angles, phi: Array, places: Sequence[_Place]) -> Iterator[Part]:
    """Yield every stage in its frame; each stage drives the next one."""
    status = np.zeros(phi.size, np.uint8)
    for stage, following, place in itertools.zip_longest(family.stages, family.stages[1:], places):
        inner = stage.family
        wanted = _needed(inner) | {inner.position}
        wanted |= set() if following is None else driving_names(inner, following.family)
        poses = inner.poses(stage.designs(matrix), angles, frozenset(wanted))
        np.copyto(status, np.asarray(poses["status"], np.uint8)[0], where=status == OK)
        yield _part(inner, stage.designs(matrix), angles, phi, dict(poses), place, status.copy())
        if following is not None:
            kappa, offset = (np.ascontiguousarray(matrix[:, column]) for column in (following.kappa, following.offset))
            angles = drive(dict(poses), inner.position, kappa, offset)


def _needed(family: Family) -> set[str]:
    coordinates = {name for at in family.points.values() for name in at if name}
    return coordinates.union(*(point.needs for point in skeleton_of(family).moving.values()))


def _part(
    family: Family, matrix: Array, angles: Angles, phi: Array, poses: dict[str, Any], place: _Place, status: Any
) -> Part:
    """Compute the joints of one stage, transformed into the frame of ``place``."""
    skeleton = skeleton_of(family)
    moving = {
        name: np.stack([poses[x][0] if x else np.zeros(phi.size) for x in at], axis=-1)
        for name, at in family.points.items()
    }
    moving |= {name: point.at(matrix, angles, poses)[0] for name, point in skeleton.moving.items()}
    if linked := {joint for link in skeleton.links for joint in link.joints}:
        # A point that no link carries is not a joint: the pitch curve is given in the frame of the cam.
        moving = {name: path for name, path in moving.items() if name in linked}
    fixed = {name: np.tile(point.at(matrix)[0], (phi.size, 1)) for name, point in skeleton.fixed.items()}
    axes = {name: point.axis(matrix)[0] for name, point in skeleton.fixed.items() if point.axis is not None}
    if place.tip is not None:
        link = family.the(OutputLink)
        moving[TIP] = np.stack(link.carried(matrix, poses[family.position], place.tip), axis=-1)[0]
    rotation, origin = place.placed.rotation[0], place.placed.at[0]
    turned = {name: path @ rotation.T + origin for name, path in (fixed | moving).items()}
    crank, position = (np.asarray(values[0], np.float64) for values in (angles.phi, poses[family.position]))
    return Part(
        place.member, place.stage, place.frame, family, matrix[0], phi, crank, position, turned,
        {name: rotation @ axis for name, axis in axes.items()},
        {name: point.kind for name, point in skeleton.fixed.items()}, skeleton.links, status,
    )  # fmt: skip
