"""Designs of scenes that are neither effects nor families: loads over the turn, the thread of a machine."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import sweep
from studies.accuracy.effect_witness import Effected
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import extended
from sweep.families import family
from sweep.families.base import Turn
from sweep.numerics.curves import table_curve

GIVEN = tomllib.loads((Path(__file__).parent / "scenes.toml").read_text(encoding="utf-8"))
NEAR, SEED = 0.01, 7  # share by which dimensions differ from the nominal ones
POINTS = 24  # points of the load's table

Scene = Callable[[int], tuple[Effected, tuple[str, ...]]]


def loads_over_the_turn(designs: int) -> tuple[Effected, tuple[str, ...]]:
    """Return crank-rockers whose rocker works against a table of torques, and their joint loads."""
    bare, outputs = family("rssr"), tuple(GIVEN["load"]["outputs"])
    phi = 2.0 * np.pi * np.arange(POINTS) / POINTS
    curve = table_curve(phi, -2e4 * (1.0 + np.sin(phi) ** 3) * (phi < np.pi))
    full = extended(bare, outputs, {"load_torque": curve})
    return Effected(bare, full, ordinary(full, designs)), outputs


def thread_balance(designs: int) -> tuple[Effected, tuple[str, ...]]:
    """Return machines with a thread over a take-up and the needle's eye, and the outputs of the thread."""
    given = GIVEN["thread"]
    made = sweep.machine(given["members"], given["threads"])
    assert isinstance(made.domain, Turn)
    places = {f"{member}.{name}": x for member, own in given["places"].items() for name, x in own.items()}
    noise = np.random.default_rng(SEED).uniform(-NEAR, NEAR, (designs, len(made.parameters)))
    values = np.array([places.get(p.name, p.default) for p in made.parameters], np.float64)
    still = np.array([p.choices is not None for p in made.parameters])
    return Effected(made, made, values * np.where(still, 1.0, 1.0 + noise)), tuple(given["outputs"])


SCENES: Mapping[str, tuple[str, Scene]] = {
    "loads over the turn": ("rssr", loads_over_the_turn),
    "thread balance": ("needle and lever", thread_balance),
}
"""By name: the mechanism, and a function of the number of designs that returns them with the evaluated outputs."""
