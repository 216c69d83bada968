"""Study files with errors of a hurried author, a broken editor or an attacker: seeded mutations of sound ones."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from sweep.families import NAMES as NAMES_OF_FAMILIES
from sweep.families import family
from sweep.families.parameter import spelt_out

FAMILY = """
[study]
name = "plain"
[mechanism]
family = "{name}"
[scene]
want = ["{want}"]
[design]
{design}
[accuracy]
target = 1e-6
[output]
keep = "all"
"""
ROCKER = """
[study]
name = "rocker"
title = "A crank-rocker"
[mechanism]
family = "rssr"
[scene]
speed = "600 rpm"
want = ["swing", "max_abs_d2psi", "margin"]
[design]
a = { from = 10, to = 30, count = 4, unit = "mm" }
b = { values = [90, 110, 130], unit = "mm" }
c = { value = 60, unit = "mm" }
e = "100 mm"
f = { from = 0, to = 10, count = 2, unit = "mm" }
g = { value = 10, unit = "mm" }
alpha = { from = 30, to = 60, count = 2, unit = "deg" }
branch = { values = [1, -1] }
[limits]
rotatable = true
max_pressure_angle = { max = 50, unit = "deg" }
swing = { min = 10, max = 90, unit = "deg" }
[objective]
minimise = "max_abs_d2psi"
[accuracy]
target = 1e-6
[optimise]
starts = 1
seed = 3
looks = 200
[tolerance]
lengths = "0.02 mm"
angles = "0.05 deg"
[reference]
design = { a = "20 mm", b = "110 mm", c = "60 mm", e = "100 mm", f = "0 mm", g = "10 mm", alpha = "45 deg" }
[output]
keep = "all"
dtype = "float64"
[budget]
disk = "1 MB"
time = "2 s"
[report]
curves = [{ label = "line", x = "a", y = "f", points = [[10, 0], [30, 10]] }]
"""

DWELL = """
[study]
name = "dwell"
[mechanism]
family = "geared_dwell"
[scene]
want = ["dwell_angle", "dwell_deviation", "max_abs_d2psi"]
[design]
k = { from = 1.0, to = 2.0 }
a = { from = 0.1, to = 3.0, scale = "log" }
sample = { kind = "sobol", n = 64, seed = 5 }
[limits]
dwell_angle = { min = 30, unit = "deg" }
max_abs_d2psi = { max = 20 }
[objective]
minimise = "max_abs_d2psi"
[accuracy]
samples = 64
[budget]
disk = "1 MB"
time = "2 s"
"""

LOCUS = """
[study]
name = "locus"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "max_abs_d2psi", "margin"]
[locus]
swing = "40 deg"
phi0 = { from = 170, to = 190, count = 3, unit = "deg" }
phi_ext = { from = 0, to = 350, count = 8, unit = "deg" }
[design]
alpha = { from = 60, to = 90, count = 3, unit = "deg" }
e = "100 mm"
f = "10 mm"
g = { from = -10, to = 20, count = 2, unit = "mm" }
[limits]
max_pressure_angle = { max = 60, unit = "deg" }
[objective]
minimise = "max_abs_d2psi"
[accuracy]
target = 1e-6
[optimise]
starts = 1
looks = 200
[pareto]
output = "max_pressure_angle"
at_most = { values = [40, 50], unit = "deg" }
starts = 1
[budget]
time = "2 s"
"""

NEEDLE = """
[study]
name = "needle"
[mechanism]
chain = ["rssr", "guide"]
[scene]
want = ["stroke", "max_abs_d2s", "max_abs_dev"]
window = { from = 0.0, to = 0.6 }
[design]
a1 = "18 mm"
b1 = "90 mm"
c1 = "45 mm"
e1 = "80 mm"
f1 = "5 mm"
g1 = "0 mm"
alpha1 = { from = 80, to = 90, count = 3, unit = "deg" }
a2 = "30 mm"
b2 = { from = 50, to = 70, count = 3, unit = "mm" }
c2 = "40 mm"
e2 = "60 mm"
branch2 = { values = [1, -1] }
lam2 = "90 deg"
[fit]
stroke = "24.5 mm"
[limits]
rotatable = true
[objective]
minimise = "max_abs_d2s"
[accuracy]
samples = 32
[budget]
time = "2 s"
"""

SWING, CRANK, K = (
    'swing = { min = 10, max = 90, unit = "deg" }',
    'a = { from = 10, to = 30, count = 4, unit = "mm" }',
    "k = { from = 1.0, to = 2.0 }",
)
# Numbers at the ends of the float range: the sound file, a text in it, and its replacement.
EDGES = [
    (ROCKER, SWING, "margin = { min = 0, max = 0 }"),
    (ROCKER, SWING, 'swing = { min = 0, max = 0, unit = "deg" }'),
    (ROCKER, SWING, 'swing = { min = 1e-320, max = 1e-300, unit = "deg" }'),
    (ROCKER, SWING, 'swing = { min = 1e-310, max = 1e-310, unit = "deg" }'),
    (ROCKER, SWING, "max_abs_d2psi = { max = 1e-310 }"),
    (ROCKER, CRANK, 'a = { from = 1e-300, to = 1e-299, count = 2, unit = "mm" }'),
    (ROCKER, CRANK, 'a = { from = 1e99, to = 1e100, count = 2, unit = "m" }'),
    (ROCKER, CRANK, 'a = { from = 10, to = 30, count = 1, unit = "mm" }'),
    (ROCKER, "max = 50", "max = 0"),
    (ROCKER, "max = 50", "max = 90"),
    (ROCKER, '"0.02 mm"', '"1e90 mm"'),
    (ROCKER, '"1 MB"', '"1e308 GB"'),
    (ROCKER, '"600 rpm"', '"1e308 rpm"'),
    (ROCKER, 'design = { a = "20 mm"', 'design = { a = "1e308 m"'),
    (ROCKER, "[30, 10]", "[-1e100, 1e100]"),
    (ROCKER, 'e = "100 mm"\nf', f"e = {10**400}\nf"),
    (DWELL, K, "k = { from = 1e99, to = 1e100 }"),
    (DWELL, K, "k = { from = 1e-300, to = 1e-299 }"),
    (DWELL, "from = 0.1", "from = 5e-324"),
]

NUMBERS = [
    "0", "-1", "1", "2", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "1e400", "0x10", "1_0", "9" * 4300,
    "9" * 5000, "123456789012345678901234567890", "2147483648", "9223372036854775807", "-9223372036854775808",
    "1e100", "1e99", "-1e100", "0.0", "-0.0", "1e-300", "1e16", "90", "1.5",
]  # fmt: skip
TEXTS = [
    '""', '"x"', '"1"', '"mm"', '"0 mm"', '"-1 mm"', '"1e999 mm"', '"nan mm"', '"1e-400 deg"', '"7 parsec"', '"%"',
    '"1e308 m"', '"1e300 rpm"', '"mm^9"', '"mm*mm*mm"', '"1/mm"', '"\\u0000"', '"é"', '"all"',
    '"' + "9" * 5000 + ' mm"', '"' + "mm*" * 3000 + 'mm"',
]  # fmt: skip
VALUES = [
    "true", "false", "[]", "{}", "[[]]", "[1, 1]", "[1e308, -1e308]", '["swing"]', "[nan]", "[0, 1, 2]", "{ min = 1 }",
    "{ from = 1, to = 1, count = 1 }", "{ value = 1 }", "{ values = [5] }", "{ values = [] }", "1979-05-27",
    "[" * 60 + "]" * 60, "[" * 3000 + "]" * 3000, "{ a = " * 900 + "1" + " }" * 900, "{ values = [5], unit = 'mm' }",
    "{ from = 1, to = 2, count = 1, unit = 'mm' }", "{ from = 1, to = 2, count = 1000000, unit = 'mm' }",
    "{ from = 1e-300, to = 1e99, count = 3, scale = 'log' }", "{ max = 1e99 }", "{ min = 0, max = 0 }",
]  # fmt: skip
NAMES = ["count", "from", "to", "unit", "values", "value", "scale", "min", "max", "want", "x", "a", "branch", "stroke1"]

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
_TEXT = re.compile(r'"[^"\n]*"')
_ENTRY = re.compile(r"(?m)(?<== ).+$")
_KEY = re.compile(r"(?m)[a-z_0-9]+(?= = )")
_TABLE = re.compile(r"(?m)^\[[a-z]+\]$")


def _swap(pattern: re.Pattern[str], choices: list[str]) -> Callable[[random.Random, str], str]:
    def change(chance: random.Random, text: str) -> str:
        places = list(pattern.finditer(text))
        if not places:
            return text
        place = chance.choice(places)
        return text[: place.start()] + chance.choice(choices) + text[place.end() :]

    return change


def _line(chance: random.Random, text: str) -> str:
    """Delete, duplicate or move a line."""
    lines = text.splitlines()
    line = lines.pop(chance.randrange(len(lines)))
    for _ in range(chance.choice([0, 1, 2])):
        lines.insert(chance.randrange(len(lines) + 1), line)
    return "\n".join(lines)


def _characters(chance: random.Random, text: str) -> str:
    """Delete some characters, or insert others."""
    place = chance.randrange(len(text))
    junk = chance.choice(
        ["", "\x00", "é", "=", "[", "]", '"', "#", "\n", "'''", "\ufeff", "{", "}", ".", ",", "9", "-"]
    )
    return text[:place] + junk + text[place + chance.choice([0, 1, 1, 3, 20]) :]


def _cut(chance: random.Random, text: str) -> str:
    return text[: chance.randrange(len(text))]


def _nested(chance: random.Random, text: str) -> str:
    depth = chance.choice([3, 50, 500, 5000])
    return text + f"\n[{'.'.join(['a'] * depth)}]\nx = 1\n"


def _no_table(chance: random.Random, text: str) -> str:
    """Delete a whole table."""
    tables = re.split(r"(?m)^(?=\[)", text)
    del tables[chance.randrange(1, len(tables))]
    return "".join(tables)


# Nearly all of these changes are valid, but ask for something rare.
GENTLE = [
    *[_swap(_NUMBER, ["0", "0.5", "1", "2", "3", "10", "45", "100", "1e-3", "-5", "180", "1e4", "1e-9", "1e7"])] * 4,
    *[_swap(re.compile(r"count = \d+"), ["count = 1", "count = 2", "count = 7"])] * 2,
    *[_swap(re.compile(r"values = \[[^]]*\]"), ["values = [1]", "values = [90]", "values = [60, 61, 59]"])] * 2,
    _swap(re.compile(r"(?m)^\w+ = \{ from = .*"), ['e = { values = [70], unit = "mm" }', "k = { values = [1.5] }"]),
    *[_no_table] * 3,
    _swap(re.compile(r"(?m)^want = .*"), ["want = []", 'want = ["swing"]', 'want = ["rotatable", "margin"]']),
    _swap(re.compile(r"(?m)^minimise = .*"), [f'minimise = "{name}"' for name in ("swing", "margin", "dwell_angle")]),
    _swap(re.compile(r"(?m)^(?:target|samples) = .*"), ["target = 1e-12", "samples = 8", "samples = 97"]),
    _swap(re.compile('keep = "all"|"float64"'), ['keep = "feasible"', '"float32"']),
    _swap(re.compile(r"(?m)^rotatable = true$"), ["", "margin = { min = 0.2 }", 'a = { max = 15, unit = "mm" }']),
    _swap(re.compile(r'"(?:mm|deg)"'), ['"mm"', '"m"', '"um"', '"in"', '"deg"', '"rad"', '"rev"']),
]
WILD = [
    *[_swap(_NUMBER, NUMBERS)] * 5,
    *[_swap(_TEXT, TEXTS)] * 2,
    *[_swap(_ENTRY, [*VALUES, *TEXTS, *NUMBERS])] * 4,
    _swap(_KEY, NAMES),
    _swap(_TABLE, ["[x]", "[design]", "[limits]", "[fit]", "[locus]", "[pareto]", "[[design]]", "[study.name]", ""]),
    *[_line] * 3,
    *[_characters] * 2,
    _cut,
    _nested,
]


def plain(name: str) -> str:
    """Return a study of any family: its example in mm, one swept size, the largest position."""
    one, lines = family(name), []
    for p in one.parameters:
        x = float(one.example.get(p.name, p.default or 0.0))
        unit = "" if p.unit in ("ratio", "sign", "count", "none", "choice") else spelt_out(p.unit)
        fixed = f'"{x!r} {unit}"' if unit else f"{int(x) if p.choices or p.unit == 'count' else x!r}"
        swept = f'{{ from = {x!r}, to = {1.02 * x!r}, count = 3, unit = "{unit}" }}'
        lines.append(f"{p.name} = {swept if p.unit == 'length' and not any('from' in at for at in lines) else fixed}")
    want = f"max_{one.position}"
    return FAMILY.format(name=name, want=want, design="\n".join(lines))


def mutated(seed: int) -> str:
    """Return a study file by seed: one to four gentle or wild changes to a valid one; every fifth of any family."""
    chance = random.Random(seed)
    text = chance.choice([ROCKER, ROCKER, DWELL, LOCUS, NEEDLE])
    text = plain(NAMES_OF_FAMILIES[seed // 5 % len(NAMES_OF_FAMILIES)]) if seed % 5 == 0 else text
    kind = chance.choice([GENTLE, GENTLE, WILD])
    for _ in range(chance.choice([1, 1, 2, 3, 4])):
        text = chance.choice(kind)(chance, text)
    return text
