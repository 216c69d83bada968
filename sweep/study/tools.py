"""[tools]: needles, blades and the seam of a machine."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sweep.study.file import Length, LengthOrPlace, Number, Section, ThreeLengths


class ToolSection(Section):
    """Table ``tools.<name>``: a needle, a blade with a back, or a seam that stands still."""

    on: str | None = Field(None, description='a moving point of a needle, as "needle.point"; a member of a blade')
    line: str | None = Field(None, description='the line that the needle lies along, as "line"')
    sense: int | None = Field(None, description="1 or -1: the needle points along the line or against it")
    scarf: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = Field(
        None, description="a direction [x, y, z] of the machine's frame, out of the scarf"
    )
    diameter: Length | None = Field(None, description='of the needle above the scarf, as "0.75 mm"')
    floor: Length | None = Field(
        None, description="from the needle's axis to the floor of the scarf; half the diameter"
    )
    top: Length | None = Field(None, description="from the guided point to where the needle begins; negative: above it")
    scarf_end: Length | None = Field(None, description="from the guided point to the upper end of the scarf")
    eye: LengthOrPlace | None = Field(
        None, description="from the guided point to the upper edge of the needle's eye; of a blade three lengths as tip"
    )
    point: Length | None = Field(None, description="from the guided point to the needle's point")
    tip: ThreeLengths | None = Field(None, description="three lengths along, across, along the axis of the output link")
    back: ThreeLengths | None = Field(None, description="the other end of the blade, as tip")
    hold: ThreeLengths | None = Field(
        None, description="where the blade holds a loop, or meets the plane of the seam, as tip"
    )
    at: ThreeLengths | None = Field(None, description="of the last stitch, three lengths in the machine's frame")
    radius: Length | None = Field(None, description='of the blade as a capsule, as "0.4 mm"; 0 if left out')
