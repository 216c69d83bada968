"""Geared dwell drive: fixed sun, equal planet on a carrier, its pin in a slotted link that turns about an offset axis.

Semin, Loktionov, Parominsky, in the corrected and stable forms of docs/geared_dwell.md; the equation numbers are of
that page.  Lengths are in planet radii: ``k`` is the distance of the pin from the planet centre, ``a`` the offset of
the two axes.  The pin is at z = 2 exp(i phi) - k exp(2 i phi) + a from the axis of the slotted link; psi = arg z.

Turning phi by pi together with (k, a) -> (-k, -a) turns z by pi.  So one set of formulas, written in t = 1 - cos(phi)
around phi = 0, serves both halves of the turn; it loses no digits where the pin comes near the axis (a -> k - 2 at
phi = 0, a -> k + 2 at phi = pi) nor at k -> 1.

``motion`` reduces a design to its constants, evaluates poses and sweeps a grid of carrier angles, ``maxima`` finds the
largest derivatives of the turn and the measures of the dwell.
"""

from kernels.families.geared_dwell.maxima import dwell_measures as dwell_measures
from kernels.families.geared_dwell.maxima import turn_maxima as turn_maxima
from kernels.families.geared_dwell.motion import Outputs as Outputs
from kernels.families.geared_dwell.motion import dense_maxima as dense_maxima
from kernels.families.geared_dwell.motion import poses as poses
