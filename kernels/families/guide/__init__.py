"""Planar four-bar with a guided coupler point.

``closure`` reduces a design to its constants, ``motion`` evaluates poses, ``precise`` the same in twice the working
precision, ``sensitivities`` has the derivatives of the deviation by the parameters.
"""

from kernels.families.guide.closure import Design as Design
from kernels.families.guide.motion import Outputs as Outputs
from kernels.families.guide.motion import dev_sensitivities as dev_sensitivities
from kernels.families.guide.motion import point_shares as point_shares
from kernels.families.guide.motion import poses as poses
from kernels.families.guide.precise import precise_poses as precise_poses
from kernels.families.guide.stage import FORM as FORM
