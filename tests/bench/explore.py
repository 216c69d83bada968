"""How long `sweep explore` takes from a request to its answer: `python -m tests.bench.explore [SOURCE]`."""

from __future__ import annotations

import sys
import time

import numpy as np

from tests.support.explorer import ROOT, asked, explored

REQUESTS = 100


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
    print(f"{len(first['outputs'])} outputs, {REQUESTS} requests: median and least, milliseconds")
    for words, times in (("request to answer", whole), ("computing", computing)):
        print(f"{words:18} {np.median(times):6.1f} {min(times):6.1f}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "studies" / "needle208"))
