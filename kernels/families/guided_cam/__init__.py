"""Thread take-up by a cam whose follower moves in a guide and carries the thread between two fixed guides.

Polukhin 1971, section 7, as worked out in docs/takeup.md; the equation numbers are of that page.
"""

from kernels.families.guided_cam.follower import follower as follower
from kernels.families.guided_cam.follower import jam_angle as jam_angle
from kernels.families.guided_cam.follower import jam_angles as jam_angles
from kernels.families.guided_cam.motion import HARMONICS as HARMONICS
from kernels.families.guided_cam.motion import Outputs as Outputs
from kernels.families.guided_cam.motion import least_radius as least_radius
from kernels.families.guided_cam.motion import poses as poses
