"""TOML of study files: parsing into tables, line numbers of keys, and writing text that reads back the same."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sweep.errors import StudyError
from sweep.families.base import Family, Parameter
from sweep.quantities.units import factor, internal_unit

DEEPEST = 16  # levels of nested tables; a study needs four
_DIGITS = re.compile(r"\d[\d_]{4000,}")
_PLACE = re.compile(r"\(at line (\d+), column \d+[^)]*\)")
_LINE = re.compile(r"\bline (\d+)")
_KEY = re.compile(r"""\s*([\w."'-]+)\s*=""")
_TABLE = re.compile(r"\s*\[+([^\[\]]+)\]+\s*(?:#.*)?")
_LONG, _SHORT = r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}', r'"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\''
_TOKEN = re.compile(
    rf"#[^\n]*|(?P<text>{_LONG}|{_SHORT})|(?P<mark>[\[\]{{}}=,.\n])|(?P<bare>[^\s#\[\]{{}}=,.\"']+)", re.DOTALL
)
_OPENED = re.compile(f"#[^\n]*|{_LONG}|(?P<three>[\"']{{3}})|{_SHORT}|(?P<one>[\"'])", re.DOTALL)
# Messages of tomllib for an unterminated text.
_QUOTED = 'a text between quotes, as name = "press", over several lines between three of them'
_NO_END = ("Illegal character '\\n'", "Found invalid character '\\n'", "Unterminated string", "Expected \"'")
# Messages of tomllib for words without quotes, and for a unit behind a bare number.
_BARE_WORDS = ("Invalid value", "Expected newline or end of document after a statement")
_BARE = 'a text, and a number with its unit, stands between quotes, as in b = "3 mm"'
# Messages of tomllib for an inline table over several lines, or with a comma at its end.
_BRACES = ("Invalid initial character for a key part", "Unclosed inline table")
_ONE_LINE = "a table between braces stands in one line and has no comma at its end"
# Messages of tomllib for a key or a table that occurs twice.
_TWICE = ("Cannot overwrite", "Cannot declare", "Duplicate inline")


def read_toml(file: Path) -> dict[str, Any]:
    """Return the tables of a file.

    Raises
    ------
    StudyError
        if it cannot be read, is no TOML, or is nested too deeply.
    """
    text = toml_text(file)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _fault(file, _clearer(text, str(error))) from None
    except ValueError:  # Python refuses to read an integer of thousands of digits
        match = _DIGITS.search(text)
        line = text.count("\n", 0, match.start() if match else 0) + 1
        raise _fault(file, f"line {line}: a number of thousands of digits; allowed: numbers up to 1e100") from None
    except RecursionError:
        raise _fault(file, f"tables or lists within each other too often; allowed: {DEEPEST} levels") from None
    for key, value in data.items():
        if _is_deeper(value, DEEPEST):
            raise _fault(file, f"{key}: tables or lists within each other too often; allowed: {DEEPEST} levels")
    return data


