"""Checks that the package ``kernels`` is linksweep's: another distribution on PyPI has the same name.

The distribution installed last overwrites the other's files, and an import would use the wrong ones.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

# A file of both packages with words that only this one contains; and a file that only this package has.
FILE, WORDS = "__init__.py", "Mechanics only: jitted, floats in, arrays out"
OWN_FILE = "jit.py"


def check_kernels() -> None:
    """Check that ``import kernels`` finds the kernels of this distribution.

    Raises
    ------
    ImportError
        if it finds another package, or none; the message says what to do.
    """
    remedy = (
        "Remove both and install linksweep again (pip uninstall kernels linksweep, then pip install linksweep), "
        "or give linksweep an environment of its own."
    )
    spec = find_spec("kernels")
    if spec is None:
        raise ImportError(f"linksweep: its package kernels is not there. {remedy}")
    places = [Path(place) for place in spec.submodule_search_locations or ()]
    ours = Path(__file__).resolve().parents[1] / "kernels"
    if not any(_is_ours(place) for place in places):
        found = spec.origin or ", ".join(map(str, places))
        raise ImportError(f"linksweep: {found} is another package called kernels. {remedy}")
    if not any(place.resolve() == ours for place in places):
        raise ImportError(
            f"linksweep: sweep lies in {ours.parent}, but kernels in {places[0].parent}: two copies of linksweep are "
            "mixed. Begin with only one of them on the path (PYTHONPATH, or the folder Python is started in)."
        )


def _is_ours(place: Path) -> bool:
    try:
        return WORDS in (place / FILE).read_text(encoding="utf-8") and (place / OWN_FILE).is_file()
    except (OSError, UnicodeDecodeError):
        return False
