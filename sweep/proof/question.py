"""The question of a proof: space of designs on the locus, objective, and limits of a study that a proof can use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels.boxes.tube import HIGH, LOW, least_acceleration, tube
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.families.capabilities import ProvableLocus
from sweep.families.chain import Chain
from sweep.optimise.multistart.multistart import listed
from sweep.quantities.limits import Limit, meets, tightest
from sweep.study import Study

MOST_FREE = 4
HUGE = 1e9  # not an acceleration: a larger target stands for none
WEAKER = 1.0 - 1e-14  # cos^2 of a limit, rounded so that more designs are feasible


@dataclass(frozen=True)
class Question:
    """A space of designs on the locus with objective and limits; lengths in mm, angles in rad.

    ``names`` are the free coordinates, between ``low`` and ``high``; ``given`` are all coordinates, with any number for
    the free ones.  ``links`` are the lower and upper limit of every link, infinite without one.  ``left_out`` are
    limits of the study that the proof does not use; the bound then holds for more designs, and is lower.
    """

    provable: ProvableLocus
    objective: str
    names: tuple[str, ...]
    low: Array
    high: Array
    given: Array
    branch: float
    cos2: float
    links: Array
    left_out: tuple[str, ...]

    @property
    def free(self) -> Array:
        """Indices of the free coordinates in the kernels."""
        return np.array([self.provable.coordinates.index(name) for name in self.names], np.float64)

    @property
    def floor(self) -> float:
        """Lower bound of the objective for any motion from rest to rest in the given time, in the unit of the rows."""
        motion = self._motion()
        if motion is None:
            return 0.0
        swing, phi0 = motion
        return max(least_acceleration(swing, phi0), least_acceleration(swing, 2.0 * np.pi - phi0))

    def tube(self, target: float) -> Array:
        """Return bounds of a rocker's motion with an acceleration of at most ``target``; empty without such bounds.

        At poses where the tube is too wide its sides are infinite: across the tube, psi must not meet the other
        assembly mode.  That mode is 2 atan(T/W) away, with T at least b cos(mu), W at most b + c.
        """
        motion = self._motion()
        if motion is None or not self.floor < target < HUGE:
            return np.zeros((0, 9))
        least, longest = max(float(self.links[-2]), 0.0), self._longest_rocker()  # of the coupler, and of the rocker
        bounds = tube(*motion, target)
        # a tube of half a turn or more contains the other mode in any case
        wide = np.tan(0.5 * np.minimum(bounds[:, HIGH] - bounds[:, LOW], np.pi))
        blurred = ~(wide * (least + longest) < least * np.sqrt(self.cos2) * WEAKER)
        bounds[blurred, LOW], bounds[blurred, HIGH] = -np.inf, np.inf
        return bounds

    def _longest_rocker(self) -> float:
        names = self.provable.links
        if "c" in names:
            return float(self.links[2 * names.index("c") + 1])
        return float(self.given[self.provable.coordinates.index("c")])

    def _motion(self) -> tuple[float, float] | None:
        """Return swing and phi0 if the objective is an acceleration and both are fixed, otherwise None."""
        order = self.provable.objectives[self.objective]
        return None if order != 2 or set(self.names) & {"swing", "phi0"} else (self.given[0], self.given[1])

    def in_kernel(self, value: float) -> float:
        """Return a value of the objective in the unit of the proof's rows: sin^2 for a pressure angle."""
        return float(np.sin(value) ** 2) if self.provable.objectives[self.objective] == 0 else value

    def outside(self, bound: float) -> float:
        """Return the value of the objective for a bound in the unit of the proof's rows."""
        if self.provable.objectives[self.objective] == 0:
            return float(np.arcsin(np.sqrt(min(max(bound, 0.0), 1.0))))
        return bound


def question_of(study: Study) -> Question:
    """Return the question that a study asks.

    Raises
    ------
    InputError
        if proofs do not support the mechanism, the objective or the number of free parameters.
    """
    place = f"{study.path}: optimise.prove"
    provable = None if isinstance(study.family, Chain) or study.locus is None else _suited(study)
    if provable is None:
        allowed = "a study of one mechanism with 'proven optimum' in sweep families, and with a table [locus]"
        raise InputError("optimise.prove", study.family.name, allowed, place)
    assert study.objective is not None
    if study.objective.output not in provable.objectives:
        allowed = f"an objective among {', '.join(provable.objectives)}"
        raise InputError("objective.minimise", study.objective.output, allowed, place)
    entries = _entries(study, provable.coordinates, place)
    names = tuple(name for name, (low, high) in entries.items() if low < high)
    if not 0 < len(names) <= MOST_FREE:
        allowed = f"1 to {MOST_FREE} parameters that vary; give the others one value each"
        raise InputError("free parameters", ", ".join(names) or "none", allowed, place)
    swing = entries[provable.coordinates[0]]
    if swing[0] * swing[1] <= 0.0:
        raise InputError("locus.swing", swing, "angles of one sign", place)
    cos2, links, left_out = _limits(study, provable, entries)
    return Question(
        provable, study.objective.output, names,
        np.array([entries[n][0] for n in names]), np.array([entries[n][1] for n in names]),
        np.array([low for low, _ in entries.values()]), -1.0 if swing[0] > 0.0 else 1.0, cos2, links, left_out,
    )  # fmt: skip


