"""Plain linkages and cams from points, lines and printed curves, 50 digits; imports nothing of the project.

Each function takes a design by name and an input angle and gives the curves whose derivatives are wanted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mpmath import mp

Numbers = Mapping[str, Any]
Curves = Callable[[Numbers, Any], dict[str, Any]]


def slider_crank(d: Numbers, phi: Any) -> dict[str, Any]:
    """Slider on the line y = e at the distance b from the crank pin, before it (branch +1) or behind."""
    height = d["e"] - d["a"] * mp.sin(phi)
    return {"s": d["a"] * mp.cos(phi) + d["branch"] * mp.sqrt(d["b"] ** 2 - height**2)}


def four_bar(d: Numbers, phi: Any) -> dict[str, Any]:
    """Rocker pin where the circles about crank pin and rocker pivot meet; a triangle stands on the coupler."""
    pin, pivot = d["a"] * mp.expj(phi), mp.mpc(d["e"])
    gap = pivot - pin
    along = (abs(gap) ** 2 + d["b"] ** 2 - d["c"] ** 2) / (2 * abs(gap))
    across = mp.sqrt(d["b"] ** 2 - along**2)
    for side in (1, -1):
        end = pin + gap / abs(gap) * mp.mpc(along, side * across)
        rocker = end - pivot
        if mp.sign(((end - pin) / (mp.mpc(0, 1) * rocker)).real) == d["branch"]:
            break
    point = pin + mp.mpc(d["xi"], d["eta"]) * (end - pin) / d["b"]
    return {"psi": mp.arg(rocker), "x_m": point.real, "y_m": point.imag}


def inverted_slider_crank(d: Numbers, phi: Any) -> dict[str, Any]:
    """The line at the distance h to the left of the rocker, through the crank pin."""
    pin = d["a"] * mp.expj(phi) - d["e"]
    s = d["branch"] * mp.sqrt(abs(pin) ** 2 - d["h"] ** 2)
    return {"psi": mp.arg(pin / mp.mpc(s, d["h"])), "s": s}


def epicyclic_dwell(d: Numbers, phi: Any) -> dict[str, Any]:
    """The pin of a planet that rolls on or in the fixed gear, from its own turning by the rolled length of arc."""
    centre = d["n"] + d["mesh"]
    turned = phi + d["mesh"] * d["n"] * phi  # carried along, and rolled by the arc n phi of the fixed gear
    pin = centre * mp.expj(phi) - d["mesh"] * d["k"] * mp.expj(turned) + d["a"]
    return {"psi": mp.arg(pin)}


def rise(law: int, x: Any) -> Any:
    """The normalised curves as the handbooks print them."""
    if law == 1:
        return 10 * x**3 - 15 * x**4 + 6 * x**5
    if law == 3:
        return x - mp.sin(2 * mp.pi * x) / (2 * mp.pi)
    k = 4 + mp.pi
    if x < mp.mpf(1) / 8:
        return (mp.pi * x - mp.sin(4 * mp.pi * x) / 4) / k
    if x <= mp.mpf(7) / 8:
        return (2 + mp.pi * x - mp.mpf(9) / 4 * mp.sin((mp.pi + 4 * mp.pi * x) / 3)) / k
    return (4 + mp.pi * x - mp.sin(4 * mp.pi * x) / 4) / k


def lifted(d: Numbers, phi: Any) -> Any:
    """Part of the lift at one cam angle."""
    if d["law"] == 4:
        waves = ((d[f"c{k}"] * mp.cos(k * phi) + d[f"s{k}"] * mp.sin(k * phi)) for k in range(1, 7))
        return mp.fsum(waves)
    t = (phi - d["start"]) % (2 * mp.pi)
    if t < d["rise"]:
        return rise(int(d["law"]), t / d["rise"])
    t -= d["rise"] + d["dwell"]
    if t < 0:
        return mp.mpf(1)
    return 1 - rise(int(d["law"]), t / d["fall"]) if t < d["fall"] else mp.mpf(0)


def cam(d: Numbers, phi: Any) -> dict[str, Any]:
    """A follower that slides by the law."""
    return {"s": d["lift"] * lifted(d, phi)}


def cam_lever(d: Numbers, phi: Any) -> dict[str, Any]:
    """A lever that rests where its roller is on the prime circle, and swings away from the cam by the law."""
    rest = mp.pi - mp.acos((d["e"] ** 2 + d["c"] ** 2 - d["r0"] ** 2) / (2 * d["e"] * d["c"]))
    return {"psi": d["branch"] * (rest - d["lift"] * lifted(d, phi))}


def derivatives(curves: Curves, design: Mapping[str, float], phi: float, most: int) -> dict[str, Any]:
    """All curves and their derivatives, named d, d2, d3 before the name, by numerical differentiation."""
    with mp.workdps(50):
        numbers = {name: mp.mpf(x) for name, x in design.items()}
        here, found = curves(numbers, mp.mpf(phi)), {}
        for name, start in here.items():

            def curve(x: Any, name: str = name, start: Any = start) -> Any:
                turned = curves(numbers, x)[name] - start
                # an angle is followed across the cut of the arctangent; no length here moves that far at once
                return start + turned - 2 * mp.pi * mp.nint(turned / (2 * mp.pi)) if name == "psi" else start + turned

            for order in range(most + 1):
                prefix = ("", "d", "d2", "d3")[order]
                found[f"{prefix}{name}"] = mp.diff(curve, mp.mpf(phi), order)
        return found


def contact_pressure(pitch: Callable[[Any], Any], centre: Any, velocity: Any, phi: float) -> float:
    """Angle between the normal of a pitch curve in the cam's frame and the motion of the roller's centre.

    ``pitch(phi)`` is the curve as a complex number; ``centre`` and ``velocity`` are in the fixed frame.
    """
    with mp.workdps(40):
        tangent = mp.diff(pitch, mp.mpf(phi)) * mp.expj(phi)
        assert abs(pitch(mp.mpf(phi)) * mp.expj(phi) - centre) < 1e-9
        normal = mp.mpc(0, 1) * tangent
        turn = normal / velocity
        return float(mp.atan2(abs(turn.imag), abs(turn.real)))
