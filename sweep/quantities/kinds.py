"""Kinds of design outputs: the types that a resolved name can have."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Literal, NamedTuple, TypeAlias

from sweep.families.base import Event, Family, Output
from sweep.families.machines.relations import EventValue, Timing
from sweep.families.reduction import Mode, Reduction
from sweep.quantities.box import Box
from sweep.quantities.dimensions import MechanismSize

BOTH_EXTREMA: tuple[Mode, ...] = (1, -1)
PLACES = ("phi_ext", "phi_fold", "phi0", "stroke_ratio")
"""Kinds of limit positions that are computed from crank angles."""


class Request(NamedTuple):
    """Requested extremum of a pose output; ``mode`` 0 largest magnitude, +1 largest, -1 smallest value.

    Each extremum is searched for independently, so that its value does not depend on other requests.
    """

    pose: str
    mode: Mode
    windowed: bool = False  # only poses whose position lies in the search's window count
    place: bool = False  # the crank angle of the extremum is wanted, to the target [rad]


@dataclass(frozen=True)
class _Meaning:
    """Fields common to all quantities.

    Parameters
    ----------
    output : name, unit, definition
    of : pose output that the quantity is computed from; "" for none
    stage : number of the stage, for margins and limit positions in a chain; in a machine behind the member's name
    """

    output: Output
    _: KW_ONLY
    of: str = ""
    stage: str = ""


@dataclass(frozen=True)
class Margin(_Meaning):
    """Rotatability, margin, or an extreme pressure or transmission angle, selected by ``kind``."""

    kind: str


@dataclass(frozen=True)
class LimitPosition(_Meaning):
    """Quantity of the two limit positions of a follower: swing, stroke, phi0, psi_ext ..., selected by ``kind``.

    ``cycles`` is the number of times that the follower goes from the one to the other and back in a turn.
    """

    kind: str
    cycles: int = 1


@dataclass(frozen=True)
class WindowAngle(_Meaning):
    """The crank angle over which the position stays in the window of the stroke."""


@dataclass(frozen=True)
class Reduced(_Meaning):
    """A reduction of a pose output over its domain: an extremum, its place, a range or a mean."""

    reduction: Reduction

    @property
    def extreme(self) -> bool:
        """Whether the reduction is computed from extrema; a mean is not."""
        return bool(self.reduction.modes)


@dataclass(frozen=True)
class EventPlace(_Meaning):
    """Value of the domain's variable at the first occurrence of an event."""

    event: Event


@dataclass(frozen=True)
class EventCount(_Meaning):
    """Number of occurrences of an event."""

    event: Event


@dataclass(frozen=True)
class Extent(_Meaning):
    """Extent of the joints along an axis."""

    box: Box


@dataclass(frozen=True)
class Dimension(_Meaning):
    """A size that follows from the dimensions alone."""

    size: MechanismSize


@dataclass(frozen=True)
class LargestLength(_Meaning):
    """The largest of some parameters by magnitude."""

    lengths: tuple[str, ...]


@dataclass(frozen=True)
class TimingOf(_Meaning):
    """Result of a machine's timing: difference of two crank angles, or value of a pose output at one."""

    timing: Timing | EventValue


@dataclass(frozen=True)
class OwnOutput(_Meaning):
    """Output that only a family's own step computes; ``of_part``: a step of a stage's or a member's family."""

    of_part: bool = False


@dataclass(frozen=True)
class Negative(_Meaning):
    """The negative of another quantity."""

    inner: Quantity


Quantity: TypeAlias = (
    Margin | LimitPosition | WindowAngle | Reduced | EventPlace | EventCount | Extent | Dimension | LargestLength
    | TimingOf | OwnOutput | Negative
)  # fmt: skip

GeneralRoute: TypeAlias = Literal["margin", "limits", "reductions", "means", "events"]
"""Groups of quantities that one general route computes together."""


def group_of(family: Family, asked: Quantity) -> GeneralRoute | None:
    """Name the general route that computes a quantity from poses; None where there is none."""
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
    """List the extrema that a quantity is computed from; only windowed pose outputs are limited to the window."""
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


def is_windowed(family: Family, asked: Quantity) -> bool:
    """Whether a quantity is taken inside the window of the stroke, if there is one."""
    return any(one.windowed for one in requests(family, asked, True))
