"""Elastic coupler that drives its follower alone, by one coefficient q: collocation, and integration over the turn."""

import numpy as np
from scipy.integrate import solve_ivp


def series(cosines, sines, phi):
    """Value and slope of a Fourier series."""
    k = np.arange(len(cosines))
    cos, sin = np.cos(k * phi), np.sin(k * phi)
    return cosines @ cos + sines @ sin, k @ (sines * cos - cosines * sin)


def periodic_solution(qc, qs, stiffness, damping, c, s):
    """Series of the eta of eta'' + damping q eta' + (stiffness q + damping q'/2) eta = r, from the series of r."""
    k = np.arange(len(c))
    grid = 2.0 * np.pi * np.arange(2 * k.size - 1) / (2 * k.size - 1)

    def basis(order):
        waves = np.exp(1j * np.outer(grid, k)) * (1j * k) ** order
        return np.hstack([waves.real, waves.imag[:, 1:]])

    q, slope = np.array([series(qc, qs, x) for x in grid]).T
    rows = basis(2) + damping * q[:, None] * basis(1) + (stiffness * q + 0.5 * damping * slope)[:, None] * basis(0)
    found = np.linalg.solve(rows, [series(c, s, x)[0] for x in grid])
    return np.array([found[: k.size], np.append(0.0, found[k.size :])])


def largest_multiplier(qc, qs, stiffness, damping):
    """Largest modulus of the multipliers of the same equation without its right side."""

    def rate(phi, state):
        q, slope = series(qc, qs, phi)
        return [state[1], -damping * q * state[1] - (stiffness * q + 0.5 * damping * slope) * state[0]]

    ends = [solve_ivp(rate, (0.0, 2.0 * np.pi), x, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1] for x in np.eye(2)]
    return float(np.abs(np.linalg.eigvals(np.array(ends))).max())
