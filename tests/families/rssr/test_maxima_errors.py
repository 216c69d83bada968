"""Error estimates of the crank-rocker's maxima, margins and limits hold in every region, hard ones included.

The reference is the motion in twice the working precision at the zero of the next derivative.
"""

import numpy as np
import pytest

from kernels import status as st
from kernels.families.rssr.careful import Loop, rounding
from studies.accuracy.regions import drawn, regions, rotatable
from sweep.families import family
from sweep.families.base import Angles
from tests.support.rssr_designs import margins, maxima

ORDERS = ("dpsi", "d2psi", "d3psi")
# Found among 40 000 of each region: the constant of the closure is a small difference where W vanishes, or W is steep
# there; a Newton step that leaves more of the way than the samples' spacing tells.
FOUND = (
    (0.529805448718618, 479.16879746963934, 2.0034187127399385, 2.2260929778535035, -478.07121656433156,
     1.090194517659195, 0.0006417695327168419, 1.0),
    (0.979239437690894, 1205.4195350674443, 1.4753303156176993, -2.7958059630266163, -1206.6997138940671,
     -1.2827040289772995, 0.0002282416211894983, 1.0),
    (0.5107873738216748, 90526.26493154901, 0.7808099702069751, 90526.26521324246, -0.13060253472393235,
     -0.7977207795058447, 0.1576793596394256, -1.0),
    (0.8724434971260119, 76781.57148874582, 1.0517358168090551, -76781.56304122866, -1.026450661705205,
     -0.9388537217480533, 3.1177917265893957, -1.0),
    (0.6453932791641727, 3.8213719993379103, 3.8215386397880393, 0.6311950574394762,
     -0.30219957365833006, -0.15377256356421443, 1.5659101838231433, -1.0),
)  # fmt: skip
PLAIN, PRECISE = family("rssr"), family("rssr").precise()


def next_derivative(designs, phi, order):
    """Of the transfer function of that order; of the jerk by the complex step."""
    if order < 3:
        return PRECISE.poses(designs, Angles.of(phi[:, None]), frozenset({ORDERS[order]}))[ORDERS[order]][:, 0]
    z = phi[:, None] + 1e-25j
    columns = PLAIN.poses(designs, Angles(z, np.cos(z), np.sin(z)), frozenset({"d3psi"}))
    return columns["d3psi"][:, 0].imag / 1e-25


def peaks(designs, found, order):
    """Height and place of the maximum next to the one found."""
    phi = found["phi"].copy()
    for _ in range(5):
        h = np.maximum(found["phi_error"], 1e-8)
        slope = (next_derivative(designs, phi + h, order) - next_derivative(designs, phi - h, order)) / (2.0 * h)
        phi += np.clip(-next_derivative(designs, phi, order) / slope, -3.0 * h, 3.0 * h)
    name = ORDERS[order - 1]
    return np.abs(PRECISE.poses(designs, Angles.of(phi[:, None]), frozenset({name}))[name][:, 0]), phi


@pytest.fixture(scope="module")
def designs():
    """Random ones, and those of 100 000 whose errors were above estimates that knew the error of Delta alone."""
    many = rotatable(100_000, 2024)
    hard = np.concatenate([region.designs for region in regions(200, 5)])
    rows = [68756, 22837, 47276, 46522, 57353, 30330, 95753]
    return np.ascontiguousarray(np.concatenate([np.array(FOUND), many[rows], many[:3000], hard]))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-12])
def test_errors_of_height_and_place_hold_and_are_no_more_than_needed(designs, order, target):
    found = maxima(designs, order, target)
    height, place = peaks(designs, found, order)
    assert (found["status"] == st.OK).all()
    off = np.abs(found["max"] - height)
    assert (off <= found["error"]).all()
    assert (np.abs(np.angle(np.exp(1j * (found["phi"] - place)))) <= found["phi_error"]).all()
    if target == 1e-12:
        assert np.median(found["error"] / np.maximum(off, 2.0**-53 * height)) < 60.0
        assert np.median(found["error"] / height) < 2e-14


def test_rounding_of_a_small_maximum_is_not_relative_to_it():
    """Negative control: the same pose taken for a hundred times higher has an estimate that its error exceeds."""
    height = 1e-3
    loop = Loop(-3.8, 1.9, -0.3, 0.4, -0.2, -0.8, 3.3)
    small, large, jerk = (
        rounding(order, loop, 0.6, 0.8, y)[0] for order, y in ((1, height), (1, 100.0 * height), (3, height))
    )
    assert small > 5.0 * large
    assert jerk > small


@pytest.mark.parametrize("order", [1, 2, 3])
def test_designs_that_do_not_turn_change_no_bit_of_those_that_do(order):
    mixed = drawn(3000, np.random.default_rng(3))
    found = maxima(mixed, order)
    turning = found["status"] == st.OK
    assert 0.2 < turning.mean() < 0.5
    np.testing.assert_array_equal(found["status"], margins(mixed)["status"])
    alone = maxima(np.ascontiguousarray(mixed[turning]), order)
    assert np.isfinite(alone["max"]).all()
    for name, column in alone.items():
        np.testing.assert_array_equal(found[name][turning], column, err_msg=name)
    for name in ("max", "phi", "error", "phi_error"):
        assert np.isnan(found[name][~turning]).all()


