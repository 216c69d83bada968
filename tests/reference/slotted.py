"""The slotted link from its joints alone, slowly: the ball against the slot's plane, or its distance from the bar."""

from __future__ import annotations

import mpmath as mp

from tests.reference.space import crank_pin, derivatives, dot, exact, length, root, vector


def _link(psi):
    return vector(mp.cos(psi), mp.sin(psi), 0), vector(-mp.sin(psi), mp.cos(psi), 0)


def position(design, phi, near=None):
    """Angle of the driven link and place of the ball along it, or None; ``near`` is a pose of the same motion."""
    a, e, f, g, alpha, s, k, tau, branch = design
    offset = crank_pin(a, f, alpha, phi) - vector(e, 0, g)

    def gap(psi):
        along, across = _link(psi)
        if k == 0:
            return s - dot(offset, across)
        from_bar = offset - across * s - along * dot(offset, along)
        return length(from_bar) ** 2 - k**2

    if near is not None:
        psi = root(gap, 0, near["psi"])
        return {"psi": psi, "rho": dot(offset, _link(psi)[0])}
    for slope in (1, -1):
        psi = root(gap, slope)
        for found in every(gap, slope) if psi is not None else ():
            along, across = _link(found)
            on_side = k == 0 or (dot(offset, across) - s) * tau > 0
            if on_side and dot(offset, along) * branch > 0:
                return {"psi": found, "rho": dot(offset, along)}
    return None


def every(gap, slope, samples=720):
    """All angles where the gap is zero with that slope."""
    step = 2 * mp.pi / samples
    angles = [-mp.pi + step * (k + mp.mpf("0.37")) for k in range(samples + 1)]
    values = [gap(x) for x in angles]
    return [
        mp.findroot(gap, (angles[k], angles[k + 1]), solver="anderson", tol=mp.mpf(10) ** -90)
        for k in range(samples)
        if values[k] * values[k + 1] <= 0 and (values[k + 1] - values[k]) * slope > 0
    ]


def outputs(design, phi):
    """psi and rho with three derivatives each."""
    with mp.workdps(100):
        numbers = exact(design)
        return derivatives(lambda x, near: position(numbers, x, near), mp.mpf(float(phi)))
