"""Registry entries of the moving back-rest, evaluated over the radius of the yarn on the beam.

The bracket angle is set by a let-off regulator (`backrest`), or it is the one that holds a wanted warp tension
(`backrest_tension`), or that of the source's closure, for comparison: f N2 H = f N1 r0 (`backrest_closure`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from kernels.families import backrest
from kernels.types import Array, Status
from sweep.families.base import Angles, Family, Interval, Output, Parameter, about, parameters_of
from sweep.families.capabilities import Fixed, Link, Skeleton
from sweep.families.poses import following, guarded, poses_of
from sweep.families.skeletons import ORIGIN, moving, parameter, standing

GEOMETRY = (
    Output("phi_rho", "rad", "bracket angle at this beam radius", "(13)"),
    Output("R1", "length", "slider on the bracket, from the pivot O2", "(1)"),
    Output("h", "length", "pin on the guide, from E", "(2)"),
    Output("theta", "rad", "direction of the yarn branch beam - back-rest, from the upward vertical", "(3)"),
    Output("gamma", "rad", "fall of the yarn branch back-rest - warp stop motion", "(4)"),
    Output("L1", "length", "yarn branch beam - back-rest", "(3)"),
    Output("L2", "length", "yarn branch back-rest - warp stop motion", "(4)"),
    Output("Lc", "length", "yarn on the back-rest", "(5)"),
    Output("wrap", "rad", "angle of the yarn on the back-rest", "(5)"),
    Output("x_axis", "length", "axis of the back-rest, to the right of the beam axis", "(1)"),
    Output("y_axis", "length", "axis of the back-rest, above the beam axis", "(1)"),
    Output("clearance", "length", "between the yarn on the beam and the back-rest", "(5)"),
    Output("roots", "1", "how many bracket angles solve the equation", "(12)", jumps=True),
)

LOADS = (
    Output("K", "N", "warp tension, slider's reaction at the axis of the back-rest", "(9)"),
    Output("N1", "N", "reaction of the guide, as for K", "(9)"),
    Output("N2", "N", "reaction of the bracket, as for K", "(9)"),
    Output("K_couple", "N", "warp tension, the slider bears a couple", "(11)"),
    Output("N1_couple", "N", "reaction of the guide, as for K_couple", "(10)"),
    Output("N2_couple", "N", "reaction of the bracket, as for K_couple", "(10)"),
    Output("offset_e", "length", "how far outwards of the axis the slider's reaction acts", "(11)"),
    Output("F_spring", "N", "force of the spring", "(6)"),
    Output("spring_length", "length", "length of the spring", "(6)"),
)

BAND = (
    Output("K_low", "N", "K_couple with friction -1, -1: one edge of the band within which friction leaves it", "(11)"),
    Output("K_high", "N", "K_couple with friction +1, +1: the other edge", "(11)"),
)

DRIFT = Output("drift", "N", "K_couple - K0", "(11)")
PHI = Output("phi", "rad", "bracket angle that solves the equation", "(12)")
_COLUMNS = backrest.Design._fields


def kernel_matrix(designs: Array, names: tuple[str, ...]) -> Array:
    """Design matrix of the kernel from that of an entry; missing columns are 0, the root is the first."""
    matrix = np.zeros((len(designs), len(_COLUMNS)), designs.dtype)
    matrix[:, -1] = 1.0
    for k, name in enumerate(names):
        if name in _COLUMNS:
            matrix[:, _COLUMNS.index(name)] = designs[:, k]
    return matrix


class _Blocks(NamedTuple):
    """Groups of outputs that the kernel computes together, (k, n, m) each."""

    geometry: Array | None
    loads: Array | None
    band: Array | None


def mode_of(mode: backrest.Mode, designs: Array) -> np.ndarray:
    """Select the same equation of the bracket angle for all designs."""
    return np.full(len(designs), int(mode), np.uint8)


def tension_mode(designs: Array) -> np.ndarray:
    """Select the equation that holds the tension: with a couple at the slider, or without one."""
    couple = parameter(parameters_of("backrest_tension"), "couple", designs)
    with_couple, without = int(backrest.Mode.COUPLE), int(backrest.Mode.TENSION)
    return np.where(couple.real == 1.0, with_couple, without).astype(np.uint8)


def beam_of(names: tuple[str, ...]) -> Interval:
    """Make the domain, beam radii from empty to full, of an entry with these parameters."""
    empty, full = names.index("rho_empty"), names.index("rho_full")

    def ends(designs: Array) -> tuple[Array, Array]:
        return designs[:, empty], designs[:, full]

    return Interval("rho", "length", "radius of the yarn on the beam", ends)


LINKS = (
    Link("bracket", ("o2", "s", "m")), Link("slider", ("s", "axis")), Link("pin", ("axis", "p")),
    Link("spring", ("m", "q")), Link("beam", ("o", "t1")), Link("back-rest", ("axis", "t2", "t3")),
    Link("warp 1", ("t1", "t2")), Link("warp 2", ("t3", "w")),
)  # fmt: skip


def skeleton(parameters: tuple[Parameter, ...], angle: str) -> Skeleton:
    """Make the skeleton in the plane of the beam; ``angle`` is the entry's output of the bracket angle."""

    def guide(designs: Array) -> Array:
        psi = parameter(parameters, "psi", designs)
        return np.stack([-np.cos(psi), np.sin(psi), 0.0 * psi], axis=1)

    made, axis = partial(moving, parameters), ("x_axis", "y_axis")
    return Skeleton(
        {
            "o": ORIGIN,
            "o2": standing(parameters, "a2", "b2"),
            "guide": Fixed(standing(parameters, "xE", "yE").at, guide, "slide"),
            "q": standing(parameters, "x3", "y3", axis=None, kind="point"),
            "w": standing(parameters, "a1", "b1", axis=None, kind="point"),
        },
        LINKS,
        {
            "s": made("a2 b2", (angle, "R1"), _slider),
            "m": made("a2 b2 lM nu", (angle,), _spring),
            "p": made("xE yE psi", ("h",), _pin),
            "t1": made("", ("theta",), _on_beam),
            "t2": made("r", (*axis, "theta"), _from_beam),
            "t3": made("r", (*axis, "gamma"), _to_fell),
        },
    )


