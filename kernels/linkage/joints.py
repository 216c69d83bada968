"""Linkage as an effect sees it: joint positions, directions and the follower's motion, never the family.

A crank turns about ``u`` at A and carries the ball joint B; a coupler runs from B to the ball joint C.  C is carried by
a follower: a rocker, which turns about ``k`` at D (``turns`` = 1), or a slider, which moves along ``tau``
(``turns`` = 0, c = 1, dpsi and d2psi its velocity and acceleration analogues, D = C).  A family fills one record per
pose and one per design; :func:`read` puts them together for one pose.
"""

from __future__ import annotations

from typing import NamedTuple

from kernels.arithmetic.vectors import Vector
from kernels.jit import inline
from kernels.types import Array

PER_POSE = 24
PER_DESIGN = 17


class Joints(NamedTuple):
    """Linkage at one pose: positions, directions, follower's rates; primes are derivatives by the crank angle."""

    B: Vector  # crank pin
    C: Vector  # driven ball joint
    s: Vector  # unit vector from B to C
    rho_b: Vector  # crank triad (rho_b, tau_b, u)
    tau_b: Vector
    rho: Vector  # follower triad (rho, tau, k)
    tau: Vector
    t_tau: float  # s . tau, signed by the branch: |t_tau| is the cosine of the pressure angle
    dpsi: float
    u: Vector  # crank axis
    k: Vector  # follower axis
    A: Vector
    D: Vector
    a: float
    b: float
    c: float
    branch: float
    d2psi: float
    turns: float  # 1 for a rocker, 0 for a slider


@inline
def read(poses: Array, designs: Array) -> Joints:
    """Joints of one pose from its record ``poses`` (PER_POSE,) and its design's record ``designs`` (PER_DESIGN,)."""
    # Written out: numba compiles a helper anew for every literal index it is called with.
    return Joints(
        (poses[0], poses[1], poses[2]),
        (poses[3], poses[4], poses[5]),
        (poses[6], poses[7], poses[8]),
        (poses[9], poses[10], poses[11]),
        (poses[12], poses[13], poses[14]),
        (poses[15], poses[16], poses[17]),
        (poses[18], poses[19], poses[20]),
        poses[21],
        poses[22],
        (designs[0], designs[1], designs[2]),
        (designs[3], designs[4], designs[5]),
        (designs[6], designs[7], designs[8]),
        (designs[9], designs[10], designs[11]),
        designs[12],
        designs[13],
        designs[14],
        designs[15],
        poses[23],
        designs[16],
    )
