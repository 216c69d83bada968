"""Joint forces of a massless planar four-bar under a force at its coupler point; imports nothing of the project."""

from __future__ import annotations

import numpy as np


def joint_forces(crank_pin, rocker_pin, rocker_pivot, point, force):
    """Force of the crank on the coupler, of the coupler on the rocker, and the torque on the crank about the origin.

    The massless rocker bears a force along itself only; the moments on the coupler about the crank pin give its size.
    """
    along = (rocker_pin - rocker_pivot) / np.linalg.norm(rocker_pin - rocker_pivot)
    arm, reach = rocker_pin - crank_pin, point - crank_pin
    moment_of_unit = arm[0] * along[1] - arm[1] * along[0]
    moment_of_force = reach[0] * force[1] - reach[1] * force[0]
    on_coupler = -moment_of_force / moment_of_unit * along
    on_pin = -force - on_coupler
    torque = crank_pin[0] * on_pin[1] - crank_pin[1] * on_pin[0]
    return on_pin, -on_coupler, torque
