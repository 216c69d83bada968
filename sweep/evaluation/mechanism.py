"""``mechanism``: one design, checked and bound once, so that evaluating it costs little more than its kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from kernels.types import TWO_PI, Array
from sweep.effects import inputs_beside
from sweep.errors import InputError, MissingInput, listed, nearest
from sweep.evaluation.angles import TURNING, grid_in_radians, is_plausible
from sweep.evaluation.poses import query_of, values_of_the_variable
from sweep.evaluation.routes import design_outputs
from sweep.evaluation.statuses import explained
from sweep.evaluation.summaries import chosen_accuracy
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Angles, Domain, Family, Parameter, Turn
from sweep.families.names import stem
from sweep.quantities.units import LARGEST, internal_unit, one_value, plain

Number: TypeAlias = "float | str"
"""A dimension in internal units (mm, rad, t, s and derived ones), or a text with its unit, as "12 mm"."""

KEPT = 2**14  # crank angles of a grid whose cosines and sines are kept for the next call


class BoundDesign:
    """One design of a mechanism, as `mechanism` binds it; it is immutable.

    Parameters
    ----------
    family : family of the design
    dimensions : its parameters, and inputs of effects, by name, in internal units
    """

    def __init__(self, family: Family, dimensions: Mapping[str, float]) -> None:
        self.family = family
        self.dimensions = dict(dimensions)
        self._rows: dict[tuple[str, ...], Array] = {}
        self._row(family)

    def __repr__(self) -> str:
        arguments = "".join(f", {name}={value!r}" for name, value in self.dimensions.items())
        return f"mechanism({self.family.name}{arguments})"

    def __call__(self, phi: ArrayLike) -> dict[str, Any]:
        """Compute every pose output at crank angles, as `poses` does."""
        return self.poses(phi, self.family.pose_names)

    def poses(self, phi: ArrayLike, want: str | Sequence[str]) -> dict[str, Any]:
        """Compute pose outputs at crank angles, bit for bit those of `sweep.evaluate`.

        Parameters
        ----------
        phi : crank angle [rad], or a plain list of them; a family over an interval takes its own variable
        want : names of pose outputs or effects, in a list or in one text between commas

        Returns
        -------
        dict
            an array like ``phi`` for each wanted name and ``status``, or a number each for one angle; ``pd.DataFrame``
            accepts it
        """
        query = query_of(self._precise, want, None, "pose")
        angles, is_scalar = _angles(self.family.domain, phi)
        with np.errstate(all="ignore"):  # values beyond float64 get a status below
            outputs = explained(
                query.family.poses(self._row(query.family), angles, frozenset(query.wanted)), query.wanted
            )
        if is_scalar:
            return {name: outputs[name].item() for name in (*query.wanted, "status")}
        return {name: outputs[name][0] for name in (*query.wanted, "status")}

    def outputs(
        self,
        want: str | Sequence[str],
        *,
        samples: int | None = None,
        accuracy: float | None = None,
        window: tuple[float, float] | None = None,
    ) -> dict[str, Any]:
        """Compute design outputs, bit for bit those of `sweep.summarise`, with the arguments of `sweep.summarise`.

        Returns
        -------
        dict
            a number for each wanted name, with ``accuracy`` also ``err_<name>``, and ``status``
        """
        query = query_of(self.family, want, None, "design")
        chosen = chosen_accuracy(self.family.domain, samples, accuracy)
        outputs = design_outputs(query.family, self._row(query.family), query.wanted, chosen, window)
        return {name: values.item() for name, values in outputs.items()}

    def with_(self, **dimensions: Number) -> BoundDesign:
        """Bind the same mechanism with some dimensions changed."""
        return BoundDesign(self.family, self.dimensions | _in_internal_units(self.family, dimensions))

    @cached_property
    def _precise(self) -> Family:
        return self.family.precise()

    def _row(self, family: Family) -> Array:
        """Build the design matrix (1, P) of a family that effects may have extended by inputs."""
        row = self._rows.get(family.parameter_names)
        if row is None:
            values = [self.dimensions.get(p.name, p.left_out(self.dimensions)) for p in family.parameters]
            for p, value in zip(family.parameters, values, strict=True):
                if value is None:
                    present = ", ".join(self.dimensions) or "nothing"
                    raise MissingInput(p.name, f"the {p.text}; given {present}", _place(self.family))
            row = self._rows[family.parameter_names] = np.array([values], np.float64)
        return row


def mechanism(family: Mechanism, **dimensions: Number) -> BoundDesign:
    """Check and bind one design of a mechanism for repeated evaluation.

    Parameters
    ----------
    family : "rssr", "guide", ..., a list of them for a chain, or a table of members by name for a machine
    dimensions : parameters, and inputs of effects that will be asked for: numbers in mm and rad (t, s, N), or texts
        with a unit.  Those of a machine have dots: ``**{"needle.a1": 10.0}``

    Returns
    -------
    BoundDesign
        ``m(phi)`` gives all pose outputs, ``m.poses(phi, names)`` some, ``m.outputs(names)`` design outputs,
        ``m.with_(a=12)`` another design

    Raises
    ------
    InputError
        for a name that the mechanism does not have, a dimension that is missing, or a bad value.

    Examples
    --------
    >>> import sweep
    >>> m = sweep.mechanism("rssr", a="12 mm", b=40, c=25, e=35, f=5, g=-3, alpha="60 deg")
    >>> {name: round(value, 4) for name, value in m.poses(0.5, "psi, d2psi").items()}
    {'psi': -1.6003, 'd2psi': -0.1961, 'status': 0}
    >>> m.poses([0.0, 0.5], ["dpsi"])["dpsi"].round(4)
    array([-0.2124, -0.4886])
    >>> found = m.with_(a=10).outputs(["margin", "max_abs_d2psi"])
    >>> round(found["max_abs_d2psi"], 4), found["status"]
    (0.6276, 0)
    """
    bare = find_family(family)
    return BoundDesign(bare, _in_internal_units(bare, dimensions))


def _place(family: Family) -> str:
    return f"mechanism {family.name}"


def _in_internal_units(family: Family, dimensions: Mapping[str, Number]) -> dict[str, float]:
    """Check dimensions and convert them to internal units."""
    inputs = dict(inputs_beside(family, dimensions)) | {p.name: p for p in family.parameters}
    for name in dimensions:
        if name not in inputs:
            allowed = f"{listed(family.parameter_names)}{nearest(name, inputs)}"
            raise InputError("dimension", name, allowed, _place(family))
    return {name: _value(name, inputs[name], value, _place(family)) for name, value in dimensions.items()}


def _is_number(given: object) -> TypeGuard[float]:
    """Whether a value is a finite number of Python or numpy."""
    if isinstance(given, bool) or not isinstance(given, int | float | np.integer | np.floating):
        return False
    number: Any = given
    return bool(abs(number) <= LARGEST)


def _value(name: str, p: Parameter, given: object, place: str) -> float:
    """Convert one dimension to its internal unit, with the checks of a table's column."""
    internal = internal_unit(p.unit)
    converted: Any = (
        one_value(given, internal, name, place) if isinstance(given, str) else plain(given, internal, name, place)
    )
    if converted is not given and _is_number(converted):
        value = float(converted)
    elif _is_number(given):
        value = float(given)
        if p.unit == "angle" and not is_plausible(abs(value), stem(name) in TURNING):
            allowed = f'an angle in rad, which this does not look like; for degrees a text, as "{value:g} deg"'
            raise InputError(name, given, allowed, place)
    else:
        allowed = (
            "a finite number" if internal == "1" else f'a finite number in {internal}, or a text such as "1 {internal}"'
        )
        raise InputError(name, given, allowed, place)
    if p.sign and p.wrong_sign(value):
        raise InputError(name, given, f"a {p.sign} {p.unit}", place)
    if p.choices is not None and value not in p.choices:
        raise InputError(name, given, p.choice, place)
    return value


def _angles(domain: Domain, phi: ArrayLike) -> tuple[Angles, bool]:
    """Check and tabulate crank angles, cached for grids of the usual size; also return whether it is one angle."""
    if isinstance(phi, float) and isinstance(domain, Turn) and abs(phi) <= TWO_PI:
        return Angles.of(np.array([[phi]])), True
    if isinstance(phi, list) and all(isinstance(x, float) for x in phi):
        phi = np.array(phi, np.float64)
    # A quantity of pint is no array: as one it would lose its unit.
    if isinstance(phi, np.ndarray) and phi.dtype == np.float64 and phi.ndim == 1 and phi.size <= KEPT:
        return _tabulated(domain, phi.tobytes()), False
    is_list = isinstance(phi, Sequence) and not isinstance(phi, str)
    return _checked(domain, phi), getattr(phi, "ndim", int(is_list)) == 0


def _checked(domain: Domain, phi: ArrayLike) -> Angles:
    return Angles.of(values_of_the_variable(domain, grid_in_radians(domain, phi, None))[None, :])


@lru_cache(maxsize=32)
def _tabulated(domain: Domain, grid: bytes) -> Angles:
    return _checked(domain, np.frombuffer(grid, np.float64).copy())
