"""Five-link: crank, two perpendicular revolutes in place of the driving ball, coupler, ball and rocker.

``closure`` reduces a design to its constants, finds all its rocker angles and designs with the limit positions of a
crank-rocker; ``solve`` finds the rocker angle of one branch and mode, ``motion`` evaluates poses.
With h = s2 = 0 it is the spatial crank-rocker, bit for bit.
"""

from kernels.families.five_link.closure import with_limits_of as with_limits_of
from kernels.families.five_link.motion import Outputs as Outputs
from kernels.families.five_link.motion import poses as poses
