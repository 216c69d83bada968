"""``load_study``: from TOML to a checked :class:`Study`, or every fault of the file at once."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.effects import extended
from sweep.errors import InputError, StudyError, closest, nearest
from sweep.families import NAMES, Specification
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Family
from sweep.families.chain import Chain
from sweep.families.members import Machine
from sweep.quantities.names import parts
from sweep.reductions.catalogue import check_certifiable
from sweep.reductions.steps import proofs
from sweep.study import units
from sweep.study.design import check_varied, read_reference, read_space
from sweep.study.faults import Faults, Key, S, read_section
from sweep.study.limits import check_fitted_stroke, read_limits, read_output_name
from sweep.study.machine import flattened, read_machine
from sweep.study.model import (
    REQUIRED_TABLES,
    TABLES,
    AccuracySection,
    BudgetSection,
    FitSection,
    MechanismSection,
    ObjectiveSection,
    OptimiseSection,
    OutputSection,
    ParetoSection,
    ReferenceSection,
    ReportSection,
    SceneSection,
    StudySection,
    ToleranceSection,
)
from sweep.study.pareto import read_pareto
from sweep.study.prescribed import prescribed_limits, read_locus, read_prescribed
from sweep.study.study import Budget, Limit, Objective, OptimiseSettings, OutputSettings, Study, Tolerance
from sweep.study.toml import read_toml

if TYPE_CHECKING:
    from sweep.synthesis.fit import LineFit

DEFAULT_TARGET = 1e-8


def load_study(path: str | Path, smoke: bool = False) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path : a study.toml, or the folder that holds one
    smoke : lay smoke.toml, which lies beside it and holds only the keys that differ, over it

    Raises
    ------
    StudyError
        lists every fault with file, key, value and what is allowed.
    """
    file = Path(path)
    file = file / "study.toml" if file.is_dir() else file
    files = {file.name: read_toml(file)}
    if smoke:
        beside = file.with_name("smoke.toml")
        files[beside.name] = read_toml(beside)
        return _build(merged(files[file.name], files[beside.name]), file, files)
    return _build(files[file.name], file, files)


def study_from_data(data: Mapping[str, Any], path: str | Path) -> Study:
    """The study of ``Study.data`` (as a dataset's _plan.json keeps it); ``path`` is what messages name.

    Raises
    ------
    StudyError
        as :func:`load_study`.
    """
    return _build(data, Path(path), {Path(path).name: data})


