"""References of the effects: by another method if an effect couples a whole turn, otherwise by finer sampling.

A witness takes the family with the effect's poses and a design matrix, and returns reference values by output.
Extrema of pose outputs without a witness are compared with successively finer grids.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kernels.types import TWO_PI
from studies.accuracy.witness import Known, extreme
from sweep.effects import NAMES, effect, extended
from sweep.families.base import Array, Family
from sweep.reductions.rounding import rounding_alone
from sweep.reductions.sampling import pose_columns

SAMPLES, MANY = 8192, 131_072
# Divisors of the number of poses; the error of a reference is DOUBT times its difference from these coarser ones.
COARSER, DOUBT = (2, 3), 2.0
PASSES, HALVINGS = 12, 200
LOOKED_AT = 360  # poses that show whether an output is rounding alone
EXTREMA = {"max_abs_": 0, "max_": 1, "min_": -1}


class Effected(NamedTuple):
    """A family, its extension by the effect's inputs, and designs of the latter."""

    bare: Family
    full: Family
    designs: Array

    def given(self, name: str) -> Array:
        """Return an input or parameter of the designs."""
        return self.designs[:, self.full.parameter_names.index(name)]

    def poses(self, names: tuple[str, ...], samples: int, changed: Mapping[str, Array] | None = None) -> list[Array]:
        """Return pose outputs over an even grid, (n, samples), of any effects; inputs ``changed`` vary by pose."""
        wider = extended(self.bare, names)
        rows = np.column_stack([self._input(wider, name) for name in wider.parameter_names])
        phi = np.arange(samples) * (TWO_PI / samples)
        n = len(rows)
        if changed is None:
            columns, _ = pose_columns(wider, rows, np.tile(phi, (n, 1)), names)
            return [columns[name] for name in names]
        rows = np.repeat(rows, samples, axis=0)
        for name, values in changed.items():
            rows[:, wider.parameter_names.index(name)] = values.ravel()
        columns, _ = pose_columns(wider, rows, np.tile(phi, n)[:, None], names)
        return [columns[name].reshape(n, samples) for name in names]

    def _input(self, wider: Family, name: str) -> Array:
        if name in self.full.parameter_names:
            return self.given(name)
        default = wider.parameters[wider.parameter_names.index(name)].default
        return np.full(len(self.designs), np.nan if default is None else default)


Witness: TypeAlias = Callable[[Effected, int], dict[str, Array]]
"""Outputs by name, from a number of poses; a method that chooses its own poses ignores the number."""


