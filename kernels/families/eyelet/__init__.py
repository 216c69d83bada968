"""Thread take-up by an eyelet that turns on a crank or, behind another linkage, on its rocker.

Polukhin 1971, section 7, as worked out in docs/takeup.md; the equation numbers are of that page.
"""

from kernels.families.eyelet.fit import length_sensitivities as length_sensitivities
from kernels.families.eyelet.fit import weighted_difference as weighted_difference
from kernels.families.eyelet.motion import Design as Design
from kernels.families.eyelet.motion import poses as poses
