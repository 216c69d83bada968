"""Command line: ``sweep VERB ...``, also ``python -m sweep VERB ...``.

Every verb imports what it needs when it runs, so that ``sweep --help`` and a misspelt option answer at once.
"""

from __future__ import annotations

from sweep.cli.main import main

__all__ = ["main"]
