"""How docstrings of this project read as Markdown: an extension of griffe, which reads them for the reference."""

from __future__ import annotations

import re
from typing import Any

import griffe

# ``name : meaning`` of our docstrings is name and type to griffe, which has the type from the signature.
ENTRY = re.compile(r"^(\*{0,2}\w[\w, *]*) : (.*)$", re.MULTILINE)
PARAMETERS = re.compile(r"(?<=Parameters\n----------\n).*?(?=\n\n|\Z)", re.DOTALL)
ROLE = re.compile(r":(?:mod|func|class|data|meth|attr):`~?([^`]+)`")


class Plain(griffe.Extension):
    """Put meanings where griffe looks for them, and names where Sphinx would have links."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Rewrite the docstring of one function, class or module."""
        if obj.docstring is not None:
            text = PARAMETERS.sub(lambda found: ENTRY.sub(r"\1\n    \2", found[0]), obj.docstring.value)
            obj.docstring.value = ROLE.sub(r"``\1``", text)
