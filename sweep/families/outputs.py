"""Outputs that several families have: a coordinate with its derivatives, joints, a working point."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from sweep.families.base import Output
from sweep.families.parts import AXES

_KINDS = ("", "velocity analogue of the ", "acceleration analogue of the ", "jerk analogue of the ")
_ORDERS = ("", "d", "d2", "d3")


def angle_outputs(
    name: str, text: str, equation: str, rates: str, *, of_name: bool = False
) -> tuple[Output, Output, Output, Output]:
    """Define an angle and its first three derivatives by phi; ``of_name`` repeats its name in the words of those."""
    of = f" of {name}" if of_name else ""
    return (
        Output(name, "rad", text, equation, wraps=True),
        Output(f"d{name}", "1", f"velocity analogue d{name}/dphi", rates),
        Output(f"d2{name}", "1", f"acceleration analogue{of}", rates),
        Output(f"d3{name}", "1", f"jerk analogue{of}", rates),
    )


def place_outputs(
    name: str, text: str, equation: str, rates: str, kind: str = "", *, of_name: bool = False
) -> tuple[Output, ...]:
    """Define a place along something and its first three derivatives by phi; ``kind`` is "sliding" where it slides."""
    kind, of = kind and f"{kind} ", f" of {name}" if of_name else ""
    return (
        Output(name, "length", text, equation),
        Output(f"d{name}", "length", f"{kind}velocity analogue d{name}/dphi", rates),
        Output(f"d2{name}", "length", f"{kind}acceleration analogue{of}", rates),
        Output(f"d3{name}", "length", f"{kind}jerk analogue{of}", rates),
    )


def point_outputs(equation: str) -> tuple[tuple[Output, ...], ...]:
    """Place, velocity, acceleration and jerk of the working point, three components each."""
    return tuple(
        tuple(Output(f"{order}{axis}_p", "length", f"{kind}working point along {axis}", equation) for axis in AXES)
        for order, kind in zip(_ORDERS, _KINDS, strict=True)
    )


def magnitude_outputs(equation: str) -> tuple[Output, ...]:
    """Magnitudes of the working point's velocity, acceleration and jerk, per radian of the family's own crank."""
    return (
        Output("speed_p", "length", "magnitude of the working point's velocity analogue", equation),
        Output("acceleration_p", "length", "magnitude of the working point's acceleration analogue", equation),
        Output("jerk_p", "length", "magnitude of the working point's jerk analogue", equation),
    )


def joint_outputs(joints: Sequence[tuple[str, str]], equation: str) -> tuple[Output, ...]:
    """Coordinates of joints, given as (suffix of the name, what it is)."""
    return tuple(
        Output(f"{axis}_{name}", "length", f"{text}, along {axis}", equation) for name, text in joints for axis in AXES
    )


def ladders(*names: str) -> dict[str, str]:
    """Of each name and its first two derivatives the next derivative."""
    return {f"{low}{name}": f"{high}{name}" for name in names for low, high in pairwise(_ORDERS)}
