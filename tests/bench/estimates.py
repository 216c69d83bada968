"""What `sweep check` expects of every study against what its sweep takes: ``python -m tests.bench.estimates``.

A slice of each study, spread over its space, is computed on one core and its process time compared with the estimate
of the whole; the same for a digit less and more of accuracy (half and twice the samples).  Ends with 1 if one of them
is wrong by more than the factor that the plan may be.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from sweep.chunks.chunk import compute_chunk, warm
from sweep.engine.estimate import estimate, neighbours
from sweep.study import Study, load_study

STUDIES = Path(__file__).resolve().parents[2] / "studies"
SECONDS = 3.0  # of a slice, by the estimate
PIECES = 8
FACTOR = 2.0


def measured(study: Study, designs: int) -> float:
    """Process time per design [s] of about that many designs in pieces spread over the space."""
    length = max(1, min(designs, study.space.count) // PIECES)
    warm(study)
    begin = time.process_time()
    for k in range(PIECES):
        start = k * (study.space.count - length) // max(PIECES - 1, 1)
        compute_chunk(study, start, start + length)
    return (time.process_time() - begin) / (PIECES * length)


def main() -> int:
    """Print the table; 1 if an estimate is off by more than `FACTOR`."""
    worst = 1.0
    print(f"{'study':20} {'accuracy':18} {'estimated':>12} {'measured':>12}  ns per design and core, their ratio")
    for path in sorted(STUDIES.glob("*/study.toml")):
        study = load_study(path)
        base = estimate(study, 1).seconds / study.space.count
        for words, other in (("its own", study), *neighbours(study)):
            expected = estimate(other, 1).seconds / study.space.count
            found = measured(other, int(SECONDS / base))
            ratio = found / expected
            worst = max(worst, ratio, 1.0 / ratio)
            print(f"{study.name:20} {words:18} {1e9 * expected:12.0f} {1e9 * found:12.0f}  {ratio:.2f}", flush=True)
    print(f"worst factor {worst:.2f}; allowed {FACTOR}")
    return int(worst > FACTOR)


if __name__ == "__main__":
    sys.exit(main())
