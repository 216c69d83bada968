"""Seeded hostile tables for every family: sizes of any kind, special designs, values that are not numbers."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pandas as pd

import sweep
from sweep.effects import extended, offered
from sweep.errors import InputError
from sweep.families import NAMES, family
from sweep.families.base import Parameter

# Every family of the register, with any domain, and chains.
FAMILIES: tuple[str | list[str], ...] = (
    *NAMES, ["rssr", "guide"], ["rssr", "rssr"], ["rssr", "slotted"], ["rssr", "rssr", "guide"],
)  # fmt: skip
PLAIN = ("rotatable", "margin", "max_pressure_angle")
BASES = ("max_abs", "max", "min", "range", "rms", "phi_max_abs")
SPECIAL = (0.0, 1.0, -1.0, 2.0, 0.5 * np.pi, np.pi, 1e-8, 1e-160, 1e160, -1e160, 1e-300, 1e300, 5e-324, 1e5, 1e-20)
THINGS = (None, "x", [1.0], (1.0, 2.0), {}, np.ones(2), np.ones((2, 2)), 1j, np.timedelta64(1, "s"), 10**400, 10**5000,
          np.nan, np.inf, b"a", "1e999", pd.NA)  # fmt: skip


def value(r: np.random.Generator, p: Parameter) -> float:
    """Return a value for one parameter, usually an ordinary one."""
    if p.choices is not None:
        return float(r.choice(p.choices))
    kind = r.random()
    if kind < 0.7:
        found = r.uniform(-3.0, 5.0) if p.unit != "angle" else r.uniform(-4.0, 4.0)
    elif kind < 0.85:
        found = float(r.choice([-1.0, 1.0])) * 10.0 ** r.uniform(-12.0, 12.0)
    else:
        found = float(r.choice(SPECIAL))
    if p.positive:
        return abs(found) or 1.0
    return abs(found) if p.not_negative else found


def spoilt(r: np.random.Generator, column: np.ndarray[Any, Any]) -> Any:
    """Return the column with an item that is not a number, or an object that is not a column."""
    thing = THINGS[r.integers(len(THINGS))]
    kind = r.integers(4)
    if kind == 0:
        objects = column.astype(object)
        objects[r.integers(len(objects))] = thing
        return objects
    if kind == 1:
        return [*column[:-1].tolist(), thing]
    if kind == 2:
        return pd.Series([*column[:-1].tolist(), thing], dtype=object)
    return thing


def case(seed: int, requests: int | None = None) -> tuple[Any, dict[str, Any], list[str], dict[str, Any], bool]:
    """Return family, table, wanted design outputs, settings, and whether the table was spoilt.

    ``requests`` is the number of different families and outputs; None leaves it to chance.
    """
    r = np.random.default_rng(seed if requests is None else seed % requests)
    chosen = FAMILIES[r.integers(len(FAMILIES))]
    bare = family(chosen)
    poses = [o.name for o in bare.pose_outputs] + [o.name for o in offered(bare)] * (r.random() < 0.5)
    names = [f"{r.choice(BASES)}_{r.choice(poses)}" for _ in range(r.integers(1, 4))]
    full = extended(bare, names)
    if requests is not None:
        r = np.random.default_rng(seed)
    rows = int(r.integers(1, 5))
    scale = 10.0 ** r.uniform(-100.0, 100.0) if r.random() < 0.1 else 1.0
    table: dict[str, Any] = {}
    for p in full.parameters:
        column = np.array([value(r, p) for _ in range(rows)])
        with np.errstate(over="ignore"):
            table[p.name] = column * scale if p.unit == "length" else column
    bad = bool(r.random() < 0.15)
    if bad:
        name = str(r.choice(list(table)))
        table[name] = spoilt(r, np.asarray(table[name], np.float64))
    settings = {"samples": 32} if r.random() < 0.3 else {"accuracy": float(10.0 ** r.uniform(-10.0, -2.0))}
    return chosen, table, names, settings, bad


def faults(seed: int, requests: int | None = None) -> list[str]:
    """Return the faults of the answer to one hostile table, usually none."""
    chosen, table, names, settings, _ = case(seed, requests)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            frame = sweep.summarise(chosen, table, names, **settings)
            bare = family(chosen)
            poses = [o.name for o in bare.pose_outputs[: 1 + (seed if requests is None else seed % requests) % 4]]
            own = {k: v for k, v in table.items() if k in bare.parameter_names}
            frames = [frame, sweep.evaluate(chosen, own, poses, phi=[0.0, 1.0, np.pi])]
        except InputError as error:
            return [] if str(error) else ["an error without words"]
        except Exception as error:  # the fault that the test seeks
            return [f"{type(error).__name__}: {error}"]
    found = []
    for columns in frames:
        for name in columns:
            if name in ("status", "design", "phi") or str(name).startswith("err_") or columns[name].dtype.kind != "f":
                continue
            lost = ~np.isfinite(columns[name].to_numpy())
            if (lost & (columns["status"] == 0)).any():
                found.append(f"{name} is missing with status 0")
            if f"err_{name}" in columns and (lost & columns[f"err_{name}"].notna()).any():
                found.append(f"err_{name} is a number beside a nan")
            if np.isinf(columns[name]).any():
                found.append(f"{name} is infinite")
    return found
