"""Planar four-bar with a guided coupler point.

``closure`` reduces a design to its constants and holds the closures for fused chains, ``motion`` evaluates poses, also
in twice the working precision.
"""

from kernels.families.guide.closure import FORM as FORM
from kernels.families.guide.motion import Outputs as Outputs
from kernels.families.guide.motion import point_shares as point_shares
from kernels.families.guide.motion import poses as poses
from kernels.families.guide.motion import precise_poses as precise_poses
