"""Where the ball joints of a coupler nearly stop: the direction of their friction turns at once there."""

from __future__ import annotations

import numpy as np

from kernels.effects.coupler import coupler_point
from sweep.effects.base import Scene
from sweep.families.base import Array


def slowness(scene: Scene) -> Array:
    """Return squares of the turning of coupler against crank and against follower per unit crank speed, (n, m, 2)."""
    poses, designs = scene.records
    omega, origin = np.empty((*scene.shape, 3)), np.zeros((len(designs), 3))
    coupler_point(
        poses, designs, origin, scene.inputs["finger"], scene.status(), None, None, None, None, omega, None, None
    )
    crank, axis, turns = designs[:, None, :3], designs[:, None, 3:6], designs[:, None, 16:17]
    of_follower = turns * poses[:, :, 22:23] * axis
    return np.stack([((omega - other) ** 2).sum(axis=2) for other in (crank, of_follower)], axis=2)
