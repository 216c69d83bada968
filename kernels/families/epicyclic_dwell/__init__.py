"""Geared dwell drive with any whole gear ratio, external or internal, and a slotted output link."""

from kernels.families.epicyclic_dwell.dwell import dwell_measures as dwell_measures
from kernels.families.epicyclic_dwell.motion import MOST_TEETH as MOST_TEETH
from kernels.families.epicyclic_dwell.motion import Design as Design
from kernels.families.epicyclic_dwell.motion import poses as poses