def least_margin(designs):
    """The least discriminant in twice the working precision: every dip of 128 samples, and ever closer about it."""

    def values(rows, phi):
        return PRECISE.poses(designs[rows], Angles.of(phi), frozenset({"discriminant"}))["discriminant"]

    grid = np.arange(128)[None, :] * (2.0 * np.pi / 128)
    y = values(np.arange(len(designs)), grid)
    row, column = np.nonzero((y <= np.roll(y, 1, axis=1)) & (y <= np.roll(y, -1, axis=1)))
    place, lowest = grid[0, column], np.full(len(designs), np.inf)
    for width in (2.0 * np.pi / 128) * 0.4 ** np.arange(20):
        around = place[:, None] + width * np.linspace(-1.0, 1.0, 9)
        y = values(row, around)
        place = around[np.arange(len(row)), y.argmin(axis=1)]
        np.minimum.at(lowest, row, y.min(axis=1))
    _, b, c, *_ = designs.T
    return lowest / (2.0 * b * c) ** 2


def almost_symmetric(n, r):
    """With tiny f and g two dips are almost equally deep."""
    designs = drawn(n, r)
    designs[:, 4:6] *= 10.0 ** r.uniform(-16.0, -5.0, (n, 1))
    return designs


def flat(n, r):
    """Couplers for which the two dips of a mechanism with tiny f and g are about to merge."""
    designs = almost_symmetric(n, r)
    a, _, c, _, _, _, alpha, _ = designs.T
    e = designs[:, 3] = 0.05 + 0.5 * np.abs(designs[:, 3])
    even = 0.5 * (np.sin(alpha) ** 2 - (e / c) ** 2)
    k0 = (2.0 * np.abs(even) * (1.0 + r.choice([-1.0, 1.0], n) * 10.0 ** r.uniform(-9.0, -1.0, n)) + e / a) * c / e
    square = a * a + c * c + e * e - 2.0 * a * c * k0
    designs[:, 1] = np.sqrt(np.where(square > 0.0, square, 1.0))
    designs[:, 5] += 10.0 ** r.uniform(-9.0, -2.0, n)
    return designs


@pytest.mark.parametrize("make", [drawn, almost_symmetric, flat])
def test_errors_of_margins_hold_whether_the_crank_turns_or_not(make):
    designs = make(4000, np.random.default_rng(12))
    found, exact = margins(designs), least_margin(designs)
    known = found["status"] != st.UNDECIDABLE
    assert 0.02 < (found["rotatable"] == 1.0).mean() < 0.6
    assert (np.abs(found["margin"] - exact) <= found["error"] + 2.0**-51 * np.abs(exact))[known].all()


def test_margin_of_symmetric_mechanisms_with_two_equal_minima():
    """With f = g = 0 Delta is even in phi, so an inner minimum is there twice: the proof of the global one is a tie."""
    r = np.random.default_rng(8)
    n, phi = 1000, np.linspace(0.0, np.pi, 4001)
    a, b, c, e = r.uniform(0.1, 3.0, (4, n)) * np.array([[1.0], [1.0], [1.0], [0.1]])
    alpha = r.uniform(0.0, np.pi, n)
    designs = np.column_stack([a, b, c, e, np.zeros(n), np.zeros(n), alpha, np.ones(n)])
    found = margins(designs)
    inner = 0
    for (a1, b1, c1, e1, _, _, alpha1, _), margin, place in zip(
        designs, found["margin"], found["phi_min"], strict=True
    ):

        def values(t, a1=a1, b1=b1, c1=c1, e1=e1, alpha1=alpha1):
            x, y = e1 - a1 * np.cos(t), a1 * np.cos(alpha1) * np.sin(t)
            w = (a1 * a1 - b1 * b1 + c1 * c1 + e1 * e1 - 2.0 * a1 * e1 * np.cos(t)) / (2.0 * c1)
            return (x * x + y * y - w * w) / (b1 * b1)

        samples = values(phi)
        size = np.abs(samples).max() + (a1 + c1 + e1) ** 2 / b1**2
        assert samples.min() - 1e-5 * size <= margin <= samples.min() + 1e-14 * size
        assert abs(values(place) - margin) <= 1e-14 * size
        inner += abs(np.sin(place)) > 1e-3
    assert inner > 300


def test_a_step_of_zero_does_not_spoil_the_error_of_the_place():
    """Where the step before the last was 0 by chance, the quotient of the two steps told 1e+249 rad."""
    lucky = np.array(
        [
            [1.7978803792741371, 45.67118718242865, 32.24142544000543, -12.133663913017486, 17.398258851254596,
             37.234072164400544, -1.1164568395247798, -1.0],
            [4.17105402316185, 26.710377169026707, 28.002048707881425, -36.22299592698721, -37.16785953738074,
             17.622368064776566, 2.875314857112466, 1.0],
        ]
    )  # fmt: skip
    found = maxima(lucky, 2)
    assert np.all(found["phi_error"] < 1e-10)
