"""Exceptions of linksweep: every message names the quantity, its value, the allowed range and the place."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import Any

INFEASIBLE = 4  # exit code where no design keeps all limits, which is an answer and no error
LONGEST = 200  # characters of a value in a message
MOST_FAULTS = 30  # of a study file in its message
MOST_NAMES = 40  # in one list of a message
# What loaders, Python, zstd and the operating system say where no memory is left.
_FULL = ("failed to map segment", "can't start new thread", "not enough memory", "Cannot allocate memory")


class LinksweepError(Exception):
    """Base of all errors raised on purpose; ``exit_code`` is the exit code of the command line."""

    exit_code = 2

    def __reduce__(self) -> tuple[Any, ...]:
        # Python would call __init__ with the message, which takes other arguments in many of these classes.
        return _copied, (type(self), self.args, vars(self))


def _copied(kind: type[LinksweepError], message: tuple[object, ...], attributes: dict[str, Any]) -> LinksweepError:
    """Return an error that a worker process has raised."""
    error = kind.__new__(kind, *message)
    vars(error).update(attributes)
    return error


class InputError(LinksweepError, ValueError):
    """A table, a name or a number handed to the API is wrong.

    Parameters
    ----------
    name : the quantity, as the user wrote it
    value : what was found
    allowed : the allowed values, in words
    place : where the value stands (column and row, file and key)
    """

    def __init__(self, name: str, value: object, allowed: str, place: str) -> None:
        self.name, self.value, self.allowed, self.place = name, value, allowed, place
        super().__init__(f"{place}: {name} = {shown(value)}; allowed: {allowed}")


class MissingInput(InputError):
    """A required column, point or other input was not given.

    Parameters
    ----------
    name : what is missing
    needed : what it should be
    place : where it was expected
    """

    def __init__(self, name: str, needed: str, place: str) -> None:
        super().__init__(name, None, needed, place)
        self.args = (f"{place}: {name} is missing; needed: {needed}",)


def shown(value: object) -> str:
    """Return the repr of a value for a message, shortened if it is long."""
    try:
        text = repr(value)
    except ValueError:  # an int of thousands of digits, an object that cannot show itself
        return f"something of type {type(value).__name__} that cannot be printed"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."


def reason(error: OSError) -> str:
    """Say what the operating system refuses, and for which file, without the number of the error."""
    words = error.strerror or str(error)
    return f"{words} ({error.filename})" if error.filename else words


def is_memory_full(error: BaseException) -> bool:
    """Whether an error says that memory is full, also for a library to be loaded, a thread or a compressor."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _FULL)


def how_many(count: int, thing: str, ending: str = "s") -> str:
    """Write a count with its noun, ``1 chunk`` or ``3 chunks``; ``ending`` is that of the plural."""
    return f"{grouped(count)} {thing}{'' if count == 1 else ending}"


def grouped(count: float) -> str:
    """Write a count with its digits in groups of three from 10 000 on, and as a power of ten from 10^15 on."""
    return f"{int(count):,}".replace(",", " ") if 10_000 <= count < 1e15 else f"{count:.6g}"


class StudyError(LinksweepError, ValueError):
    """A study file has faults; all of them are reported at once, each with its place.

    Parameters
    ----------
    path : of the file
    faults : each with its place; the message holds the first of very many
    """

    def __init__(self, path: str, faults: Sequence[str]) -> None:
        self.path, self.faults = path, list(faults)
        count = len(self.faults)
        lines = [f"{path}: {how_many(count, 'fault')}", *(f"  {f}" for f in faults[:MOST_FAULTS])]
        more = [f"  and {count - MOST_FAULTS} more; mend these first"] if count > MOST_FAULTS else []
        super().__init__("\n".join([*lines, *more]))


class BudgetError(LinksweepError):
    """A study would cost more time or disk than its budget allows; it can be forced."""

    exit_code = 3


