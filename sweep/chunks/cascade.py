"""Cascade: designs pass through the routes of a study, quick ones first, and leave at the first limit they miss.

Few designs survive the first limits, and a call of a costly route takes a millisecond or more even for a few designs.
So survivors wait before each route until a batch is full, or until no more come.  Measured times decide only the size
of batches: a design's row does not depend on them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels import status as codes
from sweep.chunks.parameters import completed
from sweep.costs import nanoseconds
from sweep.effects import called_for
from sweep.evaluation.routes import GOES_ON
from sweep.evaluation.summaries import Route, design_outputs, routes
from sweep.families.base import Array, Columns, Work
from sweep.families.curve_features import Crossing
from sweep.families.names import error_of, parts
from sweep.quantities.limits import Limit, meets
from sweep.study import Study
from sweep.synthesis.fit import driving_outputs, fit_line

# Largest batch of a route, so that its tables stay in the caches; a costly route gets at most what it computes in
# BATCH_SECONDS, so that a stop is noticed in between.
BLOCK = 16384
BATCH_SECONDS = 0.1
FEWEST = 8  # a search on poses takes a twelfth longer than in batches of 64
# Measured: the time [s] that a call of a route takes even for a few designs.
CALL_SECONDS = 1e-3


class Dropped(Exception):
    """Raised to abandon unfinished work because the run was asked to stop."""


@dataclass(frozen=True)
class Level:
    """One level of the cascade: a route and its cost; where ``route`` is None, the fit and the limits on parameters.

    ``columns`` is the number of leading columns of the design matrix that the level needs; None for all.  ``further``
    are outputs for a later level that the route computes at no extra cost.
    """

    route: Route | None
    ns_per_design: float
    columns: int | None = None
    further: tuple[str, ...] = ()

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs that the level computes, without ``further``."""
        return () if self.route is None else self.route.outputs

    @property
    def batch(self) -> int:
        """Number of designs per call of the route."""
        return batch_size(self.ns_per_design)


def batch_size(ns_per_design: float) -> int:
    """Choose the number of designs that are computed between two looks at the stop flag."""
    return int(min(max(1e9 * BATCH_SECONDS / max(ns_per_design, 1.0), FEWEST), BLOCK))


@dataclass(frozen=True)
class Batch:
    """A batch of designs: index (k,), parameters (k, P), outputs found so far, each (k,), and status (k,)."""

    index: NDArray[np.int64]
    designs: Array
    outputs: dict[str, Array]
    status: NDArray[np.uint8]

    def only(self, which: NDArray[np.int64] | slice) -> Batch:
        """Select designs of the batch by index or slice."""
        outputs = {name: values[which] for name, values in self.outputs.items()}
        return Batch(self.index[which], self.designs[which], outputs, self.status[which])

    def ordered(self) -> Batch:
        """Sort the designs by their index; an ordered batch is returned as it is."""
        if bool(np.all(self.index[1:] >= self.index[:-1])):
            return self
        return self.only(np.argsort(self.index, kind="stable"))

    @classmethod
    def joined(cls, batches: Sequence[Batch]) -> Batch:
        """Concatenate batches with the same outputs."""
        if len(batches) == 1:
            return batches[0]
        return cls(
            np.concatenate([batch.index for batch in batches]),
            np.concatenate([batch.designs for batch in batches]),
            {name: np.concatenate([batch.outputs[name] for batch in batches]) for name in batches[0].outputs},
            np.concatenate([batch.status for batch in batches]),
        )


