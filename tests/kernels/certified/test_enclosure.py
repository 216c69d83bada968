"""Enclosures hold: 50 digits find no point of a cell outside its jet, and a jet that is too narrow is found out."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from kernels.certified import enclosure as en
from kernels.certified import jets
from kernels.families.rssr import enclosure as rssr_enclosure
from kernels.families.rssr.closure import reduce_design
from kernels.jit import kernel
from studies.accuracy.regions import regions
from tests.reference.rssr import Linkage
from tests.support.rssr_designs import random_designs

DIGITS = 50
A, B, OUT, OTHER = (k * en.WIDTH for k in range(4))


@kernel
def operate(at, which):
    """One rule of the arithmetic on the jets at A and B."""
    if which == 0:
        en.multiply(at, A, B, OUT)
        return True
    if which == 1:
        en.add(at, A, B, OUT)
        return True
    if which == 2:
        return en.inverse(at, A, OUT)
    if which == 3:
        return en.root(at, A, OUT, OTHER)
    jet, good = jets.root_alone(jets.get(at, A, 1))
    jets.put(at, OUT, 1, jet)
    return good


@kernel
def trigonometric(at, reach, c):
    en.trigonometric(at, OUT, reach, c[0], c[1], c[2], c[3], c[4], c[5], c[6], 0.0)


@kernel
def double_harmonic(at, reach, c):
    jets.put(at, OUT, 1, jets.double_harmonic(c[0], c[1], c[2], c[3], c[4], reach, 0.0))


@kernel
def velocity(designs, i, u, v, reach, at):
    return rssr_enclosure.enclose(at, reduce_design(designs, i), u, v, reach)


@kernel
def jet_of_derivative(at, order, reach, share, y):
    en.derivative(at, rssr_enclosure.VELOCITY, order, reach, y)
    return en.remainders(at, rssr_enclosure.VELOCITY, order, reach, share)


@kernel
def upper_bound(y, count, share, tail):
    return en.ceiling(y, count, share, tail)


def polynomial(coefficients, x):
    return sum(mp.mpf(float(c)) * x**k for k, c in enumerate(coefficients))


def outside(value, at, jet, x, narrow=1.0):
    """Whether a value at x lies outside the jet, its remainders made narrower by a factor."""
    radius = at[jet + en.NOISE] + at[jet + en.TAIL] * float(abs(x)) ** (en.ORDER + 1)
    return abs(value - polynomial(at[jet : jet + en.ORDER + 1], x)) > narrow * radius


def points(generator, count):
    """Points of the unit disc, a third of them on the real axis."""
    x = generator.uniform(-1.0, 1.0, count) + 1j * generator.uniform(-1.0, 1.0, count)
    x = np.where(np.arange(count) % 3 == 0, x.real, x / np.maximum(1.0, abs(x)))
    return [mp.mpc(complex(value)) for value in x]


def random_jet(generator, at, jet, decay):
    """A polynomial with a remainder that is known here: (function, coefficients of its series beyond the jet)."""
    coefficients = generator.normal(size=en.ORDER + 1) * decay ** np.arange(en.ORDER + 1)
    coefficients[0] = 1.0 + abs(coefficients[0])
    noise, tail = 1e-13 * generator.normal(size=4), 1e-3 * generator.normal(size=3) * decay**en.ORDER
    at[jet : jet + en.ORDER + 1] = coefficients
    at[jet + en.NORM] = np.abs(coefficients).sum() * en.GUARD
    at[jet + en.NOISE], at[jet + en.TAIL] = np.abs(noise).sum() * en.GUARD, np.abs(tail).sum() * en.GUARD
    return lambda x: polynomial(coefficients, x) + polynomial(noise, x) + polynomial(tail, x) * x ** (en.ORDER + 1)


@pytest.mark.parametrize("which", [0, 1, 2, 3, 4])
def test_rules_of_arithmetic_enclose(which):
    generator, at, done = np.random.default_rng(which), np.zeros(4 * en.WIDTH), 0
    with mp.workdps(DIGITS):
        for _ in range(120):
            decay = generator.uniform(0.02, 0.5)
            f, g = random_jet(generator, at, A, decay), random_jet(generator, at, B, decay)
            if not operate(at, which):
                continue
            done += 1
            for x in points(generator, 4):
                exact = (f(x) * g(x), f(x) + g(x), 1 / f(x), mp.sqrt(f(x)))[min(which, 3)]
                assert not outside(exact, at, OUT, x)
                if which == 3:
                    assert not outside(1 / mp.sqrt(f(x)), at, OTHER, x)
    assert done > 60


def test_inverse_and_root_are_refused_where_there_is_a_zero():
    at = np.zeros(4 * en.WIDTH)
    for zero in (0.0, 0.3, -0.7, 0.95):
        at[A : A + 2] = -zero, 1.0
        at[A + en.NORM] = 1.0 + abs(zero)
        assert not operate(at, 2)
        assert not operate(at, 3)
        assert not operate(at, 4)
    at[A : A + en.WIDTH] = np.nan
    assert not operate(at, 2)
    assert not operate(at, 3)
    assert not operate(at, 4)


@pytest.mark.parametrize("reach", [1.0, 0.3, 1e-3, 1e-9])
def test_trigonometric_polynomials_are_enclosed(reach):
    generator, at = np.random.default_rng(5), np.zeros(4 * en.WIDTH)
    with mp.workdps(DIGITS):
        for _ in range(30):
            c = generator.normal(size=7)
            trigonometric(at, reach, c)
            for x in points(generator, 4):
                s, m = mp.sin(reach * x), 1 - mp.cos(reach * x)
                terms = (1, s, m, s * m, m * m, s * m * m, m**3)
                assert not outside(sum(mp.mpf(float(a)) * t for a, t in zip(c, terms, strict=True)), at, OUT, x)
            double_harmonic(at, reach, c)
            for x in points(generator, 4):
                s, m = mp.sin(reach * x), 1 - mp.cos(reach * x)
                terms = (1, s, m, s * m, m * m)
                assert not outside(sum(mp.mpf(float(a)) * t for a, t in zip(c[:5], terms, strict=True)), at, OUT, x)


def crank_rockers():
    """Ordinary designs and hard ones: change points, nearly parallel axes, long couplers, tiny swings, any scale."""
    hard = np.concatenate([region.designs for region in regions(12, 3)])
    tiny = random_designs(12, 8, rotatable=True)
    tiny[:, 0] *= 10.0 ** np.linspace(-3.0, -7.0, 12)
    far = random_designs(12, 9, rotatable=True)
    far[:, :6] *= 10.0 ** np.linspace(-90.0, 90.0, 12)[:, None]
    return np.concatenate([random_designs(24, 7, rotatable=True), hard, tiny, far])


def exact_velocity(linkage, phi):
    """psi' from the distance of the two balls, at real or complex phi."""
    at = [linkage.gap(phi, x) for x in (mp.mpf(0), mp.pi / 2, mp.pi)]
    constant = (at[0] + at[2]) / 2
    cosine, sine = (at[0] - at[2]) / 2, at[1] - constant
    across = linkage.branch * mp.sqrt(cosine**2 + sine**2 - constant**2)
    square = cosine**2 + sine**2
    c, s = (across * sine - constant * cosine) / square, (-across * cosine - constant * sine) / square
    axis, over = mp.matrix([0, linkage.sin, linkage.cos]), mp.matrix([0, linkage.cos, -linkage.sin])
    first = mp.matrix([1, 0, 0])
    pin = linkage.f * axis + linkage.a * (mp.cos(phi) * first + mp.sin(phi) * over)
    d = mp.matrix([linkage.e + linkage.c * c, linkage.c * s, linkage.g]) - pin
    moving = linkage.a * (-mp.sin(phi) * first + mp.cos(phi) * over)
    turning = linkage.c * mp.matrix([-s, c, 0])
    return (d.T * moving)[0] / (d.T * turning)[0]


