"""What the trees of links of the families share: how their kernels are called, and points given by parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kernels.links import Links
from sweep.families.base import Angles, Array, Columns, Parameter
from sweep.families.capabilities import DesignMap
from sweep.families.link_tree import LinkFill
from sweep.families.skeletons import parameter


def filled_by(kernel: Callable[..., object], needs: tuple[str, ...], stacked: tuple[str, ...] = ()) -> LinkFill:
    """Return the filling by a kernel that takes pose outputs one by one,
    then those ``stacked`` in one array, if any.
    """

    def fill(designs: Array, angles: Angles, motion: Columns, out: Links) -> None:
        given = [np.asarray(motion[name], np.float64) for name in needs]
        if stacked:
            given.append(np.stack([np.asarray(motion[name], np.float64) for name in stacked]))
        kernel(designs, angles.cos, angles.sin, *given, out)

    return fill


def point_of(parameters: tuple[Parameter, ...], x: str, y: str | None = None, z: str | None = None) -> DesignMap:
    """Return a point whose coordinates are parameters, or 0 where none is named."""

    def point(designs: Array) -> Array:
        return np.stack([parameter(parameters, name, designs) for name in (x, y, z)], axis=1)

    return point