class StoreError(LinksweepError):
    """The dataset cannot be read or written: disk full, no permission, a damaged file."""

    exit_code = 74


class LockedError(LinksweepError):
    """Another run is writing to the same folder."""

    exit_code = 75


class WorkerDied(LinksweepError):
    """A worker process was killed (out of memory, a crash); finished chunks are kept."""

    exit_code = 70


class ProgramFault(LinksweepError):
    """An error in the program itself, not in its input, ended a chunk; finished chunks are kept.

    Parameters
    ----------
    message : place and kind of the error, and what to do
    trace : traceback of the worker; the command line prints it before the message
    """

    exit_code = 70

    def __init__(self, message: str, trace: str) -> None:
        self.trace = trace
        super().__init__(message)


class TimeUsedUp(LinksweepError):
    """The time that the study allows is over; finished chunks are kept and the next run continues."""

    exit_code = 124


class SearchCutShort(TimeUsedUp):
    """The time limit has stopped the optimiser or the front; the folder holds the results found until then.

    Parameters
    ----------
    folder : of the dataset
    message : what was searched
    """

    def __init__(self, folder: Path, message: str) -> None:
        self.folder = folder
        super().__init__(message)


class Interrupted(LinksweepError):
    """A signal stopped the run; finished chunks are kept and the next run continues with the missing ones."""

    def __init__(self, signal_number: int, message: str) -> None:
        self.signal_number = signal_number
        super().__init__(message)
        self.exit_code = 128 + signal_number


class LinksweepWarning(UserWarning):
    """Base of all warnings of linksweep; the command line prints them as one line."""


class IncompleteWarning(LinksweepWarning):
    """A dataset is read that lacks chunks: its run has not ended, or files are missing."""


class MeasuredRangeWarning(LinksweepWarning):
    """Published constants are used outside the range in which they were measured; the numbers extrapolate."""


_SPACE = re.compile("[ -]")

ALIKE = 0.65  # similarity by difflib, from 0 to 1, that a misspelling has

# Common words and our names for them; the first name that is known at that place is meant.
SYNONYMS = {
    "crank": ("a", "a1"),
    "coupler": ("b", "b1"),
    "rocker": ("c", "c1"),
    "frame": ("e", "e1"),
    "offset": ("e", "h", "s"),
    "eccentricity": ("e",),
    "assembly": ("branch", "branch1"),
    "assembly_mode": ("branch", "branch1"),
    "configuration": ("branch", "branch1"),
    "crank_rocker": ("rssr",),
    "spatial_crank_rocker": ("rssr",),
    "spatial_slider_crank": ("rssp",),
    "planar_crank_rocker": ("four_bar",),
    "box": ("box_x", "box_x1"),
    "velocity": ("dpsi", "ds"),
    "acceleration": ("d2psi", "d2s"),
    "jerk": ("d3psi", "d3s"),
    "max_velocity": ("max_abs_dpsi", "max_abs_ds"),
    "max_acceleration": ("max_abs_d2psi", "max_abs_d2s"),
    "max_jerk": ("max_abs_d3psi", "max_abs_d3s"),
    "transmission_angle": ("least_transmission_angle", "pressure_angle", "max_pressure_angle"),
    "min_transmission_angle": ("least_transmission_angle",),
    "quick_return_ratio": ("stroke_ratio",),
    "stroke": ("swing",),
    "torque": ("drive_torque", "max_abs_drive_torque"),
    "input_torque": ("drive_torque", "max_abs_drive_torque"),
    "max_torque": ("max_abs_drive_torque",),
    "max_input_torque": ("max_abs_drive_torque",),
    "coefficient_of_fluctuation": ("unevenness",),
    "rocker_angle": ("psi", "swing"),
    "theta4": ("psi",),
    "omega4": ("dpsi",),
    "alpha4": ("d2psi",),
    "displacement": ("s", "psi"),
    "grashof": ("rotatable",),
    "degree": ("deg",),
    "degrees": ("deg",),
    "°": ("deg",),
    "arcmin": ("deg",),
    "inch": ("in",),
    "inches": ("in",),
    "min": ("from",),
    "max": ("to",),
    "start": ("from",),
    "stop": ("to",),
    "from": ("min",),
    "to": ("max",),
    "step": ("count",),
    "num": ("count",),
}


