"""Crank-rocker of Kim and Dison from its points in its own frame, 50 digits; imports nothing of the project."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def rocker_angle(design: tuple[Any, ...], phi: Any, branch: float) -> Any:
    """The angle alpha on the given side of the line from the rocker axis to the crank pin."""
    r, length, h, a, b = design
    pin = (r * mp.sin(phi), r * mp.cos(phi), 0)
    # the triangle rocker axis, rocker ball, crank pin seen along x
    e_y, e_z = pin[1] - a, -b
    reach, distance = mp.sqrt(length**2 - pin[0] ** 2), mp.hypot(e_y, e_z)
    cosine = (h**2 + distance**2 - reach**2) / (2 * h * distance)
    for side in (1, -1):
        angle = mp.atan2(e_z, e_y) + side * mp.acos(cosine)
        v_y, v_z = h * mp.cos(angle), h * mp.sin(angle)
        if mp.sign(e_y * v_z - e_z * v_y) == branch:
            return mp.atan2(-v_z, v_y)  # the ball is at a + h cos(alpha), b - h sin(alpha)
    raise ValueError("the ball is in line with the crank pin and the rocker axis")


def outputs(design: tuple[float, ...], phi: float, branch: float) -> dict[str, Any]:
    """The angle, three derivatives and the signed transmission sine, by numerical differentiation."""
    with mp.workdps(50):
        numbers = tuple(mp.mpf(x) for x in design)
        start = rocker_angle(numbers, mp.mpf(phi), branch)

        def alpha(x: Any) -> Any:
            # about the first angle, so that no difference is taken across the cut of the arctangent
            turned = rocker_angle(numbers, x, branch) - start
            return start + turned - 2 * mp.pi * mp.nint(turned / (2 * mp.pi))

        found = {n: mp.diff(alpha, mp.mpf(phi), k) for k, n in enumerate(("alpha", "dalpha", "d2alpha", "d3alpha"))}
        r, length, h, a, b = numbers
        d = (
            -r * mp.sin(phi),
            a + h * mp.cos(start) - r * mp.cos(phi),
            b - h * mp.sin(start),
        )
        found["sin_transmission"] = (-d[1] * mp.sin(start) - d[2] * mp.cos(start)) / length
        return found
