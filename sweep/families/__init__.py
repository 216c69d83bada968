"""The register of mechanism families: each has kernels, a table in families.toml and an entry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import import_module
from typing import Any, TypeAlias

import sweep.sources  # noqa: F401 (read before any source that makes a value is imported, and all of those begin here)
from sweep.errors import InputError, choices
from sweep.families.base import Family
from sweep.families.chain import chain as chain_of  # the name of the module stays that of the module
from sweep.families.check import check_family
from sweep.families.machines.machine import Machine
from sweep.families.machines.specification import Specification, built
from sweep.families.machines.specification import specification as specified
from sweep.families.register import REGISTER

NAMES = tuple(REGISTER)

Mechanism: TypeAlias = "str | Sequence[str] | Mapping[str, Any] | Specification | Family"
"""A family's name, a list of names for a chain, a table of members for a machine, or a result of `sweep.machine`."""


def chain_names(text: str) -> tuple[str, ...]:
    """Split the names of a chain's families in one text.

    >>> chain_names("rssr+guide"), chain_names("rssr, guide"), chain_names("rssr")
    (('rssr', 'guide'), ('rssr', 'guide'), ('rssr',))
    """
    return tuple(name.strip() for name in text.replace("+", ",").split(","))


def family(name: Mechanism) -> Family:
    """Return the family of a name, the chain of a list or of "rssr+guide", or the machine of a table of members.

    Raises
    ------
    InputError
        if a name is unknown; the message gives the nearest known one.
    """
    if isinstance(name, Family):
        return name
    if isinstance(name, Mapping):
        return machine(name)
    if isinstance(name, Specification):
        return _machine(name)
    if isinstance(name, str):
        parts = chain_names(name)
        return _single(name) if len(parts) == 1 else _chain(parts)
    names = tuple(name) if isinstance(name, Sequence) else (name,)
    if not names or not all(isinstance(part, str) for part in names):
        raise InputError("family", name, f"one of {', '.join(NAMES)}, or a list of them", "family")
    if len(names) == 1:
        return _single(names[0])
    return _chain(names)


def machine(
    members: Mapping[str, Any],
    relations: Mapping[str, Any] | None = None,
    shafts: Mapping[str, Any] | None = None,
    tools: Mapping[str, Any] | None = None,
) -> Machine:
    """Make a machine of several mechanisms on one main shaft; it is accepted wherever a family's name is.

    Parameters
    ----------
    members : by name, each a family, a list of families, or a table with ``family`` or ``chain`` and, as wanted,
        ``ratio`` (whole turns of its crank per turn of its driver, default 1), ``offset`` (its crank angle where the
        driving angle is 0 [rad]), ``driver`` ("shaft", or an angle of an earlier member such as "needle.psi1"),
        ``place`` (``at``, ``axis``, ``zero``: origin, z and x of the member's frame, for a chain the last stage's, in
        the machine's frame), ``tip`` (a point fixed to the output link: along it, across it, along its axis) and
        ``eye`` (a point of the coupler)
    relations : by name, such as ``{"distance": [point, point]}``, ``{"speed": [point]}``, ``{"torque": [member, ...]}``
        or ``{"event": pose output, "level": number, "rising": True}``; docs/machines.md, Relations, lists all of them
    shafts : by name, each ``at``, ``axis``, ``zero`` and, but for ``main``, ``ratio`` and ``phase``; a member then
        names its ``shaft`` with ``sense``, ``shift``, ``turn`` and ``key`` instead of its place (docs/machines.md)
    tools : by name, each a needle or a blade (docs/stitch.md), for relations such as ``{"take": [needle, blade]}``

    Returns
    -------
    Machine
        parameters and outputs have the member's name: ``needle.a1``, ``looper.swing``.  ``offset``, ``x_at`` ... and
        ``x_tip`` ... are parameters whose defaults are given here.  Relations are outputs: of a distance
        ``clearance`` there are ``min_clearance``, ``phi_min_clearance`` ...; of an event ``arrive``, where a pose
        output passes a level, there are ``phi_arrive`` and ``count_arrive``

    Raises
    ------
    InputError
        for an invalid member, relation, shaft or tool; the message gives the allowed values.

    Examples
    --------
    >>> import sweep
    >>> members = {"needle": ["rssr", "guide"], "looper": {"family": "rssr", "tip": [30.0, 0.0, 0.0]}}
    >>> drives = sweep.machine(members, {"clearance": {"distance": ["needle.point", "looper.tip"]}})
    >>> drives.parameter_names[:2], "clearance" in drives.pose_names
    (('needle.a1', 'needle.b1'), True)
    """
    if not isinstance(members, Mapping):
        raise InputError("members", members, "a table of members by name", "machine")
    return _machine(specified(members, relations, shafts, tools))


@lru_cache
def _single(name: str) -> Family:
    if name not in NAMES:
        raise InputError("family", name, f"one of {choices(name, NAMES)}", "family")
    file, _, attribute = REGISTER[name]["entry"].partition(".")
    entry: Family = getattr(import_module(f"sweep.families.{file}"), attribute)
    return check_family(entry)


@lru_cache
def _chain(names: tuple[str, ...]) -> Family:
    return chain_of(tuple(_single(name) for name in names))


@lru_cache
def _machine(given: Specification) -> Machine:
    return built(given, family)
