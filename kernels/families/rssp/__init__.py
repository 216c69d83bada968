"""Spatial slider-crank: revolute crank, two ball joints, prismatic slider (RSSP); planar for alpha = 0.

``closure`` reduces a design to its constants, ``motion`` evaluates poses, ``precise`` the same in twice the working
precision, ``margin`` decides rotatability and the largest pressure angle, ``limits`` finds the limit positions,
``joints`` and ``ellipse`` are what effects work from, ``stage`` what chains are fused by.
"""

from kernels.families.rssp.margin import limits as limits
from kernels.families.rssp.margin import margin as margin
from kernels.families.rssp.motion import Outputs as Outputs
from kernels.families.rssp.motion import joints as joints
from kernels.families.rssp.motion import poses as poses
from kernels.families.rssp.motion import pressure_ellipse as pressure_ellipse
from kernels.families.rssp.precise import precise_poses as precise_poses
from kernels.families.rssp.stage import FORM as FORM
from kernels.families.rssp.stage import PLANAR_FORM as PLANAR_FORM
from kernels.families.rssp.stage import opening as opening
