"""The log of a night: one JSON line per event, and the same in words."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sweep.dataset.files import store_errors

EVENTS, WORDS = "log.jsonl", "log.txt"


class Journal:
    """Writes every event at once, so that a killed night tells how far it came.

    Parameters
    ----------
    folder : of the night
    say : told every line in words as well
    """

    def __init__(self, folder: Path, say: Callable[[str], None]) -> None:
        self.folder, self.say = folder, say

    def note(self, event: str, words: str, **about: Any) -> None:
        """Write down an event; ``about`` is for programs, ``words`` for people."""
        now = time.gmtime()
        entry = {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", now), "event": event, "words": words} | about
        with store_errors(self.folder):
            with (self.folder / EVENTS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry) + "\n")
            with (self.folder / WORDS).open("a", encoding="utf-8") as file:
                file.write(f"{time.strftime('%H:%M:%S', now)}  {words}\n")
        self.say(words)
