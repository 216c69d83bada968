"""Masses of a design as MuJoCo takes them: three positive moments, of which none exceeds the sum of the others."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree as Xml

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array

MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
KILOGRAMS = {"mm": 1e3, "m": 1.0}  # masses of designs in mm are tonnes, as N and s want
METRES = {"mm": 1e-3, "m": 1.0}
SPARE = 2.0  # moments that do not count are made so many times what they have to be at least


def inertial(design: Mapping[str, float], name: str, stage: str, unit: str) -> Xml.Element:
    """Return the mass, centre and inertia of a body.

    A body about a fixed axis turns by its moment about that axis and its products with it alone, a slider by none: what
    does not count is filled up, so that the tensor is that of a body.

    Raises
    ------
    InputError
        for a mass without the inertia that counts, or with one that no body has.
    """
    kilograms, metres = KILOGRAMS[unit], METRES[unit]
    mass = float(design[f"m_{name}{stage}"])
    centre = np.array([float(design.get(f"com_{name}_{axis}{stage}", 0.0)) for axis in "xyz"])
    xx, yy, zz, xy, xz, yz = (float(design.get(f"j_{name}_{entry}{stage}", 0.0)) for entry in MOMENTS)
    if not mass > 0.0:
        raise InputError(f"m_{name}{stage}", mass, "a positive mass: MuJoCo moves none", "export")
    if name == "slider":
        xx = yy = zz = mass
        xy = xz = yz = 0.0
    elif name != "coupler" and zz > 0.0:
        xx = yy = SPARE * (zz + (xz * xz + yz * yz) / zz)
        xy = 0.0
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, middle, high = np.linalg.eigvalsh(tensor)
    if not low > 0.0:
        allowed = "the inertias of a body: MuJoCo takes no mass without"
        raise InputError(f"j_{name}_xx{stage}", f"least moment {low:.3g}", allowed, "export")
    if high > (low + middle) * (1.0 + 1e-9):
        allowed = "moments of which none exceeds the sum of the others, as of any body"
        raise InputError(
            f"j_{name}_xx{stage}", f"principal moments {low:.3g}, {middle:.3g}, {high:.3g}", allowed, "export"
        )
    scale = kilograms * metres**2
    return Xml.Element(
        "inertial", pos=_words(centre * metres), mass=repr(mass * kilograms),
        fullinertia=_words(np.array([xx, yy, zz, xy, xz, yz]) * scale),
    )  # fmt: skip


def _words(values: Array) -> str:
    return " ".join(repr(float(x)) for x in values)
