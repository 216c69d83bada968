"""The skeleton that all entries of the moving back-rest share: bracket, slider, guide, spring and the warp."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sweep.families.base import Angles, Array, Columns, Parameter
from sweep.families.capabilities import Fixed, Link, Made, Skeleton
from sweep.families.skeletons import ORIGIN, parameter, standing

LINKS = (
    Link("bracket", ("o2", "s", "m")), Link("slider", ("s", "axis")), Link("pin", ("axis", "p")),
    Link("spring", ("m", "q")), Link("beam", ("o", "t1")), Link("back-rest", ("axis", "t2", "t3")),
    Link("warp 1", ("t1", "t2")), Link("warp 2", ("t3", "w")),
)  # fmt: skip


def skeleton(parameters: tuple[Parameter, ...], angle: str) -> Skeleton:
    """Return the back-rest in the plane of the beam; ``angle`` is the entry's output of the bracket's angle."""

    def column(name: str, designs: Array) -> Array:
        return parameter(parameters, name, designs)[:, None]

    def guide(designs: Array) -> Array:
        psi = parameter(parameters, "psi", designs)
        return np.stack([-np.cos(psi), np.sin(psi), 0.0 * psi], axis=1)

    def made(needs: tuple[str, ...], at: Callable[..., tuple[Array, Array]]) -> Made:
        """Return a point of the plane: ``at(column, designs, rho, *needs)`` gives its x and y, each (n, m)."""

        def place(designs: Array, angles: Angles, found: Columns) -> Array:
            values = (np.asarray(found[name], np.float64) for name in needs)
            x, y = at(lambda name: column(name, designs), angles.phi, *values)
            return np.stack([x, y, 0.0 * x], axis=-1)

        return Made(needs, place)

    axis = ("x_axis", "y_axis")
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
            "s": made((angle, "R1"), _slider),
            "m": made((angle,), _spring),
            "p": made(("h",), _pin),
            "t1": made(("theta",), _on_beam),
            "t2": made((*axis, "theta"), _from_beam),
            "t3": made((*axis, "gamma"), _to_fell),
        },
    )


Columned = Callable[[str], Array]


def _slider(of: Columned, rho: Array, phi: Array, reach: Array) -> tuple[Array, Array]:
    """Return the slider's foot on the line of the bracket; (1)."""
    return of("a2") - reach * np.cos(phi), of("b2") + reach * np.sin(phi)


def _spring(of: Columned, rho: Array, phi: Array) -> tuple[Array, Array]:
    """Return the spring's end on the bracket; (6)."""
    turn = phi + of("nu")
    return of("a2") - of("lM") * np.cos(turn), of("b2") + of("lM") * np.sin(turn)


def _pin(of: Columned, rho: Array, h: Array) -> tuple[Array, Array]:
    """Return the point where the pin touches the guide; (2)."""
    return of("xE") - h * np.cos(of("psi")), of("yE") + h * np.sin(of("psi"))


def _on_beam(of: Columned, rho: Array, theta: Array) -> tuple[Array, Array]:
    """Return the point where the yarn leaves the beam, on the side away from the fell; (3)."""
    return -rho * np.cos(theta), rho * np.sin(theta)


def _from_beam(of: Columned, rho: Array, x: Array, y: Array, theta: Array) -> tuple[Array, Array]:
    """Return the point where the yarn meets the back-rest; (3)."""
    return x - of("r") * np.cos(theta), y + of("r") * np.sin(theta)


def _to_fell(of: Columned, rho: Array, x: Array, y: Array, gamma: Array) -> tuple[Array, Array]:
    """Return the point where the yarn leaves the back-rest; (4)."""
    return x + of("r") * np.sin(gamma), y + of("r") * np.cos(gamma)
