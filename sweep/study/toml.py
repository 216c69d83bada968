"""The text of a study file as tables, and the line of each key; what is no TOML is refused with its line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from sweep.errors import StudyError

DEEPEST = 16  # tables within tables; a study needs four
_DIGITS = re.compile(r"\d[\d_]{4000,}")
_PLACE = re.compile(r"\(at line (\d+), column \d+[^)]*\)")
_KEY = re.compile(r"""\s*([\w."'-]+)\s*=""")
_TABLE = re.compile(r"\s*\[+([^\[\]]+)\]+\s*(?:#.*)?")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LONG, _SHORT = r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}', r'"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\''
_STRINGS = re.compile(f"{_LONG}|{_SHORT}", re.DOTALL)
_SCALAR = re.compile(r"[^,\]}\n#]*")
_OPENED = re.compile(f"#[^\n]*|{_LONG}|(?P<three>[\"']{{3}})|{_SHORT}|(?P<one>[\"'])", re.DOTALL)
# What tomllib says of a text that has no end.
_QUOTED = 'a text between quotes, as name = "press", over several lines between three of them'
_NO_END = ("Illegal character '\\n'", "Found invalid character '\\n'", "Unterminated string", "Expected \"'")
# What tomllib says where a key or a table comes a second time.
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
        raise _fault(file, _said(text, str(error))) from None
    except ValueError:  # Python refuses to read an integer of thousands of digits
        found = _DIGITS.search(text)
        line = text.count("\n", 0, found.start() if found else 0) + 1
        raise _fault(file, f"line {line}: a number of thousands of digits; allowed: numbers up to 1e100") from None
    except RecursionError:
        raise _fault(file, f"tables or lists within each other too often; allowed: {DEEPEST} levels") from None
    key = _too_deep(data)
    if key is not None:
        raise _fault(file, f"{key}: tables or lists within each other too often; allowed: {DEEPEST} levels")
    return data


def toml_text(file: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    StudyError
        if it cannot be read, or is no UTF-8.
    """
    try:
        return file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise _fault(file, f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise _fault(file, f"line {line} is no UTF-8 text") from None
    except ValueError as error:  # a path with a null byte
        raise _fault(file, f"cannot be read: {error}") from None


def _fault(file: Path, text: str) -> StudyError:
    return StudyError(str(file), [f"{file.name}: {text}"])


def _said(text: str, message: str) -> str:
    """Repeat what tomllib says; for a key that stands twice, add the line of the first one."""
    line, column = text.count("\n") + 1, len(text) - text.rfind("\n")
    message = message.replace("at end of document", f"at line {line}, column {column}, the end of the file")
    place = _PLACE.search(message)
    if place is not None and message.startswith(_NO_END):
        opened = next((found.start() for found in _OPENED.finditer(text) if found.lastgroup), None)
        line = int(place[1]) if opened is None else text.count("\n", 0, opened) + 1
        return f"line {line}: a text without its closing quote; allowed: {_QUOTED}"
    if place is None or not message.startswith(_TWICE):
        return message
    lines = text.splitlines()[: int(place[1])]
    table = _TABLE.fullmatch(lines[-1]) if lines else None
    if table is not None:
        earlier = _earlier(lines[:-1], lambda above, own: own is not None and own[1].strip() == table[1].strip())
        return f"the table [{table[1].strip()}] stands twice {place[0]}{earlier}"
    number = next((k for k in range(len(lines), 0, -1) if _KEY.match(lines[k - 1])), None)
    if number is None or message.startswith("Duplicate inline"):
        return message
    key, here = _name(lines[number - 1]), _heading(lines[:number])
    earlier = _earlier(lines[: number - 1], lambda above, own: _name(above[-1]) == key and _heading(above) == here)
    return f"{f'{here}.' if here else ''}{key} is given twice {place[0]}{earlier}"


def _earlier(lines: list[str], is_it: Any) -> str:
    for k in range(1, len(lines) + 1):
        if is_it(lines[:k], _TABLE.fullmatch(lines[k - 1])):
            return f", first in line {k}"
    return ""


def _name(line: str) -> str | None:
    found = _KEY.match(line)
    return None if found is None else found[1].strip("\"'")


def _heading(lines: list[str]) -> str:
    """Return the table that the last line stands in."""
    found = [match[1].strip() for match in map(_TABLE.fullmatch, lines) if match is not None]
    return found[-1] if found else ""


def _too_deep(data: dict[str, Any]) -> str | None:
    """Return the first key under which tables and lists are nested too deeply."""
    for key, value in data.items():
        level = [value]
        for _ in range(DEEPEST):
            level = [
                inner
                for outer in level
                if isinstance(outer, (dict, list))
                for inner in (outer.values() if isinstance(outer, dict) else outer)
                if isinstance(inner, (dict, list))
            ]
        if level:
            return key
    return None


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
    """One pass over the text; it leans on the parser for what is wrong and looks for keys alone."""

    def __init__(self, text: str) -> None:
        self.text, self.at, self.line, self.counted = text, 0, 1, 0
        self.found: dict[str, int] = {}
        self.lengths: dict[str, int] = {}  # of lists of tables [[x]]
        heading = ""
        while self._blank():
            if text[self.at] != "[":
                self._entry(heading)
                continue
            double = text.startswith("[[", self.at)
            line = self._here()
            self.at += 2 if double else 1
            names = self._names()
            self.at += 2 if double else 1
            heading = self._heading(names, double, line)

    def _blank(self) -> bool:
        match = _BLANK.match(self.text, self.at)
        assert match is not None  # it matches nothing too
        self.at = match.end()
        return self.at < len(self.text)

    def _here(self) -> int:
        self.line += self.text.count("\n", self.counted, self.at)
        self.counted = self.at
        return self.line

    def _heading(self, names: list[str], double: bool, line: int) -> str:
        path = ""
        for k, name in enumerate(names):
            path = _join(path, name)
            if double and k == len(names) - 1:
                self.lengths[path] = self.lengths.get(path, 0) + 1
            self.found.setdefault(path, line)
            if path in self.lengths:
                path = f"{path}[{self.lengths[path] - 1}]"
                self.found.setdefault(path, line)
        return path

    def _entry(self, path: str) -> None:
        """Print an entry as ``a.b = value``."""
        line = self._here()
        for name in self._names():
            path = _join(path, name)
            self.found.setdefault(path, line)
        self.at += 1  # the equals sign
        self._value(path)

    def _names(self) -> list[str]:
        names = []
        while True:
            self._blank()
            quoted = self.text[self.at] in "\"'"
            match = (_STRINGS if quoted else _BARE).match(self.text, self.at)
            assert match is not None  # the parser has accepted the key
            self.at = match.end()
            names.append(match[0][1:-1] if quoted else match[0])
            self._blank()
            if self.text[self.at] != ".":
                return names
            self.at += 1

    def _value(self, path: str) -> None:
        self._blank()
        opening = self.text[self.at]
        if opening not in "[{":
            match = (_STRINGS if opening in "\"'" else _SCALAR).match(self.text, self.at)
            assert match is not None  # the parser has accepted the value
            self.at = match.end()
            return
        self.at += 1
        k = 0
        while self._blank() and self.text[self.at] not in "]}":
            if opening == "{":
                self._entry(path)
            else:
                self.found[f"{path}[{k}]"] = self._here()
                self._value(f"{path}[{k}]")
                k += 1
            self._blank()
            if self.text[self.at] == ",":
                self.at += 1
        self.at += 1


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
