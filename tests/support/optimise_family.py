"""An artificial family in numpy, whose best designs are known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.families.base import Accuracy, Angles, Family, Output, Parameter, Step

OUTPUTS = (
    Output("s", "length", "cos phi: the position"),
    Output("wave", "1", "cos 3phi + p cos 2phi + q cos phi + r"),
    Output("bowl", "1", "((p - 1)^2 + (q + 2)^2 + 1) cos phi"),
    Output("dev", "length", "s^2 + p s + q", windowed=True),
    Output("swell", "length", "p sin phi"),
)


def poses(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    p, q, r = (designs[:, [k]] for k in range(3))
    c, s = angles.cos, angles.sin
    values = {
        "s": c + 0.0 * p,
        "wave": c * (4 * c * c - 3) + p * (2 * c * c - 1) + q * c + r,
        "bowl": ((p - 1) ** 2 + (q + 2) ** 2 + 1) * c,
        "dev": c * c + p * c + q,
        "swell": p * s,
    }
    shape = np.broadcast_shapes(p.shape, c.shape)
    return {name: np.broadcast_to(values[name], shape).copy() for name in wanted} | {
        "status": np.zeros(shape, np.uint8)
    }


def bill(designs: Any, wanted: frozenset[str], accuracy: Accuracy) -> dict[str, Any]:
    return {"bill": np.exp(designs[:, 0]) + designs[:, 1] ** 2, "status": np.zeros(len(designs), np.uint8)}


FAMILY = Family(
    name="waves",
    title="made-up waves",
    parameters=(
        Parameter("p", "none", "p"),
        Parameter("q", "none", "q"),
        Parameter("r", "none", "r", default=0.0),
        Parameter("branch", "sign", "without effect", default=1.0, choices=(-1.0, 1.0)),
    ),
    position="s",
    outward="branch",
    pose_outputs=OUTPUTS,
    poses=poses,
    steps=(Step("bill", (Output("bill", "1", "exp p + q^2"),), bill),),
)
