"""Design outputs made of others: the negative of one, the box of a mechanism, timings, the value at an event."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI
from sweep.families.base import Accuracy, Array, Columns
from sweep.families.machines import Machine
from sweep.families.names import by_magnitude, error_of
from sweep.families.relations import EventValue, Timing
from sweep.quantities.box import ROUNDING, Box
from sweep.reductions.sampling import pose_columns

SLOPE = 1e-5  # rad, for the slope that says what the error of an angle does to a value there


def negative(name: str, of: str, designs: Array, found: Columns, accuracy: Accuracy) -> Columns:
    """Give the negative of an output, which is small where the output is to be large."""
    values = np.asarray(found[of], np.float64)
    columns: Columns = {name: -np.abs(values) if by_magnitude(of) else -values, "status": found["status"]}
    if accuracy.target is not None:
        columns[error_of(name)] = found[error_of(of)]
    return columns


def extent(box: Box, designs: Array, found: Columns, accuracy: Accuracy) -> Columns:
    """Give the extent of a mechanism from the largest and smallest coordinates of its joints."""
    still = [np.asarray(piece(designs), np.float64) for piece in box.still]
    ends = []
    errors: Array = np.zeros(len(designs))
    for which, take in ((0, np.maximum), (1, np.minimum)):
        names = [pair[which] for pair in box.reductions]
        values = [np.asarray(found[name], np.float64) for name in names]
        ends.append(take.reduce([*values, *still]))  # nan where a joint's extremum is: its status says why
        if accuracy.target is not None:
            errors = errors + np.maximum.reduce([np.asarray(found[error_of(name)], np.float64) for name in names])
    name = box.output.name
    columns: Columns = {name: ends[0] - ends[1], "status": found["status"]}
    if accuracy.target is not None:
        columns[error_of(name)] = errors + 4.0 * ROUNDING * np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    return columns


def difference(timing: Timing, designs: Array, found: Columns, accuracy: Accuracy) -> Columns:
    """Give the difference of two crank angles, in (-pi, pi]."""
    first, second = (np.asarray(found[name], np.float64) for name in timing.places)
    apart = second - first
    columns: Columns = {timing.name: apart - TWO_PI * np.ceil((apart - np.pi) / TWO_PI), "status": found["status"]}
    if accuracy.target is not None:
        errors = [np.asarray(found[error_of(name)], np.float64) for name in timing.places]
        columns[error_of(timing.name)] = errors[0] + errors[1]
    return columns


def value_at(machine: Machine, reading: EventValue, designs: Array, found: Columns, accuracy: Accuracy) -> Columns:
    """Give a pose output at a crank angle of each design; its error is that of the angle, by the slope there."""
    place = reading.places[0]
    phi = np.asarray(found[place], np.float64)
    known = np.isfinite(phi)
    near = np.where(known, phi, 0.0)[:, None] + SLOPE * np.array([0.0, -1.0, 1.0])
    poses, at = pose_columns(machine, designs, near, [reading.of.name])
    values = np.where(known[:, None], poses[reading.of.name], np.nan)
    status = np.where(found["status"] == st.OK, at[:, 0], found["status"]).astype(np.uint8)
    columns: Columns = {reading.name: np.where(status == st.OK, values[:, 0], np.nan), "status": status}
    if accuracy.target is not None:
        slope = np.abs(values[:, 2] - values[:, 1]) / (2.0 * SLOPE)
        columns[error_of(reading.name)] = slope * np.asarray(found[error_of(place)], np.float64)
    return columns