class Cascade:
    """The levels of a study with the designs that wait at each of them.

    A design's row does not depend on the other designs of its batch, so it does not depend on how designs are fed.

    Parameters
    ----------
    study : gives family, wanted outputs, limits and accuracy
    keep : whether designs that miss a limit are among the results; they are counted either way
    should_stop : called before every batch; if it returns true, `Dropped` is raised
    """

    def __init__(self, study: Study, keep: bool = True, should_stop: Callable[[], bool] = lambda: False) -> None:
        self.study, self.keep, self.should_stop = study, keep, should_stop
        self.levels = levels(study)
        self.reached = [0] * len(self.levels)
        self.counts = np.zeros(256, np.int64)
        self.missed = Counter[str]()
        self._waiting: list[list[Batch]] = [[] for _ in self.levels]
        self._left: list[Batch] = []
        self._go_on = GOES_ON if study.output.keep == "all" else np.arange(256) == codes.OK

    def feed(self, index: NDArray[np.int64], designs: Array, status: NDArray[np.uint8]) -> None:
        """Feed designs with all parameters (k, P), or with the leading columns that the first level needs.

        Designs whose status (k,) is not OK leave at once.
        """
        self._sort(Batch(index, designs, {}, status), status == codes.OK, 0)
        self._work(0, flush=False)

    def end(self, names: Sequence[str]) -> Batch:
        """Finish every waiting design, and return the results.

        Returns
        -------
        Batch
            in the order of the index; the named outputs, nan where not computed; status 0 for designs that meet every
            limit, LIMIT_EXCEEDED for those that miss one, otherwise the status of the kernel that returned no value.
        """
        for number in range(len(self.levels)):
            self._work(number, flush=True)
        batches, width = self._left, len(self.study.family.parameters)
        index = np.concatenate([np.empty(0, np.int64), *(batch.index for batch in batches)])
        order = np.argsort(index, kind="stable")
        # Column by column, each released once it is joined: a chunk is in memory once, not three times.
        outputs: dict[str, Array] = {}
        for name in names:
            taken = [batch.outputs.pop(name, None) for batch in batches]
            missing = [np.full(batch.index.size, np.nan) for batch in batches]
            columns = [gap if values is None else values for values, gap in zip(taken, missing, strict=True)]
            outputs[name] = np.concatenate([np.empty(0), *columns])[order]
        designs = np.concatenate([np.empty((0, width)), *(batch.designs for batch in batches)])[order]
        status = np.concatenate([np.empty(0, np.uint8), *(batch.status for batch in batches)])[order]
        batches.clear()
        return Batch(index[order], designs, outputs, status)

    def _work(self, number: int, flush: bool) -> None:
        """Compute the batches that wait at a level and at later levels; incomplete batches only to ``flush``."""
        if number == len(self.levels):
            return
        level, waiting = self.levels[number], self._waiting[number]
        count = sum(batch.index.size for batch in waiting)
        if not count or (count < level.batch and not flush):
            return
        together = Batch.joined(waiting)
        end = count if flush else count - count % level.batch
        waiting[:] = [together.only(slice(end, None))] if end < count else []
        for low in range(0, end, level.batch):
            if self.should_stop():
                raise Dropped
            part = together.only(slice(low, min(low + level.batch, end)))
            self.reached[number] += part.index.size
            if level.columns is None or level.columns > part.designs.shape[1]:
                part = self._completed(part)
            done, goes_on = self._fitted(part) if level.route is None else self._computed(level, part)
            self._sort(done, goes_on, number + 1)
            self._work(number + 1, flush=False)

    def _completed(self, batch: Batch) -> Batch:
        """Add the missing parameter columns to the designs of a batch."""
        designs = completed(self.study, batch.index, batch.designs)
        return batch if designs is batch.designs else replace(batch, designs=designs)

    def _computed(self, level: Level, batch: Batch) -> tuple[Batch, NDArray[np.bool_]]:
        """Add the outputs of a level to a batch; return the batch and a mask of the designs that go on."""
        study = self.study
        outputs = self._found(level, batch)
        status = np.where(batch.status == codes.OK, outputs["status"], batch.status)
        for limit in study.tested_limits:
            if limit.output in outputs:
                self._leave(limit, status, (status == codes.OK) & ~meets(limit, outputs[limit.output]))
        added = {name: np.asarray(values, np.float64) for name, values in outputs.items() if name != "status"}
        return Batch(batch.index, batch.designs, batch.outputs | added, status), self._go_on[status]

    def _found(self, level: Level, batch: Batch) -> Mapping[str, NDArray[Any]]:
        """Compute the outputs of a level with their error estimates, and ``status``."""
        study, outputs = self.study, (*level.outputs, *level.further)
        return design_outputs(study.family, batch.designs, outputs, study.accuracy, study.window)

    def _fitted(self, batch: Batch) -> tuple[Batch, NDArray[np.bool_]]:
        """Fit the parameters of a batch; return the batch and a mask of the designs within the parameter limits."""
        study, designs, status = self.study, batch.designs, batch.status.copy()
        goes_on = np.ones(status.size, np.bool_)
        if study.fit is not None:
            driving = [batch.outputs[name] for name in driving_outputs(study.family) if name in batch.outputs]
            pair = (driving[0], driving[1]) if len(driving) == 2 and bool(np.all(status == codes.OK)) else None
            designs, fit_status = fit_line(study.family, designs, study.fit, study.window, pair)
            status[:] = fit_status
            goes_on = fit_status == codes.OK
        for limit in study.parameter_limits:
            exceeds = goes_on & ~meets(limit, designs[:, study.family.parameter_names.index(limit.output)])
            self._leave(limit, status, exceeds)
            goes_on &= ~exceeds
        return Batch(batch.index, designs, batch.outputs, status), goes_on

    def _leave(self, limit: Limit, status: NDArray[np.uint8], exceeds: NDArray[np.bool_]) -> None:
        np.copyto(status, codes.LIMIT_EXCEEDED, where=exceeds)
        self.missed[limit.output] += int(np.count_nonzero(exceeds))

    def _sort(self, batch: Batch, goes_on: NDArray[np.bool_], number: int) -> None:
        """Queue the designs that go on at the next level, if any; count the others, and keep their rows if wanted."""
        staying = np.flatnonzero(goes_on) if number < len(self.levels) else np.empty(0, np.int64)
        if staying.size:
            self._waiting[number].append(batch if staying.size == goes_on.size else batch.only(staying))
        if staying.size == goes_on.size:
            return
        # Most designs leave: counting all and subtracting the staying ones is cheaper than selecting the leaving ones.
        self.counts += np.bincount(batch.status, minlength=self.counts.size)
        self.counts -= np.bincount(batch.status[staying], minlength=self.counts.size)
        leaves = np.ones(goes_on.size, np.bool_) if self.keep else batch.status == codes.OK
        leaves[staying] = False
        if leaves.any():
            self._left.append(self._completed(batch if leaves.all() else batch.only(np.flatnonzero(leaves))))


