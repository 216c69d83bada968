"""From a slider to the picture in `sweep explore`: `python -m tests.bench.explore [SOURCE]`; needs Chromium."""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from tests.support.browser import DRAWS, FLAT, launcher
from tests.support.explorer import ROOT, asked, explored

MOVES, SKIPPED = 60, 10  # of a slider; first ones, in which the browser compiles the page's own code
# Move a slider as a hand does, one place after the other, and take the time until the next picture is on its way to
# the screen: a task that is queued when a frame begins runs when the frame has been drawn.
DRAG = """async ([count, name]) => {
    const { slider } = rows[name], times = [], low = Number(slider.min), wide = slider.max - slider.min;
    const drawn = () => new Promise((done) => requestAnimationFrame(() => {
        const { port1, port2 } = new MessageChannel();
        port1.onmessage = () => done();
        port2.postMessage(0);
    }));
    for (let k = 0; k < count; k += 1) {
        await drawn();
        const begun = performance.now(), answered = new Promise((done) => {
            const seen = new MutationObserver(() => { seen.disconnect(); done(); });
            seen.observe(document.body, { attributeFilter: ["data-answers"] });
        });
        slider.value = low + wide * (0.3 + 0.4 * k / count);
        slider.dispatchEvent(new Event('input'));
        await answered;
        await drawn();
        times.push(performance.now() - begun);
    }
    return times;
}"""


def said(words: str, times: Any) -> None:
    """Print median and least of some times."""
    print(f"{words:42} {np.median(times):6.1f} {min(times):6.1f}")


def main(source: str) -> None:
    """Move the first dimension of a source to and fro: as a program, and in a browser with and without 3-D."""
    with explored(source) as address, launcher() as launch:
        first = asked(address, "answer", {"designs": [{}], "names": ["in hand"]})
        print(f"{len(first['outputs'])} outputs, {MOVES} moves: median and least, milliseconds")
        whole, computing = [], []
        for k in range(MOVES):
            begun = time.perf_counter()
            found = asked(address, "answer", {"designs": [{"a1": 8.0 + 0.04 * k}], "names": ["in hand"]})
            whole.append(1e3 * (time.perf_counter() - begun))
            computing.append(found["milliseconds"])
        said("computing", computing)
        said("request to answer", whole)
        for words, arguments in (
            ("hand to picture, curves and tables", FLAT),
            ("the same with 3-D by software", DRAWS),
        ):
            browser = launch(*arguments)
            page = browser.new_page(viewport={"width": 1400, "height": 900})
            page.goto(address)
            page.wait_for_function("document.body.dataset.answers")
            page.evaluate("moving.rest()")  # a hand on a slider looks at the design, not at its turn
            said(words, page.evaluate(DRAG, [MOVES, "a1"])[SKIPPED:])
            browser.close()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "studies" / "needle208"))
