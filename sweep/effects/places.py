"""Where a tool can hang on a family with joint records."""

from __future__ import annotations

from sweep.families.base import Family
from sweep.families.capabilities import JointRecords, OutputLink, ToolPoint

ON_LINE, ON_COUPLER, ON_TIP = 0, 1, 2  # where a tool can hang, in the order of Effect.tool_inputs


def tool_place(family: Family) -> int | None:
    """Return the place where a tool can hang on a family with joint records: ON_LINE, ON_COUPLER, ON_TIP;
    None for nowhere.
    """
    if family.find(JointRecords) is None:
        return None
    point = family.find(ToolPoint)
    if point is not None:
        return ON_COUPLER if point.direction is None else ON_LINE
    return None if family.find(OutputLink) is None else ON_TIP
