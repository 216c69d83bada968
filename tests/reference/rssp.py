"""Spatial slider-crank from joint positions, 50 digits: slow, obvious, imports nothing from kernels or sweep."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def joints(a: Any, b: Any, e: Any, f: Any, alpha: Any, branch: Any, phi: Any) -> tuple[list[Any], list[Any]]:
    """Crank pin B and slider ball C; C lies on the line x = e, z = 0 at the distance b from B."""
    u = [mp.mpf(0), mp.sin(alpha), mp.cos(alpha)]  # crank axis
    across = [mp.mpf(0), mp.cos(alpha), -mp.sin(alpha)]
    along_x = [mp.mpf(1), mp.mpf(0), mp.mpf(0)]
    crank_pin = [f * u[k] + a * (mp.cos(phi) * along_x[k] + mp.sin(phi) * across[k]) for k in range(3)]
    half_chord = mp.sqrt(b**2 - (e - crank_pin[0]) ** 2 - crank_pin[2] ** 2)
    return crank_pin, [mp.mpf(e), crank_pin[1] + branch * half_chord, mp.mpf(0)]


def outputs(design: tuple[float, ...], phi: float) -> dict[str, Any]:
    """Displacement, its derivatives by numerical differentiation, and the angle between coupler and slide line."""
    with mp.workdps(50):
        numbers = [mp.mpf(x) for x in design]
        b_pin, c_ball = joints(*numbers, mp.mpf(phi))
        result = {"s": c_ball[1]}
        for order, name in ((1, "ds"), (2, "d2s"), (3, "d3s")):
            result[name] = mp.diff(lambda x: joints(*numbers, x)[1][1], mp.mpf(phi), order)
        result["pressure_angle"] = mp.acos(abs(c_ball[1] - b_pin[1]) / numbers[1])
        return result


def limit_positions(design: tuple[float, ...], samples: int = 240) -> dict[str, Any]:
    """Extended and folded position: where the slider's motion has its extremes, found on a grid and polished."""
    with mp.workdps(50):
        numbers = [mp.mpf(x) for x in design]
        branch = numbers[5]

        def place(phi: Any) -> Any:
            return joints(*numbers, phi)[1][1]

        grid = [2 * mp.pi * k / samples for k in range(samples)]
        values = [place(phi) for phi in grid]
        step = 2 * mp.pi / samples
        result = {}
        for name, sign in (("ext", branch), ("fold", -branch)):
            start = max(range(samples), key=lambda k: sign * values[k])
            left, right = grid[start] - step, grid[start] + step
            phi = mp.findroot(lambda x: mp.diff(place, x), (left, right), solver="illinois", tol=mp.mpf(10) ** -40)
            result[f"phi_{name}"], result[f"s_{name}"] = phi % (2 * mp.pi), place(phi)
        result["phi0"] = (result["phi_fold"] - result["phi_ext"]) % (2 * mp.pi)
        result["stroke_ratio"] = result["phi0"] / (2 * mp.pi - result["phi0"])
        result["stroke"] = abs(result["s_fold"] - result["s_ext"])
        return result


def least_discriminant(design: tuple[float, ...], samples: int = 64) -> Any:
    """Smallest b^2 - (distance of the crank pin from the slide line)^2 over the turn, 60 digits."""
    with mp.workdps(60):
        a, b, e, f, alpha, _ = (mp.mpf(x) for x in design)

        def q(phi: Any) -> Any:
            pin = [a * mp.cos(phi), f * mp.cos(alpha) - a * mp.sin(alpha) * mp.sin(phi)]
            return b**2 - (e - pin[0]) ** 2 - pin[1] ** 2

        grid = [2 * mp.pi * k / samples for k in range(samples)]
        values = [q(phi) for phi in grid]
        lows = [k for k in range(samples) if values[k] <= values[k - 1] and values[k] <= values[(k + 1) % samples]]
        step = 2 * mp.pi / samples
        best = min(values)
        for k in lows:
            low, high = grid[k] - step, grid[k] + step
            for _ in range(140):  # golden section: q is flat there, its value needs half the digits of the place
                one, two = low + (high - low) * mp.mpf("0.382"), low + (high - low) * mp.mpf("0.618")
                low, high = (low, two) if q(one) < q(two) else (one, high)
            best = min(best, q((low + high) / 2))
        return best
