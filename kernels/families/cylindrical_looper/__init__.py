"""Looper on a cylinder: its shaft is swung by a crank-rocker and moved along its axis by a slider-crank.

``closure`` reduces a design to its constants, ``motion`` evaluates poses.
"""

from kernels.families.cylindrical_looper.closure import Design as Design
from kernels.families.cylindrical_looper.motion import poses as poses