def largest_reach(designs, i, phi, at, start):
    """The first reach that succeeds, halving from ``start``."""
    reach = start
    while not velocity(designs, i, np.cos(phi), np.sin(phi), reach, at):
        reach *= 0.5
        assert reach > 1e-9
    return reach


def misses(designs, narrow=1.0):
    """How many points of how many cells lie outside their enclosure of psi', psi'' or psi'''."""
    generator, at, y = np.random.default_rng(11), np.empty(rssr_enclosure.SIZE), np.empty(en.ORDER + 1)
    wrong = total = 0
    with mp.workdps(DIGITS):
        for i, design in enumerate(designs):
            linkage = Linkage(*design)
            phi = generator.uniform(0.0, 2.0 * np.pi)
            reach = largest_reach(designs, i, phi, at, generator.choice([1.0, 0.8, 0.5, 0.1]))
            x = mp.mpf(float(generator.uniform(-1.0, 1.0)))
            exact = linkage.branch * exact_velocity(linkage, mp.mpf(phi) + x * reach)
            wrong += outside(exact, at, rssr_enclosure.VELOCITY, x, narrow)
            share = 0.67
            x *= share
            for order in (1, 2):
                noise, tail = jet_of_derivative(at, order, reach, share, y)
                place, h = mp.mpf(phi) + x * reach, mp.mpf(10) ** -12 * reach
                exact = linkage.branch * mp.diff(lambda z, k=linkage: exact_velocity(k, z), place, order, h=h)
                count = en.ORDER + 1 - order
                wrong += abs(exact - polynomial(y[:count], x)) > narrow * (noise + tail)
                assert narrow < 1.0 or abs(exact) <= upper_bound(y, count, share, tail) + noise
                total += 1
            total += 1
    return wrong, total


def test_motion_of_crank_rockers_is_enclosed():
    wrong, total = misses(crank_rockers())
    assert wrong == 0
    assert total > 300


def test_enclosures_a_hundred_times_narrower_are_found_out():
    wrong, _ = misses(crank_rockers(), narrow=0.01)
    assert wrong > 10