def closest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word nearest to ``word``, or None if none is near."""
    choices = list(known)
    # Case first: E1 is as similar to f1 and g1 as to e1.
    matches = [k for k in choices if k.casefold() == word.casefold()]
    matches = matches or [name for name in SYNONYMS.get(_SPACE.sub("_", word.casefold()), ()) if name in choices]
    if not matches:
        alike = difflib.get_close_matches(word, choices, n=8, cutoff=0.5)
        if not alike and word != word.casefold():
            return closest(word.casefold(), choices)
        near = difflib.get_close_matches(word, alike, n=8, cutoff=ALIKE)
        # The first letter is rarely wrong: psy is psi, and not eps_y.
        matches = sorted((n for n in alike if n in near or _begins(word, n)), key=lambda name: name[:1] != word[:1])
    return matches[0] if matches else None


def _begins(word: str, name: str) -> bool:
    """Whether one word begins with the other, both longer than three letters."""
    return min(len(word), len(name)) > 3 and (name.startswith(word) or word.startswith(name))


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``", did you mean 'x'?"`` for the known word nearest to ``word``, or an empty string.

    A name without its member or stage, such as ``speed`` in a machine or ``a`` in a chain, means that of every one.
    """
    names, each = list(known), re.compile(f".*[.]{re.escape(word)}|{re.escape(word)}[1-9]")
    several, guess = [name for name in names if each.fullmatch(name)], closest(word, names)
    if len(several) > 1 or (several and not guess):
        return f", did you mean {listed(several)}?"
    return f", did you mean '{guess}'?" if guess else ""


def extra(name: str) -> str:
    """Say how to install an extra of this package, with pip and in a clone."""
    return f"pip install 'linksweep[{name}]', in a clone .venv/bin/pip install -e '.[{name}]'"


def listed(names: Iterable[str]) -> str:
    """Join names by commas; a long list is cut and ends with the number of omitted names."""
    every = list(names)
    more = f" and {len(every) - MOST_NAMES} more" if len(every) > MOST_NAMES else ""
    return ", ".join(every[:MOST_NAMES]) + more


def choices(word: str, known: Iterable[str]) -> str:
    """List the known names, and suggest the one nearest to ``word``."""
    names = list(known)
    return f"{listed(names)}{nearest(word, names)}"


def known_keys(table: Mapping[str, Any], keys: Sequence[str], place: str, words: str = "") -> None:
    """Raise for a key of a table that is not among ``keys``; ``words`` precede the known keys in the message."""
    for key in table:
        if key not in keys:
            raise InputError(key, table[key], f"{words}{choices(key, keys)}", place)


def number(name: str, value: Any, place: str, allowed: str = "a finite number") -> float:
    """Return a user's number as float; raise unless it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(name, value, allowed, place)
    return float(value)


def whole(name: str, value: Any, place: str, least: int, most: int | None = None) -> int:
    """Return a user's whole number; raise unless it lies between ``least`` and ``most``, which may be missing."""
    fits = isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least
    if not fits or (most is not None and int(value) > most):
        raise InputError(name, value, f"a whole number from {least}{'' if most is None else f' to {most}'}", place)
    return int(value)


def sign(name: str, value: Any, place: str, words: str) -> int:
    """Return a user's sign; ``words`` say in the message what 1 and -1 mean."""
    if value not in (1, -1) or isinstance(value, bool):
        raise InputError(name, value, f"1 or -1: {words}", place)
    return int(value)
