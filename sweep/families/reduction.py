"""The reductions of a pose output over its domain: sweeps, optimiser, report and help read them from this table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sweep.families.base import Domain, Family, Output, Turn
from sweep.families.names import without_minus

Mode: TypeAlias = Literal[-1, 0, 1]
"""Kind of extremum: 0 the largest magnitude, +1 the largest value, -1 the smallest."""


@dataclass(frozen=True)
class Reduction:
    """A number from a pose output over its domain.

    Parameters
    ----------
    name : prefix of the pose output's name
    text : definition, with the words for the domain in place of ``{over}`` and ``{variable}``
    symbol, words : text in figures and tables, ``{}`` stands for the pose output
    modes : extrema in its definition; none for a mean
    place : whether it is the value of the domain's variable at the extremum; the variable's name then stands first
    domains : kinds of domain to which it applies
    """

    name: str
    text: str
    symbol: str
    words: str
    modes: tuple[Mode, ...]
    place: bool = False
    domains: tuple[str, ...] = ("turn", "interval", "march")

    @property
    def kind(self) -> str:
        """Name of the kind in the optimiser: a mean is a scalar."""
        return "scalar" if not self.modes else f"phi_{self.name}" if self.place else self.name

    def prefix(self, domain: Domain) -> str:
        """Return the prefix of a pose output's name."""
        return f"{domain.name}_{self.name}_" if self.place else f"{self.name}_"

    def output(self, of: Output, domain: Domain) -> Output:
        """Design output: this reduction of a pose output."""
        over = "one turn" if domain.unit == "rad" else f"the interval of the {domain.text}"
        variable = "crank angle" if isinstance(domain, Turn) else domain.text
        text = f"{self.text.format(over=over, variable=variable)} {of.name}: {of.text}"
        return Output(
            f"{self.prefix(domain)}{of.name}", domain.unit if self.place else of.unit, text, of.equation, of.jumps,
            stage=of.stage, own=f"{self.prefix(domain)}{of.base}",
        )  # fmt: skip


REDUCTIONS = (
    Reduction("max_abs", "largest magnitude over {over} of", "max |{}|", "largest {}", (0,)),
    Reduction("max_abs", "{variable} of the largest magnitude of", "φ at max |{}|",
              "crank angle of the largest {}", (0,), place=True),
    Reduction("max", "largest value over {over} of", "max {}", "largest {}", (1,)),
    Reduction("min", "smallest value over {over} of", "min {}", "smallest {}", (-1,)),
    Reduction("max", "{variable} of the largest value of", "φ at max {}", "crank angle of the largest {}", (1,), True),
    Reduction("min", "{variable} of the least value of", "φ at min {}", "crank angle of the smallest {}", (-1,), True),
    Reduction("range", "largest minus smallest value over {over} of", "range of {}", "range of {}", (1, -1)),
    Reduction("rms", "root mean square over {over} of", "rms {}", "root mean square of {}", (),
              domains=("turn", "march")),
)  # fmt: skip

# Longer prefixes first: max_abs_x is not the largest value of abs_x.
_BY_LENGTH = sorted(REDUCTIONS, key=lambda reduction: -len(reduction.name) - reduction.place)


def prefixes(domain: Domain) -> tuple[str, ...]:
    """Prefixes of all reductions that apply to a domain."""
    return tuple(reduction.prefix(domain) for reduction in REDUCTIONS if domain.kind in reduction.domains)


def split(name: str, domain: Domain) -> Iterator[tuple[Reduction, str]]:
    """Yield each division of a name into a reduction and the name of a pose output."""
    for reduction in _BY_LENGTH:
        prefix = reduction.prefix(domain)
        if name.startswith(prefix):
            yield reduction, name.removeprefix(prefix)


def reduced(name: str, domain: Domain) -> set[str]:
    """Return the name itself and its remainders behind prefixes of reductions."""
    name = without_minus(name) or name
    return {name, *(rest for _, rest in split(name, domain))}


def reduction_of(family: Family, name: str) -> tuple[Reduction, Output] | None:
    """Reduction and pose output in a name; None for a name without a reduction."""
    for reduction, rest in split(name, family.domain):
        pose = family.pose_output.get(rest)
        if pose is not None:
            return reduction, pose
    return None
