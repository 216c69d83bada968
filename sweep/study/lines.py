"""Where each key of a TOML text stands, which its parser does not say: for messages that an editor can jump to."""

from __future__ import annotations

import re

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRINGS = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL)
_SCALAR = re.compile(r"[^,\]}\n#]*")


def key_lines(text: str) -> dict[str, int]:
    r"""Return the line, from 1, of every key and heading by its path as messages spell it:
    ``design.b``, ``scene.want[2]``.

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
