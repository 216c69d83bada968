"""Looper on a sphere: a carrier swung by a crank-rocker, on it a looper swung by a second crank; both axes meet.

``closure`` reduces a design to its constants, ``motion`` evaluates poses.
"""

from kernels.families.spherical_looper.closure import Design as Design
from kernels.families.spherical_looper.motion import poses as poses
