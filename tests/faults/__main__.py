"""``python -m tests.faults``: try all kinds and print the table; ends with 1 if anything was lost or wrong."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.faults.ground import Ground
from tests.faults.suite import HEAD, KINDS, tried, verdict


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the trials of every kind; one at least")
    parser.add_argument("--only", default="", help="kinds with this in their name")
    options = parser.parse_args()
    begin, rows = time.monotonic(), []
    with tempfile.TemporaryDirectory(prefix="linksweep-faults-", ignore_cleanup_errors=True) as name:
        ground = Ground(Path(name))
        print(HEAD, flush=True)
        for kind in [kind for kind in KINDS if options.only in kind.name]:
            rows.append(tried(kind, max(1, round(options.share * kind.count)), ground, Path(name)))
            print(rows[-1].line(), flush=True)
            for line in {*rows[-1].lost, *rows[-1].wrong}:
                print(f"    {line}", flush=True)
    print(f"{verdict(rows)}, {time.monotonic() - begin:.0f} s")
    return 1 if any(row.lost or row.wrong for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
