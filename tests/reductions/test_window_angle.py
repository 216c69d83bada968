"""window_angle, the crank angle spent in a part of the stroke: closed forms, counting poses, complements, faults.

Counting poses on a grid of N misses at most one step 2 pi/N at each of the two to four ends of the stay; the reported
errors are those of the extrema the window hangs on, for a target of 1e-10 below 1e-4 where the stay ends at a grazing
angle and far below elsewhere.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families import family
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.quantities.measures import measure

ROCKERS = {
    "a": [11.0, 20.0, 30.0, 8.0], "b": [36.5, 60.0, 90.0, 22.3], "c": [22.0, 70.0, 60.0, 23.9],
    "e": [25.5, 80.0, -100.0, 28.2], "f": [29.0, 3.0, 0.0, 18.6], "g": [9.0, 3.0, 0.0, 16.3],
    "alpha": [np.pi / 2, 0.4, 0.0, 1.1], "branch": [-1.0, 1.0, -1.0, 1.0],
}  # fmt: skip
POSES = 100_000
WINDOWS = [(0.0, 0.01), (0.99, 1.0), (0.3, 0.6), (0.0, 0.6)]


@pytest.mark.parametrize("window", WINDOWS)
def test_is_the_share_of_poses_in_the_window(window):
    found = sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-10, window=window)
    assert (found.status == 0).all()
    phi = np.arange(POSES) * (2.0 * np.pi / POSES)
    psi = sweep.evaluate("rssr", ROCKERS, "psi", phi=phi).psi.to_numpy().reshape(-1, POSES)
    psi = np.unwrap(psi)
    share = (psi - psi.min(axis=1, keepdims=True)) / np.ptp(psi, axis=1, keepdims=True)
    counted = ((share >= window[0]) & (share <= window[1])).mean(axis=1) * 2.0 * np.pi
    np.testing.assert_allclose(found.window_angle, counted, atol=4.0 * 2.0 * np.pi / POSES)
    assert (found.err_window_angle < 1e-4).all()


@pytest.mark.parametrize("part", [1e-6, 1e-7, 1e-10])
@pytest.mark.parametrize("upper", [False, True])
def test_stay_shorter_than_a_step_of_the_first_samples_is_found(part, upper):
    window = (1.0 - part, 1.0) if upper else (0.0, part)
    want = ["window_angle", "swing", "phi_ext", "phi_fold"]
    found = sweep.summarise("rssr", ROCKERS, want, accuracy=1e-12, window=window)
    # Extended is the larger angle where branch is +1.
    at_ext = upper == (np.array(ROCKERS["branch"]) > 0.0)
    offset = np.linspace(-0.01, 0.01, 2 * POSES + 1)
    for k, row in found.iterrows():
        phi = offset + (row.phi_ext if at_ext[k] else row.phi_fold)
        psi = sweep.evaluate("rssr", {n: x[k] for n, x in ROCKERS.items()}, "psi", phi=phi).psi.to_numpy()
        off = np.abs(psi - (psi.max() if upper else psi.min()))
        counted = (off <= part * abs(row.swing)).mean() * (offset[-1] - offset[0])
        assert row.window_angle == pytest.approx(counted, abs=row.err_window_angle + 2e-6), k


def test_one_of_them_passes_the_cut_of_the_angle():
    phi = np.linspace(0.0, 2.0 * np.pi, 721)
    psi = sweep.evaluate("rssr", ROCKERS, "psi", phi=phi).psi.to_numpy().reshape(-1, phi.size)
    assert (np.abs(np.diff(psi)).max(axis=1) > np.pi).any(), "the sample must contain a rocker that passes 180 degrees"


def test_parts_of_the_stroke_add_up_to_a_turn():
    parts = [(0.0, 0.2), (0.2, 0.7), (0.7, 1.0)]
    angles = [
        sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-10, window=part).window_angle for part in parts
    ]
    np.testing.assert_allclose(sum(angles), 2.0 * np.pi, atol=1e-7)
    whole = sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-10, window=(0.0, 1.0))
    np.testing.assert_allclose(whole.window_angle, 2.0 * np.pi, rtol=1e-15)


def test_central_slider_crank_with_an_endless_coupler_is_a_sine():
    # s = a sin(phi) + b - (a cos(phi))^2/(2 b) ...: with a/b = 1e-6 the sine is met to 1e-6 of the stroke.
    table = {"a": 10.0, "b": 1e7, "e": 0.0, "f": 0.0, "alpha": 0.0}
    found = sweep.summarise("rssp", table, "window_angle", accuracy=1e-10, window=(0.99, 1.0))
    assert found.window_angle[0] == pytest.approx(2.0 * np.arccos(0.98), abs=1e-5)


def test_grid_and_refined_agree():
    refined = sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-10, window=(0.9, 1.0))
    grid = sweep.summarise("rssr", ROCKERS, "window_angle", samples=4096, window=(0.9, 1.0))
    np.testing.assert_allclose(grid.window_angle, refined.window_angle, atol=1e-4)


def test_without_a_window_it_is_refused():
    with pytest.raises(InputError, match="window_angle"):
        sweep.summarise("rssr", ROCKERS, "window_angle")


def test_design_that_does_not_turn_has_none():
    table = {name: values[:1] for name, values in ROCKERS.items()} | {"a": [30.0]}
    found = sweep.summarise("rssr", table, "window_angle", window=(0.9, 1.0))
    assert found.status[0] != 0 and np.isnan(found.window_angle[0])


@pytest.mark.parametrize("name", ["rssr", "rssp"])
def test_optimiser_follows_the_edges_of_a_window(name):
    assert measure(family(name), "window_angle", (0.9, 1.0)).kind == "stay"
    # Without a window there is no angle, and the whole stroke takes the whole turn.
    assert measure(family(name), "window_angle").kind == "scalar"
    assert measure(family(name), "window_angle", (0.0, 1.0)).kind == "scalar"


def test_optimiser_takes_the_window_of_a_cam_as_a_number():
    # A motion law may have kinks, beside which no slope predicts anything.
    assert measure(family("cam"), "window_angle", (0.9, 1.0)).kind == "scalar"


GUIDE = {"a": 10.0, "b": 25.0, "c": 25.0, "e": 20.0, "xi": 50.0, "eta": 3.0, "lam": 1.5, "h": 0.3}
ROCKER = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 0.0, "g": 0.0, "alpha": 0.3}
PART = (0.1, 0.6)


@pytest.fixture(scope="module")
def three_guides():
    """Guides behind a rocker: one on the main shaft, one geared, one that the rocker drives; and their dimensions."""
    geared = {"family": "guide", "ratio": 2, "offset": 0.4}
    driven = {"family": "guide", "driver": "rocker.psi", "offset": 1.0}
    made = sweep.machine({"rocker": "rssr", "plain": "guide", "geared": geared, "driven": driven})
    own = {f"{member}.{name}": x for member in ("plain", "geared", "driven") for name, x in GUIDE.items()}
    return made, own | {f"rocker.{name}": x for name, x in ROCKER.items()}


@pytest.mark.parametrize("output", ["max_dev", "min_dev", "max_abs_dev", "range_dev", "window_angle"])
def test_window_of_a_member_is_a_part_of_its_own_stroke(three_guides, output):
    machine, table = three_guides
    members = ("plain", "geared", "driven")
    found = sweep.summarise(machine, table, [f"{m}.{output}" for m in members], accuracy=1e-10, window=PART).iloc[0]
    alone = sweep.summarise("guide", GUIDE, output, accuracy=1e-10, window=PART)[output].iloc[0]
    phi = np.arange(POSES) * (2.0 * np.pi / POSES)
    poses = sweep.evaluate(machine, table, ["driven.s", "driven.dev"], phi=phi)
    share = (poses["driven.s"] - poses["driven.s"].min()) / np.ptp(poses["driven.s"])
    inside = (share >= PART[0]) & (share <= PART[1])
    dev = poses["driven.dev"][inside]
    counted = {
        "max_dev": dev.max(), "min_dev": dev.min(), "max_abs_dev": dev.abs().max(), "range_dev": np.ptp(dev),
        "window_angle": 2.0 * np.pi * inside.mean(),
    }  # fmt: skip
    assert found.status == 0
    # A geared member passes through the same poses.  A step of the count changes dev by up to 1e-3.
    assert found[f"plain.{output}"] == pytest.approx(alone, rel=1e-9)
    assert found[f"geared.{output}"] == pytest.approx(alone, rel=1e-9)
    assert found[f"driven.{output}"] == pytest.approx(counted[output], abs=2e-3)


@pytest.mark.parametrize("output", ["max_dev", "min_dev", "max_abs_dev", "range_dev"])
def test_samples_count_in_the_stroke_of_the_member_too(three_guides, output):
    machine, table = three_guides
    wanted = [f"{m}.{output}" for m in ("plain", "geared", "driven")]
    exact = sweep.summarise(machine, table, wanted, accuracy=1e-10, window=PART).iloc[0]
    found = sweep.summarise(machine, table, wanted, samples=4096, window=PART).iloc[0]
    assert found.status == 0
    assert found[wanted].tolist() == pytest.approx(exact[wanted].tolist(), abs=0.05)  # a sample beside the edge


@pytest.mark.parametrize("member", ["plain", "geared", "driven"])
def test_optimiser_follows_the_window_of_the_member(three_guides, member):
    machine, table = three_guides
    whole = {p.name: table.get(p.name, p.default) for p in machine.parameters}
    output, name, h = f"{member}.max_abs_dev", f"{member}.xi", 1e-4
    rows = sensitivities(machine, np.array([*whole.values()], np.float64), [output], PART)
    found = rows["growing"][rows["parameter"].index(name)]
    ends = [whole | {name: whole[name] + step} for step in (h, -h)]
    more, less = (sweep.summarise(machine, one, output, accuracy=1e-12, window=PART)[output].iloc[0] for one in ends)
    assert found == pytest.approx((more - less) / (2.0 * h), rel=1e-5)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-9])
def test_a_follower_that_stands_still_may_be_in_the_window_all_the_turn_or_never(accuracy):
    """A cam of coefficients that are all 0 stands still: its window angle was 0 with an error of 0."""
    still = family("cam_lever").example | {"law": 4.0} | {f"{kind}{k}": 0.0 for kind in "cs" for k in range(1, 7)}
    found = sweep.summarise("cam_lever", still, ["window_angle", "swing"], window=(0.0, 0.01), accuracy=accuracy).iloc[
        0
    ]
    assert found.status == st.OK and abs(found.swing) <= found.err_swing
    assert found.err_window_angle == 2.0 * np.pi


@pytest.mark.parametrize("part", [(0.5, 0.57), (0.0, 0.2), (0.25, 1.0)])
def test_rounding_of_a_slider_that_stands_still_passes_no_window(part):
    """The crank turns about the slider's line, all but 6e-17: window angles were -22 rad to 322 rad."""
    sliders = {"a": 1.0, "b": [1.42, 1.6925, 1.1947], "e": 0.0, "f": [-2.8346, 0.7617, -1.15],
               "alpha": [-0.5 * np.pi, -0.5 * np.pi, 0.5 * np.pi], "branch": [-1.0, 1.0, -1.0]}  # fmt: skip
    found = sweep.summarise("rssp", sliders, ["window_angle"], window=part, accuracy=1e-9)
    assert (found.window_angle.between(0.0, 2.0 * np.pi) | (found.status != 0)).all()
    assert ((found.err_window_angle == 2.0 * np.pi) | (found.status != 0)).all()
    assert (found.status == 0).any()