def _slider(angles: Angles, a2: Array, b2: Array, phi: Array, reach: Array) -> tuple[Array, Array]:
    """Foot of the slider on the line of the bracket; (1)."""
    return a2 - reach * np.cos(phi), b2 + reach * np.sin(phi)


def _spring(angles: Angles, a2: Array, b2: Array, arm: Array, nu: Array, phi: Array) -> tuple[Array, Array]:
    """End of the spring on the bracket; (6)."""
    return a2 - arm * np.cos(phi + nu), b2 + arm * np.sin(phi + nu)


def _pin(angles: Angles, x: Array, y: Array, psi: Array, h: Array) -> tuple[Array, Array]:
    """Point where the pin touches the guide; (2)."""
    return x - h * np.cos(psi), y + h * np.sin(psi)


def _on_beam(angles: Angles, theta: Array) -> tuple[Array, Array]:
    """Point where the yarn leaves the beam, on the side away from the fell; (3)."""
    return -angles.phi * np.cos(theta), angles.phi * np.sin(theta)


def _from_beam(angles: Angles, r: Array, x: Array, y: Array, theta: Array) -> tuple[Array, Array]:
    """Point where the yarn meets the back-rest; (3)."""
    return x - r * np.cos(theta), y + r * np.sin(theta)


def _to_fell(angles: Angles, r: Array, x: Array, y: Array, gamma: Array) -> tuple[Array, Array]:
    """Point where the yarn leaves the back-rest; (4)."""
    return x + r * np.sin(gamma), y + r * np.cos(gamma)


def _entry(name: str, modes: Callable[[Array], np.ndarray], outputs: tuple[Output, ...], position: str) -> Family:
    """Make an entry of the back-rest; its first output is the bracket angle, ``modes`` selects the equation."""
    parameters = parameters_of(name)
    names = tuple(p.name for p in parameters)

    def kernel(designs: Array, radius: Array, status: Status, blocks: _Blocks) -> None:
        # the complex step covers the radius too, so that extrema over the beam can be followed
        dtype, matrix = np.result_type(designs, radius), kernel_matrix(designs, names)
        radius = np.ascontiguousarray(radius, dtype)
        backrest.poses(matrix.astype(dtype, copy=False), radius, modes(designs), status, *blocks)

    def drift(designs: Array, tension: Array) -> Array:
        return tension - designs[:, [names.index("K0")]]

    groups = {"geometry": (outputs[0], *GEOMETRY[1:]), "loads": LOADS, "band": BAND}
    solved = poses_of(kernel, _Blocks, groups, angles="phi")
    return Family(
        **about(name),
        parameters=parameters,
        position=position,
        pose_outputs=outputs,
        poses=guarded(following(solved, {DRIFT.name: (("K_couple",), drift)})),
        domain=beam_of(names),
        points={"axis": ("x_axis", "y_axis", None)},
        capabilities=(skeleton(parameters, outputs[0].name),),
    )


_SOLVED = (PHI, *GEOMETRY[1:], *LOADS, *BAND)

FAMILY = _entry("backrest", partial(mode_of, backrest.Mode.LAW), GEOMETRY[:-1] + LOADS + BAND + (DRIFT,), "K_couple")

TENSION = _entry("backrest_tension", tension_mode, _SOLVED, "phi")

CLOSURE = _entry("backrest_closure", partial(mode_of, backrest.Mode.CLOSURE), _SOLVED, "phi")
