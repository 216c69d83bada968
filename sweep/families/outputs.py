"""Outputs common to several families: a coordinate with its derivatives, joints, a working point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from sweep.families.base import Output
from sweep.families.parameter import of_derivative
from sweep.families.sites import AXES

_KINDS = ("", "velocity analogue of the ", "acceleration analogue of the ", "jerk analogue of the ")
_ORDERS = ("", "d", "d2", "d3")
_CIRCLE = (("sin", "sine"), ("cos", "cosine"))
ALONG_FRAME = ("along the frame", "across the frame")  # axes of planar families


def coordinate_outputs(
    name: str, unit: str, text: str, *equations: str, kind: str = "", of_name: bool = False, circle: str = ""
) -> tuple[Output, ...]:
    """Define an angle or a coordinate and its first three derivatives by phi.

    Parameters
    ----------
    name, unit, text : of the coordinate; "rad" makes it an angle
    equations : of the coordinate, and of its derivatives together or each
    kind : prefix of the descriptions of the derivatives, such as "sliding "
    of_name : whether its name is repeated in them
    circle : description of the angle, if its sine and cosine are outputs too
    """
    own, rates = equations[0], equations[1:] * (3 if len(equations) == 2 else 1)
    of = f" of {name}" if of_name else ""
    words = (f"velocity analogue d{name}/dphi", f"acceleration analogue{of}", f"jerk analogue{of}")
    return (
        Output(name, unit, text, own, wraps=unit == "rad"),
        *(
            Output(f"{order}{name}", of_derivative(unit, "rad"), f"{kind}{word}", equation)
            for order, word, equation in zip(_ORDERS[1:], words, rates, strict=True)
        ),
        *(Output(f"{short}_{name}", "1", f"{word} of {circle}", own) for short, word in _CIRCLE if circle),
    )


def point_outputs(equation: str) -> tuple[tuple[Output, ...], ...]:
    """Position, velocity, acceleration and jerk of the working point, three components each."""
    return tuple(
        tuple(Output(f"{order}{axis}_p", "length", f"{kind}working point along {axis}", equation) for axis in AXES)
        for order, kind in zip(_ORDERS, _KINDS, strict=True)
    )


def magnitude_outputs(equation: str) -> tuple[Output, ...]:
    """Magnitudes of the working point's velocity, acceleration and jerk."""
    text, words = "magnitude of the working point's", ("velocity", "acceleration", "jerk")
    return tuple(
        Output(f"{name}_p", "length", f"{text} {word} analogue", equation, parts=tuple(f"{order}{x}_p" for x in AXES))
        for name, word, order in zip(("speed", *words[1:]), words, _ORDERS[1:], strict=True)
    )


def joint_outputs(
    joints: Mapping[str, str], equation: str, ways: Sequence[str] = ("along x", "along y", "along z")
) -> tuple[Output, ...]:
    """Coordinates of joints along two or three directions, from the suffix of their names and a description."""
    return tuple(
        Output(f"{axis}_{name}", "length", f"{text}, {way}", equation)
        for name, text in joints.items()
        for axis, way in zip(AXES, ways, strict=False)
    )


def joint_rate_outputs(
    name: str, text: str, equation: str, ways: Sequence[str], orders: Sequence[int] = (1, 2)
) -> tuple[Output, ...]:
    """Return derivatives of a joint's coordinates along two or three directions, of the given orders."""
    return tuple(
        Output(f"{_ORDERS[order]}{axis}_{name}", "length", f"{_KINDS[order]}{text}, {way}", equation)
        for order in orders
        for axis, way in zip(AXES, ways, strict=False)
    )


def kinked(outputs: Iterable[Output]) -> tuple[Output, ...]:
    """Mark outputs whose curves have kinks or jumps; angles and whole numbers are left unmarked."""
    return tuple(replace(o, kinks=not (o.wraps or o.jumps)) for o in outputs)


def ladders(*names: str, orders: int = 3) -> dict[str, str]:
    """Map each name and its derivatives, up to the given order, to the next derivative."""
    return {f"{low}{name}": f"{high}{name}" for name in names for low, high in pairwise(_ORDERS[: orders + 1])}
