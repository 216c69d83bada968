"""Link lengths from two limit positions by plain geometry, in any number of digits."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def _dot(p: list[Any], q: list[Any]) -> Any:
    return sum(x * y for x, y in zip(p, q, strict=True))


def _minus(p: list[Any], q: list[Any]) -> list[Any]:
    return [x - y for x, y in zip(p, q, strict=True)]


def _crank(alpha: Any, phi: Any) -> tuple[list[Any], list[Any]]:
    """Direction of the crank and normal of the plane through crank axis and crank."""
    first, second = [mp.mpf(1), mp.mpf(0), mp.mpf(0)], [mp.mpf(0), mp.cos(alpha), -mp.sin(alpha)]
    along = [mp.cos(phi) * x + mp.sin(phi) * y for x, y in zip(first, second, strict=True)]
    normal = [-mp.sin(phi) * x + mp.cos(phi) * y for x, y in zip(first, second, strict=True)]
    return along, normal


def rssr(swing: Any, phi0: Any, phi1: Any, e: Any, f: Any, g: Any, alpha: Any) -> dict[str, Any]:
    """The crank-rocker whose rocker ball lies in the crank's plane at phi1 and, turned by the swing, at phi1 + phi0."""
    swing, phi0, phi1, e, f, g, alpha = (mp.mpf(x) for x in (swing, phi0, phi1, e, f, g, alpha))
    turn = mp.matrix([[mp.cos(swing), -mp.sin(swing)], [mp.sin(swing), mp.cos(swing)]])

    def balls(x: Any, y: Any) -> tuple[list[Any], list[Any]]:
        moved = turn * mp.matrix([x, y])
        return [e + x, y, g], [e + moved[0], moved[1], g]

    cranks = [_crank(alpha, phi1), _crank(alpha, phi1 + phi0)]

    def out_of_plane(x: Any, y: Any) -> list[Any]:
        return [_dot(c, normal) for c, (_, normal) in zip(balls(x, y), cranks, strict=True)]

    zero, right, up = out_of_plane(0, 0), out_of_plane(1, 0), out_of_plane(0, 1)
    matrix = mp.matrix([[right[k] - zero[k], up[k] - zero[k]] for k in range(2)])
    x, y = mp.lu_solve(matrix, mp.matrix([-zero[0], -zero[1]]))
    lengths = _crank_and_coupler(balls(x, y), cranks, f, alpha)
    return lengths | {"c": mp.hypot(x, y), "psi1": mp.atan2(y, x)}


def rssp(stroke: Any, s1: Any, e: Any, f: Any, alpha: Any) -> dict[str, Any]:
    """The slider-crank that is extended with the slider at s1 and folded at s1 + stroke."""
    stroke, s1, e, f, alpha = (mp.mpf(x) for x in (stroke, s1, e, f, alpha))
    balls = [e, s1, mp.mpf(0)], [e, s1 + stroke, mp.mpf(0)]
    second = [mp.mpf(0), mp.cos(alpha), -mp.sin(alpha)]
    phi1 = mp.atan2(_dot(balls[0], second), balls[0][0])
    phi2 = mp.atan2(_dot(balls[1], second), balls[1][0]) + mp.pi
    lengths = _crank_and_coupler(balls, [_crank(alpha, phi1), _crank(alpha, phi2)], f, alpha)
    return lengths | {"phi1": phi1, "phi0": (phi2 - phi1) % (2 * mp.pi)}


def _crank_and_coupler(balls: Any, cranks: Any, f: Any, alpha: Any) -> dict[str, Any]:
    """The crank length for which both limits have the same coupler, and that coupler."""
    centre = [mp.mpf(0), f * mp.sin(alpha), f * mp.cos(alpha)]
    reach = [_minus(c, centre) for c in balls]
    ahead = [_dot(d, along) for d, (along, _) in zip(reach, cranks, strict=True)]
    square = [_dot(d, d) for d in reach]
    a = (square[0] - square[1]) / (2 * (ahead[0] - ahead[1]))
    pin = [m + a * k for m, k in zip(centre, cranks[0][0], strict=True)]
    to_ball = _minus(balls[0], pin)
    return {"a": a, "b": mp.sqrt(_dot(to_ball, to_ball)), "ahead": ahead[0], "back": ahead[1]}
