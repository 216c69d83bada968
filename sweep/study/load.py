"""``load_study``: read TOML into a checked :class:`Study`, or report every fault of the file at once."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from sweep.effects.wanted import expanded
from sweep.errors import StudyError
from sweep.families.base import Accuracy, Family
from sweep.families.machines.specification import Specification
from sweep.quantities.limits import Limit
from sweep.study.accuracy import accuracy_table, check_proofs, read_accuracy
from sweep.study.design import OtherTables, check_varied, read_reference, read_space, take, taken_reference
from sweep.study.file import Faults, StudyFile
from sweep.study.limits import read_limits
from sweep.study.loads import Inputs, check_unused, read_inputs, read_window, speeds, tables_of_inputs, with_effects
from sweep.study.locus import RATIOS, read_fit, read_locus
from sweep.study.mechanism import flattened, read_mechanism
from sweep.study.objective import (
    check_goal,
    check_objective,
    check_search,
    check_steady,
    read_optimise,
    read_pareto,
)
from sweep.study.report import check_report
from sweep.study.study import (
    Budget,
    Objective,
    OutputSettings,
    ParetoSettings,
    Study,
)
from sweep.study.tables import Sections, read_sections
from sweep.study.thread import read_threads
from sweep.study.tolerance import check_tolerance, read_tolerance
from sweep.study.toml import key_lines, read_toml, toml_text

if TYPE_CHECKING:
    from sweep.synthesis.tasks.problem import SynthesisTask


def load_study(path: str | Path, smoke: bool = False) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path : a study.toml, or the folder that holds one
    smoke : override keys of the study by those in smoke.toml in the same folder

    Raises
    ------
    StudyError
        lists every fault with file, line, key, value and what is allowed.
    """
    file = Path(path)
    file = file / "study.toml" if file.is_dir() else file
    beside = file.with_name("smoke.toml")
    if smoke and not beside.exists():
        needed = "a file beside study.toml with the keys that its tiny version changes, docs/study-files.md"
        raise StudyError(str(beside), [f"{beside} is missing; needed: {needed}"])
    files = [file, beside] if smoke else [file]
    read = {str(f): read_toml(f) for f in files}
    places = {str(f): key_lines(toml_text(f)) for f in files}
    data = merged(read[str(file)], read[str(beside)]) if smoke else read[str(file)]
    return _build(data, file, read, places)


def study_from_data(data: Mapping[str, Any], path: str | Path) -> Study:
    """Return the study described by ``Study.data``, as _plan.json of a dataset keeps it; messages name ``path``.

    Raises
    ------
    StudyError
        as :func:`load_study`.
    """
    return _build(data, Path(path), {str(path): data})


def study_of(plan: Mapping[str, Any], path: Path) -> Study:
    """Return the study that a dataset answers, from its plan in ``path``, which keeps the title under ``about``.

    Raises
    ------
    StudyError
        as :func:`load_study`.
    """
    data, about = plan.get("data") or plan["chunk_data"], plan.get("about") or {"name": plan["name"]}
    return study_from_data({**data, "study": about}, path)


def with_accuracy(study: Study, target: float | None = None, certify: bool | Sequence[str] | None = None) -> Study:
    """Return the same study with another target error of its extrema, or with its proof of maxima switched on or off.

    Raises
    ------
    StudyError
        if the target is not between 1e-14 and 0.1, or what is wanted cannot be proven.
    """
    setting = accuracy_table(study.accuracy)
    if target is not None:
        setting = {"target": target} | {key: setting[key] for key in ("certify",) if key in setting}
    if certify is not None:
        setting["certify"] = certify if isinstance(certify, bool) else list(certify)
    return study_from_data(study.data | {"accuracy": setting}, study.path)


WHOLE = (("accuracy",), ("objective",))  # tables that smoke.toml replaces as a whole


def merged(base: Mapping[str, Any], over: Mapping[str, Any], key: tuple[str, ...] = ()) -> dict[str, Any]:
    """Merge the tables of one file into those of another, key by key.

    [accuracy], [objective] and the value or values of a parameter are replaced as a whole, since a mixture of two
    entries would be meaningless.
    """
    result = copy.deepcopy(dict(base))
    for name, new in over.items():
        old = result.get(name)
        mixed = (*key, name) not in WHOLE
        if isinstance(old, dict) and isinstance(new, dict) and mixed and {"value", "values"}.isdisjoint({*old, *new}):
            result[name] = merged(old, new, (*key, name))
        else:
            result[name] = copy.deepcopy(new)
    return result


