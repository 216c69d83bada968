"""Registry entry of the thread take-up by the bare edge of a turning cam on which the thread sticks and slides."""

from __future__ import annotations

import numpy as np

from kernels.families import free_cam
from sweep.families import free_cam as frictionless
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, optional_outputs
from sweep.families.capabilities import Made, Skeleton
from sweep.families.domain import March
from sweep.families.skeletons import parameter

PARAMETERS = (
    *frictionless.PARAMETERS,
    Parameter("mu", "ratio", "coefficient of friction along the edge, across the thread", not_negative=True),
    Parameter("tension_ratio", "ratio", "tension at guide 2 over tension at guide 1", default=1.0, positive=True),
    Parameter("mu_thread", "ratio", "friction along the thread; the ratio grows by e^(mu_thread wrap)", default=0.0,
              not_negative=True),
)  # fmt: skip

POSE_OUTPUTS = (
    Output("P", "length", "thread taken up, L - P_h", "(6)"),
    Output("L", "length", "length of thread between the guides", "(18)"),
    Output("wrap", "rad", "angle by which the thread turns at the edge, 0 without contact", "(1)"),
    Output("y_contact", "length", "place where the thread passes the plane of the cam, along the edge's y", "(25)"),
    Output(
        "contact", "1", "1 where the thread lies on the edge, 0 where it runs straight beside it", "(18)", jumps=True
    ),
    Output("sticking", "1", "1 where it lies where it lay before, 0 where it slides or is off", "(25)", jumps=True),
)
_KERNEL = ("L", "wrap", "y_contact", "contact", "sticking")
_OWN = len(frictionless.PARAMETERS)
DOMAIN = March(text="cam angle")


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status, each (n, m), of the last of the turns that are marched."""
    needed = wanted | {"L"} if "P" in wanted else wanted
    shape = (len(designs), angles.cos.shape[1])
    outputs, status = optional_outputs(_KERNEL, needed, shape), np.empty(shape, np.uint8)
    own, friction = (
        np.ascontiguousarray(designs[:, :_OWN]),
        np.ascontiguousarray(designs[:, [_OWN + 1, _OWN + 2, _OWN]]),
    )
    free_cam.march(own, friction, angles.cos, angles.sin, DOMAIN.turns, status, *outputs)
    found: Columns = {name: out for name, out in zip(_KERNEL, outputs, strict=True) if out is not None}
    if "P" in wanted:
        found["P"] = np.asarray(found["L"], np.float64) - designs[:, _OWN - 1 : _OWN]
    return {name: found[name] for name in found if name in wanted} | {"status": status}


def contact(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the place where the thread passes the plane of the cam:
    on the edge, or on the straight line between the guides.
    """
    y, on = (np.asarray(found[name], np.float64) for name in ("y_contact", "contact"))
    at = frictionless.turned(parameter(PARAMETERS, "a", designs)[:, None] * y * y, y, angles)
    guides = (np.stack([parameter(PARAMETERS, f"{axis}{k}", designs) for axis in "XYZ"], axis=1) for k in (1, 2))
    first, second = (guide[:, None, :] for guide in guides)
    straight = first + (second - first) * (first[..., 2:] / (first[..., 2:] - second[..., 2:]))
    return np.where(on[..., None] == 1.0, at, straight)


FAMILY = Family(
    name="free_cam_friction",
    title="thread take-up by the bare edge of a turning cam, with friction",
    parameters=PARAMETERS,
    position="P",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    domain=DOMAIN,
    analytic=False,
    capabilities=(
        Skeleton(
            frictionless.SKELETON_FIXED,
            frictionless.LINKS,
            frictionless.EDGE_POINTS | {"contact": Made(("y_contact", "contact"), contact)},
        ),
    ),
    example={**frictionless.FAMILY.example, "mu": 0.3, "tension_ratio": 1.5},
)
