"""How long `sweep explore` takes from a request to its answer, and from the hand to the picture in headless Chromium.

`python -m tests.bench.explore [SOURCE]`; the picture in space is drawn by software there.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tests.support.browser import DRAWS, launcher
from tests.support.explorer import ROOT, asked, explored

REQUESTS = 50
# Move a slider and wait for the page to have drawn the answer: times to that, of which the server and the drawing.
MOVED = """async (count) => {
    const name = page.ranges.find((range) => rows[range.name].slider).name, { slider } = rows[name], found = [];
    const drawing = show, spent = { drawing: 0 };
    show = (answer) => { const begun = performance.now(); drawing(answer); spent.drawing = performance.now() - begun; };
    for (let k = 0; k < count; k += 1) {
        const begun = performance.now(), low = Number(slider.min), high = Number(slider.max);
        const drawn = new Promise((done) => {
            const watch = new MutationObserver(() => { watch.disconnect(); done(performance.now()); });
            watch.observe(document.body, { attributeFilter: ['data-answers'] });
        });
        slider.value = low + (high - low) * ((k % 20) + 0.5) / 20;
        slider.dispatchEvent(new Event('input'));
        found.push([await drawn - begun, spent.drawing]);
        await new Promise(requestAnimationFrame);
    }
    return found;
}"""


def main(source: str) -> None:
    """Move the first dimension of a source to and fro, as a slider does."""
    with explored(source) as address:
        first = asked(address, "answer", {"designs": [{}], "names": ["in hand"]})
        whole, computing = [], []
        for k in range(REQUESTS):
            begun = time.perf_counter()
            found = asked(address, "answer", {"designs": [{"a1": 8.0 + 0.04 * k}], "names": ["in hand"]})
            whole.append(1e3 * (time.perf_counter() - begun))
            computing.append(found["milliseconds"])
        with launcher() as launch:
            page = launch(*DRAWS).new_page(viewport={"width": 1400, "height": 900}, reduced_motion="reduce")
            page.goto(address)
            page.wait_for_function("document.body.dataset.answers >= 1 && !asking")
            picture, drawing = np.array(page.evaluate(MOVED, REQUESTS)).T
    print(f"{len(first['outputs'])} outputs, {REQUESTS} requests: median and least, milliseconds")
    named = (("request to answer", whole), ("computing", computing), ("hand to picture", picture), ("drawing", drawing))
    for words, times in named:
        print(f"{words:18} {np.median(times):6.1f} {min(times):6.1f}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "studies" / "needle208"))
