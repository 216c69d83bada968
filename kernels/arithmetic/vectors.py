"""Vectors of space as triples of floats: LLVM keeps them in registers, an array would be allocated."""

from __future__ import annotations

import math
from typing import TypeAlias

from kernels.jit import inline

Vector: TypeAlias = tuple[float, float, float]


@inline
def add(a: Vector, b: Vector) -> Vector:
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inline
def sub(a: Vector, b: Vector) -> Vector:
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inline
def scale(x: float, a: Vector) -> Vector:
    """Multiple x a."""
    return x * a[0], x * a[1], x * a[2]


@inline
def mix(x: float, a: Vector, y: float, b: Vector) -> Vector:
    """Return the combination x a + y b."""
    return x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2]


@inline
def dot(a: Vector, b: Vector) -> float:
    """Scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inline
def norm(a: Vector) -> float:
    """Length of a."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inline
def turned(first: Vector, second: Vector, third: Vector, a: Vector) -> Vector:
    """Vector in fixed axes from its components along a triad: a_1 first + a_2 second + a_3 third."""
    return (
        a[0] * first[0] + a[1] * second[0] + a[2] * third[0],
        a[0] * first[1] + a[1] * second[1] + a[2] * third[1],
        a[0] * first[2] + a[1] * second[2] + a[2] * third[2],
    )


@inline
def spun(omega: Vector, eps: Vector, a: Vector) -> Vector:
    """Acceleration of the body-fixed vector a: eps x a + omega x (omega x a)."""
    return add(cross(eps, a), cross(omega, cross(omega, a)))
