"""Prices of what is no effect of the register and yet no family: loads over the turn, the thread of a machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

import sweep
from studies.accuracy.effect_witness import Effected
from sweep.effects import extended
from sweep.effects.costs import designs as ordinary
from sweep.families import family
from sweep.families.base import Array, Family
from sweep.families.domain import Turn
from sweep.numerics.curves import table_curve

NEAR, SEED = 0.01, 7  # share by which dimensions differ from the centre's
LOADED = ("max_abs_drive_torque", "max_abs_force_a", "max_abs_force_b", "max_abs_force_c", "max_abs_force_d")
POINTS = 24  # of the table of the load

# A needle drive, a lever with an eyelet, a thread from the tensioner to the needle; mm and N, ours.
MEMBERS = {"needle": ["rssr", "guide"], "lever": {"family": "eyelet", "offset": 0.4}}
PLACES = {
    "needle.a1": 9.16, "needle.b1": 18.31, "needle.c1": 10.66, "needle.e1": 13.4, "needle.f1": -14.68,
    "needle.g1": 0.0, "needle.alpha1": 1.5, "needle.a2": 2.4, "needle.b2": 15.7, "needle.c2": 3.6, "needle.e2": 17.3,
    "needle.xi2": -71.5, "needle.eta2": 91.5, "needle.lam2": 0.95, "needle.h2": 114.0, "needle.branch2": -1.0,
    "needle.offset2": 1.8, "lever.a": 20.0, "lever.e": 30.0, "lever.f": 10.0, "lever.alpha": 0.5, "lever.Z1": -30.0,
    "lever.Z2": 40.0, "lever.P_h": 60.0,
}  # fmt: skip
THREAD = {
    "thread": ["lever", [-40.0, 130.0, 20.0], [-52.0, 122.0, 8.0], "needle.point", [-83.6, 79.0, 0.0]], "stock": 130.0,
    "tension": 0.2, "stiffness": 0.004, "radius": [0.8, 1.0, 0.4],
}  # fmt: skip
BALANCE = ("max_upper_needed", "min_upper_surplus", "max_upper_surplus", "max_upper_tension", "max_upper_wrap")


def loads_over_the_turn(designs: int) -> tuple[Effected, tuple[str, ...]]:
    """Return crank-rockers whose rocker works against a table of torques, with their joint loads."""
    bare = family("rssr")
    phi = 2.0 * np.pi * np.arange(POINTS) / POINTS
    curve = table_curve(phi, -2e4 * (1.0 + np.sin(phi) ** 3) * (phi < np.pi))
    full = extended(bare, LOADED, {"load_torque": curve})
    return Effected(bare, full, ordinary(full, designs)), LOADED


def thread_balance(designs: int) -> tuple[Effected, tuple[str, ...]]:
    """Return machines with a thread over a take-up and the needle's eye."""
    made = sweep.machine(MEMBERS, {"upper": THREAD})
    return Effected(made, made, _near(made, designs)), BALANCE


def _near(made: Family, designs: int) -> Array:
    noise = np.random.default_rng(SEED).uniform(-NEAR, NEAR, (designs, len(made.parameters)))
    values = np.array([PLACES.get(p.name, p.default) for p in made.parameters], np.float64)
    still = np.array([p.choices is not None for p in made.parameters])
    matrix: Array = values * np.where(still, 1.0, 1.0 + noise)
    assert isinstance(made.domain, Turn)
    return matrix


Scene = Callable[[int], tuple[Effected, tuple[str, ...]]]
SCENES: Mapping[str, tuple[str, Scene]] = {
    "loads over the turn": ("rssr", loads_over_the_turn),
    "thread balance": ("needle and lever", thread_balance),
}
"""By name: on what it is measured; so many designs and the outputs that are judged."""
