"""Spatial slider-crank: revolute crank, two ball joints, prismatic slider (RSSP); planar for alpha = 0.

``motion`` evaluates poses, also in twice the working precision, and the records for effects; ``margin`` decides
rotatability and the largest pressure angle and finds the limit positions; ``stage`` has the closures for fused chains.
"""

from kernels.families.rssp.margin import limits as limits
from kernels.families.rssp.margin import margin as margin
from kernels.families.rssp.motion import Outputs as Outputs
from kernels.families.rssp.motion import joints as joints
from kernels.families.rssp.motion import poses as poses
from kernels.families.rssp.motion import precise_poses as precise_poses
from kernels.families.rssp.motion import pressure_ellipse as pressure_ellipse
from kernels.families.rssp.stage import FORM as FORM
from kernels.families.rssp.stage import PLANAR_FORM as PLANAR_FORM
from kernels.families.rssp.stage import opening as opening
