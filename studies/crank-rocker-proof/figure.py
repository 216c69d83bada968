"""Draw the space of the planar study: each box of the certificate has the colour of the reason that excludes it."""

import sys
from pathlib import Path

from studies.proof_space import main

if __name__ == "__main__":
    main(Path(sys.argv[1]), reach=75.0)  # no mechanism exists beyond
