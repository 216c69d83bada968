"""Planar four-bar with a guided coupler point.

``motion`` evaluates poses and sensitivities in plain arithmetic, ``precise`` poses in twice the working precision.
"""

from kernels.families.guide.motion import Design as Design
from kernels.families.guide.motion import dev_sensitivities as dev_sensitivities
from kernels.families.guide.motion import poses as poses
from kernels.families.guide.motion import travel_shares as travel_shares
from kernels.families.guide.precise import precise_poses as precise_poses
