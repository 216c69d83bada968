"""Negative controls: each shortcut below must fail a check that the house's kernels pass.

The checks are functions of this file; a control that passes its check would mean that the check sees nothing.
"""

import math

import mpmath as mp
import numpy as np

from kernels import status as st
from sweep.families.base import Accuracy
from sweep.families.rssr import sampled_maxima
from tests.families.rssr.test_oracle import EPS, POSE_DESIGNS, POSES, error
from tests.reference.rssr import Linkage
from tests.support.rssr_designs import dense, margins, maxima, poses, random_designs


def loop_closes(design, phi, psi):
    """Distance of the balls equals the coupler to 1e-12 of the links."""
    linkage = Linkage(*design)
    return abs(linkage.gap(mp.mpf(phi), mp.mpf(psi))) <= 1e-12 * sum(float(x) ** 2 for x in design[:6])


def coefficients(design, phi):
    a, b, c, e, f, g, alpha, _ = design
    sa, ca, u, v = math.sin(alpha), math.cos(alpha), math.cos(phi), math.sin(phi)
    square = a * a - b * b + c * c + e * e + f * f + g * g - 2.0 * f * g * ca
    return e - a * u, f * sa + a * ca * v, (square / 2.0 + a * g * sa * v - a * e * u) / c


def half_angle_closure(design, phi):
    """psi from the quadratic in tan(psi/2)."""
    x, y, w = coefficients(design, phi)
    t = (y + design[7] * math.sqrt(x * x + y * y - w * w)) / (w - x)
    return 2.0 * math.atan(t)


def test_half_angle_closure_fails_where_one_of_the_two_rockers_points_away():
    # One position at pi - 1e-9 ...: the leading coefficient cancels, and with it the numerator of the other position.
    a, c, e, phi = 1.0, 3.0, 4.0, 1.0
    failed = 0
    for offset in (1e-9, -1e-8, 3e-8, 1e-7):
        ball = np.array([e + c * math.cos(math.pi + offset), c * math.sin(math.pi + offset)])
        b = math.dist(ball, (a * math.cos(phi), a * math.sin(phi)))
        for branch in (-1.0, 1.0):
            design = np.array([a, b, c, e, 0.0, 0.0, 0.0, branch])
            assert loop_closes(design, phi, poses(design[None], np.array([[phi]]))["psi"][0, 0])
            failed += not loop_closes(design, phi, half_angle_closure(design, phi))
    assert failed >= 3


def keeps_dead_points(psi_of):
    """A dead point has an angle, whatever the rounding of the links: 100 of 100."""
    r = np.random.default_rng(3)
    finite = 0
    for a, c, e, phi in zip(*(r.uniform(*ends, 100) for ends in ((1, 2), (1, 2), (5, 6), (0.1, 3.0))), strict=True):
        stretched = math.dist((a * math.cos(phi), a * math.sin(phi)), (e, 0.0)) - c
        finite += math.isfinite(psi_of(np.array([a, stretched, c, e, 0.0, 0.0, 0.0, 1.0]), phi))
    return finite == 100


def house_psi(design, phi):
    found = poses(design[None], np.array([[phi]]))
    assert found["status"][0, 0] in (st.OK, st.DEAD_POINT)
    return found["psi"][0, 0]


def arccosine_closure(design, phi):
    """psi = atan2(Y, -X) + branch acos(W/sqrt(R)), unguarded."""
    x, y, w = coefficients(design, phi)
    ratio = w / math.hypot(x, y)
    return math.atan2(y, -x) + design[7] * (math.acos(ratio) if abs(ratio) <= 1.0 else math.nan)


def test_arccosine_closure_loses_dead_points():
    assert keeps_dead_points(house_psi)
    assert not keeps_dead_points(arccosine_closure)


def test_arccosine_of_the_pressure_angle_loses_half_the_digits():
    def house(design, phi):
        return poses(design[None], np.array([[phi]]))["pressure_angle"][0, 0]

    def arccosine(design, phi):
        x, y, w = coefficients(design, phi)
        return math.acos(min(math.sqrt(x * x + y * y - w * w) / design[1], 1.0))

    assert sees_small_pressure_angles(house)
    assert not sees_small_pressure_angles(arccosine)


def sees_small_pressure_angles(angle_of):
    """Pressure angles around 1e-7, made by a coupler perpendicular to the rocker, are right to a part in 1000."""
    a, c, e, phi = 1.0, 2.0, 3.0, 0.5
    pin = np.array([a * math.cos(phi), a * math.sin(phi)])
    # C on the circle about (e, 0) such that C - B is perpendicular to the rocker: Thales over pivot and pin.
    chord = pin - np.array([e, 0.0])
    r = np.hypot(*chord)
    b = math.sqrt(r * r - c * c)
    good = 0
    for k in range(8):
        design = np.array([a, b * (1.0 + 1e-7 * (k + 1)), c, e, 0.0, 0.0, 0.0, -1.0])
        linkage = Linkage(*design)
        with mp.workdps(40):
            cosine = linkage.cosine_of_pressure_angle(mp.mpf(phi), linkage.psi(mp.mpf(phi)))
            exact = mp.acos(cosine)
            good += abs(mp.mpf(angle_of(design, phi)) / exact - 1) < 1e-3
    return good == 8


def stays_on_its_branch(angles, slopes):
    """The sign of dF/dpsi never changes along the motion."""
    return all(slope > 0 for slope in slopes) and len(angles) == len(slopes)


