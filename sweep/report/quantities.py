"""Display names and units of columns, as designers read them: deg, mm, mm/rad^2, m/s^2 at the scene's speed."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import lru_cache

from sweep.families.base import Turn
from sweep.families.names import is_error, is_place, parts, without_error, without_minus
from sweep.families.reduction import split
from sweep.quantities.units import factor as unit_factor
from sweep.quantities.units import internal_unit

POSITIONS = {
    "s": "displacement",
    "psi": "follower angle",
    "dev": "deviation from the line",
    "phi0": "crank angle between the limit positions",
    "phi_ext": "crank angle of the extended position",
    "phi_fold": "crank angle of the folded position",
}
DERIVATIVES = ("", "velocity", "acceleration", "jerk")
SYMBOLS = {
    "psi": "ψ",
    "chi": "χ",
    "rho": "ρ",
    "phi": "φ",
    "phi0": "φ₀",
    "phi_ext": "φ extended",
    "phi_fold": "φ folded",
}
PRIMES = ("", "′", "″", "‴")
POWERS = {1: "", 2: "²", 3: "³", 4: "⁴"}
# Units shown instead of the stored ones, with the factor from the stored one.
READ_IN = {"t": ("g", 1e6), "t*mm^2": ("kg·mm²", 1e3), "life": ("h", 1.0 / 3600.0), "speed": ("rpm", 30.0 / math.pi)}
LENGTHS = ("mm", "um", "cm", "m", "in")
NO_ANGLE = 1e-10  # rad: smaller values are rounding of zero, or of the angle of an extremum at zero
NONE_OF = {"°": NO_ANGLE, "mm": 1e-12}  # stored values below these, by shown unit, are rounding
_PER_RADIAN = re.compile(r"(.*)/rad(?:\^([23]))?")
_POINT = re.compile("([xyz])_([a-z])")
_OF_MACHINE = re.compile("([a-z]|tip|point)_([xyz])")
_SIZE = re.compile("(speed|acceleration|jerk)_([a-z])")  # of a point's motion in space


@dataclass(frozen=True)
class ShownQuantity:
    """Display form of a dataset's column.

    ``symbolic`` says that the symbol differs from the name.  ``factor`` converts the stored value (mm, rad) to
    ``unit``; ``order`` is that of the derivative by the crank angle, ``speed_scale`` the factor to
    ``speed_unit`` for 1 rad/s, so that a value at the speed omega is ``stored * speed_scale * omega**order``.
    """

    name: str
    symbol: str
    words: str
    unit: str
    factor: float
    symbolic: bool = False
    order: int = 0
    speed_unit: str = ""
    speed_scale: float = 0.0

    @property
    def label(self) -> str:
        """Symbol and unit, for an axis."""
        return f"{self.symbol} [{self.unit}]" if self.unit else self.symbol

    @property
    def heading(self) -> str:
        """Words, with the symbol if there is one; the words already contain the member of a machine."""
        member = parts(self.name).member
        return f"{self.words} {self.symbol.removesuffix(f' {member}')}" if self.symbolic else self.words

    @property
    def title(self) -> str:
        """Heading and unit."""
        return f"{self.heading} [{self.unit}]" if self.unit else self.heading

    def show(self, stored: float, digits: int = 5) -> str:
        """Return the value with its unit; rounding of zero is shown as 0, except for errors."""
        if abs(stored) < NONE_OF.get(self.unit, 0.0) and not is_error(self.name):
            stored = 0.0
        return with_unit(number(stored * self.factor, digits), self.unit)

    def at_speed(self, stored: float, speed: float | None) -> str:
        """Return the value at the scene's speed with its unit; empty for a quantity that is no derivative."""
        if speed is None or self.order == 0:
            return ""
        return with_unit(number(stored * self.speed_scale * abs(speed) ** self.order, 4), self.speed_unit)


def with_unit(text: str, unit: str) -> str:
    """Return ``45°`` but ``24.5 mm``, and ``3·10⁻⁷ °``, whose sign would be read as a digit of the power."""
    if not unit or text == "–":
        return text
    return text + unit if unit == "°" and "·10" not in text else f"{text}\u00a0{unit}"


