"""[accuracy]: a relative error of the extrema, or a grid of crank angles; and what is to be proven."""

from __future__ import annotations

from typing import Any

from sweep.errors import InputError
from sweep.families.base import Accuracy
from sweep.reductions.catalogue import check_certifiable
from sweep.reductions.steps import proofs
from sweep.study.faults import Faults
from sweep.study.model import AccuracySection
from sweep.study.reading import Reading

DEFAULT_TARGET = 1e-8


def read(reading: Reading) -> None:
    """Read the table."""
    section = reading.section(AccuracySection, "accuracy")
    reading.fields["accuracy"] = _accuracy(section, reading.faults)


def check(reading: Reading) -> None:
    """Report wanted maxima that cannot be proven, in a study that has no other fault."""
    accuracy = reading.fields["accuracy"]
    if not accuracy.certify or reading.faults.lines:
        return
    try:
        check_certifiable(reading.family, reading.fields["want"], accuracy, reading.fields["window"] is not None)
    except InputError as error:
        reading.faults.value(("accuracy", "certify"), error.value, error.allowed)


def accuracy_table(accuracy: Accuracy) -> dict[str, Any]:
    """Return [accuracy] as a study file has it."""
    table = {
        "target": accuracy.target,
        "samples": accuracy.samples,
        "certify": list(accuracy.proven) or accuracy.certify,
    }
    return {key: value for key, value in table.items() if value is not None and value is not False}


def _accuracy(section: AccuracySection, faults: Faults) -> Accuracy:
    if section.target is not None and section.samples is not None:
        faults.value(("accuracy", "samples"), section.samples, "either target or samples, not both")
    if section.samples is not None:
        if section.certify:
            faults.value(("accuracy", "certify"), True, "false where samples is given: a grid proves nothing")
        return Accuracy(samples=section.samples)
    prove, proven = proofs(section.certify)
    return Accuracy(target=DEFAULT_TARGET if section.target is None else section.target, certify=prove, proven=proven)
