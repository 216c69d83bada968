"""Draw the space of the right-angle study over every free coordinate, coloured by the reason that excludes it."""

from studies.figure import folder_asked
from studies.proof_space import main

if __name__ == "__main__":
    main(folder_asked(__doc__))
