"""Write docs/effects.md, the page of all effects, from their register: ``make docs``.

Effects of several families that are the same stand together, and rows of all links or joints in general form.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby, takewhile
from pathlib import Path
from typing import NamedTuple

from jinja2 import StrictUndefined, Template

from sweep.cli.effects import Rows, cost_words, design_rows, every_input, input_rows, output_rows
from sweep.effects import NAMES, effect
from sweep.effects.base import Effect
from sweep.effects.link_loads import rods_of
from sweep.effects.load_passing import LOADS
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT
from sweep.families.link_tree import LinkTree

TEMPLATE, PAGE = (Path(__file__).with_name(name) for name in ("effects.md.j2", "effects.md"))
OF_PLACE = rf"(?:[123]?(?:{FRICTION_SUFFIX})?|_[xyz]{{1,2}})"  # suffix of a name behind that of a link or joint
CONTACT = "C1"  # key of the effects about contacts
OF_JOINT = re.compile(r": joint J\b(.*?)(?:; [a-z, ]+)?$")
NUMBER = re.compile(r"( [a-d]?|^)(1|2|first|second)\b")
BOTH = {"1": "1, 2", "2": "1, 2", "first": "first, second", "second": "first, second"}
AS_WITHOUT = "as without `_friction`, friction included"


def grouped(entries: Iterable[Effect]) -> list[list[Effect]]:
    """Group the effects that are the same for several families, with equal equations and equal criteria."""
    groups: dict[tuple[object, ...], list[Effect]] = {}
    for entry in entries:
        groups.setdefault((entry.formulas, entry.called_for, entry.negligible), []).append(entry)
    return list(groups.values())


def heading(group: Sequence[Effect]) -> str:
    """Return the common last words of the names of a group, or all its names."""
    names = [entry.name.split("_")[::-1] for entry in group]
    alike = takewhile(lambda words: len(set(words)) == 1, zip(*names, strict=False))
    words = "_".join([words[0] for words in alike][::-1]) or ", ".join(entry.name for entry in group)
    return f"{words} of many links" if len(group) > 2 and all(entry.tree for entry in group) else words


def needed(group: Iterable[Effect]) -> list[str]:
    """Return what the effects of a group need, without the family in front of the names."""
    return list(dict.fromkeys(n.removeprefix(f"{e.families[0]}_") for e in group for n in e.needs))


def stages(group: Sequence[Effect]) -> str:
    """Say in which stages of a chain the effects of a group serve, by name where they differ."""
    first = [entry.name for entry in group if entry.even_crank]
    if len(first) in (0, len(group)):
        return "first" if first else "any"
    return f"any ({', '.join(f'`{name}`' for name in first)}: first)"


def link_lists(group: Sequence[Effect]) -> dict[tuple[TreePlace, ...], list[Effect]]:
    """Return the links and joints of the effects of a group, with the effects that share them."""
    alike: dict[tuple[TreePlace, ...], list[Effect]] = {}
    for entry in group:
        alike.setdefault(tuple(places_of(entry)), []).append(entry)
    return alike


def without_repeats(groups: Sequence[Sequence[Effect]]) -> list[tuple[list[str], list[str]]]:
    """Return equations of each group that stand neither on another page nor before, and the headings of the latter."""
    place: dict[str, str] = {}
    out = []
    for group in groups:
        formulas = () if group[0].equation.startswith("docs/") else group[0].formulas
        new = [f for f in formulas if f not in place]
        out.append((new, list(dict.fromkeys(place[f] for f in formulas if f in place))))
        place |= dict.fromkeys(new, heading(group))
    return out


def with_friction(rows: Rows) -> Rows:
    """Say of outputs that differ from others by their friction alone what they are."""
    return [(n, unit, AS_WITHOUT if FRICTION_SUFFIX in n and FRICTION_TEXT in t else t) for n, unit, t in rows]


def alike(rows: Rows) -> Rows:
    """Merge the rows of outputs with friction into one, and rows that differ by the number 1 or 2 alone."""
    merged: dict[tuple[str, str, str], Rows] = {}
    for row in rows:
        name, unit, text = row
        general = NUMBER.sub(lambda match: match[1] + BOTH[match[2]], text) if name[-1] in "12" else text
        key = ("", "", text) if text == AS_WITHOUT else (name[:-1], unit, general) if general != text else row
        merged.setdefault(key, []).append(row)
    return [
        ("; ".join(name for name, *_ in same), ", ".join(dict.fromkeys(unit for _, unit, _ in same)), key[2])
        if len(same) > 1
        else same[0]
        for key, same in merged.items()
    ]


def without_joint(row: tuple[str, str, str]) -> tuple[str, str, str]:
    """Return the row of an input of every joint J as that of one joint."""
    return row[0].replace("_J", ""), row[1], OF_JOINT.sub(r"\1", row[2])


def shared_inputs(groups: Iterable[Sequence[Effect]]) -> Rows:
    """Return the rows of inputs that effects of several groups take."""
    tables = ([row for columns, _, rows in parts(g) if columns == "input" for row in alike(rows)] for g in groups)
    count = Counter(row for table in tables for row in dict.fromkeys(map(without_joint, table)))
    return [row for row, n in count.items() if n > 1]


class TreePlace(NamedTuple):
    """A link, ``B``, or a joint, ``J``: kind, name, axes or what acts on what, and patterns for any such place."""

    sign: str
    kind: str
    name: str
    text: str
    general: tuple[tuple[str, str], ...]


def places(tree: LinkTree, touching: bool = False) -> list[TreePlace]:
    """Return the links and the joints of a link tree, or the joints with a contact only."""
    rods, listed = rods_of(tree), list[TreePlace]()
    for k, b in enumerate(tree.bodies):
        listed.append(link("slender" if b.slender else "rod" if k in rods else "compact", b.name, b.axes))
    for j in tree.joints:
        acting = re.escape(f"of the {j.acts}"), "of its first link on the second"
        general = (f"(?<!of the ){re.escape(j.text)}", "joint J"), acting
        listed.append(TreePlace("J", j.touch if touching else j.kind, j.name, j.acts, general))
    return [place for place in listed if place.sign == "J" and place.kind] if touching else listed


def places_of(entry: Effect) -> list[TreePlace]:
    """Return the links and joints that rows of an effect are about; of a stage of one kind its links alone."""
    if entry.tree is not None:
        return places(entry.tree, entry.key == CONTACT)
    texts = {p.name: p.text for p in entry.inputs}
    bodies = [name.removeprefix("m_") for name in texts if f"com_{name.removeprefix('m_')}_x" in texts]
    axes = {body: texts[f"com_{body}_x"].partition(" (")[2][:-1] for body in bodies}
    return [link("rod" if f"rod_{body}" in texts else "compact", body, axes[body]) for body in bodies]


def link(kind: str, name: str, axes: str) -> TreePlace:
    """Return a link with the patterns of rows about it."""
    named = (rf"_{name}\b", "_B"), (rf"\bof (?:the )?{name}\b", "of link B")
    return TreePlace("B", kind, name, axes, ((re.escape(f"({axes})"), "along its axes"), *named))


def _generalised(known: Sequence[TreePlace], row: tuple[str, str, str]) -> tuple[str, str, tuple[str, str, str]] | None:
    """Return sign and kind of a row's link or joint, and the row for any of them; None for a row about none."""
    for place in known:
        name = re.sub(rf"_{place.name}(?={OF_PLACE}(?:,|$))", f"_{place.sign}", row[0], count=1)
        text = row[2]
        for words, general in place.general:
            text = re.sub(words, general, text)
        if name != row[0] and text != row[2]:
            return place.sign, place.kind, (name, row[1], text)
    return None


