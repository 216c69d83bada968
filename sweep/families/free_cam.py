"""Registry entry of the thread take-up by a turning cam over whose bare edge the thread runs without friction."""

from __future__ import annotations

from kernels.families import free_cam
from sweep.families.base import Family, Output, Parameter, poses_of
from sweep.families.capabilities import Points, ThreadPath

PARAMETERS = (
    Parameter("a", "1/length", "bend of the edge x = a y^2 in the axes of the cam", not_negative=True),
    Parameter("X1", "length", "guide 1, x in fixed axes from the cam axis"),
    Parameter("Y1", "length", "guide 1, y in fixed axes"),
    Parameter("Z1", "length", "guide 1, distance from the plane of the cam along its axis"),
    Parameter("X2", "length", "guide 2, x"),
    Parameter("Y2", "length", "guide 2, y"),
    Parameter("Z2", "length", "guide 2, on the other side of the plane"),
    Parameter("P_h", "length", "length of thread between the guides at P = 0", default=0.0),
)

POSE_OUTPUTS = (
    Output("P", "length", "thread taken up, L - P_h", "(6)"),
    Output("dP", "length", "thread taken up per radian, dP/dphi", "(22)"),
    Output("d2P", "length", "second derivative of the thread taken up", "(23)"),
    Output("L", "length", "length of thread between the guides", "(18)"),
    Output("wrap", "rad", "angle by which the thread turns at the edge, 0 without contact", "(1)"),
    Output("y_contact", "length", "place where the thread passes the plane of the cam, along the edge's y", "(19)"),
    Output("X", "length", "the same place, x in fixed axes", "(18)"),
    Output("Y", "length", "the same place, y in fixed axes", "(18)"),
    Output(
        "contact", "1", "1 where the thread lies on the edge, 0 where it runs straight beside it", "(18)", jumps=True
    ),
    Output("minima", "1", "number of minima of the length along the edge", "(19)", jumps=True),
)
_NAMES = tuple(o.name for o in POSE_OUTPUTS)

# Wanted pose outputs and status of every design at its angles, each (n, m).
poses = poses_of(free_cam.poses, _NAMES)


FAMILY = Family(
    name="free_cam",
    title="thread take-up by the bare edge of a turning cam, without friction",
    parameters=PARAMETERS,
    position="P",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    derivative_of={"P": "dP", "dP": "d2P", "L": "dP"},
    uses_phi=False,
    example={"a": 0.4, "X1": 0.83, "Y1": -2.08, "Z1": -3.56, "X2": 3.3, "Y2": -0.85, "Z2": 3.7},
    capabilities=(Points({"contact": ("X", "Y", None)}), ThreadPath("wrap", "dP", "d2P")),
)
