"""[tools]: needles, blades and the seam of a machine."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from sweep.study.file import Faults, Key
from sweep.study.section import Number, Section, read_section

LENGTHS = ("diameter", "floor", "top", "scarf_end", "eye", "point", "radius")
PLACES = ("tip", "back", "eye", "hold", "at")
Place = Annotated[list[str], Field(min_length=3, max_length=3)]


class ToolSection(Section):
    """Table ``tools.<name>``: a needle, a blade with a back, or a seam that stands still."""

    on: str | None = Field(None, description='a moving point of a needle, as "needle.point"; a member of a blade')
    line: str | None = Field(None, description='the line that the needle lies along, as "line"')
    sense: int | None = Field(None, description="1 or -1: the needle points along the line or against it")
    scarf: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = Field(
        None, description="a direction [x, y, z] of the machine's frame, out of the scarf"
    )
    diameter: str | None = Field(None, description='of the needle above the scarf, as "0.75 mm"')
    floor: str | None = Field(None, description="from the needle's axis to the floor of the scarf; half the diameter")
    top: str | None = Field(None, description="from the guided point to where the needle begins; negative: above it")
    scarf_end: str | None = Field(None, description="from the guided point to the upper end of the scarf")
    eye: str | Place | None = Field(
        None, description="from the guided point to the upper edge of the needle's eye; of a blade three lengths as tip"
    )
    point: str | None = Field(None, description="from the guided point to the needle's point")
    tip: Place | None = Field(None, description="three lengths along, across, along the axis of the output link")
    back: Place | None = Field(None, description="the other end of the blade, as tip")
    hold: Place | None = Field(None, description="where the blade holds a loop, or meets the plane of the seam, as tip")
    at: Place | None = Field(None, description="of the last stitch, three lengths in the machine's frame")
    radius: str | None = Field(None, description='of the blade as a capsule, as "0.4 mm"; 0 if left out')


def read_tool(name: str, raw: object, faults: Faults) -> dict[str, Any]:
    """Read a tool in internal units."""
    key: Key = ("tools", name)
    section = read_section(ToolSection, raw, key, faults)
    found: dict[str, Any] = section.model_dump(exclude_none=True, exclude={*LENGTHS, *PLACES})
    for one in dict.fromkeys((*LENGTHS, *PLACES)):
        given = getattr(section, one)
        if isinstance(given, str):
            found[one] = faults.number(given, "mm", (*key, one)) or 0.0
        elif given is not None:
            found[one] = [faults.number(text, "mm", (*key, one, k)) or 0.0 for k, text in enumerate(given)]
    return found
