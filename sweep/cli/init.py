"""The verbs init and schema."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

import click

from sweep.cli.families import complete_families, family_names
from sweep.cli.first_study import smoke_text, study_text
from sweep.cli.options import A_FOLDER, IS_FILE, IS_THERE
from sweep.dataset.files import unwritable
from sweep.errors import InputError, MissingInput
from sweep.exchange.points import drawn
from sweep.families import family as find_family
from sweep.families.machines.machine import Machine
from sweep.study.by_member import studies_of_members
from sweep.study.load import load_study
from sweep.study.schema import study_schema
from sweep.study.toml import toml

SCHEMA = "study.schema.json"
NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,63}")


@click.command()
@click.argument("name")
@click.option("--family", shell_complete=complete_families, help="A family, or a chain such as rssr+guide.")
@click.option(
    "--member",
    "members",
    multiple=True,
    help="A member of a machine, NAME=FAMILY, such as needle=rssr+guide; once for each member.",
)
@click.option(
    "--points",
    type=IS_FILE,
    help="Points of a drawing, as for `sweep points`, from which the design of --family is taken.",
)
@click.option("--unit", default="mm", show_default=True, help="Unit of the coordinates in --points.")
@click.option(
    "--from-cyclogram",
    "cyclogram",
    type=IS_THERE,
    help="A study of a machine with [cyclogram]; its members get studies NAME-MEMBER, in the order of design.",
)
@click.option("--into", type=A_FOLDER, default=Path(), help="Where the folder NAME is made; default: here.")
def init(
    name: str, family: str | None, members: tuple[str, ...], points: Path | None, unit: str, cyclogram: Path | None,
    into: Path,
) -> None:  # fmt: skip
    """Write a first study of a mechanism or a machine: NAME/study.toml, with comments, and its tiny version.

    It holds the example of the family, or of every --member, with two dimensions swept, passes `sweep check` and runs
    as it is.  With --points it holds the design of a drawing instead, which is its reference.  Its first line names the
    JSON schema by which an editor completes and checks it; the schema lies beside.

    With --from-cyclogram it writes a study for every member of a machine instead: needle, lower looper, upper looper,
    feed, thread supply.  What [cyclogram] and [limits] ask of a member are its limits, and each takes the members
    before it from the accepted optimum of the study before.
    """
    given = sum((family is not None, bool(members), cyclogram is not None))
    if given == 0:
        needed = "a family; or --member once for each member, or --from-cyclogram"
        raise MissingInput("--family", needed, "command line")
    if given > 1:
        raise InputError("--family, --member, --from-cyclogram", f"{given} of them", "one", "command line")
    if NAME.fullmatch(name) is None:
        plain = re.sub("[^a-z0-9]+", "-", name.lower()).strip("-")
        hint = f", such as {plain}" if NAME.fullmatch(plain) else ""
        raise InputError("NAME", name, f"a plain word of a-z, 0-9 and '-', 64 letters at most{hint}", "command line")
    if points is not None and family is None:
        raise InputError("--points", str(points), "with --family: the points of one mechanism", "command line")
    if cyclogram is not None:
        tables = studies_of_members(load_study(cyclogram), name)
        for member_study, data in tables.items():
            _write(into / member_study, {"study.toml": toml(data)})
        click.echo("\n".join(f"study: {into / member_study / 'study.toml'}" for member_study in tables))
        click.echo(
            f"next: sweep run {into / next(iter(tables))}, then its optimum as expected.json for the study behind it"
        )
        return
    machine = _machine(members)
    folder = into / name
    shared = _shared_schema(into)
    schema = SCHEMA if shared is None else Path(os.path.relpath(shared, folder.resolve())).as_posix()
    mechanism = machine or find_family(family_names(family or ""))
    design = None if points is None or family is None else drawn(family, points, unit=unit).parameters
    files = {"study.toml": study_text(name, mechanism, schema, design), "smoke.toml": smoke_text(mechanism)}
    if shared is None:
        files[SCHEMA] = schema_text()
    _write(folder, files)
    click.echo(f"study: {folder / 'study.toml'}\nnext: sweep check {folder}")


def _write(folder: Path, files: dict[str, str]) -> None:
    """Create a folder, which must not exist, with all files or not at all."""
    if folder.exists():
        raise InputError("NAME", folder.name, f"another name: the folder {folder} exists already", "command line")
    with unwritable(folder):
        folder.mkdir(parents=True)
        try:
            for file, text in files.items():
                (folder / file).write_text(text, encoding="utf-8")
        except OSError:
            shutil.rmtree(folder, ignore_errors=True)
            raise


def _machine(members: tuple[str, ...]) -> Machine | None:
    """Return the machine of NAME=FAMILY texts, or None without any."""
    mechanisms: dict[str, str | list[str]] = {}
    for text in members:
        name, _, family = text.partition("=")
        if not family or name in mechanisms:
            raise InputError(
                "--member", text, "NAME=FAMILY, every name once, such as needle=rssr+guide", "command line"
            )
        mechanisms[name] = family_names(family)
    if len(mechanisms) == 1:
        raise InputError("--member", members[0], "two members or more; --family takes one mechanism", "command line")
    machine = find_family(mechanisms) if mechanisms else None
    assert machine is None or isinstance(machine, Machine)
    return machine


@click.command()
def schema() -> None:
    """Write the JSON schema of study files, by which editors complete and check them."""
    click.echo(schema_text(), nl=False)


def schema_text() -> str:
    """Return the JSON schema as the text of a file."""
    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _shared_schema(into: Path) -> Path | None:
    """Return the schema that a project keeps for all its studies, docs/study.schema.json, if ``into`` lies in one."""
    folder = into.resolve()
    return next((file for up in (folder, *folder.parents) if (file := up / "docs" / SCHEMA).is_file()), None)
