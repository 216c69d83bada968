"""Nightly runs: all studies in dated folders, compared with the last good night, on one page."""

from __future__ import annotations

from sweep.nights.night import Settings, nightly

__all__ = ["Settings", "nightly"]
