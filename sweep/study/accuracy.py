"""[accuracy]: a relative error of the extrema, or a grid of crank angles, and the maxima to be proven."""

from __future__ import annotations

from typing import Any

from sweep.errors import InputError
from sweep.families.base import DEFAULT_TARGET, Accuracy, Family
from sweep.reductions.steps import check_certifiable, proofs
from sweep.study.file import Faults, Section, TruthOrNames, holds


class AccuracySection(Section):
    """Table [accuracy]."""

    target: float | None = holds("a relative error, 1e-14 to 0.1", ge=1e-14, le=0.1)
    samples: int | None = holds("a whole number of crank angles, 8 to 1048576", ge=8, le=2**20)
    certify: TruthOrNames = holds("true or false, or a list of the wanted maxima to prove", False)


def read_accuracy(section: AccuracySection, faults: Faults) -> Accuracy:
    """Read [accuracy] as target error, number of samples and maxima to be proven."""
    if section.target is not None and section.samples is not None:
        faults.value(("accuracy", "samples"), section.samples, "either target or samples, not both")
    if section.samples is not None:
        if section.certify:
            faults.value(("accuracy", "certify"), True, "false where samples is given: a grid proves nothing")
        return Accuracy(samples=section.samples)
    prove, proven = proofs(section.certify)
    return Accuracy(target=DEFAULT_TARGET if section.target is None else section.target, certify=prove, proven=proven)


def check_proofs(accuracy: Accuracy, family: Family, want: tuple[str, ...], *, window: bool, faults: Faults) -> None:
    """Report wanted maxima that cannot be proven, in a study that has no other fault."""
    if not accuracy.certify or faults.lines:
        return
    try:
        check_certifiable(family, want, accuracy, window)
    except InputError as error:
        faults.value(("accuracy", "certify"), error.value, error.allowed)


def accuracy_table(accuracy: Accuracy) -> dict[str, Any]:
    """Return [accuracy] as the table of a study file."""
    table = {
        "target": accuracy.target,
        "samples": accuracy.samples,
        "certify": list(accuracy.proven) or accuracy.certify,
    }
    return {key: value for key, value in table.items() if value is not None and value is not False}
