"""Threads whose path changes at events, against closed forms of a stitch made by hand and plain searches."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Angles
from sweep.families.machines.thread_balance import GF
from sweep.report.sewing import threads_figure
from tests.families.machines.test_hand_made_stitches import ARM, AT, CRANK, DESIGN, PHI, SHARE, across, machine_of

GUIDE, HOLE, SEAM = np.array([40.0, 3.0, 4.0]), np.array([-20.0, -4.0, 0.0]), np.array([-20.0, -5.0, 2.0])
RELATIONS = {"cast": {"event": "a_across", "level": 0.0, "rising": False}}
PATH = [GUIDE.tolist(), "thin", {"on": "blade", "held": ["a", "cast"]}, HOLE.tolist(), SEAM.tolist()]
TURN = 2.0 * math.pi


def machine(**changes):
    return machine_of(RELATIONS | {"upper": {"thread": PATH} | changes})


def poses(made, wanted, phi, design=DESIGN):
    found = sweep.evaluate(made, design, [f"upper_{name}" for name in wanted], phi=np.asarray(phi))
    assert (found["status"] == 0).all()
    return [found[f"upper_{name}"].to_numpy() for name in wanted]


def casting():
    """Where the looper has gone back past the needle."""
    low, high = PHI + 1.0, PHI + TURN - 0.2
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if across(middle) > 0.0 else (low, middle)
    return low


def needed(phi):
    eye = np.array([CRANK * math.cos(phi) - 30.0, CRANK * math.sin(phi), 0.0])
    length = math.dist(GUIDE, eye) + math.dist(HOLE, SEAM)
    if not (phi - PHI) % TURN < (casting() - PHI) % TURN:
        return length + math.dist(eye, HOLE)
    turned = SHARE * math.cos(phi - 0.5 * math.pi - PHI)
    arm = np.array([0.0, turned, 1.0]) / math.hypot(1.0, turned)
    tip, back = (np.array(AT) + far * arm for far in (ARM, 0.5 * ARM))

    def over(t):
        return math.dist(eye, tip + t * (back - tip)) + math.dist(tip + t * (back - tip), HOLE)

    # a parabola's bottom to the root of rounding, which leaves the length exact; the ends by themselves
    return length + min(minimize_scalar(over, bounds=(0.0, 1.0), options={"xatol": 1e-10}).fun, over(0.0), over(1.0))


def test_thread_lies_around_the_blade_from_where_it_is_taken_to_where_it_is_cast_off():
    phi = [*np.linspace(0.05, 6.2, 40), PHI - 1e-6, PHI + 1e-6, (casting() - 1e-6) % TURN, (casting() + 1e-6) % TURN]
    (found,) = poses(machine(), ["needed"], phi)
    np.testing.assert_allclose(found, [needed(x) for x in phi], rtol=1e-12)
    # The tip takes it beside the needle, where it lies already; what is cast off is a loop.
    assert abs(found[-3] - found[-4]) < 0.2
    assert found[-2] - found[-1] > 1.0


def test_rate_is_the_derivative_between_events_and_the_jumps_close_the_turn():
    made = machine(sewn=4.0, feeding=["cast", "a"], drawing=["a", "cast"])
    phi, h = np.linspace(0.05, 6.2, 40), 1e-6
    behind, ahead = (poses(made, ["demand"], phi + way * h)[0] for way in (-1.0, 1.0))
    rate, velocity = poses(made, ["rate", "velocity"], phi, DESIGN | {"upper_speed": 700.0})
    np.testing.assert_allclose(rate, (ahead - behind) / (2.0 * h), atol=1e-6)
    np.testing.assert_array_equal(velocity, 700.0 * rate)
    # Gauss between the events, and what jumps there: over a turn what is drawn is sewn in.
    ends = [PHI, casting(), PHI + TURN]
    total = 0.0
    for start, end in pairwise(ends):
        x, weights = np.polynomial.legendre.leggauss(80)
        at = start + 0.5 * (end - start) * (x + 1.0)
        total += 0.5 * (end - start) * weights @ poses(made, ["rate"], at % TURN)[0]
        before, after = poses(made, ["demand"], [(end - 1e-9) % TURN, (end + 1e-9) % TURN])[0]
        total += after - before
    assert total == pytest.approx(0.0, abs=1e-6)


def test_demand_is_needed_with_what_is_sewn_in_and_without_what_is_drawn():
    made = machine(sewn=4.0, feeding=["cast", "a"], drawing=["a", "cast"])
    phi = np.array([PHI + 1e-6, (casting() - 1e-6) % TURN, (casting() + 1e-6) % TURN, PHI - 1e-6])
    length, demand = poses(made, ["needed", "demand"], phi)
    away = demand - length
    # all is drawn from A to where the loop is cast off, and sewn in from there to A
    assert away[0] - away[1] == pytest.approx(4.0, abs=1e-9) and away[3] - away[2] == pytest.approx(4.0, abs=1e-9)


def test_thread_that_would_pass_in_no_time_has_no_demand_and_no_rate():
    """Its rate was refused and its demand was not, though it leapt by a whole stitch."""
    thread = {"thread": PATH, "sewn": 4.0, "feeding": ["cast", "late"], "drawing": ["a", "cast"]}
    made = machine_of(RELATIONS | {"late": RELATIONS["cast"], "upper": thread})
    for name in ("demand", "surplus", "rate", "velocity"):
        found = sweep.evaluate(made, DESIGN, [f"upper_{name}"], phi=np.linspace(0.05, 6.2, 7))
        assert (found["status"] == st.INVALID_INPUT).all() and found[f"upper_{name}"].isna().all(), name
    assert (sweep.evaluate(made, DESIGN, ["upper_needed"], phi=[1.0])["status"] == st.OK).all()


def test_thread_that_slides_through_the_eye_has_275_gf_and_one_that_the_bar_carries_50():
    """Reported, 1.3 of the source: 20 gf on the slack side; the wraps outside the eye and in it are inputs."""
    euler = sweep.thread.path(20.0, {"R": [0.125, 0.125], "theta_deg": [81.8, 152.2], "alpha": 0.0, "B": 0.0})
    assert euler["T2"][0] == pytest.approx(50.0, abs=0.05) and euler["T3"][0] == pytest.approx(275.0, abs=0.5)
    line = [[10.0, y, 0.0] for y in (0.0, 1.0, 2.0, 3.0)]
    outside, eye = math.radians(57.8), math.radians(193.5 - 57.8)  # the same by the whole law of contours
    path = [line[0], {"on": line[1], "wrap": outside}, {"on": line[2], "wrap": eye, "fixed": ["cast", "a"]}, line[3]]
    made = machine(thread=path, tension=20.0 * GF, radius=0.125)
    sliding, carried = poses(made, ["tension"], [PHI + 0.1, PHI - 0.1])[0] / GF
    assert sliding == pytest.approx(275.0, abs=0.5) and carried == pytest.approx(50.0, abs=0.1)


def test_tension_grows_with_the_speed_by_its_law_within_the_measured_range():
    phi = np.linspace(0.05, 6.2, 40)
    start = machine(thread=[GUIDE.tolist(), "thin"], tension=20.0 * GF)
    tension, velocity = poses(start, ["tension", "velocity"], phi, DESIGN | {"upper_speed": 300.0})
    speeds = np.clip(np.abs(velocity) / 1e3, 0.08, 7.4)
    assert np.ptp(speeds) > 1.0
    np.testing.assert_allclose(tension, 20.0 * GF * sweep.thread.speed({"v": speeds})["ratio_to_ref"], rtol=1e-12)
    np.testing.assert_allclose(poses(start, ["tension"], phi)[0], 20.0 * GF, rtol=1e-12)  # 0: nothing is asked of it


def test_extremes_of_the_surplus_are_found_at_the_jumps():
    made = machine(stock=150.0, sewn=4.0, feeding=["cast", "a"], drawing=["a", "cast"])
    found = sweep.summarise(made, DESIGN, ["min_upper_surplus", "max_upper_surplus"], accuracy=1e-9).iloc[0]
    with pytest.raises(sweep.InputError, match="samples = 0; allowed: a whole number from 1"):
        sweep.thread.diagram(made, DESIGN, samples=0)
    grid = sweep.thread.diagram(made, DESIGN, samples=20000)
    assert found["status"] == 0
    for name, value in (("min", grid["upper_surplus"].min()), ("max", grid["upper_surplus"].max())):
        assert found[f"{name}_upper_surplus"] == pytest.approx(value, abs=1e-6), name  # of 20 000 samples
    np.testing.assert_array_equal(grid["demand"], grid["upper_demand"])


def test_places_that_end_at_one_event_end_at_the_same_pose():
    # At neighbouring doubles the hole was still held and the blade no longer: a piece of no length, and nan.
    path = [*PATH[:2], {"on": HOLE.tolist(), "held": ["late", "cast"]}, *PATH[2:]]
    made = machine_of(RELATIONS | {"late": {"event": "a_across", "level": 1.0}, "upper": {"thread": path}})
    event = sweep.summarise(made, DESIGN, ["phi_cast"])["phi_cast"][0]
    near = event + np.spacing(event) * np.arange(-20.0, 21.0)
    wrap, length = poses(made, ["wrap", "needed"], near)
    assert np.isfinite(wrap).all() and (np.abs(np.diff(length)) > 1e-9).sum() == 1


@pytest.mark.parametrize("name", ["tension", "rate", "wrap"])
def test_root_mean_squares_are_those_of_gauss_between_the_events(name):
    made = machine(tension=20.0 * GF)
    found = sweep.summarise(made, DESIGN, [f"rms_upper_{name}"], accuracy=1e-8).iloc[0]
    # 400 panels between events: a kink at the end of the blade is off by (1/400)^2 of one panel's share, 1e-8.
    x, weights = np.polynomial.legendre.leggauss(12)
    square = 0.0
    for start, end in pairwise([PHI, casting(), PHI + TURN]):
        left = start + (end - start) * np.arange(400.0)[:, None] / 400.0
        values = poses(made, [name], ((left + (end - start) * (x + 1.0) / 800.0) % TURN).ravel())[0]
        square += (end - start) / 800.0 * (np.tile(weights, 400) @ values**2)
    assert found["status"] == 0
    assert found[f"rms_upper_{name}"] == pytest.approx(math.sqrt(square / TURN), rel=1e-7)


@pytest.mark.parametrize("name", ["min_upper_rate", "max_upper_rate"])
def test_the_rate_over_a_blade_keeps_the_accuracy_where_the_thread_comes_to_its_end(name):
    made = machine(thread=[[-73.8, 11.0, -1.6], "blade", [-56.5, 11.9, 6.7]])
    found = sweep.summarise(made, DESIGN, [name], accuracy=1e-8).iloc[0]
    sign, phi = -1.0 if name.startswith("min") else 1.0, np.linspace(0.0, TURN, 4001)
    for _ in range(4):
        values = sign * poses(made, ["rate"], phi)[0]
        phi = phi[values.argmax()] + (phi[1] - phi[0]) * np.linspace(-1.0, 1.0, 201)
    assert found["status"] == 0 and found[f"err_{name}"] <= 1e-8 * 46.0  # from the least to the largest
    assert sign * found[name] == pytest.approx(values.max(), rel=1e-8)


def test_complex_designs_move_the_events_too():
    made = machine(sewn=4.0, feeding=["cast", "a"], drawing=["a", "cast"])
    row = np.array([[DESIGN.get(p.name, p.default) for p in made.parameters]])
    angles = Angles.of(np.array([[0.3, 1.5, 3.0, 4.5]]))
    for name in ("looper.a", "looper.x_at", "needle.a"):
        unit = np.zeros_like(row)
        unit[0, made.parameter_names.index(name)] = 1.0
        tiny = made.poses(row + 1e-100j * unit, angles, frozenset({"upper_demand"}))["upper_demand"]
        ahead, behind = (
            made.poses(row + way * 1e-6 * unit, angles, frozenset({"upper_demand"}))["upper_demand"]
            for way in (1.0, -1.0)
        )
        np.testing.assert_allclose(np.imag(tiny) / 1e-100, (ahead - behind) / 2e-6, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("tension", [0.2, 0.4711534586397418, 0.1234])
def test_a_tension_that_nothing_changes_is_known(tension):
    events = {"sewn": 4.0, "feeding": ["cast", "a"], "drawing": ["a", "cast"]}
    made = machine(thread=[GUIDE.tolist(), "thin"], tension=tension, **events)
    wanted = ["min_upper_tension", "max_upper_tension", "range_upper_tension"]
    found = sweep.summarise(made, DESIGN, wanted, accuracy=1e-9).iloc[0]
    assert found["status"] == 0 and found[wanted].tolist() == pytest.approx([tension, tension, 0.0], abs=1e-15)


def test_events_of_several_designs_follow_the_phase_and_the_place_of_their_shafts():
    """Turned ahead by 1 rad, the shaft of all that moves does everything 1 rad earlier."""
    relations = {"up": {"event": "drive.eye_x", "level": 9.0}, "down": {"event": "drive.eye_x", "level": 9.0}}
    relations["down"]["rising"] = False
    relations["upper"] = {"thread": [HOLE.tolist(), {"on": "drive.eye", "held": ["up", "down"]}, SEAM.tolist()]}
    drive = {"family": "four_bar", "eye": [12.0, 5.0, 0.0], "shaft": "side"}
    made = sweep.machine({"drive": drive}, relations, shafts={"main": {}, "side": {"phase": 0.3}})
    design = {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0}
    rows, phi = {name: [x] * 3 for name, x in design.items()}, np.linspace(0.0, 5.2, 40)
    rows |= {"side_phase": [0.3, 1.3, 1.3], "side_x_at": [0.0, 0.0, 3.0]}
    found = sweep.evaluate(made, rows, ["upper_needed", "drive.eye_x"], phi=np.concatenate([phi, phi + 1.0]))
    needed, eye = (found[name].to_numpy().reshape(3, 2, 40) for name in ("upper_needed", "drive.eye_x"))
    np.testing.assert_allclose(needed[1, 0], needed[0, 1], rtol=1e-12)
    short = math.dist(HOLE, SEAM)
    np.testing.assert_array_equal(needed > short + 1e-9, eye > 9.0)
    assert (needed[1] != needed[2]).any()


@pytest.mark.parametrize("above", [1e-2, 1e-4, 1e-6])
def test_a_path_changes_where_its_event_first_happens_however_short_it_lasts(above):
    """The lower of two humps rises above the level for less than the 512 samples of the turn are apart."""
    members = {"drive": {"family": "four_bar", "eye": [12.0, 5.0, 0.0], "offset": 0.0041}}
    members["other"] = {"family": "guide", "ratio": 2, "offset": 0.0082, "place": {"at": [5.0, 40.0, 3.0]}}
    design = {f"{m}.{name}": x for m in members for name, x in {"a": 10.0, "b": 40.0, "c": 30.0, "e": 38.0}.items()}
    design |= {"other.xi": 12.0, "other.eta": 5.0, "other.lam": 0.3, "other.h": 0.0}
    relations = {"far": {"distance": ["drive.eye", "other.point"]}}
    relations |= {"up": {"event": "far", "level": 43.41908231 - above}, "down": {"event": "drive.eye_x", "level": 9.0}}
    path = [HOLE.tolist(), {"on": "drive.eye", "held": ["up", "down"]}, SEAM.tolist()]
    made = sweep.machine(members, relations | {"upper": {"thread": path}})
    found = sweep.summarise(made, design, ["phi_up", "count_up"], accuracy=1e-8).iloc[0]
    assert found["status"] == 0 and found["count_up"] == 2 and 0.6 < found["phi_up"] < 0.7
    before, behind = poses(made, ["needed"], found["phi_up"] + np.array([-1e-6, 1e-6]), design)[0]
    assert before == pytest.approx(math.dist(HOLE, SEAM), rel=1e-12) and behind > before + 1.0


def test_a_path_that_changes_at_an_event_of_one_that_changes_is_refused():
    relations = {"upper": {"thread": PATH}, "tight": {"event": "upper_surplus", "level": -90.0}}
    relations["lower"] = {"thread": [GUIDE.tolist(), {"on": HOLE.tolist(), "held": ["tight", "cast"]}, SEAM.tolist()]}
    with pytest.raises(InputError, match="lower: thread = 'tight'; allowed: events of what does not change at events"):
        machine_of(RELATIONS | relations)


def test_rigid_guides_draw_the_stitch_up_to_the_greatest_demand():
    """What passes the tensioner, if thread does so when it is taut alone, is the running maximum of all that is asked.

    So drawing ends where needed + sewn - given is greatest, and a short stitch comes there alone.
    """
    phi = np.linspace(0.0, TURN, 4001)[:-1]
    (length,) = poses(machine(), ["needed"], phi)
    for sewn in (1e-6, 0.5):
        asked = np.concatenate([length, length + sewn, length + 2.0 * sewn])  # a stitch taken at the seam of the turn
        passed = np.diff(np.maximum.accumulate(asked))[len(phi) :][: len(phi)]
        assert passed.sum() == pytest.approx(sewn, abs=1e-12)
        where = np.flatnonzero(passed > 0.0)
        assert where.max() % len(phi) + 1 in (length.argmax(), length.argmax() + len(phi))
        assert np.ptp(where) <= 1 if sewn < 1e-3 else np.ptp(where) > 1


def test_fast_thread_is_warned_of():
    with pytest.warns(sweep.thread.MeasuredRangeWarning, match="speed of upper"):
        sweep.thread.diagram(machine(), DESIGN | {"upper_speed": 5000.0})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"thread": [*PATH[:2], {"on": "blade", "held": ["a", "cats"]}, *PATH[3:]]}, "did you mean 'cast'"),
        ({"thread": [*PATH[:2], {"on": "blade", "heldd": ["a", "cast"]}, *PATH[3:]]}, "did you mean 'held'"),
        ({"thread": [*PATH[:3], "blade", *PATH[3:]]}, "always runs, as between blades"),
        ({"thread": ["blade", *PATH[3:]]}, "begins and ends with a point"),
        ({"sewn": 4.0}, "sewn, feeding and drawing together"),
        ({"sewn": 4.0, "feeding": ["a"], "drawing": ["a", "cast"]}, "two events or moments"),
    ],
)
def test_what_is_no_thread_by_events_is_named(changes, words):
    with pytest.raises(InputError, match=words):
        machine(**changes)


def test_figure_has_demand_surplus_and_speed_of_every_thread():
    figure = threads_figure(sweep.thread.diagram(machine(), DESIGN))
    assert [axes.get_ylabel() for axes in figure.axes] == ["P, from its mean [mm]", "surplus [mm]", "speed [m/s]"]
    assert [len(axes.lines) for axes in figure.axes] == [2, 2, 3]
    figure.canvas.draw()
    legends = [(axes, axes.get_legend()) for axes in figure.axes if axes.get_legend()]
    assert legends and all(words.get_window_extent().y0 >= axes.get_window_extent().y1 for axes, words in legends)


@pytest.mark.parametrize("fall", [0.4, 0.2])
def test_thread_leaves_a_place_where_the_cam_passes_the_level(fall):
    """Just before a cycloidal fall ends its third derivative jumps: the place was left up to 1e-7 rad beside it."""
    cam = {"lift": 20.0, "rise": 2.0, "dwell": 0.0, "fall": fall, "start": 1.0, "law": 3.0, "r0": 30.0, "e": 0.0}
    level = {"event": "m.r_x", "level": 30.02}
    thread = {"thread": [[0.0, 0.0, 50.0], {"on": HOLE.tolist(), "held": ["up", "down"]}, [0.0, 0.0, -50.0]]}
    made = sweep.machine({"m": "cam"}, {"up": level, "down": level | {"rising": False}, "upper": thread})
    share = brentq(lambda x: x - math.sin(TURN * x) / TURN - 0.001, 0.0, 0.5, xtol=1e-16)
    near = (3.0 + (1.0 - share) * fall) + 1e-12 * np.array([-1.0, 1.0])  # a rounding of 50 over a slope of 3 at least
    (length,) = poses(made, ["needed"], near, {f"m.{name}": value for name, value in cam.items()})
    assert length[0] - length[1] > 1.0
