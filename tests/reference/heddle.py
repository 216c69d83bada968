"""Heddle drive from points and circles, 50 digits: slow, obvious, imports nothing from kernels or sweep."""

from __future__ import annotations

from typing import Any

from mpmath import mp

NAMES = (
    "O2B", "BC", "O3C", "O2O3", "O4E", "chi_mid", "O3D", "O4F", "O3O4", "DF", "EG", "x_s", "side_F", "side_C",
)  # fmt: skip


def circles(one: Any, r_one: Any, two: Any, r_two: Any, side: float) -> Any:
    """Point at r_one from ``one`` and r_two from ``two`` (complex), left of the ray one -> two for side +1."""
    ray = two - one
    d = abs(ray)
    along = (r_one**2 - r_two**2 + d**2) / (2 * d)
    across = mp.sqrt(r_one**2 - along**2)
    return one + (along + side * mp.mpc(0, 1) * across) * ray / d


def positions(design: tuple[Any, ...], theta: Any) -> dict[str, Any]:
    """Bell-crank angle, shaft-lever angle and lift at one angle of the cam lever."""
    p = dict(zip(NAMES, design, strict=True))
    turn = mp.mpc(0, 1)
    b = p["O2B"] * mp.expj(theta)
    c = circles(b, p["BC"], mp.mpc(p["O2O3"]), p["O3C"], p["side_C"])
    chi = mp.arg(c - p["O2O3"])
    lam = chi - p["chi_mid"]
    if p["O3D"] != p["O4F"] or p["O3O4"] != p["DF"]:
        d = p["O3D"] * p["side_F"] * turn * mp.expj(lam)
        f = circles(d, p["DF"], mp.mpc(p["O3O4"]), p["O4F"], p["side_F"])
        lam = mp.arg((f - p["O3O4"]) / (p["side_F"] * turn))
    end = p["O4E"] * mp.expj(lam)
    y = end.imag
    if p["EG"] > 0:
        y += mp.sqrt(p["EG"] ** 2 - (end.real - p["x_s"]) ** 2)
    return {"chi": chi, "lam": lam, "y": y, "B": b, "C": c}


def outputs(design: tuple[float, ...], theta: float) -> dict[str, Any]:
    """Angle and lift with three derivatives each, by numerical differentiation with 60 digits."""
    with mp.workdps(60):
        numbers = tuple(mp.mpf(x) for x in design)
        result = {}
        for letter in ("chi", "y"):
            coefficients = mp.taylor(lambda x, k=letter: positions(numbers, x)[k], mp.mpf(theta), 3)
            for order, prefix in enumerate(("", "d", "d2", "d3")):
                result[prefix + letter] = coefficients[order] * mp.factorial(order)
        at = positions(numbers, mp.mpf(theta))
        rod, arm = at["C"] - at["B"], at["C"] - numbers[3]
        result["sin_transmission"] = (rod.imag * arm.real - rod.real * arm.imag) / (numbers[1] * numbers[2])
        return result


def condition(design: tuple[float, ...], theta: float, name: str) -> Any:
    """Sum of |parameter d(output)/d(parameter)| over the lengths and angles: what one rounding of each can do."""
    with mp.workdps(60):
        values = [*design[:12], theta]
        total = mp.mpf(0)
        for k, x in enumerate(values):
            if x != 0.0:
                step = mp.mpf(x) * mp.mpf(10) ** -25
                shifted = [mp.mpf(v) for v in values]
                shifted[k] += step
                changed = (*shifted[:12], *design[12:])
                if (design[6] == design[7] and design[8] == design[9]) and 6 <= k <= 9:
                    continue  # a parallel linkage stays one
                order = {"": 0, "d": 1, "d2": 2, "d3": 3}[name.rstrip("chiy")]
                letter = "chi" if name.endswith("chi") else "y"
                one, two = (
                    mp.diff(lambda t, c=c, k=letter: positions(c, t)[k], at, order)
                    for c, at in (((*map(mp.mpf, design),), mp.mpf(theta)), (changed, shifted[12]))
                )
                total += abs(two - one) / mp.mpf(10) ** -25
        return total


def extremes(stroke: Any, lever: Any, kappa: Any, frame: Any, arm: Any, printed: bool) -> dict[str, Any]:
    """Both extreme places of C (complex, O2 at the origin, x towards O3) for a stroke of the shaft lever's end."""
    with mp.workdps(60):
        ratio = mp.mpf(stroke) / (2 * mp.mpf(lever))
        mu = mp.atan(ratio) if printed else mp.asin(ratio)
        xi = [3 * mp.pi / 2 - mp.mpf(kappa) + sign * mu for sign in (1, -1)]
        c = [frame + arm * mp.expj(mp.pi - x) for x in xi]
        return {"mu": mu, "xi": xi, "C": c, "O2C": [abs(x) for x in c], "travel": 2 * lever * mp.sin(mu)}


def swing(places: list[Any], lever: Any, rod: Any, side: float) -> Any:
    """Angle between the two directions of O2B that the rod BC gives at the two places of C."""
    with mp.workdps(60):
        points = [circles(mp.mpc(0), mp.mpf(lever), c, mp.mpf(rod), side) for c in places]
        return mp.arg(points[0] / points[1])
