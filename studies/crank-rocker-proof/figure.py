"""Draw the space of the planar study: each box of the certificate has the colour of the reason that excludes it."""

from studies.figure import folder_asked
from studies.proof_space import main

if __name__ == "__main__":
    main(folder_asked(__doc__), reach=75.0)  # no mechanism exists beyond
