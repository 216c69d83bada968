"""The space of the right-angle study: what excludes it, over every free coordinate."""

import sys
from pathlib import Path

from studies.proof_space import main

if __name__ == "__main__":
    main(Path(sys.argv[1]))
