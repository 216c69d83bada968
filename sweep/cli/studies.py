"""The verbs that take a study or the dataset it left behind: run, check, report, compare."""

from __future__ import annotations

from pathlib import Path

import click

STUDY = click.argument("study", type=click.Path(exists=True, path_type=Path))
BACKEND = click.option(
    "--backend",
    default="threading",
    show_default=True,
    help="threading, loky (processes), dask (processes of a local cluster) or dask=tcp://HOST:8786 (docs/cluster.md).",
)


@click.command()
@STUDY
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Dataset folder; default results/<study>/designs."
)
@click.option("--jobs", type=click.IntRange(min=1), default=2, show_default=True, help="Workers.")
@BACKEND
@click.option("--accuracy", type=float, help="Relative error of the extrema, instead of the study's own target.")
@click.option("--certify", is_flag=True, help="Prove that no peak of the wanted maxima is missed.")
@click.option("--smoke", is_flag=True, help="The tiny version: smoke.toml beside the study.")
@click.option(
    "--force",
    is_flag=True,
    help="No budget: start and go on whatever it costs; set data of another study in the folder aside.",
)
def run(
    study: Path,
    out: Path | None,
    jobs: int,
    backend: str,
    accuracy: float | None,
    certify: bool,
    smoke: bool,
    force: bool,
) -> None:
    """Run or resume a study.

    An interrupted run is resumed by the same command.  Finished chunks are never computed twice, and the result is the
    same, bit for bit, with any number of workers.  The answer comes last; where no design keeps all limits, it says
    which of them have to give way, and the exit code is 4.
    """
    from sweep.engine.opening import is_part
    from sweep.engine.run import run as run_study
    from sweep.errors import SearchCutShort
    from sweep.report.terminal import ending

    proof = True if certify else None
    late: SearchCutShort | None = None
    try:
        folder = run_study(
            study, out, jobs, backend, smoke=smoke, force=force, accuracy=accuracy, certify=proof, progress=True
        )
    except SearchCutShort as error:
        late, folder = error, error.folder
    if is_part(folder):  # the answer is for the whole, once the parts are merged
        click.echo(f"part: {folder}")
        return
    found = ending(folder)
    for line in found.lines:
        click.echo(line)
    click.echo(f"dataset: {folder}")
    if late is not None:
        raise late
    click.get_current_context().exit(found.exit_code)


@click.command()
@STUDY
@click.option("--jobs", type=click.IntRange(min=1), default=2, show_default=True, help="Workers to plan for.")
@click.option("--smoke", is_flag=True, help="The tiny version: smoke.toml beside the study.")
def check(study: Path, jobs: int, smoke: bool) -> None:
    """Validate a study and print what running it would compute and cost; nothing is written.

    A study over its budget ends with exit code 3.
    """
    from sweep.cli.plan import plan_lines
    from sweep.engine.estimate import check_budget, estimate, other_accuracies
    from sweep.engine.proving import refuse_unprovable
    from sweep.jobs.progress import Phases
    from sweep.study import load_study

    model = load_study(study, smoke=smoke)
    refuse_unprovable(model)
    with Phases(show=True) as phases:
        cost = estimate(model, jobs, lambda done, of: phases.say("planning", done, of))
        others = other_accuracies(model, jobs, lambda done, of: phases.say("other accuracies", done, of))
        phases.say("what matters")
        lines = plan_lines(model, cost, others)
    for line in lines:
        click.echo(line)
    check_budget(model, cost)


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Default: beside the chunks.")
def report(folder: Path, out: Path | None) -> None:
    """Write report.html, figures and tables about a dataset.

    report.html holds everything in one file and needs no network.  Beside it: figures/, optimum.parquet and
    curves.parquet (if the study optimises), pareto.parquet (if it asks for a front) and survivors.parquet, the designs
    within all limits.
    """
    from sweep.jobs.progress import Phases
    from sweep.report import write_report

    with Phases(show=True) as phases:
        written = write_report(folder, out, phases.say)
    click.echo(f"report: {written}")


@click.command()
@click.argument("old", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("new", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--rtol", type=float, default=0.0, help="Relative change of a value that counts as none; default: any bit."
)
@click.option(
    "--slower", type=float, default=1.5, show_default=True, help="How many times as long the new run may take."
)
def compare(old: Path, new: Path, rtol: float, slower: float) -> None:
    """Say what moved between two datasets of one study: values, rows, time.

    Ends with 11 if rows, a status or the pattern of missing values changed, else with 10 if values changed, else with
    12 if the new run was slower; with 0 if nothing moved.
    """
    from sweep.dataset.comparison import compare as compare_datasets

    found = compare_datasets(old, new, rtol, slower)
    for line in found.lines():
        click.echo(line)
    click.get_current_context().exit(found.exit_code)