def known_of(name: str, given: Effected, wanted: tuple[str, ...]) -> tuple[dict[str, Known], str]:
    """Return reference values of an effect's outputs, and a description of their methods."""
    entry = WITNESSES.get(kind_of(name)) if name in NAMES else None
    found, words = {}, ""
    if entry is not None:
        witness, samples, words = entry
        fine, *coarse = (witness(given, samples // share) for share in (1, *COARSER))
        # Curves with jumps may agree by accident: the error of a reference is that of the worst design for all designs.
        found = {
            output: Known(value, DOUBT * np.abs(value) * max(np.abs(one[output] / value - 1.0).max() for one in coarse))
            for output, value in fine.items()
        }
    if name in NAMES and effect(name).whole_turn:
        return found, words
    sampled = of_samples(given, tuple(output for output in wanted if output not in found))
    return found | sampled, "; ".join(filter(None, (words, FINER if sampled else "")))


def kind_of(name: str) -> str:
    """Return the name of an effect without the kind of follower, or without the family of its link tree."""
    entry = effect(name)
    return name.removeprefix("slider_" if entry.tree is None else f"{entry.families[0]}_")


def of_samples(given: Effected, wanted: tuple[str, ...]) -> dict[str, Known]:
    """Return largest values, magnitudes and least values of pose outputs, by successively finer grids."""
    found = {}
    for name in wanted:
        for prefix, sign in EXTREMA.items():
            pose = name.removeprefix(prefix)
            if name.startswith(prefix) and pose in given.full.pose_names:
                if not _is_nothing(given, pose):
                    found[name] = extreme(given.full.precise(), given.designs, pose, sign)
                break
    return found


def _is_nothing(given: Effected, pose: str) -> bool:
    """Tell whether a pose output is only rounding, like the moment in a pin of a planar mechanism."""
    (values,) = given.poses((pose,), LOOKED_AT)
    size, looked_at = np.abs(values).max(axis=1), np.ones(len(values), np.bool_)
    return bool(rounding_alone(given.full, given.designs, pose, values, size, looked_at).any())


def pressure(given: Effected, samples: int) -> dict[str, Array]:
    """Return the largest and least pressure angle, from the angle itself."""
    largest, least = (extreme(given.full.precise(), given.designs, "pressure_angle", sign).value for sign in (1, -1))
    return {"pressure_max": largest, "pressure_min": least}


def bearing_life(given: Effected, samples: int) -> dict[str, Array]:
    """Return mean loads and lives of the rocker's bearings by even sums over very many poses, with or without kinks."""
    return _lives(given, samples, "d", "", given.bare.derivative_of[given.bare.position])


# By the name of a shaft whose angle in its bearings is a pose output: that output, and the turns per turn of the crank
# that the output does not show; cranks turn evenly.
_ANGLES = {"d": ("psi", 0.0), "d1": ("psi", 0.0), "os": ("chi", 0.0), "b": ("theta", -1.0), "h": ("beta", 0.0)}


def bearings_of_shafts(given: Effected, samples: int) -> dict[str, Array]:
    """Return mean loads and lives of the bearings of every shaft of a link tree."""
    found: dict[str, Array] = {}
    for name in given.full.parameter_names:  # bearings of the rocker alone, a massless estimate, have no shaft's name
        shaft = name.removeprefix("dynamic_capacity_")
        if shaft != name:
            found |= _lives(given, samples, shaft, f"_{shaft}", shaft)
    return found


def _lives(given: Effected, samples: int, shaft: str, tail: str, turning: str) -> dict[str, Array]:
    pair = f"equivalent_load_{shaft}1", f"equivalent_load_{shaft}2"
    first, second = given.poses(pair, samples)
    if not tail:
        way = np.abs(given.poses((turning,), samples)[0])
    elif shaft in _ANGLES:
        angle, more = _ANGLES[shaft]
        turned = np.unwrap(given.poses((angle,), samples)[0], axis=1)
        way = np.abs(_slope(turned) + more)
    else:
        way = np.ones(first.shape)
    exponent = given.given(f"life_exponent{tail}")
    travel = TWO_PI * way.mean(axis=1)
    found: dict[str, Array] = {}
    for k, load in (("1", first), ("2", second)):
        size = load.max(axis=1)
        power = ((load / size[:, None]) ** exponent[:, None] * way).mean(axis=1) * TWO_PI / travel
        mean = size * power ** (1.0 / exponent)
        turns = 1e6 * (given.given(f"dynamic_capacity{tail}") / mean) ** exponent
        found |= {
            f"mean_load_{shaft}{k}": mean, f"life_{shaft}{k}": turns * TWO_PI**2 / (travel * given.given("speed"))
        }  # fmt: skip
    return found


def _slope(angle: Array) -> Array:
    """Return the slope of an angle that grows by full turns, by differences of sixth order."""
    turns = np.rint((angle[:, -1] - angle[:, 0]) / TWO_PI)
    step = TWO_PI / angle.shape[1]
    swing = angle - turns[:, None] * np.arange(angle.shape[1]) * step
    found = np.zeros(angle.shape)
    for k, weight in enumerate((3 / 4, -3 / 20, 1 / 60), 1):
        found += weight / step * (np.roll(swing, -k, axis=1) - np.roll(swing, k, axis=1))
    slope: Array = found + turns[:, None]
    return slope


def speed(given: Effected, samples: int) -> dict[str, Array]:
    """Return the drive's speeds from its energy summed pose by pose, with the mean level found by halving."""
    return _numbers(*_steady(*_energies(given, samples), given.given("speed")), given.given("speed"), _height)


def speed_with_friction(given: Effected, samples: int) -> dict[str, Array]:
    """Return the speeds with friction, iterated at every pose with the resulting speed until it no longer changes."""
    inertia, slope, excess = _energies(given, samples)
    mean = given.given("speed")
    crank, change = np.tile(mean[:, None], (1, samples)), np.zeros(inertia.shape)
    for _ in range(PASSES):
        names = ("drive_torque_friction", "drive_torque")
        rubbing, smooth = given.poses(names, samples, {"speed": crank, "speed_change": change})
        crank, change = _steady(inertia, slope, excess - (rubbing - smooth), mean)
    found = _numbers(crank, change, mean, lambda curve: np.abs(curve).max(axis=1))  # no parabola across a jump
    return {f"{name}_friction": values for name, values in found.items()}


def _energies(given: Effected, samples: int) -> tuple[Array, Array, Array]:
    """Return the inertia about the crank, its derivative, and the excess torque at constant speed."""
    inertia, slope, drive = given.poses(("reduced_inertia", "dreduced_inertia", "drive_torque"), samples)
    mean = given.given("speed")[:, None]
    return inertia + given.given("flywheel")[:, None], slope, 0.5 * slope * mean**2 - drive


def _steady(inertia: Array, slope: Array, excess: Array, mean: Array) -> tuple[Array, Array]:
    """Return speed and acceleration of d(J w^2/2)/d phi = excess - its mean, for constant motor torque."""
    torque = excess - excess.mean(axis=1, keepdims=True)
    step = TWO_PI / inertia.shape[1]
    work = np.concatenate([np.zeros((len(torque), 1)), np.cumsum(_panels(torque), axis=1)[:, :-1]], axis=1) * step
    low, high = -work.min(axis=1), 2.0 * inertia.max(axis=1) * mean**2 - work.min(axis=1)
    for _ in range(HALVINGS):
        level = 0.5 * (low + high)
        pace = np.sqrt(inertia / np.maximum(2.0 * (level[:, None] + work), np.finfo(float).tiny)).mean(axis=1)
        slow = pace > 1.0 / mean  # a turn takes too long
        low, high = np.where(slow, level, low), np.where(slow, high, level)
    crank = np.sqrt(2.0 * (0.5 * (low + high)[:, None] + work) / inertia)
    return crank, (torque - 0.5 * slope * crank**2) / inertia


def _numbers(crank: Array, change: Array, mean: Array, height: Callable[[Array], Array]) -> dict[str, Array]:
    top = crank.max(axis=1, keepdims=True)
    fastest, slowest = height(crank), top[:, 0] - height(top - crank)
    found = {"unevenness": (fastest - slowest) / mean, "fastest": fastest, "slowest": slowest}
    return found | {"max_abs_crank_speed": fastest, "max_abs_crank_acceleration": height(change)}


def _panels(y: Array) -> Array:
    """Return the integral of every panel of a periodic curve over its width, by the cubic through four samples."""
    left, right, after = np.roll(y, 1, axis=1), np.roll(y, -1, axis=1), np.roll(y, -2, axis=1)
    panels: Array = (13.0 * (y + right) - left - after) / 24.0
    return panels


def elastic(given: Effected, samples: int) -> dict[str, Array]:
    """Return the periodic vibration by differences of eighth order, its damping by Liouville's formula."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import spsolve

    rocking = "driven_inertia" in given.full.parameter_names
    arm = given.given("c") if rocking else np.ones(len(given.designs))
    second = given.bare.derivative_of[given.bare.derivative_of[given.bare.position]]
    lever, bend = given.poses(("t_tau", second), samples)
    lever = lever * arm[:, None]
    inertia, load = (given.given(name) for name in (
        ("driven_inertia", "load_torque") if rocking else ("driven_mass", "load_force")))  # fmt: skip
    stiffness, damping, omega = (given.given(name) for name in ("stiffness", "damping", "speed"))
    first, twice = (_stencil(order, samples) for order in (1, 2))
    lag = np.empty(lever.shape)
    for k, p in enumerate(lever):
        rate = first @ p
        moved = diags(damping[k] * omega[k] * p**2) @ first
        held = diags(stiffness[k] * p**2 + damping[k] * omega[k] * p * rate)
        matrix = inertia[k] * omega[k] ** 2 * twice + moved + held
        lag[k] = spsolve(matrix.tocsc(), load[k] - inertia[k] * omega[k] ** 2 * bend[k])
    decay = (damping[:, None] * lever**2).mean(axis=1) * TWO_PI / (inertia * omega)
    found = {"floquet": np.exp(-0.5 * decay), "max_abs_lag_dynamic": _height(lag)}
    return found | {"max_abs_elongation_dynamic": _height(lag * lever)}


def _stencil(order: int, samples: int) -> Any:
    """Return the matrix of the first or second derivative of a periodic curve by differences of eighth order."""
    from scipy.sparse import diags

    half = {1: (4 / 5, -1 / 5, 4 / 105, -1 / 280), 2: (8 / 5, -1 / 5, 8 / 315, -1 / 560)}[order]
    step, sign = TWO_PI / samples, -1.0 if order == 1 else 1.0
    places = {0: 0.0 if order == 1 else -205 / 72}
    for k, weight in enumerate(half, 1):
        places |= {k: weight, -k: sign * weight, k - samples: weight, samples - k: sign * weight}
    return diags(list(places.values()), list(places), shape=(samples, samples)).tocsr() / step**order


def _height(curve: Array) -> Array:
    """Return the largest magnitude of a smooth periodic curve from close samples, by a parabola through the highest."""
    size, rows = np.abs(curve), np.arange(len(curve))
    top = size.argmax(axis=1)
    left, middle, right = (size[rows, (top + k) % size.shape[1]] for k in (-1, 0, 1))
    bow = 2.0 * middle - left - right
    height: Array = middle + np.divide((right - left) ** 2, 8.0 * bow, out=np.zeros(rows.size), where=bow > 0.0)
    return height


FINER = "poses on ever narrower grids"
WITNESSES: Mapping[str, tuple[Witness, int, str]] = {
    "pressure_extrema": (pressure, 0, "the angle on ever narrower grids"),
    "bearing_life": (bearing_life, MANY, f"even sums over {MANY} poses"),
    "rolling_bearings": (bearings_of_shafts, MANY, f"even sums over {MANY} poses"),
    "speed_fluctuation": (speed, SAMPLES, f"energy summed over {SAMPLES} poses, speed level by halving"),
    "speed_fluctuation_friction": (
        speed_with_friction, SAMPLES, f"energy summed over {SAMPLES} poses, friction at the resulting speed",
    ),
    "dynamic_elasticity": (
        elastic, SAMPLES, f"differences of eighth order over {SAMPLES} poses; Liouville's formula",
    ),
}  # fmt: skip
"""By effect without its family or kind of follower: the witness, its number of poses, and its description."""
