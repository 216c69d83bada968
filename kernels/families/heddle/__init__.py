"""Lever chain of a heddle shaft: cam lever, rod, bell crank, link to the shaft lever, heddle shaft; planar.

``closure`` brings a design to its constants and solves one link of the chain, ``motion`` evaluates poses.
"""

from kernels.families.heddle.closure import Design as Design
from kernels.families.heddle.motion import poses as poses