def toml_text(file: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises
    ------
    StudyError
        if it cannot be read, or is no UTF-8.
    """
    try:
        return file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        remedy = "; a study is a study.toml, or the folder that holds one" if file.name == "study.toml" else ""
        raise _fault(file, f"cannot be read: {error.strerror}{remedy}") from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise _fault(file, f"line {line} is no UTF-8 text") from None
    except ValueError as error:  # a path with a null byte
        raise _fault(file, f"cannot be read: {error}") from None


def _fault(file: Path, text: str) -> StudyError:
    line = _LINE.search(text)
    place = f"{file}:{line[1]}" if line else str(file)
    return StudyError(str(file), [f"{place}: {re.sub('^line [0-9]+: ', '', text)}"])


def _clearer(text: str, message: str) -> str:
    """Return tomllib's message in clearer words; for a duplicate key with the line of the first one."""
    line, column = text.count("\n") + 1, len(text) - text.rfind("\n")
    message = message.replace("at end of document", f"at line {line}, column {column}, the end of the file")
    place = _PLACE.search(message)
    if place is not None and message.startswith(_NO_END):
        opened = next((match.start() for match in _OPENED.finditer(text) if match.lastgroup), None)
        line = int(place[1]) if opened is None else text.count("\n", 0, opened) + 1
        return f"line {line}: a text without its closing quote; allowed: {_QUOTED}"
    if place is not None and message.startswith(_BARE_WORDS):
        written = f"{text}\n".splitlines()[int(place[1]) - 1].partition("=")[2]
        word = next(iter(written.split()), "")
        return f"{message}; {'true and false have small letters' if word in ('True', 'False') else _BARE}"
    if message.startswith(_BRACES):
        return f"{message}; {_ONE_LINE}"
    if place is None or not message.startswith(_TWICE):
        return message
    lines = text.splitlines()[: int(place[1])]
    if lines and _TABLE.fullmatch(lines[-1]) is not None:
        title = _heading(lines)
        first = _first(k for k in range(1, len(lines)) if _heading(lines[k - 1 : k]) == title)
        return f"the table [{title}] stands twice {place[0]}{first}"
    number = next((k for k in range(len(lines), 0, -1) if _KEY.match(lines[k - 1])), None)
    if number is None or message.startswith("Duplicate inline"):
        return message
    key, here = _name(lines[number - 1]), _heading(lines[:number])
    first = _first(k for k in range(1, number) if _name(lines[k - 1]) == key and _heading(lines[:k]) == here)
    return f"{f'{here}.' if here else ''}{key} is given twice {place[0]}{first}"


def _first(numbers: Iterable[int]) -> str:
    """Name the first of the lines, if there is one."""
    return next((f", first in line {number}" for number in numbers), "")


def _name(line: str) -> str | None:
    match = _KEY.match(line)
    return None if match is None else match[1].strip("\"'")


def _heading(lines: list[str]) -> str:
    """Return the heading of the table that holds the last line."""
    headings = [match[1].strip() for match in map(_TABLE.fullmatch, lines) if match is not None]
    return headings[-1] if headings else ""


def _is_deeper(value: object, levels: int) -> bool:
    """Tell whether tables and lists are nested in more levels than these."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return inner is not None and (levels == 0 or any(_is_deeper(one, levels - 1) for one in inner))


def key_lines(text: str) -> dict[str, int]:
    r"""Find the line, from 1, of every key and heading by its path as messages spell it, as ``scene.want[2]``.

    Parameters
    ----------
    text : TOML that its parser has accepted

    Examples
    --------
    >>> key_lines('[design]\nb = "40 mm"\ne = { values = [1, 2] }')["design.e.values[1]"]
    3
    """
    return _Walk(text).found


class _Walk:
    """One pass over the tokens of valid TOML that records the line of every key."""

    def __init__(self, text: str) -> None:
        self.tokens, line = [("", "", 0)], 1
        for match in _TOKEN.finditer(text):
            self.tokens += [(match.lastgroup, match[0], line)] if match.lastgroup else []
            line += match[0].count("\n")
        self.tokens = self.tokens[:0:-1]  # reversed: the next token is popped from the end
        self.found: dict[str, int] = {}
        lengths, heading = Counter[str](), ""  # of arrays of tables [[x]]
        while self._next() is not None:
            if self._next() != "[":
                self._entry(heading)
                continue
            line, double, heading = self._take()[2], self._next() == "[", ""
            names = self._names(skip=double)
            for k, name in enumerate(names):
                heading = _join(heading, name)
                lengths[heading] += double and k == len(names) - 1
                self.found.setdefault(heading, line)
                if lengths[heading]:
                    heading = f"{heading}[{lengths[heading] - 1}]"
                    self.found.setdefault(heading, line)
            del self.tokens[-1 - double :]

    def _take(self) -> tuple[str, str, int]:
        return self.tokens.pop()

    def _next(self) -> str | None:
        """Skip line ends and return the next token, or None at the end."""
        while self.tokens and self.tokens[-1][1] == "\n":
            self._take()
        return self.tokens[-1][1] if self.tokens else None

    def _names(self, skip: bool = False) -> list[str]:
        if skip:
            self._take()
        names = []
        while True:
            kind, word, _ = self._take()
            names.append(word[1:-1] if kind == "text" else word)
            if self._next() != ".":
                return names
            self._take()

    def _entry(self, path: str) -> None:
        """Record the keys of ``a.b = value``."""
        line = self.tokens[-1][2]
        for name in self._names():
            path = _join(path, name)
            self.found.setdefault(path, line)
        self._take()  # the equals sign
        self._value(path)

    def _value(self, path: str) -> None:
        opening, k = self._take()[1], 0
        if opening not in ("[", "{"):  # a number may hold a dot, a date a blank
            while self.tokens and self.tokens[-1][1] not in (",", "]", "}", "\n"):
                self._take()
            return
        while self._next() not in ("]", "}"):
            if opening == "{":
                self._entry(path)
            else:
                self.found[f"{path}[{k}]"] = self.tokens[-1][2]
                self._value(f"{path}[{k}]")
                k += 1
            if self._next() == ",":
                self._take()
        self._take()


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


BARE = re.compile(r"[A-Za-z0-9_-]+")
SHORT = 4  # entries of a table that are written in one line
EXACT = 17  # digits that determine every float64


def toml(data: Mapping[str, Any]) -> str:
    """Return the tables of a study as TOML."""
    return "\n".join(_table((name,), entries) for name, entries in data.items())


def _table(path: tuple[str, ...], entries: Mapping[str, Any]) -> str:
    inline = {name: entry for name, entry in entries.items() if not (isinstance(entry, dict) and len(entry) > SHORT)}
    head = [f"[{'.'.join(map(_key, path))}]"] if inline or not entries else []
    lines = [*head, *(f"{_key(name)} = {_value(entry)}" for name, entry in inline.items())]
    inner = [_table((*path, name), entry) for name, entry in entries.items() if name not in inline]
    return "\n".join([*(["\n".join(lines) + "\n"] if lines else []), *inner])


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _value(entry: object) -> str:
    if isinstance(entry, Mapping):
        return f"{{ {', '.join(f'{_key(name)} = {_value(inner)}' for name, inner in entry.items())} }}"
    if isinstance(entry, list | tuple):
        return f"[{', '.join(map(_value, entry))}]"
    if isinstance(entry, str | bool):
        return json.dumps(entry, ensure_ascii=False)
    return repr(entry)


def design_entries(family: Family, design: Mapping[str, float]) -> dict[str, str | float]:
    """Return a design as entries of a study file: texts with units; signs and ratios as numbers."""
    return {p.name: written(p, design[p.name]) for p in family.parameters if p.name in design}


def written(p: Parameter, value: float) -> str | float:
    """Return a value in mm, degrees ... with the fewest digits, at least six, that read back as the same number."""
    internal = internal_unit(p.unit)
    if internal == "1":
        return int(value) if p.choices is not None else value
    unit = "deg" if internal == "rad" else internal
    scale = factor(unit, internal)
    texts = (f"{value / scale:.{digits}g}" for digits in range(6, EXACT + 1))
    shortest = next((text for text in texts if float(text) * scale == value), None)
    return f"{value!r} {internal}" if shortest is None else f"{shortest} {unit}"
