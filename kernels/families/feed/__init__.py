"""Rack of a feed mechanism on two chains: rocker of a four-bar for the length, eccentric for the lift; planar rack.

``closure`` reduces a design to its constants and closes both chains, ``motion`` evaluates poses and finds entry and
leaving, ``triad`` is the rack on three leads.
"""

from kernels.families.feed.motion import feeding as feeding
from kernels.families.feed.motion import lift_rows as lift_rows
from kernels.families.feed.motion import poses as poses
from kernels.families.feed.triad import triad_poses as triad_poses
