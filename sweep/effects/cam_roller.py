"""Roller on a cam: undercut and curvature of the profile, and stress of the line contact."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import Array
from sweep.effects.base import Effect, about, largest
from sweep.effects.contact import MODULUS, line_stress
from sweep.effects.load_effects import loads_of
from sweep.effects.load_passing import compute_loads
from sweep.effects.scene import Scene, take_over
from sweep.families.base import Columns, Output, Parameter, floats
from sweep.families.curve_features import Bends

ROLLER = Parameter("roller", "length", "radius of the roller", positive=True)
LENGTH = Parameter("contact_length_r", "length", "length of the roller on the cam", positive=True)
OUTPUTS = (
    Output("undercut", "1", "curvature of the pitch curve times the roller; from 1 on it is undercut"),
    Output("profile_curvature", "1/length", "curvature of the cam's profile, positive where it is convex"),
    Output("stress_r", "pressure", "largest pressure between roller and cam (Hertz)", kinks=True),
)


def _pitch(scene: Scene) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """First and second derivative of the roller's centre in the cam's frame, in fixed directions, (n, m)."""
    body, centre, at = scene.links.bodies[:, :, 1], scene.links.bodies[:, :, 0, :3], scene.links.lines[:, :, 0, :3]
    omega, arm = body[:, :, 9:12], at - body[:, :, :3]
    v = body[:, :, 3:6] + np.cross(omega, arm)
    a = body[:, :, 6:9] + np.cross(body[:, :, 12:15], arm) + np.cross(omega, np.cross(omega, arm))
    place, first, second = (x[:, :, 0] + 1j * x[:, :, 1] for x in (at - centre, v, a))
    return first - 1j * place, second - 2j * first - place


def pitch_curvature(scene: Scene) -> Array:
    """Curvature of the roller centre's path in the cam's frame, (12), (n, m)."""
    first, second = _pitch(scene)
    found: Array = -(np.conj(first) * second).imag / np.abs(first) ** 3
    return found


def normal_force(scene: Scene) -> Array:
    """Signed force on the roller normal to the pitch curve, times the speed of its centre, (n, m, 1)."""
    loads = compute_loads(scene, frozenset({"force_r_x", "force_r_y"}))
    along, (x, y) = _pitch(scene)[0], floats(loads, "force_r_x", "force_r_y")
    found: Array = along.real * y - along.imag * x
    return found[:, :, None]


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted outputs; an undercut profile has no curvature and no contact."""
    status, kappa = scene.status(), pitch_curvature(scene)
    columns: Columns = {"undercut": kappa * scene.inputs[ROLLER.name][:, None]} if "undercut" in wanted else {}
    if wanted <= {"undercut"}:
        return columns | {"status": status}
    radius = scene.inputs[ROLLER.name][:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        profile = kappa / (1.0 - kappa * radius)
    good = kappa * radius < 1.0
    if "stress_r" in wanted:
        loads = compute_loads(scene, frozenset({"force_r"}))
        take_over(status, loads["status"])
        together = np.where(good, profile + 1.0 / radius, np.nan)
        length, modulus = (scene.inputs[p.name][:, None] for p in (LENGTH, MODULUS))
        columns["stress_r"] = line_stress(np.asarray(loads["force_r"]), modulus, 1.0 / together, length)
    if "profile_curvature" in wanted:
        columns["profile_curvature"] = np.where(good, profile, np.nan)
    np.copyto(status, st.NOT_ADMISSIBLE, where=~good & (status == st.OK))
    return {name: np.where(status == st.OK, x, np.nan) for name, x in columns.items()} | {"status": status}


@lru_cache
def roller_of(name: str) -> Effect:
    """Make the entry of the roller of a cam."""
    bare = loads_of(name)
    return replace(
        bare,
        **about("roller", name),
        needs=(bare.name,),
        inputs=(*bare.inputs, ROLLER, LENGTH, MODULUS),
        only_for={p.name: ("stress_r",) for p in (*bare.inputs, LENGTH, MODULUS)},
        outputs=OUTPUTS,
        compute=compute,
        bends=(Bends(frozenset(("stress_r",)), normal_force, zero=True),),
        advise=largest(compute, "undercut", "undercut", 0.3),
    )
