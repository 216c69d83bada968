"""Feed mechanism from points, circles and plain root finding, 40 digits; imports nothing from kernels or sweep."""

from __future__ import annotations

import cmath
from typing import Any

import numpy as np
from mpmath import mp


def rocker(p: dict[str, Any], phi: Any) -> Any:
    """Angle of the rocker: the zero of |BC|^2 - b^2 with slope of the sign h_sigma."""
    a, b, c, e, f, g = (p[k] for k in ("h_a", "h_b", "h_c", "h_e", "h_f", "h_g"))
    sa, ca = mp.sin(p["h_alpha"]), mp.cos(p["h_alpha"])
    pin = [a * mp.cos(phi), f * sa + a * ca * mp.sin(phi), f * ca - a * sa * mp.sin(phi)]
    flat = mp.mpc(pin[0] - e, pin[1])
    reach2 = b**2 - (g - pin[2]) ** 2
    cos = (abs(flat) ** 2 + c**2 - reach2) / (2 * c * abs(flat))
    # C on the circle about D seen from D: towards the pin, turned by the angle of the triangle to either side
    one = mp.arg(flat) + p["h_sigma"] * mp.acos(cos)
    return mp.arg(mp.expj(one))


def points(p: dict[str, Any], phi: Any) -> dict[str, Any]:
    """Pins, rack angle and tooth at one crank angle (complex plane)."""
    psi = rocker(p, phi) + p["dh"]
    h = p["h_e"] + p["rh"] * mp.expj(psi)
    e = mp.mpc(p["xE"], p["yE"]) + p["rE"] * mp.expj(phi + p["dE"])
    f = mp.mpc(p["fx"], p["fy"])
    # triangle H E F: at H between HE and HF
    to_e = e - h
    cos = (abs(to_e) ** 2 + abs(f) ** 2 - p["q"] ** 2) / (2 * abs(to_e) * abs(f))
    chi = mp.arg(to_e / f) - p["bar_branch"] * mp.acos(cos)
    tooth = mp.mpc(p["tx"] + p["tooth"] * p["pitch"], p["ty"])
    return {"psi_plus_dh": psi, "chi": chi, "H": h, "E": e, "F": h + mp.expj(chi) * f, "T": h + mp.expj(chi) * tooth}


def tooth(p: dict[str, Any], phi: Any) -> Any:
    """Tooth as a complex number."""
    return points(p, phi)["T"]


def feeding(p: dict[str, Any], phi_entry: float, phi_leave: float) -> dict[str, Any]:
    """Events polished from rough crank angles, and what lies between them."""
    with mp.workdps(30):

        def height(x: Any) -> Any:
            return tooth(p, x).imag - p["y_plate"]

        entry, leave = mp.findroot(height, mp.mpf(phi_entry)), mp.findroot(height, mp.mpf(phi_leave))
        if leave < entry:
            leave += 2 * mp.pi
        xs = [entry + (leave - entry) * k / 400 for k in range(401)]
        top = max(xs, key=height)
        top = mp.findroot(lambda x: mp.diff(height, x), top)
        stitch = tooth(p, leave).real - tooth(p, entry).real
        # the x-derivative by a central difference of 1e-10: 1e-20 of the path
        step = mp.mpf(10) ** -10

        def strip(x: Any) -> Any:
            return height(x) * (tooth(p, x + step).real - tooth(p, x - step).real) / (2 * step)

        cuts = [entry + (leave - entry) * k / 8 for k in range(9)]
        area = mp.quad(strip, cuts, maxdegree=4)
        return {
            "phi_entry": entry % (2 * mp.pi), "phi_leave": leave % (2 * mp.pi), "feed_angle": leave - entry,
            "entry_speed": mp.diff(height, entry), "leave_speed": mp.diff(height, leave), "stitch_length": stitch,
            "rise": height(top), "flatness": area / (height(top) * stitch),
        }  # fmt: skip


