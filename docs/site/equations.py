"""Sets the equations of the pages as MathML, which browsers show without a script and without network.

Pages write equations as a designer types them, `psi' = -(X' C - Y' S)/T`, with the names that the code has, in indented
blocks whose lines may end with a number.  That stays readable where nothing renders it.  A block in which something is
not understood stays as it is.
"""

from __future__ import annotations

import re
from html import escape
from typing import NamedTuple

LABEL = re.compile(r"^(.*?\S)\s{2,}\((\d+\s?[a-z]?\*?|[A-Z]\*)\)$|^(.*?\S)\s\((\d+\s?[a-z]?\*?)\)$")
TOKEN = re.compile(
    r"""\s*(?:
      (?P<code>`[^`]*`|docs/[\w-]+\.md)
    | (?P<index>_\w+)                            # of brackets: (rocker pin)_x
    | (?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)
    | (?P<name>[A-Za-z](?:\w
          | (?<=\d),(?=\d)                       # xi_1,2
          | (?<=[a-z]{3})'(?=s\b)                # rack's
          | (?<=[a-z]{3})-(?=[a-z]{3})           # mid-stroke
      )*)
    | (?P<prime>'+)
    | (?P<op>\.\.\.|<=|>=|:=|\+-|[-+=<>.,;:|/^(){}\[\]*])
    )""",
    re.VERBOSE,
)
GREEK = {
    "alpha": "α", "beta": "β", "bet": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "eps": "ε", "theta": "θ",
    "phi": "φ", "psi": "ψ", "chi": "χ", "rho": "ρ", "mu": "μ", "nu": "ν", "lam": "λ", "tau": "τ", "kappa": "κ",
    "xi": "ξ", "eta": "η", "omega": "ω", "sigma": "σ", "pi": "π", "Delta": "Δ",
}  # fmt: skip
FUNCTIONS = {"sin", "cos", "tan", "asin", "atan", "atan2", "arctan", "hypot", "exp", "arg", "max", "min", "cot", "Rot",
             "Im", "sign", "sqrt", "sum"}  # fmt: skip
SHORT_WORDS = {"an", "be", "up", "of", "to", "is", "at", "by", "or", "in", "it", "if", "no", "as", "so", "on"}
SIGNS = {"-": "−", "<=": "≤", ">=": "≥", "+-": "±", ":=": ":=", "...": "…", ".": "·", "*": "∗"}
PRIMES = ("", "′", "″", "‴", "⁗")
CLOSING = {"(": ")", "[": "]", "{": "}"}
BAR = '<mo stretchy="false" lspace="0" rspace="0">|</mo>'
SPACE = '<mspace width="0.2em"/>'


class NotUnderstood(Exception):
    """The block is left as it is."""


class Token(NamedTuple):
    """A piece of a line; ``spaced`` where a blank stands before it."""

    kind: str
    text: str
    spaced: bool


def typeset(markdown: str) -> str:
    """Return a page with its indented blocks of equations set; all other blocks as they were."""
    lines, done, block, fenced = markdown.split("\n"), [], [], False
    for line in [*lines, ""]:
        fenced ^= line.startswith("```")
        if not fenced and line.startswith("    ") and (block or not done or not done[-1].strip()):
            block.append(line[4:])
            continue
        if block:
            done += _block(block)
            block = []
        done.append(line)
    return "\n".join(done[:-1])


def _block(block: list[str]) -> list[str]:
    """Return the lines that stand for a block."""
    as_it_was = [f"    {line}" for line in block]
    text = "\n".join(block)
    labelled = any(LABEL.match(line) for line in block)
    if not labelled and (
        not re.search(" (=|<=) ", text) or re.search(r'["#%]|\bimport\b|\b[a-z]+\.[a-z]{3,}|\w=\w', text)
    ):
        return as_it_was
    try:
        rows = [_row(line) for line in block if line.strip()]
    except NotUnderstood:
        return as_it_was
    return ['<div class="equations" markdown="0">', *rows, "</div>"]


def _row(line: str) -> str:
    """Return a line: what it says, and its number."""
    found = LABEL.match(line)
    said, label = (line, "") if found is None else (found[1] or found[3], found[2] or found[4])
    indent = (len(said) - len(said.lstrip())) * 0.45
    pieces = [f'<math displaystyle="true">{expression(piece)}</math>' for piece in _pieces(said.strip())]
    style = f' style="padding-left: {indent:.2f}em"' if indent else ""
    number = f'<span class="number">({escape(label)})</span>' if label else ""
    return f'<div class="equation"><span class="said"{style}>{" ".join(pieces)}</span>{number}</div>'


