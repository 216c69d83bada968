"""Other variables than the parameters themselves: maps from what is varied to designs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Family
from sweep.synthesis.prescription import OnLocus

EXACT = Accuracy(target=1e-12)


class Coordinates(Protocol):
    """A map from variables that are no parameters (``given``) to parameters that follow from them (``made``)."""

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the variables this map adds."""
        ...

    @property
    def made(self) -> tuple[str, ...]:
        """Names of the parameters that follow; they cannot be varied themselves."""
        ...

    @property
    def periodic(self) -> tuple[str, ...]:
        """Those of ``given`` that come to the same after a turn."""
        ...

    def make(self, columns: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the parameters in ``made``, (n,) each, nan where there is no such design.

        ``columns`` holds what is given and all other parameters; complex columns give complex parameters.
        """
        ...

    def read(self, family: Family, designs: Array) -> Mapping[str, Array]:
        """Return what is given, (n,) each, of designs (n, P)."""
        ...


@dataclass(frozen=True)
class LocusCoordinates:
    """Limit positions instead of links: swing or stroke (by magnitude), phi0 and the place on the locus are variables.

    The links of the stage follow (docs/synthesis.md), so a prescribed swing, stroke or phi0 holds exactly wherever the
    search goes.  The branch belongs to the start as ever; it tells the sign of the swing.
    """

    stage: OnLocus

    @cached_property
    def given(self) -> tuple[str, ...]:
        """The prescribed design outputs, with the number of the stage."""
        return tuple(p.name for p in self.stage.prescribed)

    @cached_property
    def made(self) -> tuple[str, ...]:
        """The links that follow."""
        return tuple(name for name in self.stage.made if name != self._branch)

    @property
    def periodic(self) -> tuple[str, ...]:
        """The place on the locus."""
        return (f"phi_ext{self.stage.number}",)

    @cached_property
    def _asked(self) -> tuple[str, ...]:
        return tuple(self.stage.outside(name) for name in self.stage.way.parameter_names)

    @property
    def _branch(self) -> str:
        return f"branch{self.stage.number}"

    def make(self, columns: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the links that do what is prescribed; nan where the locus has no mechanism there."""
        matrix = np.column_stack([columns[name] for name in self._asked])
        matrix[:, 0] *= -columns[self._branch].real
        links = self.stage.links_of(self.stage.way.solve(matrix))
        return {name: links[name] for name in self.made}

    def read(self, family: Family, designs: Array) -> Mapping[str, Array]:
        """Limit positions of designs; nan where there are none."""
        number, direction = self.stage.number, f"direction{self.stage.number}"
        asked = [name for name in self.given if name != direction]
        columns = design_outputs(family, designs, asked, EXACT)
        found = {name: np.asarray(columns[name], np.float64) for name in asked}
        found[asked[0]] = np.abs(found[asked[0]])
        if direction in self.given:
            e, g = (designs[:, family.parameter_names.index(f"{name}{number}")] for name in ("e", "g"))
            found[direction] = np.arctan2(g, e)
        return found
