"""Draw the space of the spatial study over every free coordinate, coloured by the reason that excludes it."""

import sys
from pathlib import Path

from studies.proof_space import main

if __name__ == "__main__":
    main(Path(sys.argv[1]))
