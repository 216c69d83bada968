"""Effects at single poses compared with their 25-digit tables, through the public functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import sweep
from tests.support.oracle_judge import Row, Worst, judge, read

GEOMETRY = ("a", "b", "c", "e", "f", "g", "alpha", "phi")
BODIES = ("crank", "coupler", "rocker")
TENSOR = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
FRICTION = {
    **{f"mu_{joint}": f"mu_{joint.upper()}" for joint in "abcd"},
    **{f"radius_{joint}": f"r_{joint.upper()}" for joint in "abcd"},
    "thrust_radius_a": "rt_A", "thrust_radius_d": "rt_D",
    "support_a1": "zA1", "support_a2": "zA2", "support_d1": "zD1", "support_d2": "zD2",
}  # fmt: skip
ALLOWED, OF_POINT = 64.0, 16.0


def effect_factors(folder: Path) -> list[Worst]:
    """Return factors of joint forces and torques without and with friction, and of coupler points."""
    return [*_kinetostatics(folder), *_friction(folder), *_coupler(folder)]


def _columns(rows: Sequence[Row]) -> dict[str, Any]:
    """Return a table of crank-rockers with bodies, one row per pose."""
    table: dict[str, Any] = {name: [float(row[name]) for row in rows] for name in GEOMETRY}
    table |= {"branch": [float(row["sigma"]) for row in rows], "speed": [row["omega"] for row in rows]}
    table |= {"speed_change": [row["epsilon"] for row in rows], "load_torque": [row["M_load"] for row in rows]}
    table["finger"] = [float(row["construction"] == "driving") for row in rows]
    for k, body in enumerate(BODIES, 1):
        table[f"m_{body}"] = [row[f"m{k}"] for row in rows]
        table |= {f"com_{body}_{x}": [row[f"com{k}"][i] for row in rows] for i, x in enumerate("xyz")}
        table |= {f"j_{body}_{xy}": [row[f"J{k}"][i][j] for row in rows] for xy, (i, j) in TENSOR.items()}
    return table | {f"gravity_{x}": [row["gravity"][i] for row in rows] for i, x in enumerate("xyz")}


def _spread(row: Row, vectors: Mapping[str, str]) -> dict[str, Any]:
    """Return the row with every component of its vectors under its own key."""
    expected = row["expected"]
    parts = {f"{key}_{x}": expected[key][i] for key in vectors.values() for i, x in enumerate("xyz")}
    return dict(row) | {key: expected[key] for key in ("M_drive", "m_finger") if key in expected} | parts


def _forces(suffix: str) -> tuple[dict[str, str], dict[str, tuple[str, list[str]]]]:
    """Return vectors by the effect's names, and for each output its key in the table and keys of its magnitude."""
    vectors = {f"force_{joint}{suffix}": f"R_{joint.upper()}" for joint in "abcd"}
    wanted = {f"{ours}_{x}": (f"{key}_{x}", [f"{key}_{x}"]) for ours, key in vectors.items() for x in "xyz"}
    wanted |= {f"drive_torque{suffix}": ("M_drive", ["M_drive"])}
    return vectors, wanted | {f"finger_couple{suffix}": ("m_finger", ["m_finger"])}


def _largest(row: Row, keys: Sequence[str]) -> float:
    return max(abs(float(x)) for key in keys for x in row["expected"][key])


def _kinetostatics(folder: Path) -> list[Worst]:
    """Measure errors in units of 2^-53 of the tabulated sensitivity, for couples plus b times the largest R_B."""
    rows = read(folder, "kinetostatics")
    vectors, wanted = _forces("")

    def size(row: Row, key: str) -> float:
        own = key.rpartition("_")[0] if key.startswith("R_") else key
        if own in row["sens"]:
            part = _largest(row, [own]) if key.startswith("R_") else abs(float(row[key]))
            lever = float(row["inputs"]["b"]) * _largest(row, ["R_B"]) if key == "m_finger" else 0.0
            return max(float(row["sens"][own]) + lever, part)
        return _largest(row, ["R_A", "R_B", "R_C", "R_D"]) * float(row["inputs"]["b"])

    got = sweep.evaluate("rssr", _columns([row["inputs"] for row in rows]), list(wanted))
    return judge("joint loads", [_spread(row, vectors) for row in rows], got, wanted, ALLOWED, (), size)


def _friction(folder: Path) -> list[Worst]:
    """Measure errors in units of 2^-53 of the largest force, times the coupler for couples, without a sensitivity."""
    rows = [row for row in read(folder, "friction") if row["inputs"]["omega"] > 0.0]  # cranks turn this way
    vectors, wanted = _forces("_friction")

    def size(row: Row, key: str) -> float:
        force = _largest(row, ["R_A", "R_B", "R_C", "R_D"])
        return force if key.startswith("R_") else force * float(row["inputs"]["b"])

    table = _columns([row["inputs"] for row in rows])
    table |= {ours: [row["inputs"]["friction"][key] for row in rows] for ours, key in FRICTION.items()}
    got = sweep.evaluate("rssr", table, list(wanted))
    return judge("joint loads with friction", [_spread(row, vectors) for row in rows], got, wanted, ALLOWED, (), size)


def _coupler(folder: Path) -> list[Worst]:
    """Return factors of coupler points and their derivatives, with the conditions of the lower orders included."""
    rows = read(folder, "coupler")
    orders = {"": "P", "d": "dP", "d2": "ddP"}
    table = {name: [float(row[name]) for row in rows] for name in GEOMETRY}
    table |= {f"{x}_point": [float(row[x]) for row in rows] for x in "xyz"}
    table |= {"branch": [float(row["sigma"]) for row in rows]}
    table["finger"] = [float(row["construction"] == "driving") for row in rows]
    flat = [
        dict(row) | {f"{key}_{x}": row[key][i] for key in orders.values() for i, x in enumerate("xyz")} for row in rows
    ]
    names = list(orders.values())
    wanted = {
        f"{order}{x}_p": (f"{key}_{x}", names[: names.index(key) + 1]) for order, key in orders.items() for x in "xyz"
    }

    def size(row: Row, key: str) -> float:
        return max(*(float(c) for c in row["cond"][key]), *(abs(float(x)) for x in row[key]))

    return judge("points of the coupler", flat, sweep.evaluate("rssr", table, list(wanted)), wanted, OF_POINT, (), size)
