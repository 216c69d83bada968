"""Rendering of the package's templates into pages and files."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).resolve().parent / "templates"


@cache
def environment() -> Environment:
    """Environment of the templates; values are escaped in HTML, and an undefined name is an error."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

    found = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["files"] = lambda *names: Markup("\n".join((TEMPLATES / n).read_text("utf-8") for n in names))
    return found


def rendered(template: str, **names: Any) -> Markup:
    """Render a template; all names that it uses must be given, and ``files`` inserts template files verbatim."""
    return Markup(environment().get_template(template).render(**names))