def of_any_place(known: Sequence[Sequence[TreePlace]], tables: Sequence[Rows]) -> tuple[Rows, list[Rows]]:
    """Return the rows that all links or joints of some kinds share, in general form, and each effect's other rows."""
    every = Counter((place.sign, place.kind) for places in known for place in places)
    generalised = [[_generalised(places, row) for row in table] for places, table in zip(known, tables, strict=True)]
    kinds: dict[tuple[str, tuple[str, str, str]], Counter[str]] = {}
    for sign, kind, row in (entry for entries in generalised for entry in entries if entry is not None):
        kinds.setdefault((sign, row), Counter())[kind] += 1
    shared = {
        key: count
        for key, count in kinds.items()
        if count.total() > 1 and all(every[key[0], kind] == n for kind, n in count.items())
    }
    rows = []
    for (sign, (name, unit, text)), count in shared.items():
        all_kinds = len(count) == sum(entry == sign for entry, _ in every)
        rows.append((name, unit, text if all_kinds else f"{text}; {', '.join(count)}"))
    left = [
        [row for row, entry in zip(table, entries, strict=True) if entry is None or (entry[0], entry[2]) not in shared]
        for table, entries in zip(tables, generalised, strict=True)
    ]
    return rows, left


def parts(group: Sequence[Effect]) -> list[tuple[str, list[str], Rows]]:
    """Return the tables of a group: columns, names of the effects (empty for all), and rows.

    Inputs that an effect takes from one that it needs are not repeated.  Rows of several effects form one table, rows
    of all links or joints of link trees are merged into one.
    """
    inputs = [{p for name in entry.needs for p in every_input(effect(name))} for entry in group]
    kinds = {
        "output": [output_rows(entry.outputs) for entry in group],
        "output per design": [design_rows(entry) for entry in group],
        "input": [
            input_rows(p for p in every_input(entry) if p not in old) for entry, old in zip(group, inputs, strict=True)
        ],
    }
    listed = [places_of(entry) for entry in group]
    together = len(group) > 1 and all(listed)
    out: list[tuple[str, list[str], Rows]] = []
    for columns, tables in kinds.items():
        general, remaining = of_any_place(listed, tables) if together else ([], tables)
        general, *remaining = map(with_friction, (general, *remaining))
        common = [row for row in remaining[0] if all(row in table for table in remaining)]
        remaining = [[row for row in table if row not in common] for table in remaining]
        of_several: dict[tuple[str, ...], Rows] = {}
        for row in dict.fromkeys(row for table in remaining for row in table):
            names = tuple(entry.name for entry, table in zip(group, remaining, strict=True) if row in table)
            of_several.setdefault(names, []).append(row)
        out += [(columns, [], common + general), *((columns, list(names), rows) for names, rows in of_several.items())]
    return [part for part in out if part[2]]


def page() -> str:
    """Return docs/effects.md, generated from the register."""
    groups = grouped(effect(name) for name in NAMES)
    template = Template(TEMPLATE.read_text("utf-8"), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return str(
        template.render(
            groups=groups,
            equations=without_repeats(groups),
            shared=shared_inputs(groups),
            without_joint=without_joint,
            heading=heading,
            subject=lambda group: "; ".join(dict.fromkeys(entry.title.split(": ")[0] for entry in group)),
            families=lambda group: dict.fromkeys(name for entry in group for name in entry.families),
            needed=needed,
            stages=stages,
            link_lists=link_lists,
            listed=(LOADS, CONTACT),
            tables=lambda group: groupby(parts(group), key=lambda part: part[0]),
            alike=alike,
            cost=cost_words,
        )
    )


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
