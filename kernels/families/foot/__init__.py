"""Presser foot on a rack that rises harmonically: closed forms of its first jump, contact and flight over the turn.

``harmonic`` has the closed forms and the path; the march over events is :mod:`kernels.effects.foot`.
"""

from kernels.families.foot.harmonic import Design as Design
from kernels.families.foot.harmonic import closed_forms as closed_forms
from kernels.families.foot.harmonic import rack_path as rack_path
