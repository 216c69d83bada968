"""Command line: ``sweep VERB ...``, also ``python -m sweep VERB ...``."""

from __future__ import annotations

from sweep.cli.main import main

__all__ = ["main"]
