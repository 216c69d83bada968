"""The space of the planar study: every box of the certificate, coloured by what excludes it."""

import sys
from pathlib import Path

from studies.proof_space import main

if __name__ == "__main__":
    main(Path(sys.argv[1]), reach=75.0)  # no mechanism exists beyond
