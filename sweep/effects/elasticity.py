"""E1, E2: lag of the follower through the coupler's elasticity, quasi-static and in the periodic steady state."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.elasticity import quasi_static, steady_state
from sweep.effects.base import DesignResult, Effect, Scene
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, optional_outputs

EQUATION = "dynamics sheet 5"

INPUTS = (
    Parameter("driven_inertia", "inertia", "inertia of rocker and all it drives about its axis", positive=True),
    Parameter("stiffness", "stiffness", "stiffness of the coupler along B-C", positive=True),
    Parameter("damping", "damping", "damping of the coupler along B-C", default=0.0),
    Parameter("speed", "speed", "speed of the crank"),
    Parameter("load_torque", "torque", "constant torque on the rocker about its axis", default=0.0),
)
_NAMES = ("driven_inertia", "stiffness", "damping", "speed", "load_torque")

STATIC_OUTPUTS = (
    Output("lag", "rad", "quasi-static deflection of the rocker, eta", EQUATION),
    Output("lag_displacement", "length", "the same at the joint C, c eta", EQUATION),
    Output("frequency_ratio", "1", "natural frequency over crank speed", EQUATION),
)
DYNAMIC_OUTPUTS = (
    Output("lag_dynamic", "rad", "deflection of the rocker in the periodic steady state", EQUATION),
    Output("elongation_dynamic", "length", "elongation of the coupler in the periodic steady state", EQUATION),
)
FLOQUET = Output("floquet", "1", "largest modulus of the Floquet multipliers; stable below 1", EQUATION)

# Odd grids of the steady state: the next one is tried for designs that the one before does not resolve.
GRIDS = (61, 121, 241)


def _lever(scene: Scene) -> tuple[Array, Array, Array]:
    """Give p = c t_tau, the rigid acceleration analogue, and c."""
    per_pose, per_design = scene.records
    c = np.ascontiguousarray(per_design[:, 14])
    return per_pose[:, :, 21] * c[:, None], np.ascontiguousarray(per_pose[:, :, 23]), c


def compute_static(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted pointwise quantities; status NOT_LINEAR where the deflection is no longer small."""
    names = tuple(o.name for o in STATIC_OUTPUTS)
    outputs = optional_outputs(names, wanted, scene.shape)
    status = scene.status()
    quasi_static(*_lever(scene), scene.table(_NAMES), status, *outputs)
    found: Columns = {name: out for name, out in zip(names, outputs, strict=True) if out is not None}
    return found | {"status": status}


def compute_dynamic(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Steady state on its own grid, carried to the wanted angles."""
    eta, elongation, _, turn = _steady(scene, scene.angles.phi)
    status = scene.status()
    np.copyto(status, turn[:, None], where=(status == st.OK) & (turn[:, None] != st.OK))
    found: Columns = {"lag_dynamic": eta, "elongation_dynamic": elongation}
    return {name: values for name, values in found.items() if name in wanted} | {"status": status}


def _steady(scene: Scene, phi: Array) -> tuple[Array, Array, Array, np.ndarray]:
    n = len(scene.designs)
    eta, elongation = np.empty((n, phi.shape[1])), np.empty((n, phi.shape[1]))
    floquet, status = np.empty(n), np.full(n, st.NOT_CONVERGED, np.uint8)
    rows = np.arange(n)
    for size in GRIDS:
        inputs = {name: values[rows] for name, values in scene.inputs.items()}
        grid = Scene(scene.family, scene.designs[rows], Angles.of(2.0 * np.pi * np.arange(size)[None] / size), inputs)
        own = np.ascontiguousarray(phi[rows] if phi.shape[0] > 1 else phi)
        parts = np.empty((rows.size, phi.shape[1])), np.empty((rows.size, phi.shape[1])), np.empty(rows.size)
        found = np.empty(rows.size, np.uint8)
        steady_state(*_lever(grid), grid.table(_NAMES), own, found, *parts)
        eta[rows], elongation[rows], floquet[rows], status[rows] = *parts, found
        rows = rows[found == st.NOT_CONVERGED]
        if rows.size == 0:
            break
    return eta, elongation, floquet, status


def _multiplier(
    family: Family, designs: Array, inputs: dict[str, Array], wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    scene = Scene(family, designs, Angles.of(np.zeros((1, 1))), inputs)
    _, _, floquet, status = _steady(scene, np.zeros((1, 1)))
    # A multiplier is known even where the forced solution is not resolved or not linear.
    status[np.isfinite(floquet)] = st.OK
    return {"floquet": floquet, "status": status}


STATIC = Effect(
    key="E1",
    name="elasticity",
    title="quasi-static elasticity of the coupler",
    equation=EQUATION,
    families=("rssr",),
    needs=("pressure",),
    inputs=INPUTS,
    outputs=STATIC_OUTPUTS,
    compute=compute_static,
    ns_per_pose=15.0,
    called_for="a fast machine, a precise meeting of hook and needle",
    negligible="largest lag times the lever of the working point below the tolerance",
)
DYNAMIC = Effect(
    key="E2",
    name="dynamic_elasticity",
    title="periodic steady state of the elastic coupler and its stability",
    equation=EQUATION,
    families=("rssr",),
    needs=("elasticity",),
    inputs=INPUTS,
    outputs=DYNAMIC_OUTPUTS,
    compute=compute_dynamic,
    ns_per_pose=1500.0,
    called_for="the second difference of the lag over the squared frequency ratio exceeds a third of the tolerance",
    negligible="least frequency ratio above 10 times the highest harmonic of the lag",
    whole_turn=True,
    design_result=DesignResult((FLOQUET,), _multiplier, 600_000.0),
)
