"""Spatial crank-rocker with two revolute and two ball joints (RSSR); planar four-bar for alpha = 0, f = g.

``closure`` reduces a design to its constants and has its transfer functions, ``motion`` evaluates poses (``precise`` in
twice the working precision) and sweeps a grid of crank angles, ``block`` decides rotatability, ``limits`` finds the
limit positions, ``maxima`` the true maxima over the turn, and ``certify`` proves them, and those of a guided point that
crank-rockers in series drive, on the enclosures of ``driven``.  ``stage`` holds the closures for fused chains.
``proof`` searches boxes of designs (``box_*``).
"""

from kernels.families.rssr.block import margin as margin
from kernels.families.rssr.limits import LIMIT_NAMES as LIMIT_NAMES
from kernels.families.rssr.limits import limits as limits
from kernels.families.rssr.maxima import true_maxima as true_maxima
from kernels.families.rssr.motion import Outputs as Outputs
from kernels.families.rssr.motion import dense_maxima as dense_maxima
from kernels.families.rssr.motion import joints as joints
from kernels.families.rssr.motion import poses as poses
from kernels.families.rssr.motion import pressure_ellipse as pressure_ellipse
from kernels.families.rssr.precise import PRECISE_COLUMNS as PRECISE_COLUMNS
from kernels.families.rssr.precise import precise_constants as precise_constants
from kernels.families.rssr.precise import precise_poses as precise_poses
from kernels.families.rssr.sampling import sampling_tables as sampling_tables
from kernels.families.rssr.stage import FORM as FORM
from kernels.families.rssr.stage import opening as opening
