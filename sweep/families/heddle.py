"""Registry entry of the heddle drive: cam lever, rod, bell crank, link, shaft lever, heddle shaft."""

from __future__ import annotations

import numpy as np

from kernels.families import heddle
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, Output, about, parameters_of
from sweep.families.capabilities import Assembly, Dimensions, Fixed, Link, MovingPoint, Skeleton
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders
from sweep.families.planar_trees import heddle_shaft
from sweep.families.poses import poses_of
from sweep.families.skeletons import ORIGIN, Y, Z, line, links, moving, parameter, squared, standing

PARAMETERS = parameters_of("heddle")

VALUE_OUTPUTS = (
    *coordinate_outputs("chi", "rad", "bell-crank angle, direction of O3C from the line O2O3", "(4)", "(5)"),
    *coordinate_outputs(
        "y",
        "length",
        "lift of the shaft from mid-stroke; with a heddle rod the height of its lower end",
        "(7)",
        "(9)",
    ),
    Output("discriminant", "length^2", "Delta; the rod reaches where it is not negative", "(3)"),
)

PLACE_OUTPUTS = (
    Output("sin_transmission", "1", "sine of the angle from the rod BC to the arm O3C", "(4)"),
    Output("pressure_angle", "rad", "between the rod's force and the velocity of C", "(4)"),
    Output("lam", "rad", "angle of the shaft lever from mid-stroke", "(6)", wraps=True),
    *joint_outputs({"b": "end of the cam lever"}, "(3)", ("along O2O3 from O2", "across O2O3")),
    *joint_outputs({"c": "upper end of the bell crank"}, "(4)", ("along O2O3 from O2", "across O2O3")),
)

poses = poses_of(heddle.poses, heddle.Outputs, {"places": PLACE_OUTPUTS})


def _column(name: str, designs: Array) -> Array:
    return parameter(PARAMETERS, name, designs)


def _may_part(designs: Array) -> Array:
    """Whether DF or EG may fail to reach where BC reaches: not in a parallelogram whose heddle rod is infinite."""
    arm, back, frame, link, rod = (_column(name, designs) for name in ("O3D", "O4F", "O3O4", "DF", "EG"))
    return (arm != back) | (frame != link) | (rod > 0.0)  # type: ignore[no-any-return]


def shaft_pivot(designs: Array) -> Array:
    """Return O4, along O2O3 behind O3: the drawing puts both frames on one line."""
    x = _column("O2O3", designs) + _column("O3O4", designs)
    return np.stack([x, 0.0 * x, 0.0 * x], axis=1)


def shaft_line(designs: Array) -> tuple[Array, Array]:
    """Return a point and the direction of the shaft's vertical: through its rod's slide, or through E at mid-stroke."""
    at = shaft_pivot(designs)
    at[:, 0] += np.where(_column("EG", designs) > 0.0, _column("x_s", designs), _column("O4E", designs))
    return at, np.tile(np.array(Y), (len(designs), 1))


def lower_arm(angles: Angles, x: Array, middle: Array, length: Array, side: Array, chi: Array) -> tuple[Array, Array]:
    """D: the lower arm of the bell crank, perpendicular to O3O4 at mid-stroke."""
    turn = chi - middle
    return x - length * side * np.sin(turn), length * side * np.cos(turn)


def shaft_lever(angles: Angles, x: Array, frame: Array, length: Array, lam: Array) -> tuple[Array, Array]:
    """E: the arm of the shaft lever to the heddle rod, horizontal at mid-stroke."""
    return x + frame + length * np.cos(lam), length * np.sin(lam)


def shaft_lever_back(
    angles: Angles, x: Array, frame: Array, length: Array, side: Array, lam: Array
) -> tuple[Array, Array]:
    """F: the arm of the shaft lever to the link, perpendicular to the other arm."""
    return x + frame - length * side * np.sin(lam), length * side * np.cos(lam)


def shaft(designs: Array, angles: Angles, found: Columns) -> Array:
    """Compute G: the heddle shaft on its vertical."""
    y = np.asarray(found["y"], np.float64)
    return shaft_line(designs)[0][:, None, :] + np.stack([0.0 * y, y, 0.0 * y], axis=-1)


FAMILY = Family(
    **about("heddle"),
    parameters=PARAMETERS,
    position="y",
    pose_outputs=VALUE_OUTPUTS + PLACE_OUTPUTS,
    poses=poses,
    derivative_of=ladders("chi", "y"),
    points={"b": ("x_b", "y_b", None), "c": ("x_c", "y_c", None)},
    capabilities=(
        Dimensions(links("O2B BC O3C O4E"), optional=("O3D", "O4F", "DF", "EG")),
        Assembly("discriminant", "pressure_angle", squared(PARAMETERS, "BC"), end=("d2y", _may_part)),
        heddle_shaft(PARAMETERS, shaft_line),
        Skeleton(
            {
                "o2": ORIGIN, "o3": standing(PARAMETERS, "O2O3"),
                "o4": Fixed(shaft_pivot, standing(PARAMETERS, axis=Z).axis), "line": line(shaft_line),
            },
            (
                Link("cam lever", ("o2", "b")), Link("rod", ("b", "c")), Link("bell crank", ("o3", "c", "d")),
                Link("link", ("d", "f")), Link("shaft lever", ("o4", "f", "e")), Link("heddle rod", ("e", "g")),
                Link("shaft", ("g",)),
            ),
            {
                "d": moving(PARAMETERS, "O2O3 chi_mid O3D side_F", ("chi",), lower_arm),
                "e": moving(PARAMETERS, "O2O3 O3O4 O4E", ("lam",), shaft_lever),
                "f": moving(PARAMETERS, "O2O3 O3O4 O4F side_F", ("lam",), shaft_lever_back),
                "g": MovingPoint(("y",), shaft),
            },
        ),
    ),
)  # fmt: skip
