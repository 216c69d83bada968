"""E1, E2: lag of the follower by the coupler's elasticity, quasi-static and in the periodic steady state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kernels import status as st
from kernels.effects.elasticity import Steady, quasi_static, steady_state
from kernels.types import Status
from sweep.effects import loads
from sweep.effects.base import Advice, DesignResult, Effect, about
from sweep.effects.driven import DrivenSide, driven_side
from sweep.effects.load_passing import LOADS, behind
from sweep.effects.loads import SPEED
from sweep.effects.scene import Scene, take_over
from sweep.effects.turn import RESOLVED, at_poses, on_finer_grids, per_turn, reduction_outputs
from sweep.families.base import Accuracy, Array, Columns, Output, Parameter, floats
from sweep.families.poses import optional_outputs
from sweep.numerics.even_grids import forwards

_SHARED = (
    Parameter("stiffness", "stiffness", "stiffness of the coupler along B-C", positive=True),
    Parameter("damping", "damping", "damping of the coupler along B-C", default=0.0, not_negative=True),
    SPEED,
)
INPUTS = {
    "rocker": (
        Parameter(
            "driven_inertia",
            "inertia",
            "inertia of the rocker about its axis, and of what it drives besides the stages behind and its tool",
            positive=True,
        ),
        *_SHARED,
        Parameter("load_torque", "torque", "torque on the rocker about its axis", default=0.0),
    ),
    "slider": (
        Parameter("driven_mass", "mass", "mass of slider and all it moves", positive=True),
        *_SHARED,
        Parameter("load_force", "force", "force on the slider along the slide", default=0.0),
    ),
}


def _static_outputs(kind: loads.Follower) -> tuple[Output, ...]:
    unit = "rad" if kind is loads.ROCKER else "length"
    at_joint = Output("lag_displacement", "length", "the same at the joint C, c eta")
    return (
        Output("lag", unit, f"quasi-static deflection of the {kind.name}, eta"),
        *((at_joint,) if kind is loads.ROCKER else ()),
        Output("frequency_ratio", "1", "natural frequency over crank speed"),
    )


def _dynamic_outputs(kind: loads.Follower) -> tuple[Output, ...]:
    unit = "rad" if kind is loads.ROCKER else "length"
    return (
        Output("lag_dynamic", unit, f"deflection of the {kind.name} in the periodic steady state"),
        Output("elongation_dynamic", "length", "elongation of the coupler in the periodic steady state"),
    )


# A tool on the coupler itself moves with its elongation, which is not modelled.
_AT_TIP = ((), (), (*loads.TOOLS[2], *loads.GRAVITY))
_KERNEL_NAMES = ("lag", "lag_displacement", "frequency_ratio")
FLOQUET = Output(
    "floquet", "1", "largest modulus of the Floquet multipliers; stable below 1, exactly 1 without damping"
)

# Odd grids of the steady state: the next one is tried for designs that the previous one does not resolve.
MULTIPLIER_ERROR = 1e-6
GRIDS = (31, 61, 121, 241)
# For stiff couplers near a dead point, where psi'' peaks within a few degrees.
FINER = (481, 961, 1921)


def _arguments(scene: Scene) -> tuple[Array, Array, Array, Array, Array]:
    """Return p = c t_tau, the rigid acceleration analogue, c, the reference length of a lag, and the inputs."""
    per_pose, per_design = scene.records
    c, turns = np.ascontiguousarray(per_design[:, 14]), per_design[:, 16]
    reach = np.where(turns == 1.0, 1.0, per_design[:, 13])
    inertia, stiffness, damping, speed, load = (p.name for p in INPUTS[loads.follower_of(scene.family).name])
    data = scene.table((inertia, stiffness, damping, speed, load))
    return per_pose[:, :, 21] * c[:, None], np.ascontiguousarray(per_pose[:, :, 23]), c, reach, data


def _varying(scene: Scene, driven: DrivenSide | None = None) -> Array | None:
    """Load of the curve and the driven side in addition to the constant one, (n, m); None if there is none."""
    load = loads.follower_of(scene.family).load.name
    if load not in scene.curves and driven is None:
        return None
    added = np.broadcast_to(scene.load(load) - scene.inputs[load][:, None], scene.shape)
    return np.ascontiguousarray(added if driven is None else added - driven.torque)


def compute_static(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted quasi-static outputs; status NOT_LINEAR where the deflection is not small."""
    scene, outputs = scene.even(), optional_outputs(_KERNEL_NAMES, wanted, scene.shape)
    lag, displacement, ratio = outputs
    status = scene.status()
    p, d2psi, c, reach, data = _arguments(scene)
    driven = driven_side(scene, False)
    if driven is not None and (handed_back := behind(scene, LOADS)) is not None:
        take_over(status, np.where(np.isfinite(driven.torque), st.OK, np.asarray(handed_back["status"], np.uint8)))
    quasi_static(p, d2psi, c, reach, data, status, lag, displacement, ratio, _varying(scene, driven))
    if driven is not None and ratio is not None:
        ratio *= np.sqrt(data[:, :1] / (data[:, :1] + driven.inertia))
    if ratio is not None:
        np.abs(ratio, out=ratio)  # also where the crank turns backwards
    columns: Columns = {name: out for name, out in zip(_KERNEL_NAMES, outputs, strict=True) if out is not None}
    return columns | {"status": status}


