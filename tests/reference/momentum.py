"""Momentum of crank, coupler and follower over a turn, from joint positions alone.

Bodies are rigid triads of unit vectors; velocities come from differentiating positions and triads with respect to the
crank angle by the discrete Fourier transform, which is exact to rounding for smooth periodic motion on a fine grid.
"""

from __future__ import annotations

import numpy as np


def derivative(values):
    """Derivative by the crank angle of samples over one turn along axis 0."""
    n = len(values)
    order = np.fft.fftfreq(n, 1.0 / n)
    if n % 2 == 0:
        order[n // 2] = 0.0
    shape = (n,) + (1,) * (values.ndim - 1)
    return np.fft.ifft(1j * order.reshape(shape) * np.fft.fft(values, axis=0), axis=0).real


def triads(B, C, u, phi_triad, follower, branch, driven):
    """Triads (n, 3, 3) of crank, coupler and follower; rows are the body axes."""
    rho_b, tau_b = phi_triad
    s = (C - B) / np.linalg.norm(C - B, axis=1, keepdims=True)
    w = follower[:, 0] if driven else np.broadcast_to(u, s.shape)
    n = np.cross(w, s) * (branch if driven else 1.0)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    crank = np.stack([rho_b, tau_b, np.broadcast_to(u, rho_b.shape)], axis=1)
    coupler = np.stack([s, np.cross(n, s), n], axis=1)
    return crank, coupler, follower


def body_momentum(origin, triad, mass, centre, tensor, omega):
    """Linear momentum and angular momentum about the fixed origin, and the positions of the centre of mass."""
    place = origin + np.einsum("k,nkx->nx", centre, triad)
    velocity = omega * derivative(place)
    rate = omega * derivative(triad)
    # omega vector from dE/dt = w x E: w = (1/2) sum E_k x dE_k/dt
    spin = 0.5 * np.cross(triad, rate).sum(axis=1)
    inertia = np.einsum("nkx,kl,nly->nxy", triad, tensor, triad)
    linear = mass * velocity
    angular = np.cross(place, linear) + np.einsum("nxy,ny->nx", inertia, spin)
    energy = 0.5 * mass * (velocity**2).sum(axis=1) + 0.5 * np.einsum("nx,nxy,ny->n", spin, inertia, spin)
    return linear, angular, energy, place


def balance(parts, gravity, omega):
    """What the frame and the load together must supply: rates of total momentum less the weights' share."""
    force = sum(omega * derivative(p[0]) for p, _ in parts)
    moment = sum(omega * derivative(p[1]) for p, _ in parts)
    power = sum(omega * derivative(p[2]) for p, _ in parts)
    for (linear, _, _, place), mass in parts:
        force = force - mass * gravity
        moment = moment - np.cross(place, mass * gravity)
        power = power - linear @ gravity
    return force, moment, power
