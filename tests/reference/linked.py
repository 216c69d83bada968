"""Bodies and joints of the loopers from their public poses alone: what the momentum of each body is made of.

Nothing here comes from kernels.linkage.bodies: axes of bodies are built from joint coordinates and angles, rates by
differentiating over the turn (tests/reference/momentum.py).
"""

from __future__ import annotations

import numpy as np

Z = np.array([0.0, 0.0, 1.0])


def turned(axis, angle, vector):
    """A vector turned about a unit axis by angles (n,)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    vector = np.broadcast_to(vector, (len(angle), 3))
    axis = np.broadcast_to(axis, (len(angle), 3))
    return c * vector + s * np.cross(axis, vector) + (1.0 - c) * (axis * vector).sum(axis=1, keepdims=True) * axis


def axes(x, z):
    """Triads (n, 3, 3) from their first axis and a vector to which the second is square."""
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(np.broadcast_to(z, x.shape), x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def at(poses, name):
    """Coordinates (n, 3) of a point."""
    return poses[[f"x_{name}", f"y_{name}", f"z_{name}"]].to_numpy()


def shaft(d, f="f", alpha="alpha"):
    """Axis and centre of a crank."""
    u = np.array([0.0, np.sin(d[alpha]), np.cos(d[alpha])])
    return u, d[f] * u


def rod(start, end):
    """Origin and triad of a slender rod; any axes across it do, if they turn smoothly."""
    return start, axes(end - start, np.array([0.31, -0.87, 0.43]))


def five_link(d, p):
    u, a = shaft(d)
    foot = np.array([d["e"], 0.0, d["g"]])
    b, h, c = (at(p, name) for name in "bhc")
    m = turned(u, p["theta"].to_numpy(), np.array([1.0, 0.0, 0.0]))
    t = np.cross(u, m)
    bodies = {
        "crank": (a, axes(b - a, u)),
        "cross": (b, np.stack([m, t, np.broadcast_to(u, m.shape)], axis=1)),
        "coupler": (h, np.stack([(c - h) / d["b"], t, np.cross((c - h) / d["b"], t)], axis=1)),
        "rocker": (foot, axes(c - foot, Z)),
    }
    joints = {
        "a": (a, "crank", None), "b": (b, "cross", "crank"), "h": (h, "coupler", "cross"),
        "c": (c, "rocker", "coupler"), "d": (foot, "rocker", None),
    }  # fmt: skip
    return bodies, joints, "rocker", {"b": u, "h": t, "d": Z}


def slotted(d, p):
    u, a = shaft(d)
    pivot = np.array([d["e"], 0.0, d["g"]])
    b, psi = at(p, "b"), p["psi"].to_numpy()
    t = np.stack([np.cos(psi), np.sin(psi), 0.0 * psi], axis=1)
    n = np.cross(Z, t)
    if d["k"] == 0.0:
        arm, place = (b, np.stack([n, t, np.cross(n, t)], axis=1)), b
    else:
        place = pivot + p["rho"].to_numpy()[:, None] * t + d["s"] * n
        x = (b - place) / d["k"]
        arm = (place, np.stack([x, t, np.cross(x, t)], axis=1))
    bodies = {"crank": (a, axes(b - a, u)), "link": (pivot, axes(t, Z)), "arm": arm}
    joints = {"a": (a, "crank", None), "b": (b, "arm", "crank"), "c": (place, "arm", "link"),
              "d": (pivot, "link", None)}  # fmt: skip
    return bodies, joints, "link", {"d": Z}


def swivel(d, p):
    u, a = shaft(d)
    b, q = at(p, "b"), np.array([d["e"], 0.0, d["g"]])
    bodies = {"crank": (a, axes(b - a, u)), "rod": rod(b, b + at(p, "n"))}
    joints = {"a": (a, "crank", None), "b": (b, "rod", "crank"), "q": (q, "rod", None)}
    return bodies, joints, "rod", {}


def spherical_looper(d, p):
    u, a1 = shaft(d, "f1", "alpha1")
    foot, os = np.array([d["e1"], 0.0, d["g1"]]), np.array([d["e1"], 0.0, d["o"]])
    a2 = np.array([d["x2"], d["y2"], d["z2"]])
    st, ct, sb, cb = np.sin(d["theta2"]), np.cos(d["theta2"]), np.sin(d["beta2"]), np.cos(d["beta2"])
    b1, c1, b2, c2 = (at(p, name) for name in ("b1", "c1", "b2", "c2"))
    n2 = np.array([np.sin(d["delta"]) * np.cos(d["gamma"]), np.sin(d["delta"]) * np.sin(d["gamma"]),
                   np.cos(d["delta"])])  # fmt: skip
    psi, chi = p["psi"].to_numpy(), p["chi"].to_numpy()
    looper = np.stack([turned(Z, psi, turned(n2, chi, x)) for x in np.eye(3)], axis=1)
    bodies = {
        "crank1": (a1, axes(b1 - a1, u)), "crank2": (a2, axes(b2 - a2, np.array([st * cb, st * sb, ct]))),
        "carrier": (foot, axes(c1 - foot, Z)), "looper": (os, looper),
        "coupler1": rod(b1, c1), "coupler2": rod(b2, c2),
    }  # fmt: skip
    joints = {
        "a1": (a1, "crank1", None), "b1": (b1, "coupler1", "crank1"), "c1": (c1, "carrier", "coupler1"),
        "d1": (foot, "carrier", None), "a2": (a2, "crank2", None), "b2": (b2, "coupler2", "crank2"),
        "c2": (c2, "looper", "coupler2"), "os": (os, "looper", "carrier"),
    }  # fmt: skip
    return bodies, joints, "looper", {"d1": Z, "os": turned(Z, psi, n2)}


def cylindrical_looper(d, p):
    u, a1 = shaft(d, "f1", "alpha1")
    foot = np.array([d["e1"], 0.0, d["g1"]])
    phi = p["phi"].to_numpy() + d["offset2"]
    # RSSP in its own frame: the crank's axis leans by alpha2 from y to z, its slide is x = e2 along y.
    x2 = np.array([np.cos(d["gamma2"]), np.sin(d["gamma2"]), 0.0])
    z2 = np.cross(x2, Z)
    own = np.stack([
        d["a2"] * np.cos(phi) - d["e2"],
        d["f2"] * np.sin(d["alpha2"]) + d["a2"] * np.cos(d["alpha2"]) * np.sin(phi),
        d["f2"] * np.cos(d["alpha2"]) - d["a2"] * np.sin(d["alpha2"]) * np.sin(phi),
    ], axis=1)  # fmt: skip
    b2 = foot + own @ np.stack([x2, Z, z2])
    axis2 = np.sin(d["alpha2"]) * Z + np.cos(d["alpha2"]) * z2
    a2 = foot - d["e2"] * x2 + d["f2"] * axis2
    b1, c1 = at(p, "b1"), at(p, "c1")
    psi, s = p["psi"].to_numpy(), p["s"].to_numpy()
    place, held = foot + s[:, None] * Z, foot + d["slides"] * s[:, None] * Z
    beta = psi + d["beta2"]
    c2 = place + d["d2"] * np.stack([np.cos(beta), np.sin(beta), 0.0 * beta], axis=1)
    rocker = axes(c1 - held, Z)
    bodies = {
        "crank1": (a1, axes(b1 - a1, u)), "crank2": (a2, axes(b2 - a2, axis2)), "shaft": (place, rocker),
        "rocker": (held, rocker), "coupler1": rod(b1, c1), "coupler2": rod(b2, c2),
    }  # fmt: skip
    joints = {
        "a1": (a1, "crank1", None), "b1": (b1, "coupler1", "crank1"), "c1": (c1, "rocker", "coupler1"),
        "key": (held, "rocker", "shaft"), "hold": (held, "rocker", "shaft" if d["slides"] else None),
        "d": (foot, "shaft", None), "a2": (a2, "crank2", None), "b2": (b2, "coupler2", "crank2"),
        "c2": (c2, "shaft", "coupler2"),
    }  # fmt: skip
    return bodies, joints, "shaft", {"d": Z}


READERS = {
    "five_link": five_link, "slotted": slotted, "swivel": swivel, "spherical_looper": spherical_looper,
    "cylindrical_looper": cylindrical_looper,
}  # fmt: skip
POSES = {
    "five_link": [*(f"{a}_{n}" for n in "bhc" for a in "xyz"), "theta", "psi"],
    "slotted": [*(f"{a}_b" for a in "xyz"), "psi", "rho"],
    "swivel": [f"{a}_{n}" for n in "bnp" for a in "xyz"],
    "spherical_looper": [*(f"{a}_{n}" for n in ("b1", "c1", "b2", "c2", "p") for a in "xyz"), "psi", "chi"],
    "cylindrical_looper": [*(f"{a}_{n}" for n in ("b1", "c1", "p") for a in "xyz"), "psi", "s"],
}  # fmt: skip