def compute_dynamic(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Solve the steady state on its own grid, and interpolate it to the wanted angles."""
    return at_poses(scene, *on_finer_grids(scene, scene.angles.phi, GRIDS + FINER, _solve), wanted)


def _solve(grid: Scene, phi: Array, last: bool) -> tuple[dict[str, Array], Status]:
    """Solve the steady state of designs on one grid.

    A crank that turns backwards is treated as one that turns forwards in -phi: only so do multipliers below 1 mean
    stability.
    """
    grid, speed, size = grid.even(), grid.inputs["speed"], grid.shape[1]
    _, _, c, reach, _ = _arguments(grid)
    equation = _equation(grid)
    found, status = _steady(equation, speed, c, reach, phi, last)
    found["missed"] = np.zeros(len(speed))
    bent = np.flatnonzero(grid.least_samples > 0.0)
    if bent.size:
        part, own = grid.only(bent), phi[bent] if phi.shape[0] > 1 else phi
        fine = _equation(part.on_grid(3 * (-(-FINER[-1] // size) | 1) * size))
        given = equation[0][bent], speed[bent], c[bent], reach[bent]
        # Every third sample, from two starts: a jump is halfway between samples in one of them at most.
        (whole, codes), *thirds = (_bent(fine, *taken, given, own, last) for taken in ((0, 1), (0, 3), (1, 3)))
        lag = whole["lag_dynamic"]
        change, most = (np.abs(x).max(axis=-1) for x in ([y["lag_dynamic"] - lag for y, _ in thirds], lag))
        for _, other in thirds:
            take_over(codes, np.where(other == st.NOT_CONVERGED, other, st.OK))
        over = np.fft.rfft(fine[-1], axis=1)[:, size // 2 + 1 :] * (2.0 / fine[-1].shape[1])
        dropped = (np.abs(over) / (size // 2 + 1 + np.arange(over.shape[1])) ** 2).sum(axis=1)
        whole["missed"] = np.divide(change.max(axis=0) + dropped, most, out=np.zeros(bent.size), where=most > 0.0)
        for name in ("lag_dynamic", "elongation_dynamic"):
            whole[name][codes == st.NOT_CONVERGED] = np.nan
        status[bent] = codes
        for name, values in whole.items():
            found[name][bent] = values
    return found, status


def _bent(
    fine: list[Array], start: int, step: int, given: tuple[Array, ...], phi: Array, last: bool
) -> tuple[dict[str, Array], Status]:
    """Solve under loads with kinks or jumps, whose higher harmonics are removed so that they do not alias.

    ``fine`` is the equation on a finer grid, from which every ``step``-th sample from ``start`` on is taken.
    """
    p, speed, c, reach = given
    n, size = fine[0].shape[1], p.shape[1]
    turn = np.exp(-2j * np.pi * start / n * np.arange(size // 2 + 1)) * (step * size / n)
    smooth = [
        np.fft.irfft(np.fft.rfft(y[:, start::step], axis=1)[:, : size // 2 + 1] * turn, n=size, axis=1)
        for y in fine[1:]
    ]
    return _steady([p, *smooth], speed, c, reach, phi, last)


def _steady(
    equation: list[Array], speed: Array, c: Array, reach: Array, phi: Array, last: bool
) -> tuple[dict[str, Array], Status]:
    n = len(speed)
    lag, elongation = (np.empty((n, phi.shape[1])) for _ in range(2))
    found = Steady(np.empty(n, np.uint8), lag, elongation, np.empty(n))
    phi, (p, first, zeroth, right) = forwards(speed, phi, *equation)
    steady_state(p, first * np.copysign(1.0, speed)[:, None], zeroth, right, c, reach, phi, last, found)
    return {"lag_dynamic": lag, "elongation_dynamic": elongation, "floquet": found.floquet}, found.status


def _equation(scene: Scene) -> list[Array]:
    """Compute p, the factors of eta' and eta, and the right side, over the factor of eta''; (3) with (5), (n, N)."""
    p, d2psi, _, _, data = _arguments(scene)
    driven = driven_side(scene, True)
    inertia, stiffness, damping, speed, _ = (data[:, k, None] for k in range(5))
    square = p * p
    orders = np.arange(p.shape[1] // 2 + 1)
    slope = np.fft.irfft(1j * orders * np.fft.rfft(square, axis=1), n=p.shape[1], axis=1)
    mass = inertia * speed * speed
    first = damping * speed * square
    zeroth = stiffness * square + 0.5 * damping * speed * slope
    right = scene.load(loads.follower_of(scene.family).load.name) - mass * d2psi
    if driven is not None:
        mass = mass + driven.inertia * speed * speed
        first += speed * speed * driven.bend * scene.records[0][:, :, 22]
        zeroth += driven.slope
        right = right - driven.torque
    return [p, first / mass, zeroth / mass, right / mass]


def turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute the Floquet multiplier and reductions of lag and elongation, on finer grids where needed."""
    columns = _turn(scene, wanted, GRIDS)
    unseen = (scene.least_samples > GRIDS[-1]) & (wanted != {"floquet"})
    late = np.flatnonzero((columns["status"] == st.NOT_CONVERGED) | unseen)
    if late.size:
        for name, values in _turn(scene.only(late), wanted, FINER).items():
            before = columns[name][late]
            # A known multiplier is kept: it must not depend on whether the lag is wanted too.
            kept = np.isfinite(before) & name.endswith("floquet")
            columns[name][late] = np.where(kept, before, values)
    return columns


def _turn(scene: Scene, wanted: frozenset[str], grids: tuple[int, ...]) -> Columns:
    phi = scene.on_grid(1 if wanted == {"floquet"} else grids[-1]).angles.phi
    found, status = on_finer_grids(scene, phi, grids, _solve)
    floquet = found["floquet"]
    if wanted == {"floquet"}:
        # A multiplier is known even where the forced solution is not resolved or not linear.
        status[np.isfinite(floquet)] = st.OK
    numbers: Columns = {"floquet": floquet, "err_floquet": np.full(len(floquet), MULTIPLIER_ERROR)}
    known = np.maximum(found["missed"], RESOLVED)
    return per_turn(found, status, numbers, _dynamic_outputs(loads.follower_of(scene.family)), wanted, known=known)


def advise_static(scene: Scene) -> Advice | None:
    """Largest quasi-static lag over the turn: an angle, or the share of the coupler's length."""
    found = compute_static(scene, frozenset({"lag"}))
    lag = np.abs(np.asarray(found["lag"], np.float64)).max(axis=1)
    unit = "rad" if loads.follower_of(scene.family) is loads.ROCKER else "of the coupler's length"
    return Advice.of_turning("quasi-static lag", lag / _arguments(scene)[3], 1e-4, unit)


def advise_dynamic(scene: Scene) -> Advice | None:
    """Estimate max|eta_qs''/nu^2|/max|eta_qs|; dynamics adds 0.7 to 2.8 times this share to the lag."""
    found = compute_static(scene.on_grid(GRIDS[-1]), frozenset({"lag", "frequency_ratio"}))
    lag, ratio = floats(found, "lag", "frequency_ratio")
    orders = np.arange(lag.shape[1] // 2 + 1)
    second = np.fft.irfft(-(orders**2) * np.fft.rfft(lag, axis=1), n=lag.shape[1], axis=1)
    size = np.abs(lag).max(axis=1)
    estimate = np.abs(second / ratio**2).max(axis=1) / np.where(size > 0.0, size, 1.0)
    return Advice.of_turning("estimated share that vibration adds to the lag", estimate, 0.01 / 3.0)


def _static(kind: loads.Follower) -> Effect:
    return Effect(
        **about(f"{kind.prefix}elasticity"),
        followers=(kind.name,),
        needs=("pressure",),
        inputs=INPUTS[kind.name],
        tool_inputs=_AT_TIP,
        takes_load=LOADS,
        may_drive_nothing=True,
        outputs=_static_outputs(kind),
        least=("frequency_ratio",),
        compute=compute_static,
        even_crank=True,
        advise=advise_static,
    )


def _dynamic(kind: loads.Follower) -> Effect:
    outputs = _dynamic_outputs(kind)
    return replace(
        _static(kind),
        **about(f"{kind.prefix}dynamic_elasticity"),
        needs=(f"{kind.prefix}elasticity",),
        outputs=outputs,
        least=(),
        compute=compute_dynamic,
        whole_turn=True,
        design_result=DesignResult((FLOQUET, *reduction_outputs(outputs)), turn),
        advise=advise_dynamic,
    )


STATIC, SLIDER_STATIC = _static(loads.ROCKER), _static(loads.SLIDER)
DYNAMIC, SLIDER_DYNAMIC = _dynamic(loads.ROCKER), _dynamic(loads.SLIDER)