@pytest.mark.parametrize("window", WINDOWS)
def test_error_is_that_of_exact_ends_at_loose_targets(window):
    """The ends of the stroke were found to the target, which moved a stay next to them by up to fifty times as much."""
    exact = sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-12, window=window)
    found = sweep.summarise("rssr", ROCKERS, "window_angle", accuracy=1e-2, window=window)
    assert (found.status == 0).all() and (found.err_window_angle <= 1e-8).all()
    assert (np.abs(found.window_angle - exact.window_angle) <= found.err_window_angle).all()


@pytest.mark.parametrize("law", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-8])
def test_stay_of_a_cam_whose_flat_ends_are_found_to_fewer_digits_has_no_status(law, accuracy):
    """Ends of phases are flat: the search for the ends of the stroke missed its own target of 1e-12 and said so.

    Both halves of these laws are alike, so that the follower is in the upper half from the middle of the rise to the
    middle of the return: rise/2 + dwell + fall/2.
    """
    table = {"lift": 1.0, "rise": 1.2, "dwell": 1.0, "fall": 1.5, "r0": 3.0, "law": law}
    found = sweep.summarise("cam", table, "window_angle", accuracy=accuracy, window=(0.5, 1.0)).iloc[0]
    assert found.status == st.OK
    assert abs(found.window_angle - 2.35) <= found.err_window_angle < 1e-9


