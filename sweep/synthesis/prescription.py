"""Designs from what the first stage has to do: its limit positions stand in the study, its links follow.

A study with [locus] prescribes design outputs of stage 1, or of the only stage: swing (rssr) or stroke (rssp), phi0 and
phi_ext, the place on the locus.  Links and branch that meet them exactly come from :mod:`sweep.synthesis`, so every
design of the sweep keeps these limits and none is lost on looking for them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kernels.types import TWO_PI, Status
from sweep.families import family as find_family
from sweep.families.base import Array, Parameter
from sweep.synthesis.locus import Found, Locus, locus

# The synthesis calls the crank angle of the extended position phi1; as a design output it is phi_ext.
_PLACE = ("phi1", "phi_ext")


@dataclass(frozen=True)
class OnLocus:
    """The stage whose links follow from its limit positions: its family, and its number as text ("" if it is alone).

    ``told_by`` is the column that tells the way of the synthesis: phi1, or direction for a rocker of given length.
    """

    family: str
    number: str
    told_by: str = _PLACE[0]

    @cached_property
    def way(self) -> Locus:
        """The way of the synthesis that takes the place as a crank angle."""
        return locus(self.family, (self.told_by,))

    @cached_property
    def prescribed(self) -> tuple[Parameter, ...]:
        """The design outputs that are prescribed, as columns of a design space."""
        own = find_family(self.family).parameter_names
        asked = [p for p in self.way.parameters if p.name not in own]
        return tuple(Parameter(self.outside(p.name), p.unit, p.text) for p in asked)

    @cached_property
    def made(self) -> tuple[str, ...]:
        """Parameters of the mechanism that follow: a, b, c and branch, of a slider-crank also e."""
        given = self.way.parameter_names
        return tuple(f"{name}{self.number}" for name in find_family(self.family).parameter_names if name not in given)

    def allowed(self, name: str, values: Array) -> str | None:
        """Return what a prescribed output may be, if not all the values [mm, rad] are that; else None."""
        stem = name.removesuffix(self.number) if self.number else name
        if stem == "swing":
            bad, words = ~((values != 0.0) & (np.abs(values) < TWO_PI)), "an angle below one turn, or its negative"
        elif stem == "stroke":
            bad, words = (
                ~(values > 0.0),
                "a positive length (a mirrored mechanism whose crank turns back does the rest)",
            )
        elif stem == "phi0":
            bad, words = ~((values > 0.0) & (values < TWO_PI)), "an angle between 0 and 360 deg"
        else:
            bad, words = ~((values >= 0.0) & (values <= TWO_PI)), "an angle from 0 to 360 deg"
        return words if bad.any() else None

    def links(self, columns: Mapping[str, Array]) -> tuple[dict[str, Array], Status]:
        """Parameters in ``made``, (n,) each, and the status of each design.

        Parameters
        ----------
        columns : (n,) arrays by name, among them the prescribed outputs and what the locus needs of the stage [mm, rad]

        Returns
        -------
        columns : nan where the status is not OK
        status : OK, or NOT_ADMISSIBLE where the place on the locus gives no mechanism that does what is prescribed
        """
        way = self.way
        found = way.solve(way.read({name: columns[self.outside(name)] for name in way.parameter_names}))
        return self.links_of(found), found.status

    def links_of(self, found: Found) -> dict[str, Array]:
        """Parameters in ``made`` out of mechanisms of this stage alone."""
        own = find_family(self.family).parameter_names
        return {name: found.designs[:, own.index(name.removesuffix(self.number))] for name in self.made}

    def outside(self, name: str) -> str:
        """Return what a column of the requirement is called in a study."""
        return f"{_PLACE[1] if name == _PLACE[0] else name}{self.number}"