def _build(
    data: Mapping[str, Any],
    path: Path,
    files: Mapping[str, Mapping[str, Any]],
    places: Mapping[str, Mapping[str, int]] = MappingProxyType({}),
) -> Study:
    members = data.get("machine")
    faults = Faults({name: flattened(content, members) for name, content in files.items()}, places)
    file = StudyFile(flattened(data, members), path, faults)
    sections = read_sections(file)
    window, accuracy = read_window(sections.scene.window, faults), read_accuracy(sections.accuracy, faults)
    check_goal(sections.objective, file)
    if not (sections.scene.want or file.free_table("limits") or sections.objective.goal):
        faults.missing(("scene", "want"), "design outputs to compute, here or in [limits] or [objective]")
    mechanism = read_mechanism(sections.mechanism, file, read_threads(file))
    task = None
    if "task" in file:
        from sweep.study.task import read_study_task  # imports every task, which few studies need

        task = read_study_task(file, mechanism and mechanism[0])
    if mechanism is None:  # the remaining checks need the mechanism
        raise StudyError(str(path), faults.lines)
    return _study(file, sections, window, accuracy, task, *mechanism)


def _study(
    file: StudyFile,
    sections: Sections,
    window: tuple[float, float] | None,
    accuracy: Accuracy,
    task: SynthesisTask | None,
    mechanism: tuple[str, ...] | Specification,
    bare: Family,
) -> Study:
    faults, objective, goal = file.faults, sections.objective, sections.objective.goal
    named = [*(file.free_table("limits") or ()), *(x for x in (goal, sections.pareto.output) if x)]
    family = with_effects(file, bare, named, (inputs := read_inputs(file, bare)).curves)
    check_unused(file, bare, family, inputs)
    fit = read_fit(sections.fit, file, family)
    take(file, bare, fitted := () if fit is None else fit.parameters(family))
    locus, prescribed = read_locus(file, bare)
    limits = read_limits(file, family, prescribed)
    check_search(sections.optimise, file, bare)
    check_objective(objective, family, faults)
    check_steady(file, family, objective, limits)
    front = read_pareto(sections.pareto, file, family, objective, sections.optimise, limits)
    made, given = (() if locus is None else locus.made), speeds(family, sections.scene.speed)
    other = OtherTables(fitted, given, made, prescribed, inputs.raw, tables_of_inputs(file, bare, family, inputs))
    space = read_space(file, family, other)
    if space is not None and fit is None and (locus is None or sections.optimise.variables != "parameters"):
        check_varied(file, family, space, inputs.raw)
    tolerance = read_tolerance(sections.tolerance, file, family)
    check_tolerance(tolerance, family, limits, space, faults)
    reference = read_reference(taken_reference(file, sections.reference), bare, family, faults, other, space)
    check_report(sections.report, file, family, prescribed)
    prescribed_names = [*prescribed, *(name for name in file.free_table("locus") or () if name.startswith(RATIOS))]
    want = _computed(family, [*expanded(bare, sections.scene.want), *prescribed_names], limits, goal, front)
    check_proofs(accuracy, family, want, window=window is not None, faults=faults)
    file.raise_faults()
    assert space is not None  # a faulty space was raised above
    return Study(
        name=sections.study.name or "",
        title=sections.study.title,
        question=sections.study.question,
        path=file.path,
        mechanism=mechanism,
        speed=sections.scene.speed,
        curves=inputs.curves,
        want=want,
        space=space,
        locus=locus,
        fit=fit,
        limits=limits,
        objective=Objective(goal) if goal else None,
        accuracy=accuracy,
        window=window,
        optimise=read_optimise(sections.optimise) if "optimise" in file else None,
        pareto=front,
        tolerance=tolerance,
        reference=reference,
        task=task,
        output=OutputSettings(**sections.output.model_dump()),
        budget=Budget(sections.budget.disk, sections.budget.time),
        data=_completed(file, sections, accuracy, inputs),
    )


def _computed(
    family: Family, names: list[str], limits: tuple[Limit, ...], goal: str | None, front: ParetoSettings | None
) -> tuple[str, ...]:
    """Return the names of all computed design outputs: wanted, limited, objective and second output of the front."""
    wanted = [*names, *(limit.output for limit in limits), goal, None if front is None else front.output]
    parameters = family.parameter_names
    return tuple(name for name in dict.fromkeys(wanted) if name and name not in parameters)


def _completed(file: StudyFile, sections: Sections, accuracy: Accuracy, inputs: Inputs) -> dict[str, Any]:
    """Return the content of the file with its defaults and with the files that [loads] names."""
    defaults = {"accuracy": accuracy_table(accuracy), "output": sections.output.model_dump()}
    if inputs.inlined:
        defaults["loads"] = copy.deepcopy(inputs.inlined)
    return copy.deepcopy(dict(file.data)) | defaults
