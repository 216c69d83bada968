"""E1, E2: lag of the follower through the coupler's elasticity, quasi-static and in the periodic steady state."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.elasticity import quasi_static, steady_state
from sweep.effects.base import Advice, DesignResult, Effect, Scene, Status
from sweep.effects.loads import SPEED
from sweep.effects.turn import chosen, reduction_outputs, reductions
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, optional_outputs

EQUATION = "E1 (1), (2), E2 (3), (4)"
FORMULAS = (
    "(1) lag = (M - J omega^2 psi'')/(k p^2), p = c t_tau; elongation = p lag",
    "(2) frequency ratio nu = sqrt(k/J) |p|/omega",
    "(3) J omega^2 eta'' + h omega p^2 eta' + (k p^2 + h omega p p') eta = M - J omega^2 psi'', 2 pi periodic,",
    "    by Fourier collocation",
    "(4) stable while the largest Floquet multiplier stays below 1",
)

INPUTS = (
    Parameter("driven_inertia", "inertia", "inertia of rocker and all it drives about its axis", positive=True),
    Parameter("stiffness", "stiffness", "stiffness of the coupler along B-C", positive=True),
    Parameter("damping", "damping", "damping of the coupler along B-C", default=0.0),
    SPEED,
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
MULTIPLIER_ERROR = 1e-6
GRIDS = (31, 61, 121, 241)


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


def _steady(scene: Scene, phi: Array) -> tuple[Array, Array, Array, Status]:
    """Lag and elongation at the angles phi, Floquet multiplier and status of every design."""
    n = len(scene.designs)
    eta, elongation = np.empty((n, phi.shape[1])), np.empty((n, phi.shape[1]))
    floquet = np.empty(n)
    status: Status = np.full(n, st.NOT_CONVERGED, np.uint8)
    rows = np.arange(n)
    for size in GRIDS:
        grid = scene.only(rows).on_grid(size)
        own = np.ascontiguousarray(phi[rows] if phi.shape[0] > 1 else phi)
        parts = np.empty((rows.size, phi.shape[1])), np.empty((rows.size, phi.shape[1])), np.empty(rows.size)
        found = np.empty(rows.size, np.uint8)
        steady_state(*_lever(grid), grid.table(_NAMES), own, size == GRIDS[-1], found, *parts)
        eta[rows], elongation[rows], floquet[rows], status[rows] = *parts, found
        rows = rows[found == st.NOT_CONVERGED]
        if rows.size == 0:
            break
    return eta, elongation, floquet, status


def per_turn(
    family: Family, designs: Array, inputs: dict[str, Array], wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    """Floquet multiplier and the reductions of lag and elongation."""
    scene = Scene(family, designs, Angles.of(np.zeros((1, 1))), inputs)
    curves = wanted != {"floquet"}
    eta, elongation, floquet, status = _steady(scene, scene.on_grid(GRIDS[-1] if curves else 1).angles.phi)
    columns: Columns = {"floquet": floquet, "err_floquet": np.full(len(designs), MULTIPLIER_ERROR)}
    if wanted == {"floquet"}:
        # A multiplier is known even where the forced solution is not resolved or not linear.
        status[np.isfinite(floquet)] = st.OK
    for o, values in zip(DYNAMIC_OUTPUTS, (eta, elongation), strict=True):
        if any(name.endswith(f"_{o.name}") for name in wanted):
            columns |= reductions(o.name, values, status)
    return chosen(columns, wanted, status)


def advise_static(scene: Scene) -> Advice | None:
    """Largest quasi-static lag over the turn [rad]."""
    found = compute_static(scene, frozenset({"lag"}))
    turning = np.isfinite(found["lag"]).all(axis=1)
    if not turning.any():
        return None
    return Advice("largest quasi-static lag of the rocker [rad]", np.abs(found["lag"][turning]).max(axis=1), 1e-4)


def advise_dynamic(scene: Scene) -> Advice | None:
    """Sheet 5, criterion (ii): max|eta_qs''/nu^2|/max|eta_qs|, 0.7 to 2.8 times of which dynamics adds to the lag."""
    found = compute_static(scene.on_grid(GRIDS[-1]), frozenset({"lag", "frequency_ratio"}))
    lag, ratio = (np.asarray(found[name], np.float64) for name in ("lag", "frequency_ratio"))
    turning = np.isfinite(lag).all(axis=1)
    if not turning.any():
        return None
    lag, ratio = lag[turning], ratio[turning]
    orders = np.arange(lag.shape[1] // 2 + 1)
    second = np.fft.irfft(-(orders**2) * np.fft.rfft(lag, axis=1), n=lag.shape[1], axis=1)
    size = np.abs(lag).max(axis=1)
    estimate = np.abs(second / ratio**2).max(axis=1) / np.where(size > 0.0, size, 1.0)
    return Advice("estimated share that vibration adds to the lag", estimate, 0.01 / 3.0)


STATIC = Effect(
    key="E1",
    name="elasticity",
    title="quasi-static elasticity of the coupler",
    equation=EQUATION,
    formulas=FORMULAS,
    families=("rssr",),
    needs=("pressure",),
    inputs=INPUTS,
    outputs=STATIC_OUTPUTS,
    compute=compute_static,
    ns_per_pose=30.0,
    called_for="a fast machine, a precise meeting of hook and needle",
    negligible="largest lag times the lever of the working point below the tolerance (1e-4 rad: 0.01 mm at 100 mm)",
    advise=advise_static,
)
DYNAMIC = Effect(
    key="E2",
    name="dynamic_elasticity",
    title="periodic steady state of the elastic coupler and its stability",
    equation=EQUATION,
    formulas=FORMULAS,
    families=("rssr",),
    needs=("elasticity",),
    inputs=INPUTS,
    outputs=DYNAMIC_OUTPUTS,
    compute=compute_dynamic,
    ns_per_pose=1260.0,
    called_for="max|lag''/nu^2|/max|lag| above a third of the tolerance",
    negligible="max|lag''/nu^2|/max|lag| below 1/300 for a tolerance of 1 %; as a rule nu above 10 times the harmonics",
    whole_turn=True,
    design_result=DesignResult((FLOQUET, *reduction_outputs(DYNAMIC_OUTPUTS)), per_turn, 930_000.0),
    advise=advise_dynamic,
)
