"""Ordinary linkages with all inputs of their effects, for the accuracy study, benchmarks and tests."""

from __future__ import annotations

import numpy as np

from sweep.effects.base import ON_TIP, tool_place
from sweep.families.base import Array, Family, Parameter
from sweep.families.link_tree import LinkTree

CENTRE = {
    "a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2, "branch": 1.0,
    "xi": 100.0, "eta": 3.0, "lam": 0.3, "h": 2.0, "Z1": -30.0, "Z2": 40.0,
}  # fmt: skip
# A small machine in mm, t, s, of our own choice.
INPUTS = {
    "m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 3e-4, "m_slider": 3e-4, "com_coupler_x": 45.0, "com_coupler_y": 2.0,
    "com_rocker_x": 25.0, "j_coupler_xx": 0.004, "j_coupler_yy": 0.08, "j_coupler_zz": 0.08, "j_rocker_zz": 0.3,
    "j_rocker_xx": 0.3, "j_rocker_yy": 0.1, "j_crank_zz": 0.2, "speed": 520.0, "load_torque": -500.0,
    "load_force": -50.0, "gravity_z": -9810.0, "flywheel": 5.0, "mu_a": 0.05, "mu_b": 0.08, "mu_c": 0.08, "mu_d": 0.05,
    "radius_a": 8.0, "radius_b": 5.0, "radius_c": 5.0, "radius_d": 7.0, "support_a1": -30.0, "support_a2": -60.0,
    "support_d1": -20.0, "support_d2": 30.0, "resisting_torque": 500.0, "journal_diameter": 12.0,
    "journal_length1": 15.0, "journal_length2": 15.0, "collar_diameter": 20.0, "permissible_pressure1": 1.0,
    "permissible_pressure2": 1.0, "permissible_pressure3": 0.5, "radial_factor": 0.56, "axial_factor": 1.5,
    "e_limit": 0.3, "dynamic_capacity": 6000.0, "required_life": 2e7, "driven_inertia": 0.6, "driven_mass": 3e-4,
    "stiffness": 20000.0, "damping": 1.0, "x_point": 40.0, "m_tool": 2.5e-5, "thread_tension": 5.0,
    "eyelet_radius": 1.0, "mu_eyelet": 0.2,
}  # fmt: skip

# For linkages of a few units of length, by the beginning of an input's name.
SMALL = {"k": 1.8, "tau": -1.0, "speed": 520.0, "flywheel": 1e-2, "m_tool": 2.5e-5, "tool_x": 2.0, "tool_force_y": -5.0}
KINDS = {
    "mu_": 0.05, "radius_": 0.1, "m_": 1e-5, "radial_factor_": 0.56, "axial_factor_": 1.5, "e_limit_": 0.3,
    "dynamic_capacity_": 6000.0, "required_life_": 2e7, "journal_": 0.2, "collar_": 0.4, "permissible_": 1.0,
    "contact_radius_": 0.5, "contact_length_": 0.5, "bore_radius_": 0.55,
}  # fmt: skip


def designs(full: Family, n: int, seed: int = 0) -> Array:
    """Return linkages within a few per cent of a regular one, with the inputs of the family's effects."""
    noise = np.random.default_rng(seed).uniform(-0.05, 0.05, (n, len(full.parameters)))
    values = [_value(full, p) for p in full.parameters]
    matrix = np.array(values, dtype=np.float64) * (1.0 + noise)
    for k, p in enumerate(full.parameters):
        if p.choices is not None or p.name not in CENTRE:
            matrix[:, k] = values[k]
    return matrix


def _value(full: Family, p: Parameter) -> float | None:
    """Return the value of a parameter or input: of the small machine, the family's example, or the kind of input."""
    linked = full.find(LinkTree) is not None
    if tool_place(full) == ON_TIP:
        # a tool at the tip would load all other effects: it is present for its own effect alone
        at_tip = "tip_load" in full.pose_names
        if p.name in ("m_tool", "tool_x"):
            return (INPUTS | {"tool_x": 75.0})[p.name] if at_tip else 0.0
    if p.name == "k" and "sliding_c" in full.pose_names:
        return 0.0  # the ball slides in a fork; on a bar it does not touch
    for known in (full.example, SMALL) if linked else (CENTRE, INPUTS):
        if p.name in known:
            return known[p.name]
    kind = next((value for start, value in KINDS.items() if p.name.startswith(start)), None) if linked else None
    default = 0.0 if p.unless else p.default  # centres and inertias are given
    if kind is not None or default is not None:
        return default if kind is None else kind
    return -0.5 if p.name.endswith("1") else 0.6  # positions of supports
