"""The verb ``explore``."""

from __future__ import annotations

import tomllib
from pathlib import Path

import click

from sweep.cli.families import family_names
from sweep.cli.first_study import study_text
from sweep.dataset.files import PLAN, beside, located
from sweep.engine.estimate import compiling
from sweep.errors import InputError
from sweep.explore.hand import Hand, of_results, of_study
from sweep.explore.server import Server
from sweep.families import family
from sweep.jobs.progress import Phases
from sweep.study import load_study
from sweep.study.load import study_from_data


@click.command()
@click.argument("source")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of the page; default: a free one.")
@click.option("--open/--no-open", "opened", default=False, help="Show the page in the browser of this machine.")
def explore(source: str, port: int, opened: bool) -> None:
    """Take a design in hand: sliders for its dimensions; mechanism, curves, outputs and limits follow.

    SOURCE is a STUDY, the FOLDER of a run, whose optimum is taken in hand, or a FAMILY, of which it is the example.
    The page is served on this machine only, under an address that nobody can guess; Ctrl-C ends it.  It needs
    `pip install 'linksweep[explore]'`, in a clone `.venv/bin/pip install -e '.[explore]'`.
    """
    hand = in_hand(source)
    server = Server(hand, port)
    with Phases(show=True) as phases, compiling(phases):  # the kernels of the page's first request: up to half a minute
        hand.answer([hand.first], [""])
    click.echo(f"explore: {server.address}\nCtrl-C ends it")
    if opened:
        click.launch(server.address)
    try:
        server.run()
    except KeyboardInterrupt:
        click.echo("")


def in_hand(source: str) -> Hand:
    """Return the design of a study file, a folder of results or a family's name."""
    path = Path(source)
    if path.is_dir() and (beside(located(path)) / PLAN).exists():
        return of_results(path)
    if path.exists():
        return of_study(load_study(path))
    try:
        mechanism = family(family_names(source))
    except InputError as error:
        allowed = f"a study, a folder of results, or a family, {error.allowed}"
        raise InputError("SOURCE", source, allowed, "explore") from None
    return of_study(study_from_data(tomllib.loads(study_text("first-look", mechanism, "")), "study.toml"))
