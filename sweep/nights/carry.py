"""Reuse of an earlier night: verified chunks of the same identity are linked."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sweep.chunks.plan import make_plan
from sweep.dataset import files
from sweep.dataset.files import link_or_copy
from sweep.dataset.verification import verify
from sweep.engine.opening import words_of
from sweep.engine.searches import optimum_key
from sweep.errors import LinksweepError
from sweep.optimise import read_survey
from sweep.optimise.front.study import saved
from sweep.proof import known_proof
from sweep.study import Study

REPORT, FIGURES, SURVIVORS = "report.html", "figures", "survivors.parquet"


@dataclass(frozen=True)
class Carried:
    """The night from which chunks were linked, their number, and whether the study is ``whole``: nothing left to do."""

    night: str | None = None
    chunks: int = 0
    whole: bool = False


def carry(study: Study, earlier: Sequence[Path], target: Path) -> Carried | None:
    """Link the results of an earlier night for the same study, computed by the same sources.

    Parameters
    ----------
    study : tonight's study
    earlier : folders of nights, the newest first
    target : this night's folder of the study, which need not exist

    Returns
    -------
    Carried
        None if no night has a chunk of this identity.  Every chunk was compared with its hash, and its rows with
        the plan; damaged ones are left out.
    """
    for night in earlier:
        source = night / target.name / files.DESIGNS
        plan = files.read_plan(source)
        if plan is None or make_plan(study, plan["chunk_size"]).identity != plan["identity"]:
            continue
        try:
            verification = verify(source, designs=0)
        except LinksweepError:  # a faulty earlier night is computed again
            continue
        bad = {finding.path for finding in verification.findings}
        sound = [path for path in sorted(source.glob("part-*.parquet")) if path not in bad]
        if not sound:
            continue
        designs = target / files.DESIGNS
        with files.store_errors(target):
            designs.mkdir(parents=True, exist_ok=True)
            for path in sound:
                link_or_copy(path, designs / path.name)
            link_or_copy(files.beside(source) / files.PLAN, target / files.PLAN)
            for name in files.SIDE_FILES:
                path = files.beside(source) / name
                if path.is_file() and path not in bad:
                    link_or_copy(path, target / name)
            # This file is appended to, so it is copied.
            if (files.beside(source) / files.RUNS).is_file():
                shutil.copyfile(files.beside(source) / files.RUNS, target / files.RUNS)
            same = all(plan.get(key) == words for key, words in words_of(study).items())  # titles are in the report
            whole = not verification.findings and bool(plan.get("complete")) and same and searched(study, target)
            if whole:
                _link_report(files.beside(source), target)
        return Carried(night.name, len(sound), whole)
    return None


def searched(study: Study, folder: Path) -> bool:
    """Tell whether optimum, proof and front in a folder belong to the study and were made by these sources.

    Parts that the study does not ask for do not count.  A search that ran out of time is repeated.
    """
    note = files.read_plan(folder / files.DESIGNS) or {}
    if study.optimise is not None and note.get("optimised") != optimum_key(replace(study, pareto=None), note):
        return False
    survey = read_survey(folder / files.OPTIMUM)
    if survey is not None and survey.ended == "time":
        return False
    wants_proof = study.optimise is not None and study.optimise.prove is not None
    if wants_proof and known_proof(study, folder / files.DESIGNS) is None:
        return False
    if study.pareto is None:
        return True
    front = saved(folder / files.PARETO, optimum_key(study, note))
    return front is not None and front.complete


def _link_report(source: Path, target: Path) -> None:
    """Link the report and its files; copy those that a new report would overwrite."""
    if not (source / REPORT).is_file():
        return
    copied = [*(source / FIGURES).glob("*.svg"), *(source / name.removeprefix("_") for name in files.SIDE_FILES)]
    for path in (source / SURVIVORS, *copied, source / REPORT):
        if path.is_file():
            place = target / path.relative_to(source)
            place.parent.mkdir(exist_ok=True)
            if path in copied:
                shutil.copyfile(path, place)
            else:
                link_or_copy(path, place)