def _hyphened(text: str) -> bool:
    """Return whether a name with a hyphen is one word, not a difference."""
    return all(part not in GREEK and part not in FUNCTIONS and part.isalpha() for part in text.split("-"))


def _pieces(text: str) -> list[str]:
    """Return what stands apart by more than one blank, outside of brackets."""
    pieces = [""]
    for part in re.split(r"(\s{2,})", text):
        inside = sum(map(pieces[-1].count, "([{")) > sum(map(pieces[-1].count, ")]}"))
        if not part.isspace():
            pieces[-1] += part
        elif inside or not pieces[-1] or pieces[-1].endswith("="):
            pieces[-1] += " "
        else:
            pieces.append("")
    joined = pieces[:1]
    for piece in pieces[1:]:  # signs under each other are no reason for a gap
        if piece.startswith(("=", "<=")):
            joined[-1] += f" {piece}"
        else:
            joined.append(piece)
    return joined


def expression(text: str) -> str:
    """Return the MathML of a piece of a line."""
    tokens, at = [], 0
    while at < len(text.rstrip()):
        found = TOKEN.match(text, at)
        if found is None:
            raise NotUnderstood(text[at:])
        kind = str(found.lastgroup)
        text_here = found[kind]
        if kind == "name" and not _hyphened(text_here):
            text_here = text_here.split("-")[0]
        tokens.append(Token(kind, text_here, found.start(kind) > at))
        at = found.start(kind) + len(text_here)
    reader = _Reader(tokens)
    made = reader.terms("")
    if reader.at < len(tokens):
        raise NotUnderstood(text)
    return f"<mrow>{made}</mrow>"


