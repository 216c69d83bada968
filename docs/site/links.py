"""Check a built site: every link within it leads to a page and an anchor that are there, and nothing is fetched.

``python docs/site/links.py build/site`` prints what is wrong and ends with 1.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

FETCHED = {"img": "src", "script": "src", "link": "href", "iframe": "src", "source": "src"}


class Page(HTMLParser):
    """Links, anchors and fetched files of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what a tag links to, fetches, and is called."""
        found = dict(attrs)
        self.anchors |= {value for key in ("id", "name") if (value := found.get(key))}
        if tag == "a" and (link := found.get("href")):
            self.links.append(link)
        if tag in FETCHED and (source := found.get(FETCHED[tag])):
            self.fetched.append(source)


def faults(site: Path) -> list[str]:
    """Return what is wrong, a line for each link."""
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        name = path.relative_to(site.resolve())
        if name.name == "404.html":
            continue  # its links start at the root of a server
        found += [f"{name}: fetches {source}" for source in page.fetched if urlsplit(source).netloc]
        inside = [link for link in page.fetched if not urlsplit(link).scheme and not urlsplit(link).netloc]
        for link in [*page.links, *inside]:
            if urlsplit(link).scheme or urlsplit(link).netloc:
                continue
            target, anchor = urldefrag(link)
            file = (path.parent / unquote(target)).resolve() if target else path
            if not file.exists():
                found.append(f"{name}: {link} is not there")
            elif anchor and file in pages and unquote(anchor) not in pages[file].anchors:
                found.append(f"{name}: {link} has no such place")
    return found


if __name__ == "__main__":
    wrong = faults(Path(sys.argv[1]))
    sys.stdout.write("".join(f"{line}\n" for line in wrong) or "all links lead somewhere\n")
    sys.exit(1 if wrong else 0)
