"""Spatial slotted link: a crank whose ball runs in a fork slot, or along a bar, of the driven link (R-S-R, R-S-C-R).

``closure`` reduces a design to its constants, ``motion`` evaluates poses, ``synthesis`` finds the crank for a wanted
crank angle between the limit positions.
"""

from kernels.families.slotted.closure import crank_of_phi0 as crank_of_phi0
from kernels.families.slotted.motion import Outputs as Outputs
from kernels.families.slotted.motion import poses as poses
