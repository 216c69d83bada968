"""Thread take-up by a turning cam plate over whose bare edge the thread runs, with and without friction.

Polukhin 1971, section 7, as worked out in docs/takeup.md; the equation numbers are of that page.
"""

from kernels.families.free_cam.contact import Outputs as Outputs
from kernels.families.free_cam.contact import poses as poses
from kernels.families.free_cam.friction import MarchOutputs as MarchOutputs
from kernels.families.free_cam.friction import limit_points as limit_points
from kernels.families.free_cam.friction import march as march
