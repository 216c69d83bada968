"""The kinds of design outputs: what a name can stand for."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Literal, NamedTuple, TypeAlias

from sweep.families.base import Event, Family, Output
from sweep.families.machines.relations import EventValue, Timing
from sweep.families.reduction import Mode, Reduction
from sweep.quantities.box import Box
from sweep.quantities.dimensions import Size

BOTH_EXTREMA: tuple[Mode, ...] = (1, -1)
PLACES = ("phi_ext", "phi_fold", "phi0", "stroke_ratio")
"""Of the kinds of limit positions, those that need crank angles."""


class Request(NamedTuple):
    """An extremum that is wanted: of which pose output, and which (0 largest magnitude, +1 largest, -1 least).

    Each is searched for as if it were the only one, so that no bit of it depends on what is wanted beside it.
    """

    pose: str
    mode: Mode
    windowed: bool = False  # only poses whose position lies in the search's window count
    place: bool = False  # its crank angle is wanted, to the target [rad]


@dataclass(frozen=True)
class _Meaning:
    """What every quantity has.

    Parameters
    ----------
    output : name, unit, definition
    of : the pose output that it is taken of; "" for none
    stage : the number of the stage, of margins and limit positions in a chain; in a machine behind the member's name
    """

    output: Output
    _: KW_ONLY
    of: str = ""
    stage: str = ""


@dataclass(frozen=True)
class Margin(_Meaning):
    """Rotatability, margin, or an extreme pressure or transmission angle, as ``kind`` says."""

    kind: str


@dataclass(frozen=True)
class LimitPosition(_Meaning):
    """A number made of the two limit positions of a follower: swing, stroke, phi0, psi_ext ..., as ``kind`` says."""

    kind: str


@dataclass(frozen=True)
class WindowAngle(_Meaning):
    """The crank angle over which the position stays in the window of the stroke."""


@dataclass(frozen=True)
class Reduced(_Meaning):
    """A reduction of a pose output over its domain: an extremum, its place, a range or a mean."""

    reduction: Reduction

    @property
    def extreme(self) -> bool:
        """Whether it is made of extrema; a mean is not."""
        return bool(self.reduction.modes)


@dataclass(frozen=True)
class EventPlace(_Meaning):
    """The value of the domain's variable at which an event first happens."""

    event: Event


@dataclass(frozen=True)
class EventCount(_Meaning):
    """How often an event happens."""

    event: Event


@dataclass(frozen=True)
class Extent(_Meaning):
    """How far the joints reach along an axis."""

    box: Box


@dataclass(frozen=True)
class Dimension(_Meaning):
    """A size that follows from the dimensions alone."""

    size: Size


@dataclass(frozen=True)
class LargestLength(_Meaning):
    """The largest of some parameters by magnitude."""

    lengths: tuple[str, ...]


@dataclass(frozen=True)
class TimingOf(_Meaning):
    """What a machine's timing gives: the difference of two crank angles, or the value of a pose output at one."""

    timing: Timing | EventValue


@dataclass(frozen=True)
class OwnOutput(_Meaning):
    """What nothing but an own step of the family gives; ``of_part``: of a stage's or a member's family."""

    of_part: bool = False


@dataclass(frozen=True)
class Negative(_Meaning):
    """The negative of another quantity."""

    inner: Quantity


Quantity: TypeAlias = (
    Margin | LimitPosition | WindowAngle | Reduced | EventPlace | EventCount | Extent | Dimension | LargestLength
    | TimingOf | OwnOutput | Negative
)  # fmt: skip

Group: TypeAlias = Literal["margin", "limits", "reductions", "means", "events"]
"""What general routes work out together."""


def group_of(family: Family, asked: Quantity) -> Group | None:
    """Name the general route that works a quantity out from poses; None where there is none."""
    match asked:
        case Margin():
            return "margin"
        case EventPlace() | EventCount():
            return "events"
        case Reduced(extreme=False):
            return "means"
        case Reduced() | LimitPosition() | WindowAngle():
            return "limits" if asked.of in family.positions else "reductions"
        case _:
            return None


def requests(family: Family, asked: Quantity, windowed: bool) -> tuple[Request, ...]:
    """List the extrema that a quantity is made of; a window concerns deviations across a line only."""
    match asked:
        case LimitPosition(kind=kind):
            modes, place = BOTH_EXTREMA, kind in PLACES
        case WindowAngle():
            modes, place = BOTH_EXTREMA, False
        case Reduced(reduction=reduction):
            modes, place = reduction.modes, reduction.place
        case _:
            return ()
    inside = windowed and family.pose_output[asked.of].windowed
    return tuple(Request(asked.of, mode, inside, place) for mode in modes)
