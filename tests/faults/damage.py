"""Chunks and tables that somebody, or a disk, has changed: reading, ``verify`` and the next run find them."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import sweep
from sweep.dataset.files import PLAN, RUNS, beside
from sweep.errors import IncompleteWarning, LinksweepError
from tests.faults.ground import TABLES, Ground, Kind, Outcome, files

Damage = Callable[[list[Path], random.Random], None]


def flip(chunks: list[Path], moments: random.Random) -> None:
    data = bytearray(chunks[0].read_bytes())
    data[moments.randrange(len(data))] ^= 1 << moments.randrange(8)
    chunks[0].write_bytes(data)


def cut(chunks: list[Path], moments: random.Random) -> None:
    data = chunks[0].read_bytes()
    chunks[0].write_bytes(data[: moments.randrange(1, len(data))])


def empty(chunks: list[Path], moments: random.Random) -> None:
    chunks[0].write_bytes(b"")


def delete(chunks: list[Path], moments: random.Random) -> None:
    chunks[0].unlink()


def swap(chunks: list[Path], moments: random.Random) -> None:
    one, other = chunks[0].read_bytes(), chunks[1].read_bytes()
    chunks[0].write_bytes(other)
    chunks[1].write_bytes(one)


def duplicate(chunks: list[Path], moments: random.Random) -> None:
    """The file of one chunk under the index of another."""
    _, _, identity, digest = chunks[0].name.split("-")
    other = chunks[1].name.split("-")[1]
    shutil.copy(chunks[0], chunks[0].with_name(f"part-{other}-{identity}-{digest}"))


def read(designs: Path) -> str:
    """What reading the dataset says: nothing, a warning, or an error of ours."""
    import warnings

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            sweep.load(designs)
        except LinksweepError as error:
            return str(error)
    return "; ".join(str(one.message) for one in caught if issubclass(one.category, IncompleteWarning))


def damaged_chunk(damage: Damage, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """A chunk of a complete dataset is damaged; a file too many is moved away, as the message says."""
    designs = ground.swept(ground.plain, folder)
    chunks = sorted(designs.glob("part-*"))
    moments.shuffle(chunks)
    damage(chunks, moments)
    whole = ground.whole(ground.plain)
    sound = {name: data for name, data in files(designs).items() if whole.get(name) == data}
    found = Outcome(said=read(designs))
    found.wrong += [] if found.said else ["it is read without a word"]
    found.wrong += [] if sweep.verify(designs, designs=0).exit_code == 74 else ["verify finds nothing"]
    for path in set(designs.glob("part-*")) - set(chunks):
        path.unlink()
    return ground.settled(ground.plain, designs, sound, found, damaged=True)


def damaged_table(damage: Damage, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """A table beside the chunks is damaged, or gone: verify says so, and the next run makes it anew."""
    designs = ground.swept(ground.rich, folder)
    table = beside(designs) / moments.choice(TABLES)
    damage([table], moments)
    names = [str(one) for one in sweep.verify(designs, designs=0).findings if one.path == table]
    found = Outcome(said=names[0] if names else "")
    found.wrong += [] if names else [f"verify finds nothing in {table.name}"]
    sound = {name: data for name, data in files(designs).items() if name != table.name}
    return ground.settled(ground.rich, designs, sound, found, damaged=True)


def damaged_note(name: str, damage: Damage, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """The plan or the log is damaged: the chunks stand for themselves."""
    designs = ground.swept(ground.plain, folder)
    damage([beside(designs) / name], moments)
    return ground.settled(ground.plain, designs, files(designs), Outcome())


DAMAGE = [
    Kind("flipped chunk", 40, partial(damaged_chunk, flip)),
    Kind("truncated chunk", 40, partial(damaged_chunk, cut)),
    Kind("emptied chunk", 15, partial(damaged_chunk, empty)),
    Kind("deleted chunk", 15, partial(damaged_chunk, delete)),
    Kind("swapped chunks", 30, partial(damaged_chunk, swap)),
    Kind("duplicated chunk", 30, partial(damaged_chunk, duplicate)),
    Kind("flipped table", 30, partial(damaged_table, flip)),
    Kind("truncated table", 30, partial(damaged_table, cut)),
    Kind("deleted table", 15, partial(damaged_table, delete)),
    Kind("truncated plan", 20, partial(damaged_note, PLAN, cut)),
    Kind("truncated log", 15, partial(damaged_note, RUNS, cut)),
    Kind("flipped plan", 20, partial(damaged_note, PLAN, flip)),
]