def test_nearest_root_tracking_changes_the_branch_at_a_change_point():
    # A near-parallelogram: the two branches nearly touch at phi = pi, where nearness decides by the step's luck.
    design = np.array([1.0, 2.0, 1.0 + 1e-4, 2.0, 0.0, 0.0, 0.0, 1.0])
    assert margins(design[None])["status"][0] in (st.OK, st.NOT_ROTATABLE)
    if margins(design[None])["status"][0] != st.OK:
        design[[1, 3]] = 2.0 + 2e-4, 2.0
    assert margins(design[None])["status"][0] == st.OK
    grid = np.arange(91) * (2.0 * np.pi / 90)
    other = design * np.array([1, 1, 1, 1, 1, 1, 1, -1])
    both = [poses(d[None], grid[None])["psi"][0] for d in (design, other)]
    tracked = [both[0][0]]
    for k in range(1, grid.size):
        tracked.append(min((p[k] for p in both), key=lambda x: abs(np.angle(np.exp(1j * (x - tracked[-1]))))))
    linkage = Linkage(*design)

    def slopes(angles):
        return [linkage.slope(mp.mpf(phi), mp.mpf(psi)) for phi, psi in zip(grid, angles, strict=True)]

    assert stays_on_its_branch(both[0], slopes(both[0]))
    assert not stays_on_its_branch(tracked, slopes(tracked))


def jerk_meets_the_oracle(values, rows):
    """Eight roundings of the condition, as tests/families/rssr/test_oracle.py asks."""
    scales = [max(*(POSES[i]["cond"][k] for k in ("d1", "d2", "d3")), abs(float(POSES[i]["d3"]))) for i in rows]
    return all(
        error(value, POSES[i]["d3"]) <= 8.0 * EPS * scale for value, i, scale in zip(values, rows, scales, strict=True)
    )


def test_difference_quotient_of_the_acceleration_is_no_jerk():
    rows = [i for i, row in enumerate(POSES) if row["kind"] == "regular_crank_rocker"]
    designs, phi = POSE_DESIGNS[rows], np.array([[POSES[i]["phi"]] for i in rows])
    assert jerk_meets_the_oracle(poses(designs, phi)["d3psi"][:, 0], rows)
    best = np.inf
    for h in 10.0 ** -np.arange(2.0, 9.0):
        quotient = (poses(designs, phi + h)["d2psi"] - poses(designs, phi - h)["d2psi"])[:, 0] / (2.0 * h)
        assert not jerk_meets_the_oracle(quotient, rows)
        best = min(best, np.abs(quotient - poses(designs, phi)["d3psi"][:, 0]).max())
    assert best > 1e-11


def finds_the_peak(values, exact):
    """Within 1e-6 of the true maximum, for every design."""
    return bool(np.all(np.abs(values - exact) <= 1e-6 * exact))


def test_a_dense_grid_of_360_is_no_true_maximum():
    designs = random_designs(1000, 12, rotatable=True)
    exact, _, _ = dense(designs, 2, 8192)
    assert finds_the_peak(maxima(designs, 2)["max"], np.maximum(exact, maxima(designs, 2)["max"]))
    assert np.all(maxima(designs, 2)["max"] >= exact * (1.0 - 1e-8))
    assert not finds_the_peak(dense(designs, 2, 360)[0], exact)


def test_printed_constant_loses_everything_for_nearly_parallel_axes():
    # K as printed, f^2 + g^2 - 2 f g cos(alpha), against (K*): oracle rows with huge offsets.
    rows = [i for i, row in enumerate(POSES) if row["kind"] == "hard_huge_offsets"]
    designs, phi = POSE_DESIGNS[rows], np.array([[POSES[i]["phi"]] for i in rows])
    house = poses(designs, phi)["psi"][:, 0]
    worst_house = worst_printed = 0.0
    for k, i in enumerate(rows):
        x, y, w = coefficients(designs[k], phi[k, 0])
        delta = x * x + y * y - w * w
        t = designs[k, 7] * math.sqrt(max(delta, 0.0))
        printed = math.atan2(y * w - x * t, -(x * w + y * t))
        scale = EPS * max(POSES[i]["cond"]["psi"], 1.0)
        for value in (house[k], printed):
            wrapped = abs(complex(math.cos(value), math.sin(value)) - np.exp(1j * float(POSES[i]["psi"])))
            if value == house[k]:
                worst_house = max(worst_house, wrapped / scale)
            else:
                worst_printed = max(worst_printed, wrapped / scale)
    assert worst_house < 8.0
    assert worst_printed > 1000.0


def knows_what_does_not_turn(values, stuck):
    return bool(np.isnan(values[stuck]).all())


def test_a_grid_alone_invents_maxima_for_cranks_that_do_not_turn():
    designs = random_designs(2000, 14)
    stuck = margins(designs)["status"] == st.NOT_ROTATABLE
    sampled = sampled_maxima(designs, frozenset({"max_abs_d2psi"}), Accuracy(samples=24))
    assert knows_what_does_not_turn(maxima(designs, 2)["max"], stuck)
    assert knows_what_does_not_turn(sampled["max_abs_d2psi"], stuck)
    grid, _, least = dense(designs, 2, 24)
    assert not knows_what_does_not_turn(np.where(least > 0.0, grid, np.nan), stuck)
