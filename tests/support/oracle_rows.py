"""Reading of the oracle tables, and errors in units of 2^-53 times the tabulated sensitivity."""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np

from kernels.families import rssr
from kernels.families.rssr.motion import joints
from kernels.linkage.joints import PER_DESIGN, PER_POSE
from sweep.families import family
from sweep.families.base import Angles

FOLDER = Path(__file__).parents[1] / "oracle"
EPS = mp.mpf(2) ** -53
GEOMETRY = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")


def rows(table, **equal):
    """Return the rows of one table whose fields equal the given values."""
    everything = json.loads((FOLDER / f"{table}_open.json").read_text())["rows"]
    return [row for row in everything if all(row[key] == value for key, value in equal.items())]


def factor(got, expected, scale):
    """Return the largest error of a quantity's components in units of 2^-53 max(scale, |y|)."""
    got = np.atleast_1d(got)
    expected = [mp.mpf(y) for y in (expected if isinstance(expected, list) else [expected])]
    error = max(abs(mp.mpf(float(g)) - y) for g, y in zip(got, expected, strict=True))
    size = max(mp.mpf(scale), *(abs(y) for y in expected))
    return float(error / (EPS * size)) if size else float(error)


def geometry(inputs):
    """Return design matrix and crank angles of rows with the parameter names of the crank-rocker."""
    designs = np.array([[i[name] for name in GEOMETRY] for i in inputs], dtype=float)
    return designs, np.array([i.get("phi", 0.0) for i in inputs])


def joint_records(designs, phi):
    """Return joint records and status of crank-rockers, one angle each, as the effects receive a linkage."""
    angles = Angles.of(np.asarray(phi, dtype=float).reshape(len(designs), -1))
    wanted = frozenset({"cos_psi", "sin_psi", "dpsi", "d2psi", "discriminant"})
    motion = family("rssr").poses(designs, angles, wanted)
    per_pose = np.empty((*angles.cos.shape, PER_POSE))
    per_design = np.empty((len(designs), PER_DESIGN))
    args = [motion[name] for name in ("cos_psi", "sin_psi", "dpsi", "d2psi", "discriminant")]
    joints(designs, angles.cos, angles.sin, np.stack(args), per_pose, per_design)
    return per_pose, per_design, motion["status"].copy()


__all__ = ["factor", "geometry", "joint_records", "rows", "rssr"]
