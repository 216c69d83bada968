"""Enclosures hold: 50 digits find no point of a cell outside its jet, and a jet that is too narrow is found out."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from kernels.certified import cells
from kernels.certified import jets as en
from kernels.certified.jets import LANES
from kernels.families.rssr import driven
from kernels.jit import kernel
from studies.accuracy.regions import regions
from tests.reference.rssr import Linkage
from tests.support.rssr_designs import random_designs

DIGITS = 50
A, B, OUT = (k * en.WIDTH for k in range(3))


@kernel
def operate(at, which):
    """One rule of the arithmetic on the jets at A and B."""
    a, b, good = en.get(at, A, 1), en.get(at, B, 1), True
    if which == 0:
        jet = en.product(a, b)
    elif which == 1:
        jet = en.sum_of(a, b)
    elif which == 2:
        jet, good = en.reciprocal(a)
    else:
        jet, good = en.root_of(a)
    en.put(at, OUT, 1, jet)
    return good


@kernel
def triple_harmonic(at, reach, c):
    en.put(at, OUT, 1, en.triple_harmonic(c[0], c[1], c[2], c[3], c[4], c[5], c[6], reach, 0.0))


@kernel
def double_harmonic(at, reach, c):
    en.put(at, OUT, 1, en.double_harmonic(c[0], c[1], c[2], c[3], c[4], reach, 0.0))


@kernel
def velocity(stages, couplings, shares, i, walk, numbers, jets, good):
    driven.load(0, numbers, stages, couplings, shares, i)
    driven.enclose_motion(1, 1, numbers, jets, walk, True, False, False, good)


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


@pytest.mark.parametrize("which", [0, 1, 2, 3])
def test_rules_of_arithmetic_enclose(which):
    generator, at, done = np.random.default_rng(which), np.zeros(3 * en.WIDTH), 0
    with mp.workdps(DIGITS):
        for _ in range(120):
            decay = generator.uniform(0.02, 0.5)
            f, g = random_jet(generator, at, A, decay), random_jet(generator, at, B, decay)
            if not operate(at, which):
                continue
            done += 1
            for x in points(generator, 4):
                exact = (f(x) * g(x), f(x) + g(x), 1 / f(x), mp.sqrt(f(x)))[which]
                assert not outside(exact, at, OUT, x)
    assert done > 60


def test_inverse_and_root_are_refused_where_there_is_a_zero():
    at = np.zeros(3 * en.WIDTH)
    for zero in (0.0, 0.3, -0.7, 0.95):
        at[A : A + 2] = -zero, 1.0
        at[A + en.NORM] = 1.0 + abs(zero)
        assert not operate(at, 2)
        assert not operate(at, 3)
    at[A : A + en.WIDTH] = np.nan
    assert not operate(at, 2)
    assert not operate(at, 3)


@pytest.mark.parametrize("reach", [1.0, 0.3, 1e-3, 1e-9])
def test_trigonometric_polynomials_are_enclosed(reach):
    generator, at = np.random.default_rng(5), np.zeros(3 * en.WIDTH)
    with mp.workdps(DIGITS):
        for _ in range(30):
            c = generator.normal(size=7)
            triple_harmonic(at, reach, c)
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


def misses(designs, narrow=1.0):
    """How many points of how many cells lie outside their enclosure of psi', psi'' or psi'''."""
    generator, n = np.random.default_rng(11), len(designs)
    stages, couplings, shares = np.ascontiguousarray(designs)[None], np.empty((0, n, 2)), np.zeros((n, 8))
    numbers, jets = np.empty(driven.STAGE + driven.SHARES * LANES), np.empty(driven.JETS)
    walk, good, y = np.zeros(cells.WALK), np.zeros(LANES), np.empty(cells.CURVE)
    wrong = total = 0
    with mp.workdps(DIGITS):
        for i, design in enumerate(designs):
            linkage, phi = Linkage(*design), generator.uniform(0.0, 2.0 * np.pi)
            reach, good[0] = 2.0 * generator.choice([1.0, 0.8, 0.5, 0.1]), 0.0
            while not good[0]:
                reach *= 0.5
                assert reach > 1e-9
                walk[cells.CENTRE], walk[cells.REACH] = phi, reach
                velocity(stages, couplings, shares, i, walk, numbers, jets, good)
            at, x = jets[driven.RATE :: LANES], mp.mpf(float(generator.uniform(-1.0, 1.0)))
            exact = linkage.branch * exact_velocity(linkage, mp.mpf(phi) + x * reach)
            wrong += outside(exact, at, 0, x, narrow)
            total += 1
            x *= cells.SHARE
            for order in (0, 1, 2):
                y[:] = 0.0
                cells.weigh(1, walk, y, jets[driven.RATE :], order)
                place, h = mp.mpf(phi) + x * reach, mp.mpf(10) ** -12 * reach
                exact = linkage.branch * mp.diff(lambda z, k=linkage: exact_velocity(k, z), place, order, h=h)
                close = polynomial(y[cells.Y0 : cells.Y0 + (en.ORDER + 1 - order) * LANES : LANES], x)
                noise, tail, bound = (float(y[k]) for k in (cells.OF_NOISE, cells.OF_TAIL, cells.WHOLE))
                wrong += abs(exact - close) > narrow * (noise + tail)
                # The walk is in no march, so the bound is that of the whole cell.
                assert narrow < 1.0 or abs(exact) <= bound + noise
                total += 1
    return wrong, total


def test_motion_of_crank_rockers_is_enclosed():
    wrong, total = misses(crank_rockers())
    assert wrong == 0
    assert total > 300


def test_enclosures_a_hundred_times_narrower_are_found_out():
    wrong, _ = misses(crank_rockers(), narrow=0.01)
    assert wrong > 10