def with_accuracy(study: Study, target: float | None = None, certify: bool | Sequence[str] | None = None) -> Study:
    """The same study with its extrema refined to another relative error, or with or without the proof of its maxima.

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


def merged(base: Mapping[str, Any], over: Mapping[str, Any], key: tuple[str, ...] = ()) -> dict[str, Any]:
    """Lay one file's tables over another's, key by key.

    [accuracy] and whatever stands as value or values of a parameter replace what they cover: half of one and half of
    the other would be neither.
    """
    result = copy.deepcopy(dict(base))
    for name, new in over.items():
        old = result.get(name)
        if not isinstance(old, dict) or not isinstance(new, dict) or (*key, name) == ("accuracy",):
            result[name] = copy.deepcopy(new)
        elif {"value", "values"}.isdisjoint({*old, *new}):
            result[name] = merged(old, new, (*key, name))
        else:
            result[name] = copy.deepcopy(new)
    return result


def _build(data: Mapping[str, Any], path: Path, files: Mapping[str, Mapping[str, Any]]) -> Study:
    members = data.get("machine")
    data = flattened(data, members)
    faults = Faults({name: flattened(content, members) for name, content in files.items()})
    for name in data:
        if name not in TABLES:
            faults.unknown((name,), [t for t in TABLES if t not in data], "table")
    for name in REQUIRED_TABLES:
        if name not in data:
            faults.missing((name,), f"a table [{name}]")

    about = _section(StudySection, "study", data, faults)
    scene = _section(SceneSection, "scene", data, faults)
    search = _section(OptimiseSection, "optimise", data, faults)
    output = _section(OutputSection, "output", data, faults)
    budget = _section(BudgetSection, "budget", data, faults)
    report = _section(ReportSection, "report", data, faults)
    goal = _section(ObjectiveSection, "objective", data, faults).minimise
    accuracy = _accuracy(_section(AccuracySection, "accuracy", data, faults), faults)
    design = _free_table("design", data, faults)
    prescribed_table = _free_table("locus", data, faults)
    bounds = _free_table("limits", data, faults)
    reference_design = _section(ReferenceSection, "reference", data, faults).design
    mechanism, bare = _mechanism(data, faults)

    speed = _quantity(scene.speed, "rad/s", ("scene", "speed"), faults)
    window = _window(scene, faults)
    time_budget = _quantity(search.time_budget, "s", ("optimise", "time_budget"), faults)
    unseen = _share(search.unseen, ("optimise", "unseen"), faults)
    tolerance = _tolerance(_section(ToleranceSection, "tolerance", data, faults), data, faults)
    disk_bytes = _quantity(budget.disk, "B", ("budget", "disk"), faults)
    seconds = _quantity(budget.time, "s", ("budget", "time"), faults)
    front = _section(ParetoSection, "pareto", data, faults)
    front_budget = _quantity(front.time_budget, "s", ("pareto", "time_budget"), faults)
    if "pareto" in data and "optimise" not in data:
        faults.missing(("optimise",), "a table [optimise], as [pareto] begins at the optimum")
    if "optimise" in data and "objective" not in data:
        faults.missing(("objective",), "a table [objective] with minimise = a design output, as [optimise] is given")
    if not scene.want and not bounds and goal is None:
        faults.missing(("scene", "want"), "design outputs to compute, here or in [limits] or [objective]")

    if bare is None:
        raise StudyError(str(path), faults.lines)
    names = [name for _, name in _texts(data, "scene", "want")]
    family = extended(
        bare, [*names, *(bounds or {}), *([goal] if goal else []), *([front.output] if front.output else [])]
    )
    given = {} if speed is None else speeds(family, speed)
    for k, name in _texts(data, "scene", "want"):
        read_output_name(family, name, ("scene", "want", k), faults)
    locus = read_locus(bare, faults) if prescribed_table is not None else None
    if search.variables == "locus" and prescribed_table is None:
        faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    sampled = isinstance(design, dict) and "sample" in design
    prescribed = {} if locus is None else read_prescribed(locus, prescribed_table or {}, faults, sampled)
    for name in [name for name in bounds or () if name in prescribed]:
        faults.value(("limits", name), (bounds or {})[name], "nothing here: [locus] prescribes it")
    limits = (*prescribed_limits(prescribed), *read_limits(family, bounds or {}, faults))
    chained = [stage.family.name for stage in bare.stages] if isinstance(bare, Chain) else []
    if search.globally == "proportions" and chained != ["rssr", "guide"]:
        faults.value(("optimise", "global"), "proportions", '"none", or the chain ["rssr", "guide"]')
    if goal is not None:
        read_output_name(family, goal, ("objective", "minimise"), faults)
    pareto = None
    if isinstance(data.get("pareto"), dict):
        pareto = read_pareto(front, data["pareto"], family, goal, front_budget, faults)
    fit = _fit(_section(FitSection, "fit", data, faults), family, faults) if "fit" in data else None
    if fit is not None and "optimise" in data:
        check_fitted_stroke(fit, family, bounds or {}, faults)
    fitted = fit.parameters(family) if fit is not None else ()
    made = () if locus is None else locus.made
    space = None if design is None else read_space(family, design, faults, fitted, given, made, prescribed)
    if "optimise" in data and space is not None and fit is None and (locus is None or search.variables != "parameters"):
        check_varied(family, space, design or {}, faults)
    # The inputs of effects describe the scene: the reference design has the same unless it says otherwise.
    if space is not None:
        given |= {name: x for name, x in space.fixed.items() if name not in (*bare.parameter_names, *prescribed)}
    if tolerance is not None:
        _check_touched(family, tolerance, limits, faults)
    reference = None if reference_design is None else read_reference(family, reference_design, faults, given)
    _check_figures(report, faults)
    _check_curves(report, [*prescribed, *(name for name in design or () if name in family.parameter_names)], faults)
    if faults.lines or space is None or disk_bytes is None or seconds is None:
        raise StudyError(str(path), faults.lines)

    wanted = [*scene.want, *prescribed, *(limit.output for limit in limits), *([goal] if goal else [])]
    wanted += [pareto.output] if pareto else []
    want = tuple(name for name in dict.fromkeys(wanted) if name not in family.parameter_names)
    if accuracy.certify:
        _check_certifiable(family, want, accuracy, path, faults)
    defaults = {"accuracy": accuracy_table(accuracy), "output": output.model_dump()}
    return Study(
        name=about.name or "",
        title=about.title,
        question=about.question,
        path=path,
        mechanism=mechanism,
        speed=speed,
        want=want,
        space=space,
        locus=locus,
        fit=fit,
        limits=limits,
        objective=Objective(goal) if goal else None,
        accuracy=accuracy,
        window=window,
        optimise=_search_settings(search, time_budget, unseen) if "optimise" in data else None,
        pareto=pareto,
        tolerance=tolerance,
        reference=reference,
        output=OutputSettings(output.keep, output.dtype, output.curves),
        budget=Budget(disk_bytes, seconds),
        data=copy.deepcopy(dict(data)) | defaults,
    )


def _section(model: type[S], name: str, data: Mapping[str, Any], faults: Faults) -> S:
    return read_section(model, data[name], (name,), faults) if name in data else model()


def _free_table(name: str, data: Mapping[str, Any], faults: Faults) -> dict[str, Any] | None:
    raw = data.get(name)
    if raw is None or isinstance(raw, dict):
        return raw
    faults.value((name,), raw, f"a table [{name}]")
    return None


def _texts(data: Mapping[str, Any], table: str, key: str) -> list[tuple[int, str]]:
    """The texts of a list as it stands in the file, with their places, whatever else is wrong with it."""
    raw = data[table].get(key) if isinstance(data.get(table), dict) else None
    return [(k, name) for k, name in enumerate(raw) if isinstance(name, str)] if isinstance(raw, list) else []


def _quantity(text: str | None, internal: str, key: Key, faults: Faults) -> float | None:
    """A text such as "7000 rpm" in the internal unit; it must be positive."""
    if text is None:
        return None
    try:
        number, unit = units.split(text, internal)
        value = number * units.factor(unit, internal)
    except units.UnitFault as fault:
        faults.value(key, text, str(fault))
        return None
    if not value > 0.0:
        faults.value(key, text, f"a positive number; {units.example(internal)}")
    return value


def _search_settings(search: OptimiseSection, time_budget: float | None, unseen: float) -> OptimiseSettings:
    return OptimiseSettings(
        starts=search.starts,
        seed=search.seed,
        time_budget=time_budget,
        variables=search.variables,
        unseen=unseen,
        looks=search.looks,
        globally=search.globally,
        finalists=search.finalists,
    )


def _share(text: str, key: Key, faults: Faults) -> float:
    """A text such as "2 %" as a share between 0 and 1, neither of them."""
    share = _quantity(text, "1", key, faults)
    if share is not None and not share < 1.0:
        faults.value(key, text, 'a share below 100 %, as "2 %"')
    return 0.5 if share is None else share


def _tolerance(section: ToleranceSection, data: Mapping[str, Any], faults: Faults) -> Tolerance | None:
    if "tolerance" not in data:
        return None
    if "optimise" not in data:
        faults.missing(("optimise",), "a table [optimise], as [tolerance] is about the optimum")
    if section.lengths is None and section.angles is None:
        faults.missing(("tolerance", "lengths"), 'a length as "0.02 mm"; or angles, as "0.05 deg"', instead="angles")
    lengths = _quantity(section.lengths, "mm", ("tolerance", "lengths"), faults)
    angles = _quantity(section.angles, "rad", ("tolerance", "angles"), faults)
    share = None if section.robust is None else _share(section.robust, ("tolerance", "robust"), faults)
    return Tolerance(lengths or 0.0, angles or 0.0, share)


def _check_touched(family: Family, tolerance: Tolerance, limits: Sequence[Limit], faults: Faults) -> None:
    """Report tolerances that change nothing, and a robust search for what no made mechanism can keep."""
    for key, unit, size in (("lengths", "length", tolerance.lengths), ("angles", "angle", tolerance.angles)):
        if size > 0.0 and not any(p.unit == unit and p.choices is None for p in family.parameters):
            faults.value(("tolerance", key), size, f"nothing: {family.name} has no {key} that could deviate")
    equal = [x.output for x in limits if x.minimum is not None and x.minimum == x.maximum]
    if tolerance.robust is not None and equal:
        words = 'limits with room, as swing = "40 +- 0.2 deg": no mechanism that is made keeps an equation'
        faults.value(("tolerance", "robust"), ", ".join(equal), words)


def _window(scene: SceneSection, faults: Faults) -> tuple[float, float] | None:
    if scene.window is None:
        return None
    low, high = scene.window.low, scene.window.high
    if low is None or high is None:
        faults.missing(("scene", "window", "from" if low is None else "to"), "a fraction of the stroke, 0 to 1")
        return None
    if not low < high:
        faults.value(("scene", "window", "to"), high, f"a fraction greater than from = {low:g}")
    return low, high


def _fit(section: FitSection, family: Family, faults: Faults) -> LineFit | None:
    from sweep.synthesis.fit import LineFit

    fit = LineFit(_quantity(section.stroke, "mm", ("fit", "stroke"), faults), section.direction == "free")
    try:
        fit.parameters(family)
    except InputError as error:
        faults.value(("fit",), family.name, error.allowed)
        return None
    return fit


def _accuracy(section: AccuracySection, faults: Faults) -> Accuracy:
    if section.target is not None and section.samples is not None:
        faults.value(("accuracy", "samples"), section.samples, "either target or samples, not both")
    if section.samples is not None:
        if section.certify:
            faults.value(("accuracy", "certify"), True, "false where samples is given: a grid proves nothing")
        return Accuracy(samples=section.samples)
    prove, proven = proofs(section.certify)
    return Accuracy(target=DEFAULT_TARGET if section.target is None else section.target, certify=prove, proven=proven)


def accuracy_table(accuracy: Accuracy) -> dict[str, Any]:
    """[accuracy] as a study file has it."""
    table = {
        "target": accuracy.target,
        "samples": accuracy.samples,
        "certify": list(accuracy.proven) or accuracy.certify,
    }
    return {key: value for key, value in table.items() if value is not None and value is not False}


def _check_certifiable(family: Family, wanted: Sequence[str], accuracy: Accuracy, path: Path, faults: Faults) -> None:
    try:
        check_certifiable(family, wanted, accuracy)
    except InputError as error:
        faults.value(("accuracy", "certify"), error.value, error.allowed)
        raise StudyError(str(path), faults.lines) from None


def _families(section: MechanismSection, data: Mapping[str, Any], faults: Faults) -> tuple[str, ...]:
    raw = data.get("mechanism")
    if isinstance(raw, dict) and "family" in raw and "chain" in raw:
        faults.value(("mechanism", "chain"), raw["chain"], "either family or chain, not both")
    if isinstance(raw, dict) and "family" not in raw and "chain" not in raw:
        faults.missing(("mechanism", "family"), f"one of {', '.join(NAMES)}; or chain, a list of them", instead="chain")
    if section.family is not None:
        return (section.family,)
    return tuple(section.chain or ())


def _mechanism(data: Mapping[str, Any], faults: Faults) -> tuple[tuple[str, ...] | Specification, Family | None]:
    """What [mechanism] or [machine] says, and the family, chain or machine; None with its faults."""
    if "machine" not in data:
        if "mechanism" not in data:
            faults.missing(("mechanism",), "a table [mechanism]")
        if "relations" in data:
            faults.value(("relations",), data["relations"], "nothing here: relations are those of a [machine]")
        names = _families(_section(MechanismSection, "mechanism", data, faults), data, faults)
        return names, _family(names, data, faults)
    if "mechanism" in data:
        faults.value(("mechanism",), data["mechanism"], "either [mechanism] or [machine.NAME], not both")
    for table in ("locus", "fit"):
        if table in data:
            faults.value((table,), data[table], "nothing here: it finishes the links of a [mechanism] alone")
    found = read_machine(data, faults)
    return ((), None) if found is None else found


def speeds(family: Family, speed: float) -> dict[str, float]:
    """What scene.speed gives where an effect asks for the speed of a crank: a member turns ratio times as fast."""
    if isinstance(family, Machine):
        ratios = {m.name: abs(m.ratio) for m in family.members}
        return {p: speed * ratios[parts(p).member] for p in family.parameter_names if parts(p).stem == "speed"}
    return {p: speed for p in family.parameter_names if parts(p).stem == "speed"}


def _family(names: tuple[str, ...], data: Mapping[str, Any], faults: Faults) -> Family | None:
    """The mechanism, or None with a fault for each unknown name, or for a chain that cannot be.

    A misspelt family is a fault, but the rest is checked against the nearest one, so that no second round is needed.
    """
    single = "family" in data.get("mechanism", {}) if names else False
    unknown = [k for k, name in enumerate(names) if name not in NAMES]
    for k in unknown:
        key: Key = ("mechanism", "family") if single else ("mechanism", "chain", k)
        faults.value(key, names[k], f"one of {', '.join(NAMES)}{nearest(names[k], NAMES)}")
    guessed = tuple(closest(name, NAMES) if name not in NAMES else name for name in names)
    if not guessed or None in guessed:
        return None
    try:
        return find_family([name for name in guessed if name is not None])
    except InputError as error:
        faults.value(("mechanism", "chain"), list(names), error.allowed)
        return None


def _check_figures(report: ReportSection, faults: Faults) -> None:
    for k, figure in enumerate(report.figures):
        for name in figure.required:
            if getattr(figure, name) is None:
                faults.missing(("report", "figures", k, name), str(type(figure).model_fields[name].description))
        if figure.file is not None and not re.fullmatch(r"[\w-]+\.svg", figure.file):
            faults.value(("report", "figures", k, "file"), figure.file, "letters, digits, - and _, ending in .svg")


def _check_curves(report: ReportSection, parameters: list[str], faults: Faults) -> None:
    for k, curve in enumerate(report.curves):
        for name in curve.required:
            if getattr(curve, name) is None:
                faults.missing(("report", "curves", k, name), str(type(curve).model_fields[name].description))
        for key, axis in (("x", curve.x), ("y", curve.y)):
            if axis is not None and axis not in parameters:
                allowed = f"one of {', '.join(parameters)}{nearest(axis, parameters)}"
                faults.value(("report", "curves", k, key), axis, allowed)
