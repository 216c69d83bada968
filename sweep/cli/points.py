"""The verbs that read designs from points and tasks, and export them: points, export, task."""

from __future__ import annotations

from pathlib import Path

import click
import pandas as pd

from sweep.cli.families import complete_families
from sweep.cli.options import A_FILE, DESIGN, FOLDER, IS_FILE
from sweep.cli.tables import checked_format, refuse_degrees, write_table
from sweep.cli.workbook import write_workbook
from sweep.dataset.files import beside, located
from sweep.errors import INFEASIBLE
from sweep.exchange.export import FORMATS, MOST_POSES
from sweep.exchange.export import export as write
from sweep.exchange.points import TOLERANCE, drawn
from sweep.families import family as find_family
from sweep.plot.sheet import write_sheet
from sweep.report.dataset import chosen
from sweep.study.task import load_task
from sweep.study.toml import design_entries, toml
from sweep.synthesis.tasks import solve

OF_DATASETS = ("xlsx", "pdf", "svg", "dxf")  # formats that need the study of a design
FILE = click.argument("file", type=IS_FILE)


@click.command()
@click.argument("family", shell_complete=complete_families)
@FILE
@click.option("--part", default="", help="Part of a file that has several: `stage 1`, the member's name, or both.")
@click.option("--unit", default="mm", show_default=True, help="Unit, if no heading such as `x [inch]` names it.")
@click.option("--tolerance", type=float, help="Largest residual as a fraction of the drawing's size; default 1e-4.")
@click.option("--out", type=A_FILE, help="Write the design as a table for `sweep eval`.")
def points(family: str, file: Path, part: str, unit: str, tolerance: float | None, out: Path | None) -> None:
    """Find the dimensions of FAMILY from the points of a drawing: FILE.csv with the columns name, x, y, z.

    FILE may also be a .csv, .dxf or .glb that `sweep export` wrote; if it holds several stages or members, --part names
    one of them.

    The points are named A (centre of the crank circle), axis_A (crank axis), B (crank pin), C, D, axis_D and so on; see
    docs/frames.md.  The answer is TOML: the table [design] of a study file, and [drawing] with the crank angle of the
    drawn position, the place of the family's frame in the drawing [mm], and the residual, which is the largest distance
    of a point from its joint.  --out also writes the parameters and phi as a table [mm, rad].
    """
    out = checked_format(out)
    design = drawn(family, file, part, unit, TOLERANCE if tolerance is None else tolerance)
    if out is not None:
        write_table(pd.DataFrame([design.parameters | {"phi": design.phi}]), out)
    place = design.place
    drawing = {"phi": f"{design.phi!r} rad", "at": list(place.at), "axis": list(place.axis), "zero": list(place.zero)}
    tables = {
        "design": design_entries(find_family(family), design.parameters),
        "drawing": drawing | {"residual": design.residual},
    }
    click.echo(toml(tables), nl=False)


@click.command()
@FOLDER
@DESIGN
@click.option("--format", "kind", required=True, type=click.Choice([*dict.fromkeys([*FORMATS, *OF_DATASETS])]))
@click.option("--out", type=A_FILE, help="Default: export/DESIGN.ending beside FOLDER.")
@click.option("--phi", type=float, default=0.0, show_default=True, help="Crank angle of the drawn position [rad].")
@click.option("--poses", type=click.IntRange(3, MOST_POSES), default=120, show_default=True, help="Steps of a turn.")
def export(folder: Path, design: str | None, kind: str, out: Path | None, phi: float, poses: int) -> None:
    """Write one design of a dataset to a file that other programs read.

    csv: hardpoints and axes.  glb: an animated model that a browser opens.  mjcf: a model for MuJoCo.  law: the motion
    over one turn with units, .csv or .parquet.

    pdf, svg, dxf: a sheet with three views, dimensions and tolerances, hardpoints, limits, and a machine's cyclogram.
    dxf needs `pip install 'linksweep[cad]'`, in a clone `.venv/bin/pip install -e '.[cad]'`.

    xlsx: the whole dataset as a workbook, best designs first, with optimum, curves and definitions; it needs
    `pip install 'linksweep[excel]'`, in a clone `.venv/bin/pip install -e '.[excel]'`.
    """
    if kind == "xlsx":
        click.echo(f"xlsx: {write_workbook(folder, out or _place(folder, 'results.xlsx'))}")
        return
    choice = chosen(folder, design)
    refuse_degrees(choice.family.domain, phi)
    if kind in OF_DATASETS:
        target = out or _place(folder, f"{design or 'result'}.{kind}")
        click.echo(f"{kind}: {write_sheet(folder, design, target, phi)}")
        return
    if out is None:
        name = f"{design or 'result'}{'-law' if kind == 'law' else ''}{FORMATS[kind][0]}"
        out = _place(folder, name)
    path = write(choice.family, choice.design, out, kind, phi=phi, poses=poses, speed=choice.speed, angles="rad")
    click.echo(f"{kind}: {path}")


def _place(folder: Path, name: str) -> Path:
    """Return the path of a file in the folder ``export`` beside the designs, and create that folder."""
    place = beside(located(folder)) / "export"
    place.mkdir(exist_ok=True)
    return place / name


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--candidates",
    default=4096,
    show_default=True,
    type=click.IntRange(min=16),
    help="Points of each sample tried first.",
)
@click.option(
    "--starts", default=6, show_default=True, type=click.IntRange(min=1), help="How many of them are refined."
)
@click.option("--samples", default=12, show_default=True, type=click.IntRange(min=1), help="Most samples drawn.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0), help="Seed of the samples.")
@click.option("--out", type=click.Path(path_type=Path), help="The mechanisms as a table: .csv or .parquet.")
def task(file: Path, candidates: int, starts: int, samples: int, seed: int, out: Path | None) -> None:
    """Answer the [task] table of FILE (docs/tasks.md): mechanisms, the best first, lengths in mm, angles in rad."""
    out = checked_format(out)
    solutions = solve(load_task(file), candidates=candidates, starts=starts, samples=samples, seed=seed)
    for solution in solutions:
        click.echo(str(solution))
    if not solutions:
        click.echo("no candidate was a mechanism at all: what is given allows none (docs/synthesis.md, section 5)")
    if out is not None:
        rows = [s.mechanism | {"objective": s.objective, "feasible": s.feasible} for s in solutions]
        write_table(pd.DataFrame(rows), out)
    if not any(s.feasible for s in solutions):
        raise click.exceptions.Exit(INFEASIBLE)