@lru_cache(maxsize=4096)  # the page of a slider needs the same forty names at every step
def quantity(name: str, unit: str) -> ShownQuantity:
    """Return the display form of the column ``name``, stored in ``unit`` ("mm" or "length", "rad", "1" ...)."""
    unit = internal_unit(unit)
    if of := without_minus(name):  # a maximised output is shown itself
        shown = quantity(of, unit)
        return replace(shown, name=name, factor=-shown.factor, speed_scale=-shown.speed_scale)
    if is_error(name):
        shown = quantity(without_error(name), unit)
        return ShownQuantity(
            name, f"error of {shown.symbol}", f"error of the {shown.words}", shown.unit, abs(shown.factor)
        )
    if member := parts(name).member:
        shown = quantity(name.removeprefix(f"{member}."), unit)
        return replace(shown, name=name, symbol=f"{shown.symbol} {member}", words=f"{shown.words} of the {member}")
    reduction, base = next(split(name, Turn()), (None, name))
    symbol_form, words_form = (reduction.symbol, reduction.words) if reduction else ("{}", "{}")
    order, root, stage = _derivative(base)
    per = _PER_RADIAN.fullmatch(unit)
    followed = root in ("s", "psi", "dev")  # only the follower's own motion has a symbol and a word
    symbolic = followed and (order > 0 or root != "dev")
    symbol, words = _called(order, root, stage)
    symbol, words = symbol_form.format(symbol), words_form.format(words)
    if per:  # a derivative by its unit
        unit, order = per[1], max(order, int(per[2] or 1))
    length = unit in LENGTHS
    order = order if length or unit in ("1", "rad") else 0  # a force called ds is no derivative
    if is_place(name) or (order == 0 and unit in ("rad", "angle")):
        return ShownQuantity(name, symbol, words, "°", math.degrees(1.0), symbolic)
    if order == 0:
        kind = {"s": "life", "rad/s": "speed"}.get(unit, "")  # if the name contains the kind
        read, factor = READ_IN.get(kind if kind and kind in name else unit, (_pretty_unit(unit), 1.0))
        return ShownQuantity(name, symbol, words, read, factor, symbolic)
    return ShownQuantity(
        name,
        symbol,
        words,
        f"{unit if length else 'rad'}/rad{POWERS[order]}",
        1.0,
        symbolic,
        order,
        f"{'m' if length else 'rad'}/s{POWERS[order]}",
        1e-3 * unit_factor(unit, "mm") if length else 1.0,
    )


SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def _called(order: int, root: str, stage: str) -> tuple[str, str]:
    """Return symbol and words of a quantity or its derivative."""
    at = ""
    if size := _SIZE.fullmatch(root):
        root, order = f"{size[1]} of {size[2].upper()}", 0
    elif point := _POINT.fullmatch(root):
        root, at = point[1], f" of {point[2].upper()}"
    elif point := _OF_MACHINE.fullmatch(root):
        root, at = point[2], f" of {point[1].upper() if len(point[1]) == 1 else point[1]}"
    symbol = SYMBOLS.get(root, root.replace("_", " ")) + PRIMES[order] + at + stage.translate(SUBSCRIPTS)
    symbol, root = symbol.replace("phi ", "φ "), root + at
    words = POSITIONS.get(root, root.replace("_", " ")) if order == 0 else DERIVATIVES[order]
    words += "" if not order or root in ("s", "psi") else " across the line" if root == "dev" else f" of {root}"
    return symbol, words + (f" of stage {stage}" if stage else "")


def _derivative(base: str) -> tuple[int, str, str]:
    """Return order, quantity and stage number of a name such as ``d2psi1``."""
    _, root, stage = parts(base)
    if size := _SIZE.fullmatch(root):
        return ("speed", "acceleration", "jerk").index(size[1]) + 1, root, stage
    match = re.fullmatch(r"(d[23]?)?(s|psi|dev|chi|rho|alpha|P|S|y|[xyz]_[a-z]|(?:[a-z]|tip|point)_[xyz])", root)
    if match:
        mark, root = match.groups()
        return (0 if mark is None else int(mark[1:] or 1)), root, stage
    return (0, f"{root}{stage}", "") if root.endswith("_") else (0, root, stage)  # a number in a name: sews_at_7000


def _pretty_unit(unit: str) -> str:
    if unit in ("1", "", "ratio", "sign", "none", "count"):
        return ""
    return re.sub(r"\^(\d)", lambda m: POWERS[int(m[1])], unit).replace("*", "\u00b7")


def number(value: float, digits: int = 5) -> str:
    """Format a number for a table: significant digits, no trailing zeros, powers of ten written out."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞" if value > 0.0 else "−∞"
    if value == 0.0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        text = f"{value:.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        power = str(int(exponent)).replace("-", "−").translate(SUPERSCRIPTS)
        text = f"{mantissa}·10{power}"
    return text.replace("-", "−")


SUPERSCRIPTS = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


SIGNED = re.compile(r"(max|min)_(?!abs_)")


def change(shown: ShownQuantity, new: float, old: float) -> str:
    """Compare a value with another: sizes in percent, angles and values of changing sign by their difference."""
    signed = bool(SIGNED.match(shown.name)) and min(new, old) < 0.0
    if shown.unit != "°" and not signed:
        return percent_change(new, old)
    difference = new - old if signed else abs(new) - abs(old)
    if not math.isfinite(difference):
        return ""
    if abs(difference) <= max(1e-9 * max(abs(new), abs(old)), NO_ANGLE if shown.unit == "°" else 0.0):
        return "the same"
    return f"{shown.show(abs(difference), 3)} {'less' if difference < 0.0 else 'more'}"


def percent_change(new: float, old: float) -> str:
    """Return ``14.2 % less`` or ``3.1 % more`` for a magnitude compared with the old one."""
    if not (math.isfinite(new) and math.isfinite(old)) or old == 0.0:
        return ""
    change = 100.0 * (abs(new) / abs(old) - 1.0)
    if abs(change) < 0.005:
        return "the same"
    return f"{number(abs(change), 3)}\u00a0% {'less' if change < 0.0 else 'more'}"


def rpm(speed: float | None) -> str:
    """Return a speed in revolutions per minute, as text."""
    return "" if speed is None else f"{number(speed * 30.0 / math.pi, 5)} rpm"
