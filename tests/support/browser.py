"""Headless Chromium for tests: Debian's package controlled by playwright, without playwright's own browser."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
# WebGL in software, so that a machine without a graphics card gives the same picture.
DRAWS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
FLAT = ("--no-sandbox", "--disable-3d-apis")


def executable() -> str:
    """Return the path of the installed browser; without one the tests fail."""
    named = os.environ.get("CHROMIUM")
    found = named or next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        pytest.fail("no Chromium here: apt-get install chromium, or name its path in the variable CHROMIUM")
    return found


@contextmanager
def launcher() -> Iterator[Callable[..., Browser]]:
    """Start browsers by their command-line arguments, DRAWS or FLAT; only one playwright runs at a time."""
    with sync_playwright() as playwright:
        yield lambda *arguments: playwright.chromium.launch(executable_path=executable(), args=list(arguments))


@contextmanager
def opened(browser: Browser, address: str, width: int = 1400, **options: Any) -> Iterator[Page]:
    """Yield a page at rest; at the end it must have loaded one file only and logged nothing."""
    options = {"reduced_motion": "reduce"} | options
    context = browser.new_context(viewport={"width": width, "height": 900}, **options)
    page = context.new_page()
    said: list[str] = []
    loaded: list[str] = []
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: loaded.append(request.url))
    page.goto(address)
    yield page
    context.close()
    assert said == []
    assert [url for url in loaded if not url.startswith(("data:", "blob:"))] == [address]


def pixels(of: Page | Locator, **options: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a screenshot as (height, width, 3) in 0 to 1."""
    picture = Image.open(io.BytesIO(of.screenshot(**options))).convert("RGB")
    return np.asarray(picture, np.float64) / 255.0