def _suited(study: Study) -> ProvableLocus | None:
    """Return the locus whose coordinates the study gives; for a fixed rocker length the locus by the rocker.

    On that locus e and g follow, and their ranges become limits; otherwise e and g are coordinates, and the rocker
    follows.
    """
    ways, known = study.family.every(ProvableLocus), {*study.space.bounds, *study.space.fixed}
    given = {limit.output for limit in study.parameter_limits if limit.minimum == limit.maximum is not None}
    by_rocker = [way for way in ways if given & set(way.coordinates)]
    others = [way for way in ways if way not in by_rocker and set(way.coordinates) <= known]
    return next(iter(by_rocker or others), None)


def _entries(study: Study, coordinates: tuple[str, ...], place: str) -> dict[str, tuple[float, float]]:
    """Return the interval of every coordinate; its ends are equal if the coordinate is fixed."""
    intervals: dict[str, tuple[float, float]] = {}
    chosen = listed(study)
    for name in coordinates:
        if name in chosen:
            allowed = "one value, or a range with from and to: a proof covers a space without gaps"
            raise InputError(name, "a list of values", allowed, place)
        fixed = next((x.minimum for x in study.limits if x.output == name and x.minimum == x.maximum), None)
        if name in study.space.bounds:
            low, high = study.space.bounds[name]
        elif name in study.space.fixed:
            low = high = float(study.space.fixed[name])
        elif fixed is not None:
            low = high = fixed
        else:  # an angle of the rocker, unrestricted
            low, high = -np.pi, np.pi
        intervals[name] = _narrowed(study, name, float(low), float(high))
    return intervals


def _narrowed(study: Study, name: str, low: float, high: float) -> tuple[float, float]:
    """Return the interval of a coordinate reduced by the limits on it; unchanged if nothing would remain."""
    if name in study.prescribed:
        return low, high
    least, most = tightest([*study.limits, Limit(name, low, high)], name)
    return (least, most) if least <= most else (low, high)


def _limits(
    study: Study, provable: ProvableLocus, entries: Mapping[str, tuple[float, float]]
) -> tuple[float, Array, tuple[str, ...]]:
    """Return the least cos^2 of the pressure angle, the limits of every link, and the names of unused limits."""
    cos2, left_out = 0.0, []
    links = np.array([-np.inf, np.inf] * len(provable.links))
    for number, name in enumerate(provable.links):
        if name in study.space.bounds:
            links[2 * number : 2 * number + 2] = study.space.bounds[name]
        elif name in study.space.fixed:
            links[2 * number : 2 * number + 2] = study.space.fixed[name]
    satisfied = {"rotatable", *study.prescribed}
    for limit in study.limits:
        name = limit.output
        if name == "max_pressure_angle" and limit.maximum is not None:
            cos2 = max(cos2, float(np.cos(min(limit.maximum, 0.5 * np.pi)) ** 2) * WEAKER)
        elif name == "margin" and limit.minimum is not None:
            cos2 = max(cos2, limit.minimum * WEAKER)
        elif name in provable.links:
            ends = links[2 * provable.links.index(name) :][:2]
            ends[:] = max(ends[0], limit.ends[0]), min(ends[1], limit.ends[1])
        elif name not in satisfied and not (name in entries and meets(limit, np.array(entries[name])).all()):
            left_out.append(name)
    return cos2, links, tuple(left_out)


def described(question: Question) -> Mapping[str, Any]:
    """Return the data with which another program can check the certificate."""
    return {
        "objective": question.objective,
        "coordinates": list(question.provable.coordinates),
        "free": list(question.names),
        "low": question.low.tolist(),
        "high": question.high.tolist(),
        "given": question.given.tolist(),
        "branch": question.branch,
        "cos2": question.cos2,
        "links": {
            name: [None if np.isinf(end) else end for end in question.links[2 * k : 2 * k + 2]]
            for k, name in enumerate(question.provable.links)
        },
        "limits not used": list(question.left_out),
    }