class _Reader:
    """Reads tokens from left to right: terms are factors and signs, a factor may have powers, primes, a divisor."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.at = 0

    def peek(self, ahead: int = 0) -> Token:
        k = self.at + ahead
        return self.tokens[k] if 0 <= k < len(self.tokens) else Token("end", "", False)

    def terms(self, end: str) -> str:
        """Return all up to ``end``, which is taken too; up to the end of the line where it is empty."""
        made: list[str] = []
        product = False  # the last thing was a factor
        while True:
            token = self.peek()
            if token.kind == "end":
                if end:
                    raise NotUnderstood(f"no {end}")
                return "".join(made)
            if end and token.text == end:
                self.at += 1
                return "".join(made)
            if token.kind == "op" and token.text not in ("(", "[", "{", "|"):
                if token.text in "/^)]}":
                    raise NotUnderstood(token.text)
                made.append(self.sign(product))
                product = False
            elif product and token.text == "x" and self.crosses():
                self.at += 1
                made.append("<mo>×</mo>")
                product = False
            else:
                made.append(SPACE if product and token.spaced else "")
                made.append(self.factor())
                product = True

    def sign(self, binary: bool) -> str:
        """Return an operator; between words a comma, colon or full stop is punctuation."""
        text = self.peek().text
        self.at += 1
        if text in ",;:":
            return f'<mo separator="true" lspace="0" rspace="0.35em">{text}</mo>'
        form = "" if binary or text in "=<>" else ' form="prefix"'
        return f"<mo{form}>{escape(SIGNS.get(text, text))}</mo>"

    def crosses(self) -> bool:
        """Return whether x stands between two factors: a vector product."""
        after = self.peek(1)
        return after.spaced and (after.text in ("(", "[", "|") or (after.kind == "name" and not self.word(1)))

    def factor(self) -> str:
        """Return an atom with what stands after it; a fraction where it is divided by another."""
        made, bare = self.powered()
        while self.peek().text == "/":
            self.at += 1
            if self.peek().kind == "end":
                raise NotUnderstood("/")
            below, bare_below = self.powered()
            made = f"<mfrac><mrow>{bare or made}</mrow><mrow>{bare_below or below}</mrow></mfrac>"
            bare = ""
        return made

    def powered(self) -> tuple[str, str]:
        """Return an atom with primes and powers; without its brackets, where they alone enclose it."""
        made, bare = self.atom()
        if self.peek().kind == "index":
            made = f'<msub><mrow>{made}</mrow><mi mathvariant="normal">{self.peek().text[1:]}</mi></msub>'
            self.at += 1
        if self.peek().kind == "prime" and not self.peek().spaced:
            made += f'<mo lspace="0" rspace="0">{PRIMES[len(self.peek().text)]}</mo>'
            bare = ""
            self.at += 1
        if self.peek().text != "^":
            return made, bare
        self.at += 1
        return f"<msup><mrow>{made}</mrow><mrow>{self.exponent()}</mrow></msup>", ""

    def exponent(self) -> str:
        if self.peek().text == "-":
            self.at += 1
            return f'<mo form="prefix">−</mo>{self.atom()[0]}'
        made, bare = self.atom()
        return bare or made

    def atom(self) -> tuple[str, str]:
        """Return a number, name, word, function with its argument, or brackets; second the inside of brackets."""
        token = self.peek()
        self.at += 1
        if token.kind == "number":
            return f"<mn>{token.text}</mn>", ""
        if token.kind == "code":
            shown = escape(token.text.strip("`"))
            return f'<mtext class="code">{shown}</mtext>', ""
        if token.text == "|":
            inside = self.terms("|")
            return f"{BAR}<mrow>{inside}</mrow>{BAR}", ""
        if token.text in CLOSING:
            inside = self.terms(CLOSING[token.text])
            shown = (
                inside
                if token.text == "{"
                else f"<mrow><mo>{token.text}</mo>{inside}<mo>{CLOSING[token.text]}</mo></mrow>"
            )
            return shown, inside
        if token.kind != "name":
            raise NotUnderstood(token.text)
        self.at -= 1
        if self.word(0):
            return self.words(), ""
        self.at += 1
        return self.applied(token.text) if token.text in FUNCTIONS else (name(token.text), "")

    def applied(self, function: str) -> tuple[str, str]:
        """Return a function with its power and its argument: in brackets, or the next factor."""
        if function == "sqrt" and self.peek().text in ("(", "["):
            return f"<msqrt><mrow>{self.atom()[1]}</mrow></msqrt>", ""
        if function == "sum":  # of all that follows, its divisor too
            return "<mo>∑</mo>", ""
        head = f"<mi>{function}</mi>"
        if self.peek().text == "^":
            self.at += 1
            head = f"<msup>{head}<mrow>{self.exponent()}</mrow></msup>"
        after = self.peek()
        if after.text in ("(", "["):
            return head + self.atom()[0], ""
        if after.kind in ("name", "number") or after.text == "|":
            return head + SPACE + self.powered()[0], ""
        return head, ""

    def word(self, ahead: int) -> bool:
        """Return whether a name is a word of a sentence."""
        token = self.peek(ahead)
        if token.kind != "name":
            return False
        text = token.text
        plain = text.replace("'", "").replace("-", "").isalpha() and text not in FUNCTIONS and text not in GREEK
        if plain and len(text) == 1:
            return text in "aA" and self.longer(ahead + 1) and (self.at + ahead == 0 or self.longer(ahead - 1))
        return text in SHORT_WORDS or (plain and len(text) > 2 and not _greeks(text))

    def longer(self, ahead: int) -> bool:
        token = self.peek(ahead)
        text = token.text
        return token.kind == "name" and text.isalpha() and len(text) > 1 and text not in GREEK and text not in FUNCTIONS

    def words(self) -> str:
        """Return words that follow each other."""
        found = []
        while self.word(0) and (not found or (self.peek().spaced and self.peek(1).text not in ("/", "^"))):
            found.append(self.peek().text)
            self.at += 1
        return f"<mtext>{' '.join(found)}</mtext>"


def name(text: str) -> str:
    """Return a symbol with its index: psi_ext, phi0, G_phipsi, X1."""
    head, _, index = text.partition("_")
    digits = re.fullmatch(r"([A-Za-z]+?)([\d,]+)", head)
    if digits:
        head, index = digits[1], f"{digits[2]}{',' if index else ''}{index}"
    symbol = GREEK.get(head, head)
    if "_" in index or (index and len(symbol) > 2):  # a column's name, not a symbol
        return f"<mtext>{escape(text)}</mtext>"
    if not index:
        return f"<mi>{symbol}</mi>" if len(symbol) < 3 or symbol in FUNCTIONS else f"<mtext>{symbol}</mtext>"
    below = "".join(_greeks(index) or index)
    return f'<msub><mi>{symbol}</mi><mi mathvariant="normal">{escape(below)}</mi></msub>'


def _greeks(text: str) -> list[str]:
    """Return greek letters one after the other, as phipsi; none where it is something else."""
    found = []
    while text:
        first = next((key for key in sorted(GREEK, key=len, reverse=True) if text.startswith(key)), None)
        if first is None:
            return []
        found.append(GREEK[first])
        text = text.removeprefix(first)
    return found
