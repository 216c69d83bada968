"""Back-rest from points, contacts and balances of forces and moments, 40 digits; imports nothing from kernels."""

from __future__ import annotations

from typing import Any

from mpmath import mp


def cross(a: Any, b: Any) -> Any:
    """Moment of the force b at the lever a, both complex."""
    return (mp.conj(a) * b).imag


def points(p: dict[str, Any], phi: Any, rho: Any) -> dict[str, Any]:
    """Axis of the back-rest and the four points where the yarn touches; the plane is the complex one."""
    i = mp.mpc(0, 1)
    pivot, end = mp.mpc(p["a2"], p["b2"]), mp.mpc(p["a1"], p["b1"])
    arm = mp.mpc(-mp.cos(phi), mp.sin(phi))
    side = mp.mpc(mp.sin(phi), mp.cos(phi))
    normal = mp.mpc(mp.sin(p["psi"]), mp.cos(p["psi"]))
    guide = mp.mpc(p["xE"], p["yE"])

    def gap(length: Any) -> Any:
        to_guide = guide - (pivot + length * arm + p["H"] * side)
        return (to_guide * mp.conj(normal)).real - p["r0"]

    zero, one = gap(mp.mpf(0)), gap(mp.mpf(1))
    r1 = zero / (zero - one)
    axis = pivot + r1 * arm + p["H"] * side

    def touching(n: Any) -> Any:
        """Axis and beam on one side of the branch that touches both along n."""
        return (axis * mp.conj(n)).real - (rho - p["r"])

    # n = unit normal of the branch beam - back-rest: n.axis = rho - r, and the yarn runs up on the outer side
    base, tilt = mp.arg(axis), mp.acos((rho - p["r"]) / abs(axis))
    n1 = mp.expj(base + tilt)
    assert abs(touching(n1)) < mp.mpf(10) ** -30
    reach = end - axis
    n2 = mp.expj(mp.arg(reach) + mp.acos(p["r"] / abs(reach)))
    return {
        "R1": r1, "axis": axis, "arm": arm, "side": side, "normal": normal, "pivot": pivot, "end": end,
        "A0": rho * n1, "A": axis + p["r"] * n1, "B": axis + p["r"] * n2, "i": i,
        "along": mp.mpc(-mp.cos(p["psi"]), mp.sin(p["psi"])), "guide": guide,
    }  # fmt: skip


def geometry(p: dict[str, Any], phi: Any, rho: Any) -> dict[str, Any]:
    """Lengths and angles measured on the points."""
    g = points(p, phi, rho)
    up, down = g["A"] - g["A0"], g["end"] - g["B"]
    theta, gamma = mp.atan2(up.real, up.imag), mp.atan2(-down.imag, down.real)
    return {
        "R1": g["R1"], "h": ((g["axis"] - g["guide"]) * mp.conj(g["along"])).real,
        "theta": theta, "gamma": gamma, "L1": abs(up), "L2": abs(down),
        "wrap": mp.pi / 2 - theta + gamma, "Lc": p["r"] * (mp.pi / 2 - theta + gamma),
        "x_axis": g["axis"].real, "y_axis": g["axis"].imag,
    }  # fmt: skip


def statics(p: dict[str, Any], phi: Any, rho: Any) -> dict[str, Any]:
    """Tension and reactions: with the slider's reaction at the axis, and with the couple that balances moments."""
    g, f = points(p, phi, rho), p["f"]
    yarn = (g["A0"] - g["A"]) / abs(g["A0"] - g["A"]) + (g["end"] - g["B"]) / abs(g["end"] - g["B"])
    c1 = -g["normal"] + p["s1"] * f * g["along"]
    c2 = g["side"] + p["s2"] * f * g["arm"]
    m = g["pivot"] + p["lM"] * mp.mpc(-mp.cos(phi + p["nu"]), mp.sin(phi + p["nu"]))
    anchor = mp.mpc(p["x3"], p["y3"])
    length = abs(anchor - m)
    force = p["F0"] + p["cs"] * (length - p["l0"])  # negative where the spring is pressed
    pull = force * (anchor - m) / length
    centre = p["rg"] * mp.mpc(-mp.cos(phi + p["nug"]), mp.sin(phi + p["nug"]))
    outer = cross(m - g["pivot"], pull) + cross(centre, mp.mpc(0, -p["P2"]))
    # unknowns K, N1, N2, and the moment arm e N2 of the slider's reaction along the bracket
    rows = mp.matrix(4, 4)
    right = mp.matrix(4, 1)
    pin, rail = p["r0"] * g["normal"], -p["H"] * g["side"]
    for k, column in enumerate((yarn, c1, c2)):
        rows[0, k], rows[1, k] = column.real, column.imag
    right[1] = p["P1"]
    rows[2, 0] = cross(g["A"] - g["axis"], g["A0"] - g["A"]) / abs(g["A0"] - g["A"])
    rows[2, 0] += cross(g["B"] - g["axis"], g["end"] - g["B"]) / abs(g["end"] - g["B"])
    rows[2, 1], rows[2, 2], rows[2, 3] = cross(pin, c1), cross(rail, c2), cross(g["arm"], c2)
    rows[3, 2], rows[3, 3] = -cross(g["R1"] * g["arm"], c2), -cross(g["arm"], c2)
    right[3] = -outer
    consistent = mp.lu_solve(rows, right)
    source = mp.lu_solve(
        mp.matrix([[rows[0, 0], rows[0, 1], rows[0, 2]], [rows[1, 0], rows[1, 1], rows[1, 2]], [0, 0, rows[3, 2]]]),
        mp.matrix([0, p["P1"], -outer]),
    )
    return {
        "K": source[0], "N1": source[1], "N2": source[2],
        "K_couple": consistent[0], "N1_couple": consistent[1], "N2_couple": consistent[2],
        "offset_e": consistent[3] / consistent[2], "F_spring": force, "spring_length": length,
    }  # fmt: skip