# The follower of its guide is at its lowest point next to a pose of coarse samples.
NARROW = {
    "a": 0.18172147599251193, "b": 3.853540537411128, "c": 2.536402990434361,
    "e": 1.8148205791431087, "xi": 3.8940469376621047, "eta": 0.11187313081782202,
    "lam": 2.1876039628469206, "h": 2.066737079326538, "branch": 1.0,
}  # fmt: skip


def guided(phi):
    """Position and deviation of the guided point of NARROW, with mpmath."""
    a, b, c, e, xi, eta, lam, h, branch = (mp.mpf(x) for x in NARROW.values())
    x, y = e - a * mp.cos(phi), a * mp.sin(phi)
    w = (a * a - b * b + c * c + e * e) / (2 * c) - a * e / c * mp.cos(phi)
    r, t = x * x + y * y, branch * mp.sqrt(x * x + y * y - w * w)
    pin = mp.mpc(a * mp.cos(phi), y)
    joint = e + c * mp.mpc(-(x * w + y * t), y * w - x * t) / r
    along = (pin + (joint - pin) / b * mp.mpc(xi, eta)) * mp.expj(-lam)
    return along.real, along.imag - h


def extreme(sense):
    """Crank angle at which the position is largest, or with -1 smallest."""
    best = max((2 * mp.pi * k / 240 for k in range(240)), key=lambda phi: sense * guided(phi)[0])
    return mp.findroot(lambda phi: mp.diff(lambda at: guided(at)[0], phi), best)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-8])
@pytest.mark.parametrize("upper", [1e-4, 1e-5, 1e-6])
def test_deviation_in_a_window_shorter_than_the_samples_has_its_value(upper, accuracy):
    """No sample was in it and a parabola saw none: the value was nan, the status INVALID_INPUT."""
    found = sweep.summarise("guide", NARROW, "max_abs_dev", accuracy=accuracy, window=(0.0, upper)).iloc[0]
    with mp.workdps(40):
        low, high = extreme(-1), extreme(1)
        rise = upper * (guided(high)[0] - guided(low)[0])
        reach = mp.sqrt(2 * rise / mp.diff(lambda phi: guided(phi)[0], low, 2))
        ends = [mp.findroot(lambda phi: guided(phi)[0] - guided(low)[0] - rise, low + k * reach) for k in (-1, 1)]
        # The deviation passes the lowest point at a slope: it is largest where the window ends.
        exact = float(max(abs(guided(phi)[1]) for phi in ends))
    assert found["status"] == st.OK
    assert abs(found["max_abs_dev"] - exact) <= found["err_max_abs_dev"] + 2.0**-52 * exact  # exact is rounded once