def triad(p: dict[str, Any], phi: Any, start: tuple[float, float, float]) -> list[Any]:
    """Tooth and rack angle of the rack on three leads, by plain root finding from a start nearby."""
    leads = [p["h_e"] + p["rh"] * mp.expj(rocker(p, phi) + p["dh"])]
    leads += [mp.mpc(p[f"xE{k}"], p[f"yE{k}"]) + p[f"rE{k}"] * mp.expj(phi + p[f"dE{k}"]) for k in (2, 3)]
    arms = [mp.mpc(p[f"f{k}x"], p[f"f{k}y"]) for k in (1, 2, 3)]

    def closures(place: Any) -> Any:
        x, y, chi = place
        return mp.matrix([
            abs(mp.mpc(x, y) + mp.expj(chi) * arm - lead) - p[f"q{k}"]
            for k, (arm, lead) in enumerate(zip(arms, leads, strict=True), 1)
        ])  # fmt: skip

    place, step = mp.matrix([mp.mpf(float(v)) for v in start]), mp.mpf(10) ** -25
    for _ in range(6):
        slopes = mp.matrix(3, 3)
        for k in range(3):
            moved = place.copy()
            moved[k] += step
            slopes[:, k] = (closures(moved) - closures(place)) / step
        place -= mp.lu_solve(slopes, closures(place))
    return list(place)


def _at_start(p: dict[str, float]) -> tuple[dict[str, float], list[complex], list[complex]]:
    """All dimensions, leads at phi = 0 and joints of the rack seen from the tooth."""
    full = {name: p.get(name, 0.0) for name in ("h_f", "h_g", "h_alpha", "dh")} | p
    leads = [complex(full["h_e"] + full["rh"] * mp.expj(rocker({k: mp.mpf(v) for k, v in full.items()}, mp.mpf(0))
                     + full["dh"]))]  # fmt: skip
    leads += [complex(full[f"xE{k}"], full[f"yE{k}"]) + full[f"rE{k}"] * cmath.exp(1j * full[f"dE{k}"]) for k in (2, 3)]
    return full, leads, [complex(full[f"f{k}x"], full[f"f{k}y"]) for k in (1, 2, 3)]


def triad_closes(p: dict[str, float], samples: int = 4096) -> bool:
    """Whether there is an assembly at phi = 0, whatever the guess.

    Two differences of the closures are linear in the tooth, so that the first closure times the square of their
    determinant is a trigonometric polynomial of the rack's angle, of degree 3: it has to change its sign.
    """
    full, leads, arms = _at_start(p)
    turn = np.exp(2j * np.pi * np.arange(samples) / samples)
    first, *others = (turn * arm - lead for arm, lead in zip(arms, leads, strict=True))
    u, v = (other - first for other in others)
    r, s = (0.5 * (full[f"q{k}"] ** 2 - full["q1"] ** 2 - np.abs(d) ** 2) for k, d in ((2, u), (3, v)))
    determinant = (np.conj(u) * v).imag
    left = np.abs(r * v - s * u) ** 2 - (full["q1"] * determinant) ** 2
    return bool(left.min() < 0.0 < left.max())


def triad_from_guess(p: dict[str, float], steps: int) -> list[float] | None:
    """Tooth and rack angle at phi = 0 on the assembly that the guess chooses, None where the leads lock before.

    Links as long as the guess needs them take on their own lengths: their squares change evenly, in so many steps.
    """
    full, leads, arms = _at_start(p)

    def links(place: Any) -> Any:
        turned = [cmath.exp(1j * place[2]) * arm for arm in arms]
        return [complex(place[0], place[1]) + g - lead for g, lead in zip(turned, leads, strict=True)], turned

    place = np.array([full["x0"], full["y0"], full["chi0"]])
    own = np.array([full[f"q{k}"] ** 2 for k in (1, 2, 3)])
    guessed = np.abs(links(place)[0]) ** 2
    positive = None
    for step in range(1, steps + 1):
        wanted = guessed + (own - guessed) * (step / steps)
        for _ in range(12 if step == steps else 3):
            d, turned = links(place)
            slopes = np.array(
                [[x.real, x.imag, (x * (1j * g).conjugate()).real] for x, g in zip(d, turned, strict=True)]
            )
            size = float(np.linalg.det(slopes))
            if positive is not None and (size > 0.0) != positive:
                return None
            positive = size > 0.0
            place = place - np.linalg.solve(2.0 * slopes, np.abs(d) ** 2 - wanted)
    return [float(x) for x in place]
