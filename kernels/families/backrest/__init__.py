"""Warp beam, moving back-rest on sprung brackets with a guide, warp stop motion; planar statics over the beam radius.

``closure`` holds geometry and statics at one bracket angle, ``motion`` finds bracket angles and evaluates poses.
"""

from kernels.families.backrest.closure import Design as Design
from kernels.families.backrest.closure import Mode as Mode
from kernels.families.backrest.motion import poses as poses
from kernels.families.backrest.motion import positions as positions
