"""Pages and files that are made from the templates of the package."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

TEMPLATES = Path(__file__).resolve().parent / "templates"


@cache
def environment() -> Environment:
    """Return where templates are found; what is put into HTML is escaped, and a name that is missing is an error."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape
    from markupsafe import Markup

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
    """Fill a template, in which ``files`` sets others as they are; all names that it knows have to be given."""
    from markupsafe import Markup

    return Markup(environment().get_template(template).render(**names))
