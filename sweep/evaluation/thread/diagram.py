"""Thread diagram P(phi) of every thread of a machine over one turn, and their sum; docs/thread.md, section 7."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kernels.types import TWO_PI
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, in_radians
from sweep.evaluation.poses import evaluate
from sweep.evaluation.tables import Table, one_design
from sweep.evaluation.thread.rows import warn_outside
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.curve_features import switches
from sweep.families.machines.thread_balance import MEASURED_SPEED, MM_PER_M, ThreadBalance

BESIDE = 1e-9  # rad, from an event to the angles just before and after it
COLUMNS = ("demand", "given", "surplus", "tension", "velocity")


def diagram(
    mechanism: Mechanism, design: Table, *, samples: int = 720, angles: AngleUnit | None = None
) -> pd.DataFrame:
    """Compute demand, supply, surplus, tension and velocity of every thread over one turn.

    Parameters
    ----------
    mechanism, design : a machine with threads, and one design of it
    samples : number of even angles of the turn; angles just before and after every event of a thread are added
    angles : unit of the angles of ``design``, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    DataFrame
        ``phi`` [rad]; of each thread ``NAME_demand``, ``NAME_given``, ``NAME_surplus`` [length], ``NAME_tension``
        [force] and, where the velocities of all its points are known, ``NAME_velocity`` [length/s]; ``demand``, the
        sum of all; ``status``

    Raises
    ------
    InputError
        for a mechanism without threads, several designs, or a number of samples below 1.

    Warns
    -----
    MeasuredRangeWarning
        where a thread is faster than 7.4 m/s, the largest speed at which the law of speed was measured (lengths in mm)

    Examples
    --------
    >>> import sweep
    >>> drive = {"family": "four_bar", "eye": [12.0, 5.0, 0.0]}
    >>> thread = [[0.0, 60.0, 0.0], "drive.eye", [0.0, -30.0, 0.0]]
    >>> machine = sweep.machine({"drive": drive}, {"upper": {"thread": thread}})
    >>> design = {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0}
    >>> sweep.thread.diagram(machine, design, samples=4)[["phi", "upper_demand"]].round(2)
        phi  upper_demand
    0  0.00        101.76
    1  1.57         92.58
    2  3.14         90.17
    3  4.71         95.23
    """
    family = find_family(mechanism)
    threads = family.every(ThreadBalance)
    if not threads:
        raise InputError("mechanism", family.name, "a machine with threads", "thread diagram")
    if not isinstance(samples, int | np.integer) or samples < 1:
        raise InputError("samples", samples, "a whole number from 1", "thread diagram")
    given = in_radians(family, design, angles)
    names = {o.name for thread in threads for o in thread.outputs}
    wanted = [name for t in threads for name in (f"{t.name}_{key}" for key in COLUMNS) if name in names]
    events = switches(family, one_design(family, given), wanted)[0]
    turn = np.arange(samples) * (TWO_PI / samples)
    phi = np.unique(np.mod(np.concatenate([turn, events - BESIDE, events + BESIDE]), TWO_PI))
    result = evaluate(family, given, wanted, phi=phi).drop(columns="design")
    result["demand"] = sum(result[f"{t.name}_demand"] for t in threads)
    result.attrs["units"]["demand"] = result.attrs["units"][f"{threads[0].name}_demand"]
    for name in (name for name in wanted if name.endswith("_velocity")):
        speeds = np.abs(result[name].to_numpy(np.float64)) / MM_PER_M
        warn_outside(
            speeds, MEASURED_SPEED._replace(low=0.0, name=f"speed of {name.removesuffix('_velocity')}"), (), {}
        )
    return result
