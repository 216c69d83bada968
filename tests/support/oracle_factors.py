"""Largest error of every oracle table, in units of 2^-53 max(cond, |y|), as docs/accuracy/factors.md prints it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import sweep
from tests.support.effect_factors import effect_factors
from tests.support.oracle_judge import UNIT, Row, Worst, judge, read, size_of

__all__ = ["UNIT", "Worst", "factors", "judge", "read"]

FINEST = 1e-14


def factors(folder: Path) -> list[Worst]:
    """Return the factors of every table whose sheet states a tolerance."""
    judges = (_rssr, _rssp, _needle, _composite, _limits, _pressure, _largest_pressure, _synthesis, _geared_dwell,
              effect_factors)  # fmt: skip
    return [worst for judge in judges for worst in judge(folder)]


def _column(rows: Sequence[Row], name: str) -> list[float]:
    return [float(row[name]) for row in rows]


def _orders(position: str, name: str) -> dict[str, tuple[str, list[str]]]:
    """Return the outputs of a follower ``name`` with the keys d1, d2, d3 of the tables."""
    ladder = ["d1", "d2", "d3"]
    derivatives = {f"{'d' if k == 0 else f'd{k + 1}'}{name}": (ladder[k], ladder[: k + 1]) for k in range(3)}
    return {name: (position, [position])} | derivatives


def _rssr(folder: Path) -> list[Worst]:
    rows = [row for row in read(folder, "rssr") if row["feasible"]]
    table = {name: _column(rows, name) for name in ("a", "b", "c", "e", "f", "g", "alpha", "phi")}
    wanted = _orders("psi", "psi") | {"discriminant": ("D", ["D"])}
    got = sweep.evaluate("rssr", table | {"branch": _column(rows, "sigma")}, list(wanted))
    return judge("rssr", rows, got, wanted, 8.0, ("psi",), lambda row, k: _unit_size(row, k))


def _unit_size(row: Row, key: str) -> float | None:
    """Return the size that is the unit of errors; an angle is known to a rounding of one radian at best."""
    size = size_of(row, key)
    return max(size, 1.0) if size is not None and key == "psi" else size


def _rssp(folder: Path) -> list[Worst]:
    rows = [row for row in read(folder, "rssp") if row["feasible"]]
    table = {name: _column(rows, name) for name in ("a", "b", "e", "f", "alpha", "phi")}
    wanted = _orders("S", "s") | {"discriminant": ("Q", ["Q"])}
    return judge(
        "rssp", rows, sweep.evaluate("rssp", table | {"branch": _column(rows, "sigma")}, list(wanted)), wanted, 8.0
    )


def _needle(folder: Path) -> list[Worst]:
    rows = read(folder, "needle208")
    table: dict[str, Any] = {f"{name}{k}": _column(rows, f"{name}{k}") for name in "abce" for k in (1, 2)}
    table |= {"f1": 0.0, "g1": 0.0, "alpha1": 0.0, "phi": _column(rows, "phi")}
    table |= {
        f"{ours}2": _column(rows, name) for ours, name in (("xi", "xi"), ("eta", "eta"), ("lam", "lam"), ("h", "hl"))
    }
    table |= {"branch1": _column(rows, "sigma1"), "branch2": _column(rows, "sigma2")}
    table |= {"kappa2": _column(rows, "kappa"), "offset2": _column(rows, "theta0")}
    along, across = ["along_d1", "along_d2", "along_d3"], ["dev_d1", "dev_d2"]
    wanted = {"s": ("along", ["along"]), "dev": ("dev", ["dev"]), "x_m": ("x", ["x"]), "y_m": ("y", ["y"])}
    wanted |= {name: (along[k], along[: k + 1]) for k, name in enumerate(("ds", "d2s", "d3s"))}
    wanted |= {name: (across[k], across[: k + 1]) for k, name in enumerate(("ddev", "d2dev"))}
    return judge("needle208", rows, sweep.evaluate(["rssr", "guide"], table, list(wanted)), wanted, 8.0)


def _composite(folder: Path) -> list[Worst]:
    found = []
    for second, name in (("rssr", "psi"), ("rssp", "s")):
        rows = [row for row in read(folder, "composite") if row["stage2_type"].lower() == second]
        table: dict[str, Any] = {
            f"{key}{k}": _column([row[f"stage{k}"] for row in rows], key)
            for k in (1, 2)
            for key in rows[0][f"stage{k}"]
        }
        table |= {"branch1": _column(rows, "sigma1"), "branch2": _column(rows, "sigma2")}
        table |= {"kappa2": _column(rows, "kappa"), "offset2": _column(rows, "theta0"), "phi": _column(rows, "phi")}
        wanted = _orders("y", name)
        got = sweep.evaluate(["rssr", second], table, list(wanted))
        found += judge(f"composite rssr + {second}", rows, got, wanted, 8.0, ("psi",))
    return found


LIMITS = ("phi_ext", "psi_ext", "phi_fold", "psi_fold", "phi0", "stroke_ratio")


def _limits(folder: Path) -> list[Worst]:
    rows = [row for row in read(folder, "limits") if row.get("rocker") == "oscillates"]
    table = {name: _column(rows, name) for name in ("a", "b", "c", "e", "f", "g", "alpha")}
    got = sweep.summarise("rssr", table | {"branch": _column(rows, "sigma")}, [*LIMITS, "swing"], accuracy=FINEST)
    wanted = {name: (name, [name]) for name in LIMITS} | {"swing": ("psi0", ["psi0"])}
    return judge("limits", rows, got, wanted, 16.0, ("phi_ext", "psi_ext", "phi_fold", "psi_fold"))


def _pressure(folder: Path) -> list[Worst]:
    """Return the factors of pressure angles of crank-rockers."""
    rows = [row | row["expected"] for row in read(folder, "pressure") if row["kind"] == "rssr"]
    names = ("a", "b", "c", "e", "f", "g", "alpha")
    table = {name: _column([row["inputs"] for row in rows], name) for name in (*names, "phi")}
    table |= {"branch": _column([row["inputs"] for row in rows], "sigma")}
    wanted = {
        "pressure_angle": ("theta", ["theta"]),
        "theta1": ("theta1", ["theta1"]),
        "theta2": ("theta2", ["theta2"]),
        "theta3": ("theta3", ["theta3"]),
    }
    got = sweep.evaluate("rssr", table, list(wanted))
    return judge("pressure", rows, got, wanted, 64.0, (), lambda row, k: float(row["sens"][k]))


def _largest_pressure(folder: Path) -> list[Worst]:
    """Return factors of the largest pressure angle over the turn, in roundings of one radian without a sensitivity."""
    found = []
    for family, names in (("rssr", ("a", "b", "c", "e", "f", "g", "alpha")), ("rssp", ("a", "b", "e", "f", "alpha"))):
        rows = [row | row["expected"] for row in read(folder, "pressure") if row["kind"] == f"extrema_{family}"]
        rows = [row | {"kind": f"extrema, {family}"} for row in rows]
        table = {name: _column([row["inputs"] for row in rows], name) for name in names}
        table |= {"branch": [float(row["inputs"].get("sigma", 1)) for row in rows]}
        got = sweep.summarise(family, table, "max_pressure_angle", accuracy=FINEST)
        keys = {"max_pressure_angle": ("theta_max", ["theta_max"])}
        rows = [{key: value for key, value in row.items() if key != "case"} for row in rows]
        found += judge("largest pressure angle", rows, got, keys, 64.0, (), lambda row, key: 1.0)
    return found


def _synthesis(folder: Path) -> list[Worst]:
    """Return factors of links from requirements; of two solutions per row, that closer to the table's crank."""
    found = []
    for family, mechanism, inputs, outputs in (
        ("rssr", "RSSR", {"swing": "psi0", "psi1": "psi1", "g": "g"}, {"a": "a", "b": "b", "c": "c"}),
        ("rssp", "RSSP", {"stroke": "S0"}, {"a": "a", "b": "b", "s_ext": "S1"}),
    ):
        rows = [row for row in read(folder, "synthesis") if row["mechanism"] == mechanism]
        keys = inputs | {name: name for name in ("phi0", "e", "f", "alpha")}
        both = sweep.synthesise(family, {ours: _column(rows, theirs) for ours, theirs in keys.items()})
        crank = np.array(_column(rows, "a"))[both.index.to_numpy()]
        nearest = both.assign(off=(both["a"] / crank - 1.0).abs().fillna(np.inf)).sort_values("off", kind="stable")
        got = nearest[~nearest.index.duplicated()].sort_index()
        wanted = {name: (key, [key]) for name, key in (outputs | {"phi_ext": "phi1"}).items()}
        found += judge(f"synthesis of {family}", rows, got, wanted, 16.0, ("phi_ext",))
    return found


