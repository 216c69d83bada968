"""Figures of mechanisms and datasets as matplotlib axes, in the style of the report.

Each function returns the axes it drew, as an array if there may be several; ``axes.figure.savefig("name.svg")`` saves
them.  No window is opened.
"""

from __future__ import annotations

from sweep.plot.datasets import front, map, sensitivity, tolerance
from sweep.plot.mechanisms import cyclogram, mechanism, motion, polar_load

__all__ = ["cyclogram", "front", "map", "mechanism", "motion", "polar_load", "sensitivity", "tolerance"]
