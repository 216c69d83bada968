"""Crank whose rod slides through a swivel block at a fixed point and carries a working point beyond it.

The planar form is the looper with a rod through a swinging block.  ``closure`` reduces a design to its constants,
``motion`` evaluates poses.
"""

from kernels.families.swivel.closure import Design as Design
from kernels.families.swivel.motion import poses as poses
