"""Designer's units and numbers: hand-calculated values, and that a printed number means the stored one."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from sweep.families.names import is_place
from sweep.quantities.units import internal_unit
from sweep.report.dataset import Dataset
from sweep.report.quantities import change, number, percent_change, quantity
from sweep.study.load import load_study

RPM = 2.0 * math.pi / 60.0
STUDIES = Path(__file__).parents[2] / "studies"


@pytest.mark.parametrize(
    ("name", "unit", "symbol", "words", "shown_unit"),
    [
        ("max_abs_d2s", "mm", "max |s″|", "largest acceleration", "mm/rad²"),
        ("max_abs_d2s", "length", "max |s″|", "largest acceleration", "mm/rad²"),
        ("max_abs_d3psi1", "1", "max |ψ‴₁|", "largest jerk of stage 1", "rad/rad³"),
        ("dpsi", "1", "ψ′", "velocity", "rad/rad"),
        ("psi", "rad", "ψ", "follower angle", "°"),
        ("phi_max_abs_d2s", "rad", "φ at max |s″|", "crank angle of the largest acceleration", "°"),
        ("max_pressure_angle2", "rad", "max pressure angle₂", "largest pressure angle of stage 2", "°"),
        ("max_abs_dev", "length", "max |dev|", "largest deviation from the line", "mm"),
        ("max_abs_d2x_m2", "length", "max |x″ of M₂|", "largest acceleration of x of M of stage 2", "mm/rad²"),
        (
            "looper.max_acceleration_p",
            "length",
            "max acceleration of P looper",
            "largest acceleration of P of the looper",
            "mm/rad²",
        ),
        ("speed_p", "length", "speed of P", "speed of P", "mm/rad"),
        ("max_abs_d2alpha", "1", "max |alpha″|", "largest acceleration of alpha", "rad/rad²"),
        ("alpha", "rad", "alpha", "alpha", "°"),
        ("looper.range_p_y", "length", "range of y of P looper", "range of y of P of the looper", "mm"),
        ("max_speed", "length/rad", "max speed", "largest speed", "mm/rad"),
        ("err_rms_pace", "mm/rad", "error of rms pace", "error of the root mean square of pace", "mm/rad"),
        ("hit", "length/rad^2", "hit", "hit", "mm/rad²"),
        ("looper.dtip_x", "length", "x′ of tip looper", "velocity of x of tip of the looper", "mm/rad"),
        ("speed1", "rad/s", "speed₁", "speed of stage 1", "rpm"),
        ("omega3", "rad/s", "omega₃", "omega of stage 3", "rad/s"),
        ("pull.dS", "length", "S′ pull", "velocity of S of the pull", "mm/rad"),
        ("dchi", "1", "χ′", "velocity of chi", "rad/rad"),
        ("range_x_m2", "length", "range of x of M₂", "range of x of M of stage 2", "mm"),
        ("min_discriminant", "length^4", "min discriminant", "smallest discriminant", "mm⁴"),
        ("margin", "1", "margin", "margin", ""),
        ("phi_a", "rad", "φ a", "phi a", "°"),
        ("sews_at_7000", "mm", "sews at 7000", "sews at 7000", "mm"),
        ("err_max_abs_d2s", "mm", "error of max |s″|", "error of the largest acceleration", "mm/rad²"),
        ("err_swing", "rad", "error of swing", "error of the swing", "°"),
    ],
)
def test_column_is_shown_in_designers_words(name: str, unit: str, symbol: str, words: str, shown_unit: str) -> None:
    shown = quantity(name, unit)
    assert (shown.symbol, shown.words, shown.unit) == (symbol, words, shown_unit)


def test_values_at_speed_are_those_calculated_by_hand() -> None:
    # 12 mm/rad^2 at 7000/min: 0.012 m * (733.038 rad/s)^2 = 6448.1 m/s^2
    assert quantity("max_abs_d2s", "mm").at_speed(12.0, 7000.0 * RPM) == "6448\u00a0m/s²"
    # 1 rad/rad^3 at 60/min: (2 pi)^3 rad/s^3
    assert quantity("d3psi", "1").at_speed(1.0, 60.0 * RPM) == "248.1\u00a0rad/s³"
    assert quantity("ds", "mm").at_speed(2.0, 500.0) == "1\u00a0m/s"
    assert quantity("ds", "m").at_speed(0.002, 500.0) == "1\u00a0m/s" and quantity("d2s", "cm").unit == "cm/rad²"
    assert quantity("ds", "N*mm").show(2.0) == "2\u00a0N·mm"  # a relation that is called so
    assert quantity("max_pace", "length/rad").at_speed(2.0, 500.0) == "1\u00a0m/s"
    assert quantity("hit", "length/rad^2").at_speed(12.0, 7000.0 * RPM) == "6448\u00a0m/s²"
    assert quantity("looper.max_acceleration_p", "mm").at_speed(12.0, 7000.0 * RPM) == "6448\u00a0m/s²"
    assert quantity("speed", "rad/s").show(7000.0 * RPM) == "7000\u00a0rpm"
    assert quantity("stroke", "mm").at_speed(24.5, 500.0) == ""
    assert quantity("d2s", "mm").at_speed(12.0, None) == ""


def test_angles_are_shown_in_degrees() -> None:
    assert quantity("swing", "rad").show(math.pi / 4.0) == "45°"
    assert quantity("err_swing", "rad").show(math.radians(1e-7)) == "1·10⁻⁷\u00a0°"
    assert quantity("swing", "rad").show(math.nan) == "–"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (24.5, "24.5"),
        (-0.05, "−0.05"),
        (123456.7, "123457"),
        (1234567.0, "1.2346·10⁶"),
        (0.00012345678, "0.00012346"),
        (3.2e-8, "3.2·10⁻⁸"),
        (0.0, "0"),
        (math.nan, "–"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
        (999999.97, "1000000"),
    ],
)
def test_number_has_five_digits_and_no_more(value: float, text: str) -> None:
    assert number(value) == text


@settings(deadline=None, max_examples=200)
@given(some.floats(-1e300, 1e300, allow_subnormal=False), some.integers(4, 8))
def test_number_means_what_is_stored(value: float, digits: int) -> None:
    text = number(value, digits).replace("−", "-")
    mantissa, _, power = text.partition("·10")
    exponent = power.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")) or "0"
    read = float(f"{mantissa}e{exponent}")
    assert abs(read - value) <= 0.5000001 * 10.0 ** (1 - digits) * abs(value)


def test_percent_change_names_its_direction() -> None:
    assert percent_change(8.0, 10.0) == "20\u00a0% less"
    assert percent_change(-11.0, 10.0) == "10\u00a0% more"
    assert percent_change(10.0, 10.0) == "the same"
    assert percent_change(1.0, 0.0) == percent_change(math.nan, 1.0) == ""


def test_changes_of_sizes_angles_and_signed_values() -> None:
    assert change(quantity("max_abs_d2s", "length"), 8.0, 10.0) == "20\u00a0% less"
    assert change(quantity("swing", "rad"), -math.radians(50.0), math.radians(40.0)) == "10° more"
    # From one side of zero to the other there are no percents.
    assert change(quantity("max_x_m2", "length"), -45.0, 55.0) == "100\u00a0mm less"
    assert change(quantity("max_x_m2", "length"), 66.0, 55.0) == "20\u00a0% more"
    assert change(quantity("dwell_angle", "rad"), 1.0, 1.0 + 1e-15) == "the same"
    assert change(quantity("max_abs_d2s", "length"), math.nan, 1.0) == ""


@pytest.mark.parametrize(
    ("want", "second"),
    [
        (("needle.max_abs_d2s", "looper.max_abs_dpsi"), "looper.max_abs_dpsi"),
        (("max_abs_d2s", "phi_max_abs_dev", "max_pressure_angle", "max_abs_dev"), "max_abs_dev"),
        (("max_abs_d2s", "swing", "looper.max_pressure_angle"), "looper.max_pressure_angle"),
        (("max_abs_d2s", "swing"), None),
    ],
)
def test_what_stands_against_the_objective_is_found_for_members_too(want: tuple[str, ...], second: str | None) -> None:
    study = SimpleNamespace(pareto=None, objective=SimpleNamespace(output=want[0]), want=want)
    assert Dataset.second.func(SimpleNamespace(study=study)) == second


def test_heading_names_a_member_once() -> None:
    assert quantity("needle.d2s", "mm").title == "acceleration of the needle s″ [mm/rad²]"
    assert quantity("needle.max_abs_d2s", "mm").heading == "largest acceleration of the needle max |s″|"
    assert quantity("d2s", "mm").title == "acceleration s″ [mm/rad²]"


def test_rounding_of_an_angle_or_a_length_is_none():
    shown = quantity("swing", "rad")
    assert shown.show(5e-16) == "0°" and shown.show(1e-9) != "0°"
    assert change(shown, 5e-16, 0.0) == "the same"
    assert quantity("err_swing", "rad").show(5e-16) != "0°"
    assert (
        quantity("a_room", "mm").show(-7e-15) == "0\u00a0mm" and quantity("err_a_room", "mm").show(7e-15) != "0\u00a0mm"
    )


@pytest.mark.parametrize("study", ["overlock208", "looper-sphere", "feed208"])
def test_speeds_by_the_crank_angle_are_shown_so_whatever_they_are_called(study: str) -> None:
    family = load_study(STUDIES / study).family
    outputs = [*family.pose_outputs, *(o for step in family.steps for o in step.provides)]
    words = re.compile("derivative of the [dh]|derivative of [ab]_|per radian|velocity analogue")
    rates = [o for o in outputs if words.search(o.text) and not is_place(o.name)]
    shown = [quantity(o.name, internal_unit(o.unit)) for o in rates if o.unit != "1"]
    assert shown and [one.name for one in shown if one.unit != "mm/rad" and one.order < 2] == []
    assert {one.speed_unit for one in shown} <= {"m/s", "m/s²", "m/s³"}
