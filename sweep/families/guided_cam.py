"""Registry entry of the thread take-up by a cam whose follower moves in a guide."""

from __future__ import annotations

import numpy as np

from kernels.families import guided_cam
from kernels.types import EPS, Array
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, Parameter, Step, Work, about, parameters_of
from sweep.families.capabilities import Fixed, Link, Skeleton, ThreadPath
from sweep.families.curve_features import Singular
from sweep.families.planar_trees import thread_follower
from sweep.families.poses import following, poses_of
from sweep.families.skeletons import Y, moving, parameter, standing

_ORDERS = range(1, guided_cam.HARMONICS + 1)
PARAMETERS = (
    *parameters_of("guided_cam"),
    *(Parameter(f"A{k}", "length", f"coefficient of cos({k} phi) in P", default=0.0) for k in _ORDERS),
    *(Parameter(f"B{k}", "length", f"coefficient of sin({k} phi) in P", default=0.0) for k in _ORDERS),
)

VALUE_OUTPUTS = (
    Output("P", "length", "thread taken up", "(9)"),
    Output("dP", "length", "thread taken up per radian, dP/dphi", "(9)"),
    Output("d2P", "length", "second derivative of the thread taken up", "(9)"),
    Output("L", "length", "length of thread between the guides, P_h + P", "(6)"),
    Output("S", "length", "displacement of the follower from the line of the guides", "(10)"),
    Output("dS", "length", "velocity analogue of the follower", "(11)"),
    Output("d2S", "length", "acceleration analogue of the follower", "(12)"),
    Output("pressure_angle", "rad", "between the normal of the profile and the way of the follower", "(15)"),
)
WRAP = Output("wrap", "rad", "angle by which the thread turns at the follower", "(17 a)")

PROFILE_OUTPUTS = (
    Output("X_P", "length", "profile of the cam in its own axes, along its zero", "(17)"),
    Output("Y_P", "length", "profile of the cam in its own axes, across its zero", "(17)"),
)
CURVATURE = Output("curvature", "1/length", "curvature of the profile, positive where it is convex", "(17)")

DESIGN_OUTPUTS = (
    Output("least_radius", "length", "least R0 at which the follower nowhere jams in its guide", "(16)"),
    Output("phi_least_radius", "rad", "cam angle that asks for it, -pi to pi", "(16)"),
    Output("jam_angle", "rad", "pressure angle at which the follower jams", "(13)"),
    Output("least_displacement", "length", "least displacement of the follower over the turn", "(10)"),
)


def _wrap(designs: Array, s: Array) -> Array:
    """Angle of wrap: the guides are symmetric, so the thread makes the same angle with their line on both sides."""
    x1, z1, e = (designs[:, [k]] for k in (1, 2, 3))
    return 2.0 * np.arctan(s / np.sqrt(z1 * z1 + (e - x1) ** 2))


# Wanted pose outputs and status of every design at its cam angles, each (n, m).
poses = following(
    poses_of(guided_cam.poses, guided_cam.Outputs, {"profile": PROFILE_OUTPUTS}), {WRAP.name: (("S",), _wrap)}
)


def size(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute the least radius and related maxima of smooth functions, to rounding at any accuracy.

    The error bounds exceed the errors measured against 10^5 samples: 64 roundings of the lengths for a maximum, and
    their square root for its place.  Where the thread is hardly longer than the way between the guides, roundings of
    its length L change S by L/(4 S) times as much.
    """
    n = len(designs)
    status, columns = np.empty(n, np.uint8), {o.name: np.empty(n) for o in DESIGN_OUTPUTS}
    guided_cam.least_radius(np.ascontiguousarray(designs), status, *columns.values())
    found: Columns = {name: columns[name] for name in columns if name in wanted}
    if accuracy.target is not None:
        length = 64.0 * EPS * (np.abs(columns["least_radius"]) + designs[:, 0])
        least, place = columns["least_displacement"], columns["phi_least_radius"]
        there = np.asarray(poses(designs, Angles.of(place[:, None]), frozenset("S"))["S"], np.float64)[:, 0]
        with np.errstate(all="ignore"):
            amplified = EPS * (designs[:, 0] + np.abs(designs[:, guided_cam.FIRST :]).sum(axis=1)) ** 2
            slope = columns["least_radius"] - least + there  # |S'|/tan [theta], whose share of error is that of S
            radius = length + amplified * (1.0 / least + 1.0 / there + np.abs(slope) / there**2)
            errors = {
                "least_radius": radius, "phi_least_radius": np.full(n, 1e-7), "jam_angle": np.full(n, 4.0 * EPS),
                "least_displacement": length + amplified / least,
            }  # fmt: skip
        found |= {f"err_{name}": errors[name] for name in list(found)}
    return found | {"status": status}


def cam_axis(designs: Array) -> Array:
    """Compute the cam's centre on the follower's line: R0 behind the least displacement of the whole turn."""
    least = np.asarray(size(designs, frozenset({"least_displacement"}), Accuracy())["least_displacement"], np.float64)
    e, radius = (parameter(PARAMETERS, name, designs) for name in ("e", "R0"))
    return np.stack([e, least - radius, np.zeros(len(designs))], axis=1)


def follower(angles: Angles, e: Array, s: Array) -> tuple[Array, Array]:
    """End of the follower, which lies on the cam and carries the thread."""
    return e, s


def guide(side: float) -> Fixed:
    """Make one of the two guides, on either side of the plane of the cam."""

    def at(designs: Array) -> Array:
        x, z = (parameter(PARAMETERS, name, designs) for name in ("X1", "Z1"))
        return np.stack([x, 0.0 * x, side * z], axis=1)

    return Fixed(at, kind="point")


FAMILY = Family(
    **about("guided_cam"),
    parameters=PARAMETERS,
    position="S",
    pose_outputs=(*VALUE_OUTPUTS, *PROFILE_OUTPUTS, CURVATURE, WRAP),
    poses=poses,
    steps=(Step("cam body", DESIGN_OUTPUTS, size, work=Work.LONG),),
    derivative_of={"P": "dP", "dP": "d2P", "L": "dP", "S": "dS", "dS": "d2S"},
    points={"profile": ("X_P", "Y_P", None)},
    capabilities=(
        Singular.where_small("S"),
        thread_follower(PARAMETERS, cam_axis),
        ThreadPath(WRAP.name, "dP", "d2P"),
        Skeleton(
            {
                "a": Fixed(cam_axis, standing(PARAMETERS).axis),
                "d": standing(PARAMETERS, "e", axis=Y, kind="slide"),
                "n1": guide(1.0),
                "n2": guide(-1.0),
            },
            (
                Link("cam", ("a", "r")),
                Link("follower", ("r",)),
                Link("thread 1", ("n1", "r")),
                Link("thread 2", ("r", "n2")),
            ),
            {"r": moving(PARAMETERS, "e", ("S",), follower)},
        ),
    ),
)
