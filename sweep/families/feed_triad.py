"""Registry entry of the feed rack on three leads: rocker pin and two eccentrics, each with a link to the rack."""

from __future__ import annotations

import numpy as np

from kernels.families import feed
from kernels.families.feed import triad
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter
from sweep.families.capabilities import Dimensions, Link, Made, Points, Skeleton
from sweep.families.feed import ROCKER, SIGMA
from sweep.families.pace import Singular
from sweep.families.rssr import FAMILY as CRANK_ROCKER
from sweep.families.skeletons import links, parameter, standing


def _eccentric(number: int) -> tuple[Parameter, ...]:
    return (
        Parameter(f"xE{number}", "length", f"eccentric {number}: centre of turning, along x"),
        Parameter(f"yE{number}", "length", f"eccentric {number}: centre of turning, along y"),
        Parameter(f"rE{number}", "length", f"eccentric {number}: eccentricity", not_negative=True),
        Parameter(f"dE{number}", "angle", f"eccentric {number}: ahead of the crank"),
    )


PARAMETERS = (
    *ROCKER,
    *_eccentric(2),
    *_eccentric(3),
    *(
        Parameter(f"f{k}{axis}", "length", f"joint of link {k}, {word} the rack from the tooth")
        for k in (1, 2, 3)
        for axis, word in (("x", "along"), ("y", "across"))
    ),
    *(Parameter(f"q{k}", "length", f"link {k}", positive=True) for k in (1, 2, 3)),
    Parameter("x0", "length", "where the tooth is about at phi = 0, along x: it chooses the assembly"),
    Parameter("y0", "length", "where the tooth is about at phi = 0, along y"),
    Parameter("chi0", "angle", "angle of the rack at phi = 0, about"),
    SIGMA,
)

POSE_OUTPUTS = (
    Output("x_t", "length", "tooth, along the feed", "(15)"),
    Output("y_t", "length", "tooth, upwards", "(15)"),
    Output("chi", "rad", "angle of the rack", "(15)", wraps=True),
    Output("dx_t", "length", "velocity analogue of the tooth along the feed", "(16)"),
    Output("dy_t", "length", "velocity analogue of the tooth upwards", "(16)"),
    Output("dchi", "1", "first derivative of chi by phi", "(16)"),
    Output("d2x_t", "length", "acceleration analogue of the tooth along the feed", "(17)"),
    Output("d2y_t", "length", "acceleration analogue of the tooth upwards", "(17)"),
    Output("d2chi", "1", "second derivative of chi", "(17)"),
    Output("determinant", "length^4", "of the closures: zero where the three leads lock", "(16)"),
)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    shape = (len(designs), angles.phi.shape[1])
    status = np.empty(shape, np.uint8)
    outputs = np.empty((len(triad.OUTPUTS), *shape), np.result_type(designs, angles.phi))
    feed.triad_poses(designs, angles.phi, status, outputs)
    return {name: x for name, x in zip(triad.OUTPUTS, outputs, strict=True) if name in wanted} | {"status": status}


def rocker_loop(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the discriminant of the horizontal chain, (n, m)."""
    return np.asarray(
        CRANK_ROCKER.poses(_chain(designs), angles, frozenset({"discriminant"}))["discriminant"], np.float64
    )


def determinant_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the square of the determinant of the closures, (n, m): it falls like a root where the leads lock."""
    return np.square(np.asarray(found["determinant"], np.float64))


def _chain(designs: Array) -> Array:
    return np.column_stack([designs[:, [0, 1, 2, 3, 4, 5, 6]], parameter(PARAMETERS, SIGMA.name, designs)])


def _columns(designs: Array, *names: str) -> list[Array]:
    return [parameter(PARAMETERS, name, designs)[:, None] for name in names]


def rocker_pin(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return H, on the arm of the horizontal chain's rocker."""
    psi = np.asarray(CRANK_ROCKER.poses(_chain(designs), angles, frozenset({"psi"}))["psi"], np.float64)
    e, arm, ahead = _columns(designs, "h_e", "rh", "dh")
    return np.stack([e + arm * np.cos(psi + ahead), arm * np.sin(psi + ahead), 0.0 * psi], axis=-1)


def eccentric(number: int) -> Made:
    """Return the centre of an eccentric."""

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        x, y, radius, ahead = _columns(designs, *(f"{name}{number}" for name in ("xE", "yE", "rE", "dE")))
        turn = angles.phi + ahead
        return np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn), 0.0 * turn], axis=-1)

    return Made((), at)


def rack_joint(number: int) -> Made:
    """Return the joint of a link on the rack."""

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        x, y, chi = (np.asarray(found[name], np.float64) for name in ("x_t", "y_t", "chi"))
        along, across = _columns(designs, f"f{number}x", f"f{number}y")
        cos, sin = np.cos(chi), np.sin(chi)
        return np.stack([x + along * cos - across * sin, y + along * sin + across * cos, 0.0 * chi], axis=-1)

    return Made(("x_t", "y_t", "chi"), at)


EXAMPLE = {
    "h_a": 0.5, "h_b": 3.4, "h_c": 1.6, "h_e": 3.5, "rh": 1.2, "xE2": 2.0, "yE2": -2.5, "rE2": 0.15, "dE2": 0.3,
    "xE3": 5.5, "yE3": -2.5, "rE3": 0.15, "dE3": 0.5, "f1x": -1.0, "f1y": -0.5, "f2x": -0.8, "f2y": -0.6, "f3x": 1.2,
    "f3y": -0.6, "q1": 1.5, "q2": 2.5, "q3": 2.5, "x0": 4.0, "y0": 1.0, "chi0": 0.0, "h_sigma": -1.0,
}  # fmt: skip


FAMILY = Family(
    name="feed_triad",
    title="feed rack on three leads",
    parameters=PARAMETERS,
    position="x_t",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    example=EXAMPLE,
    derivative_of={
        "x_t": "dx_t", "dx_t": "d2x_t", "y_t": "dy_t", "dy_t": "d2y_t", "chi": "dchi", "dchi": "d2chi",
    },
    capabilities=(
        Singular(rocker_loop),
        Singular(determinant_squared, ("determinant",)),
        Dimensions(links("h_a h_b h_c rh q1 q2 q3"), optional=("rE2", "rE3")),
        Points({"t": ("x_t", "y_t", None)}),
        Skeleton(
            {
                "d": standing(PARAMETERS, "h_e"), "l2": standing(PARAMETERS, "xE2", "yE2"),
                "l3": standing(PARAMETERS, "xE3", "yE3"),
            },
            (
                Link("rocker", ("d", "h")), Link("eccentric 2", ("l2", "e2")), Link("eccentric 3", ("l3", "e3")),
                Link("link 1", ("h", "f1")), Link("link 2", ("e2", "f2")), Link("link 3", ("e3", "f3")),
                Link("rack", ("f1", "f2", "f3", "t")),
            ),
            {
                "h": Made((), rocker_pin), "e2": eccentric(2), "e3": eccentric(3),
                "f1": rack_joint(1), "f2": rack_joint(2), "f3": rack_joint(3),
            },
        ),
    ),
)  # fmt: skip
