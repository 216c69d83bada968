"""Looper on a cylinder: its shaft is swung by a crank-rocker and moved along its axis by a slider-crank.

``closure`` reduces a design to its constants, ``motion`` evaluates poses; ``coupled`` those of a looper whose sliding
drive has its ball beside the shaft's axis.
"""

from kernels.families.cylindrical_looper.coupled import coupled_poses as coupled_poses
from kernels.families.cylindrical_looper.motion import Outputs as Outputs
from kernels.families.cylindrical_looper.motion import poses as poses
