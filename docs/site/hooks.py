"""What the site has besides the pages: reference from docstrings and registers, notebooks, links between pages."""

from __future__ import annotations

import base64
import json
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "docs" / "notebooks"
CODE = re.compile(r"(^```.*?^```|`[^`\n]+`|^(?: {4}|\t).*?$)", re.DOTALL | re.MULTILINE)
PAGE = re.compile(r"(?<![\w/])(?<!\]\()docs/([\w-]+)\.md")

sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

from equations import typeset  # noqa: E402


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are generated, and leave the notebooks themselves out."""
    for file in [f for f in files if f.src_uri.endswith((".ipynb", ".schema.json"))]:
        files.remove(file)
    pages = {"reference/python.md": python_page(), "reference/families.md": families_page()}
    for notebook in sorted(NOTEBOOKS.glob("*.ipynb")):
        text, pictures = notebook_page(notebook)
        pages[f"notebooks/{notebook.stem}.md"] = text
        for name, content in pictures.items():
            files.append(File.generated(config, f"notebooks/{name}", content=content))
    for uri, text in pages.items():
        files.append(File.generated(config, uri, content=text))
    for name in ("style.css", "iframe-worker.js"):
        text = (Path(__file__).parent / name).read_text(encoding="utf-8")
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Turn pages named in the text, docs/x.md, into links and set equations; what stands in code stays as it is."""
    up = "../" * page.file.src_uri.count("/")
    own = page.file.src_uri

    def linked(match: re.Match[str]) -> str:
        name = f"{match[1]}.md"
        return match[0] if name == own else f"[{titles(files)[name]}]({up}{name})"

    pieces = CODE.split(markdown)
    return typeset("".join(piece if k % 2 else PAGE.sub(linked, piece) for k, piece in enumerate(pieces)))


def titles(files: Any) -> dict[str, str]:
    """Return the first heading of every page by its name."""
    if not _TITLES:
        for path in (ROOT / "docs").glob("*.md"):
            line = path.read_text(encoding="utf-8").split("\n", 1)[0]
            _TITLES[path.name] = re.sub(r" \(`.*", "", line.removeprefix("# ")).split(":")[0]
    return _TITLES


_TITLES: dict[str, str] = {}


def python_page() -> str:
    """Return every public name, from its docstring."""
    import sweep

    groups = (
        ("Evaluate", ("evaluate", "summarise", "mechanism", "joints", "cyclogram", "machine", "rod")),
        ("Find", ("synthesise", "from_points")),
        ("Sweep", ("run", "load", "scan", "is_complete", "verify", "compare")),
        ("Show and take along", ("export", "plot")),
        ("Thread", ("thread",)),
        (
            "Errors and warnings",
            ("InputError", "StudyError", "LinksweepError", "LinksweepWarning", "IncompleteWarning"),
        ),
    )
    listed = {name for _, names in groups for name in names}
    if listed != set(sweep.__all__):
        raise ValueError(f"names without a place in the reference: {listed ^ set(sweep.__all__)}")
    lines = [
        "# Python",
        "",
        "Examples run as they stand here; what reads `results/press/designs` follows the [tutorial](../tutorial.md).",
        "",
    ]
    for title, names in groups:
        lines += [f"## {title}", ""]
        for name in names:
            found = getattr(sweep, name)
            for key in getattr(found, "__all__", ("",)):
                value = getattr(found, key) if key else found
                shown = f"sweep.{name}.{key}" if key else f"sweep.{name}"
                lines += [f"::: {value.__module__}.{value.__name__}", "    options:", f"      heading: {shown}",
                          f"      toc_label: {shown}", "      heading_level: 3", ""]  # fmt: skip
    return "\n".join(lines)


def families_page() -> str:
    """Return parameters and outputs of every family, from the register."""
    from sweep.cli.families import capability_words, domain_words, main_outputs
    from sweep.evaluation.summaries import output
    from sweep.families import NAMES, family

    lines = [
        "# Families",
        "",
        "Made from the register. Lengths are in any one unit, angles in rad; in studies and datasets mm and rad.",
        "Equations in the last column are those of the family's page. `sweep families NAME` says the same.",
        "",
    ]
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")}
    for name in NAMES:
        entry = family(name)
        lines += [f"## {name}", "", f"{entry.title[0].upper()}{entry.title[1:]}, over: {domain_words(entry)}.", ""]
        words = capability_words(entry)
        lines += [f"Can be asked for: {', '.join(words)}.", ""] if words else []
        lines += [f"Equations and frame: [{name}](../{name}.md).", ""] if name in pages else []
        lines += ["| parameter | unit | meaning |", "|---|---|---|"]
        for p in entry.parameters:
            notes = [note for note in (p.sign, p.choice if p.choices else "") if note]
            notes += [f"{p.default:g} if left out"] if p.default is not None else []
            words = f" ({', '.join(notes)})" if notes else ""
            lines.append(f"| `{p.name}` | {p.unit} | {cell(p.text)}{words} |")
        lines += ["", "| pose output | unit | definition | equation |", "|---|---|---|---|"]
        lines += [f"| `{o.name}` | {o.unit} | {cell(o.text)} | {cell(o.equation)} |" for o in entry.pose_outputs]
        lines += ["", "| design output | unit | definition |", "|---|---|---|"]
        found = [output(entry, key) for key in main_outputs(entry)]
        lines += [f"| `{o.name}` | {o.unit} | {cell(o.text)} |" for o in found]
        lines.append("")
    return "\n".join(lines)


def cell(text: str) -> str:
    """Return the text that may stand in a table."""
    return text.replace("|", "\\|").replace("\n", " ")


def notebook_page(path: Path) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown: text, code, what the code printed, pictures as files of their own."""
    pictures: dict[str, bytes] = {}
    parts: list[str] = []
    for number, found in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        source = "".join(found["source"])
        if found["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for result in found["outputs"]:
            data = result.get("data", {})
            if "image/png" in data:
                name = f"{path.stem}-{number}.png"
                pictures[name] = base64.b64decode("".join(data["image/png"]))
                parts.append(f"![What this cell draws]({name})")
            else:
                text = "".join(result.get("text", data.get("text/plain", "")))
                parts.append(f"```text\n{text.rstrip()}\n```")
    parts.append(f"This page is the notebook `docs/notebooks/{path.name}`, as it was executed.")
    return "\n\n".join(parts) + "\n", pictures