def _geared_dwell(folder: Path) -> list[Worst]:
    """Return the factors of poses, dwell measures and maxima, without condition numbers (16 roundings of the size)."""
    everything = [row | row["out"] | row["in"] for row in read(folder, "geared_dwell")]
    points = [row for row in everything if row["kind"] == "point"]
    ladder = ["phi", "dphi", "d2phi", "d3phi"]
    wanted = {name: (ladder[k], ladder[min(k, 1) : k + 1]) for k, name in enumerate(("psi", "dpsi", "d2psi"))}
    table = {"k": _column(points, "k"), "a": _column(points, "a"), "phi": _column(points, "alpha")}

    def size(row: Row, key: str) -> float:
        # one rounding of the carrier angle moves y by |alpha y'|
        following = ladder[ladder.index(key) + 1]
        return max(abs(float(row[key])), abs(float(row["alpha"]) * float(row[following])))

    points = [row | {"kind": "point"} for row in points]
    found = judge("geared_dwell", points, sweep.evaluate("geared_dwell", table, list(wanted)), wanted, 16.0, (), size)
    for kind, names in (
        ("dwell", {"dwell_angle": "alpha0", "dwell_deviation": "delta", "dwell_band": "band_dwell"}),
        ("turn", {"max_abs_d2psi": "max_abs_d2phi", "phi_max_abs_d2psi": "alpha_of_max_in_0_pi"}),
    ):
        rows = [row for row in everything if row["kind"] == kind]
        table = {"k": _column(rows, "k"), "a": _column(rows, "a")}
        got = sweep.summarise("geared_dwell", table, list(names), accuracy=FINEST)
        keys = {ours: (key, [key]) for ours, key in names.items()}
        found += judge("geared_dwell", rows, got, keys, 16.0, (), lambda row, key: abs(float(row[key])))
    return found
