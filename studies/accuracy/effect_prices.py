"""The price list of the effects: error of each effect's outputs, and its time, at every accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from studies.accuracy.effect_witness import Effected, known_of
from studies.accuracy.ordinary import designs as ordinary
from studies.accuracy.scenes import SCENES
from studies.accuracy.subjects import moves
from studies.accuracy.timing import per_design
from studies.accuracy.witness import Known
from sweep.effects import NAMES, effect, extended
from sweep.effects.wanted import expanded
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Family
from sweep.families.names import error_of

if TYPE_CHECKING:
    import pandas as pd

SAMPLES, TARGETS = (90, 360, 3600), (1e-3, 1e-6, 1e-9)
SMOKE_SAMPLES, SMOKE_TARGETS, SMOKE_EVERY = (360,), (1e-6,), 12
GRID, REFINED = "grid", "accuracy="
DEAR, DEAR_POSE, DEAREST = 5e6, 1e3, 5e7  # ns per design and per pose; per design
MASS, ARM, MIXED = 1e-4, 0.4, ("xy", "xz", "yz")  # masses of bodies without inputs [t]; share of an ordinary length
MANY, FEW = 8, 2
SPARE = 4  # ordinary designs per measured one, since not all of them turn
ROUNDING = 1e-14  # difference of two methods beyond their own error estimates


PRICED = (*NAMES, *SCENES)


def effect_prices(smoke: bool, names: Sequence[str] | None = None) -> pd.DataFrame:
    """Return rows of every effect by accuracy, on the first family it serves, and of the scenes; or of ``names``."""
    import pandas as pd

    rows: list[dict[str, object]] = []
    for name in PRICED[:: SMOKE_EVERY if smoke else 1] if names is None else names:
        if name in SCENES:
            on, scene = SCENES[name]
            rows += prices_of(name, on, *scene(FEW if smoke else MANY), smoke)
            continue
        bare = family(effect(name).families[0])
        wanted = outputs_of(name, bare)
        full = extended(bare, wanted)
        given = Effected(bare, full, loaded(bare, full, count(name, smoke)))
        rows += prices_of(name, bare.name, given, wanted, smoke)
        print(f"        {name}", flush=True)  # noqa: T201
    return pd.DataFrame(rows)


def loaded(bare: Family, full: Family, designs: int) -> Array:
    """Return ordinary designs with the inputs of an effect; bodies without any mass get one, or all loads would vanish.

    If a tool at a tip is the only mass, the tip is placed off the axis of its link for the same reason.
    """
    own, some = len(bare.parameters), ordinary(full, SPARE * designs)
    matrix = some[moves(bare, some[:, :own])][:designs]
    still = {p.name: k for k, p in enumerate(full.parameters) if k >= own and not matrix[:, k].any()}
    inert = [p.name for p in full.parameters[own:] if p.unit in ("mass", "inertia") and p.name != "m_tool"]
    bodies = [name for name in inert if name.startswith("m_")]
    lengths = [abs(x) for x, p in zip(matrix[0], bare.parameters, strict=False) if p.unit == "length"]
    length = float(np.median(lengths)) if lengths else 1.0  # proportions alone have the unit length
    for name, k in still.items():
        if name == "tool_x" and not inert:
            matrix[:, k] = ARM * length
        elif all(body in still for body in bodies):
            if name.startswith("m_"):
                matrix[:, k] = MASS
            elif name.startswith("com_") and name.endswith("_x"):
                matrix[:, k] = ARM * length
            elif name.startswith("j_") and not name.endswith(MIXED):
                matrix[:, k] = MASS * (ARM * length) ** 2
    return matrix


def count(name: str, smoke: bool) -> int:
    """Return the number of designs on which an effect is measured."""
    if effect(name).ns_per_design > DEAREST:
        return 1
    dear = effect(name).ns_per_design > DEAR or effect(name).ns_per_pose > DEAR_POSE
    return FEW if smoke or dear else MANY


def outputs_of(name: str, bare: Family) -> tuple[str, ...]:
    """Return the outputs of an effect in ``want``; for an output with the effect's name those of a whole turn."""
    found = tuple(expanded(bare, [name]))
    whole = effect(name).design_result
    if found != (name,) or whole is None:
        return found
    return tuple(o.name for o in whole.outputs if not o.jumps and not o.name.startswith(f"{bare.domain.name}_"))


def prices_of(
    name: str, on: str, given: Effected, wanted: tuple[str, ...], smoke: bool = False
) -> list[dict[str, object]]:
    """Return rows of one effect or scene, for its outputs."""
    known, words = known_of(name, given, wanted)
    head: dict[str, object] = {
        "effect": name,
        "family": on,
        "outputs": len(wanted),
        "judged": sum(output in known for output in wanted),
        "designs": len(given.designs),
        "reference": words,
    }
    return [
        head | {"method": method, "setting": setting} | _priced(given, wanted, accuracy, known)
        for method, setting, accuracy in _methods(name, smoke)
    ]


def _methods(name: str, smoke: bool) -> Sequence[tuple[str, float, Accuracy]]:
    samples, targets = (SMOKE_SAMPLES, SMOKE_TARGETS) if smoke else (SAMPLES, TARGETS)
    if name in NAMES and effect(name).whole_turn:
        samples = samples[:1]  # the effect chooses its samples
    return [
        *((GRID, float(n), Accuracy(samples=n)) for n in samples),
        *((REFINED, target, Accuracy(target=target)) for target in targets),
    ]


def _priced(given: Effected, wanted: tuple[str, ...], accuracy: Accuracy, known: dict[str, Known]) -> dict[str, object]:
    run = partial(design_outputs, given.full, wanted=wanted, accuracy=accuracy)
    columns = run(given.designs)
    errors, own, exceeded = {}, {}, 0
    for output in (output for output in wanted if output in known):
        value, sure = known[output]
        size, found = np.where(value != 0.0, np.abs(value), 1.0), np.asarray(columns[output], np.float64)
        off = np.abs(found - value)
        if np.isfinite(off).any():
            errors[output], own[output] = (float(np.nanmax(part / size)) for part in (off, sure))
        if accuracy.target is not None:
            said = np.asarray(columns[error_of(output)], np.float64)
            exceeded += int((off > said + sure + ROUNDING * size).sum())
    worst = max(errors, key=lambda output: errors[output], default="")
    return {
        "largest_error": errors.get(worst, float("nan")),
        "median_error": float(np.median(list(errors.values()))) if errors else float("nan"),
        "reference_error": own.get(worst, float("nan")),
        "worst_output": worst,
        "exceeded": exceeded,
        "unsure": int((columns["status"] != st.OK).sum()),
        **per_design(run, given.designs),
    }
