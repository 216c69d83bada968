"""Geared dwell drive from the place of its pin: angle followed step by step, derivatives of log z, plain scans."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp, mpf


def pin(k: Any, a: Any, phi: Any, order: int = 0) -> Any:
    """Pin from the output axis, or its derivative of that order: carrier arm 2, planet arm k at double speed."""
    place = 2 * mpc(1j) ** order * mp.expj(phi) - mpf(k) * mpc(2j) ** order * mp.expj(2 * mpf(phi))
    return place + a if order == 0 else place


def mpc(number: complex) -> Any:
    """A complex number of working precision."""
    return mp.mpc(number)


def derivatives(k: float, a: float, phi: float) -> list[Any]:
    """psi', psi'', psi''', psi'''' as imaginary parts of the derivatives of log z."""
    z, z1, z2, z3, z4 = (pin(k, a, mpf(phi), order) for order in range(5))
    u1, u2, u3, u4 = z1 / z, z2 / z, z3 / z, z4 / z
    logarithmic = [
        u1,
        u2 - u1**2,
        u3 - 3 * u2 * u1 + 2 * u1**3,
        u4 - 4 * u3 * u1 - 3 * u2**2 + 12 * u2 * u1**2 - 6 * u1**4,
    ]
    return [mp.im(value) for value in logarithmic]


def followed_angle(k: float, a: float, phi: float, steps: int = 4000) -> float:
    """Output angle by following the pin from phi = 0 in small steps."""
    carrier = np.linspace(0.0, phi, steps)
    z = 2.0 * np.exp(1j * carrier) - k * np.exp(2j * carrier) + a
    start = 0.0 if z[0].real > 0.0 else np.pi
    return float(start + np.sum(np.angle(z[1:] / z[:-1])))


def curve(k: float, a: float, samples: int) -> tuple[Any, Any, Any]:
    """Carrier angles of the half turn, output angle and |psi''| there, in doubles."""
    phi = np.linspace(0.0, np.pi, samples)
    w = np.exp(1j * phi)
    z, z1, z2 = 2 * w - k * w**2 + a, 2j * w - 2j * k * w**2, -2 * w + 4 * k * w**2
    return phi, np.unwrap(np.angle(z)), abs((z2 / z - (z1 / z) ** 2).imag)


def dwell(k: float, a: float, samples: int = 200_001) -> tuple[float, float, float]:
    """(Return dwell, deviation, band dwell) read off a fine curve with linear interpolation."""
    phi, psi, _ = curve(k, a, samples)
    lowest = int(np.argmin(psi))
    rising_phi, rising_psi = phi[lowest:], psi[lowest:]
    deviation = -psi[lowest]
    back = np.interp([0.0, deviation], rising_psi, rising_phi)
    return 2.0 * back[0], deviation, 2.0 * back[1]


def slide_dwell(ratio: float, tracer: float, share: float) -> float:
    """Carrier angle [deg] during which a cross-slide stays within ``share`` of its stroke from its end.

    The slide follows a tracer on a planet that rolls inside a fixed ring ``ratio`` times its size; ``tracer`` is the
    tracer's distance from the planet centre in planet radii, pointing inwards at mid-dwell.
    """

    def slide(angle: Any) -> Any:
        return (ratio - 1.0) * np.cos(angle) - tracer * np.cos((ratio - 1.0) * angle)

    turn = np.linspace(0.0, 2.0 * np.pi, 720_001)
    stroke = np.ptp(slide(turn))
    end = slide(turn).max()
    outside = np.nonzero(slide(turn) < end - share * stroke)[0]
    return float(2.0 * np.degrees(turn[outside[0]]))