class Recalled(Cascade):
    """Cascade for designs whose outputs are known from an earlier run with other limits.

    Parameters
    ----------
    study, keep, should_stop : as for `Cascade`
    known : column ``design``, ascending, and every output and error estimate of these designs, in float64
    """

    def __init__(self, study: Study, keep: bool, should_stop: Callable[[], bool], known: Columns) -> None:
        super().__init__(study, keep, should_stop)
        self.known = known

    def _found(self, level: Level, batch: Batch) -> Mapping[str, NDArray[Any]]:
        rows = np.searchsorted(self.known["design"], batch.index)
        names = [name for out in level.outputs for name in (out, error_of(out)) if name in self.known]
        return {name: self.known[name][rows] for name in names} | {"status": np.zeros(batch.index.size, np.uint8)}


def levels(study: Study) -> tuple[Level, ...]:
    """Levels of a study: its routes in the order of `Work`, the fit before routes that need fitted parameters."""
    ordered = [_level(study, route) for route in ordered_routes(study)]
    if study.fit is not None or study.parameter_limits:
        position = sum(_before_fit(study, level.route) for level in ordered if level.route is not None)
        ordered.insert(position, Level(None, nanoseconds("work", "fit") if study.fit is not None else 0.0))
    return tuple(ordered)


def _level(study: Study, route: Route) -> Level:
    """Make the level of a route; a route with one of the outputs that the fit needs also computes the other."""
    needed = driving_outputs(study.family) if study.fit is not None else ()
    further = tuple(name for name in needed if name not in route.outputs) if set(needed) & set(route.outputs) else ()
    return Level(route, route.ns_per_design, route.columns, further)


def ordered_routes(study: Study) -> tuple[Route, ...]:
    """Order the routes of a study by `Work`; routes that need fitted parameters come last.

    Where only feasible designs are kept, effects and other long routes follow all limits, unless they have limits
    themselves.
    """
    selected = routes(study.family, study.want, study.accuracy, study.window is not None, _jumping(study))
    limited = {limit.output for limit in study.tested_limits}

    def place(route: Route) -> tuple[bool, bool]:
        waits = study.output.keep != "all" and route.order[0] >= Work.EFFECT and limited.isdisjoint(route.outputs)
        return not _before_fit(study, route), waits

    return tuple(sorted(selected, key=place))


def _jumping(study: Study) -> frozenset[str]:
    """Pose outputs that jump where a tool pierces, in a study that gives it a force."""
    fixed, bounds = study.space.fixed, study.space.bounds
    largest = np.array([[fixed.get(name, bounds.get(name, (0.0, 0.0))[1]) for name in study.family.parameter_names]])
    return frozenset().union(*(known.of for known in study.family.every(Crossing) if known.matters(largest).any()))


def _before_fit(study: Study, route: Route) -> bool:
    """Whether a route needs only stages before the one that [fit] completes, and no load of that stage."""
    if study.fit is None:
        return False
    last = len(study.bare.stages)
    numbers = [parts(name).stage for name in route.outputs]
    if not all(number and int(number) < last for number in numbers):
        return False
    # The loads of a stage include those of all later stages.
    return not any(placed.entry.takes_load for placed in called_for(study.bare, route.outputs))
